A cloud layer over a host's picture, from its tile: radiance, and transmittance in alpha. With CLOUD_UPSAMPLE from a picture of half as many pixels a side.

#PROGRAM{ cloud_layer }#

#DEFINE{
    #VARYING{
struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) ray: vec3<f32>,
}

struct CloudDraw {
    ray_middle: vec3<f32>,
    eye_altitude: f32,
    ray_right: vec3<f32>,
    ground_radius: f32,
    ray_up: vec3<f32>,
    // The march ends here [m].
    far: f32,
    forward: vec3<f32>,
    // Depth is depth_numerator / linear depth - depth_offset.
    depth_numerator: f32,
    to_sun: vec3<f32>,
    depth_offset: f32,
    // Irradiance of the sun at the clouds; times the albedo without CLOUD_ORDERS.
    sun_light: vec3<f32>,
    min_transmittance: f32,
    // Radiance that comes to the clouds from above and from below; without CLOUD_ORDERS the mean of both times the albedo, twice.
    above: vec3<f32>,
    extinction: f32,
    below: vec3<f32>,
    // Share of the extinction that is left without the peak of the phase function.
    kept: f32,
    place: vec2<f32>,
    shear: vec2<f32>,
    tiles_per_metre: f32,
    bottom: f32,
    thickness: f32,
    levels: f32,
    g_forward: f32,
    g_backward: f32,
    backward_share: f32,
    // Depth where there is nothing before the sky.
    sky_depth: f32,
    // Way that is free of clouds for each unit that the tile's density is below 0 [m].
    clear: f32,
    // The least density that the tile tells.
    least: f32,
    // Irradiance of the sun at the top of the air that is seen before the clouds.
    air_light: vec3<f32>,
    // What all marches start farther by with CLOUD_MASK, a share of a step.
    start: f32,
    // Pixels a side of a coarse picture of the layer for each of the host's.
    coarse: vec2<f32>,
}

@group(0) @binding(0) var<uniform> draw_view: CloudDraw;
    }#
}#

#VERTEX{
    #USE{ VARYING }#
    #CODE{
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let clip = vec2<f32>(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u));
    return Corner(vec4<f32>(clip, 0.0, 1.0), draw_view.ray_middle + clip.x * draw_view.ray_right + clip.y * draw_view.ray_up);
}
    }#
}#

#FRAGMENT{
    #CODE{
#ifndef CLOUD_UPSAMPLE
#import veduta::post::dither::{blue_mask}
#ifdef CLOUD_WINDOW
#ifdef CLOUD_ORDERS
#import veduta::clouds::window::{CloudWindows, march_windows_orders}
#else
#import veduta::clouds::window::{CloudWindows, march_windows}
#endif
#ifdef CLOUD_ABOVE
#import veduta::clouds::tile::{CloudTile, cloud_shadow}
#endif
#else
#ifdef CLOUD_ORDERS
#ifdef CLOUD_ABOVE
#import veduta::clouds::tile::{CloudTile, march_tile_orders, cloud_shadow}
#else
#import veduta::clouds::tile::{CloudTile, march_tile_orders}
#endif
#else
#ifdef CLOUD_ABOVE
#import veduta::clouds::tile::{CloudTile, march_tile, cloud_shadow}
#else
#import veduta::clouds::tile::{CloudTile, march_tile}
#endif
#endif
#endif
#ifndef CLOUD_ORDERS
#import veduta::lighting::phase::{phase_double_henyey_greenstein}
#endif
#ifdef CLOUD_ABOVE
#import veduta::planet::shell::{ground_distance, altitude_along}
#else
#import veduta::planet::shell::{ground_distance}
#endif
#ifdef CLOUD_AIR
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::sky_view::{SkyEye, sky_place_shown}
#import veduta::atmosphere::ray::{AirLight, air_ray}
#import veduta::atmosphere::aerial::{aerial_light}
#endif
#endif
    }#
    #USE{ VARYING }#
    #CODE{
#ifdef CLOUD_OVER_DEPTH
@group(1) @binding(2) var host_depth: texture_depth_2d;

// The texel of the host's depth that stands for four of them, in turns another one of the four.
fn stands_for(texel: vec2<i32>) -> vec2<i32> {
    return min(2 * texel + vec2<i32>(texel.y & 1, texel.x & 1), vec2<i32>(textureDimensions(host_depth)) - 1);
}
#endif
#ifdef CLOUD_UPSAMPLE
// The layer in half as many pixels a side.
@group(1) @binding(4) var coarse: texture_2d<f32>;

#ifdef CLOUD_OVER_DEPTH
// One over the linear depth.
fn nearness(texel: vec2<i32>) -> f32 {
    return (textureLoad(host_depth, texel, 0) + draw_view.depth_offset) / draw_view.depth_numerator;
}
#endif

// The mean of four pixels around, by their distance and by whether their rays end as far away.
@fragment
fn draw(in: Corner) -> @location(0) vec4<f32> {
    let last = vec2<i32>(textureDimensions(coarse)) - 1;
    let at = draw_view.coarse * in.position.xy - 0.5;
    let low = floor(at);
    let share = at - low;
    var sum = vec4<f32>(0.0);
    var total = 0.0;
#ifdef CLOUD_OVER_DEPTH
    let own = nearness(vec2<i32>(in.position.xy));
#endif
    for (var k = 0; k < 4; k++) {
        let right = (k & 1) == 1;
        let down = k >= 2;
        let texel = clamp(vec2<i32>(low) + vec2<i32>(k & 1, k >> 1u), vec2<i32>(0), last);
        var weight = select(1.0 - share.x, share.x, right) * select(1.0 - share.y, share.y, down);
#ifdef CLOUD_OVER_DEPTH
        let there = nearness(stands_for(texel));
        weight *= max(1.0 - 8.0 * abs(there - own) / max(max(there, own), 1e-12), 1e-4);
#endif
        sum += weight * textureLoad(coarse, texel, 0);
        total += weight;
    }
    return sum / total;
}
#else
@group(1) @binding(0) var linear: sampler;
// The tile, or the stack of windows.
@group(1) @binding(1) var tile: texture_3d<f32>;
#ifdef CLOUD_WINDOW
@group(0) @binding(2) var<uniform> windows: CloudWindows;
#endif
#ifdef CLOUD_ORDERS
@group(1) @binding(3) var cells: texture_3d<f32>;
#ifdef CLOUD_WINDOW
// Their mean over the land.
@group(1) @binding(5) var mean_cells: texture_3d<f32>;
#endif

// What the two parts of the sun's own light are weighed by at 128 angles between view and sun, whose roots are even; two to a vector.
struct CloudWeights {
    pairs: array<vec4<f32>, 64>,
}

@group(0) @binding(1) var<uniform> weights: CloudWeights;

fn weight_at(i: i32) -> vec2<f32> {
    let pair = weights.pairs[i / 2];
    return select(pair.xy, pair.zw, i % 2 == 1);
}
#endif

#ifdef CLOUD_ABOVE
// Another layer that shades this one.
@group(0) @binding(3) var<uniform> other: CloudTile;
@group(1) @binding(6) var other_tile: texture_3d<f32>;
#endif

override CLOUD_STEPS: i32 = 64;
// Whether half as many pixels a side are drawn as the host's picture has.
override CLOUD_HALF: i32 = 0;
// Whether marches start at places that a mask shifts.
override CLOUD_MASK: i32 = 0;

#ifdef CLOUD_AIR
// Air, eye and tables of the sky behind the clouds, for eyes within the air.
@group(2) @binding(0) var<uniform> air: Air;
@group(2) @binding(1) var<uniform> eye: SkyEye;
@group(2) @binding(2) var clamped: sampler;
@group(2) @binding(3) var air_table: texture_2d_array<f32>;
@group(2) @binding(4) var air_depths: texture_2d<f32>;

// Light and transmittance of the air up to a distance.
fn air_before(dir: vec3<f32>, distance: f32) -> AirLight {
    let place = sky_place_shown(eye, dir);
    let ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
    return aerial_light(air_table, air_depths, clamped, air, eye, place, distance - ray.from_eye, ray.length);
}
#endif

// What is blended over the picture: light of clouds, behind the air, and transmittance.
fn laid(dir: vec3<f32>, light: vec3<f32>, transmittance: f32, mean_distance: f32) -> vec4<f32> {
#ifdef CLOUD_AIR
    // The picture has the air before it in it, of which clouds hide what lies behind them.
    let front = air_before(dir, mean_distance);
    return vec4<f32>(front.transmittance * light + (1.0 - transmittance) * front.in_scatter * draw_view.air_light, transmittance);
#else
    return vec4<f32>(light, transmittance);
#endif
}

// The sun's light at a distance, behind another layer.
fn sun_at(altitude: f32, dir: vec3<f32>, distance: f32) -> vec3<f32> {
#ifdef CLOUD_ABOVE
    let there = altitude_along(draw_view.ground_radius, altitude, dir.y, distance);
    return draw_view.sun_light * cloud_shadow(other_tile, linear, other, dir.xz * distance, there);
#else
    return draw_view.sun_light;
#endif
}

@fragment
fn draw(in: Corner) -> @location(0) vec4<f32> {
    let dir = normalize(in.ray);
    let altitude = max(draw_view.eye_altitude, 0.0);
    let ground = ground_distance(draw_view.ground_radius, altitude, dir.y);
    var far = select(draw_view.far, min(draw_view.far, ground), ground >= 0.0);
#ifdef CLOUD_OVER_DEPTH
    let texel = vec2<i32>(in.position.xy);
    let depth = textureLoad(host_depth, select(texel, stands_for(texel), CLOUD_HALF != 0), 0);
    let linear_depth = draw_view.depth_numerator / (depth + draw_view.depth_offset);
    let reached = linear_depth / max(dot(dir, draw_view.forward), 1e-4);
    far = select(min(far, max(reached, 0.0)), far, depth == draw_view.sky_depth || reached > 1e8);
#endif
#ifndef CLOUD_WINDOW
    let layer = CloudTile(draw_view.place, draw_view.shear, vec2<f32>(0.0), draw_view.tiles_per_metre, draw_view.bottom, draw_view.thickness, draw_view.levels, draw_view.extinction, draw_view.clear, draw_view.least);
#endif
    let nu = clamp(dot(dir, draw_view.to_sun), -1.0, 1.0);
    let start = select(0.0, fract(blue_mask(vec2<u32>(in.position.xy)) + draw_view.start), CLOUD_MASK != 0);
#ifdef CLOUD_ORDERS
#ifdef CLOUD_WINDOW
    let light = march_windows_orders(tile, cells, mean_cells, linear, windows, draw_view.kept, nu, draw_view.ground_radius, altitude, dir, far, draw_view.min_transmittance, CLOUD_STEPS, start);
#else
    let light = march_tile_orders(tile, cells, linear, layer, draw_view.kept, nu, draw_view.ground_radius, altitude, dir, far, draw_view.min_transmittance, CLOUD_STEPS, start);
#endif
    let x = clamp(sqrt(acos(nu) * 0.31830989), 0.0, 1.0) * 127.0;
    let i = min(i32(x), 126);
    let weight = mix(weight_at(i), weight_at(i + 1), x - f32(i));
    let sun = max(weight.x * light.whole + weight.y * light.kept, 0.0) + light.before.x;
    // What the peak scatters of the light behind; about the eye's level of both, or there were a line.
    let behind = mix(draw_view.below, draw_view.above, smoothstep(-0.15, 0.15, dir.y)) * (light.kept_transmittance - light.transmittance);
    let around = draw_view.above * light.before.y + draw_view.below * light.before.z + behind;
    return laid(dir, sun * sun_at(altitude, dir, light.mean_distance) + around, light.transmittance, light.mean_distance);
#else
#ifdef CLOUD_WINDOW
    let light = march_windows(tile, linear, windows, draw_view.ground_radius, altitude, dir, far, draw_view.min_transmittance, CLOUD_STEPS, start);
#else
    let light = march_tile(tile, linear, layer, draw_view.ground_radius, altitude, dir, far, draw_view.min_transmittance, CLOUD_STEPS, start);
#endif
    let phase = phase_double_henyey_greenstein(nu, draw_view.g_forward, draw_view.g_backward, draw_view.backward_share);
    return laid(dir, light.scatter * phase * sun_at(altitude, dir, light.mean_distance) + (1.0 - light.transmittance) * draw_view.above, light.transmittance, light.mean_distance);
#endif
}
#endif
    }#
}#
