A ball's ground in a host's pass, with its depth: rays over the field itself, three lights that follow the sun's height, rock, sea and snow. For views from orbit.

#PROGRAM{ terrain_globe }#

#DEFINE{
    #VARYING{
struct Corner {
    @builtin(position) position: vec4<f32>,
    // The ray through the pixel, at the depth 1.
    @location(0) ray: vec3<f32>,
}

// Lights on level ground.
struct GlobeLight {
    sun: vec3<f32>,
    sky: vec3<f32>,
    bounce: vec3<f32>,
}

struct GlobeView {
    ray_middle: vec3<f32>,
    // Angle of a pixel.
    pixel_angle: f32,
    ray_right: vec3<f32>,
    // Rays end here [m].
    far: f32,
    ray_up: vec3<f32>,
    exposure: f32,
    forward: vec3<f32>,
    // Depth is depth_numerator / linear depth - depth_offset.
    depth_numerator: f32,
    to_sun: vec3<f32>,
    depth_offset: f32,
    // Tangent of the sun's angular radius.
    sun_width: f32,
    snow_edge_low: f32,
    snow_edge_high: f32,
    snow_noise: f32,
    snow_albedo: vec3<f32>,
    snow_line: f32,
    sea_albedo: vec3<f32>,
    // Cosine and sine of how far from the foot point the highest ground can be seen.
    rim_cosine: f32,
    // For zenith cosines of the sun of 1.2 (k / 31)^2 - 0.2.
    lights: array<GlobeLight, 32>,
}

@group(0) @binding(0) var<uniform> draw_view: GlobeView;
    }#
}#

#VERTEX{
    #USE{ VARYING }#
    #CODE{
#import veduta::terrain::globe::{Globe}

@group(0) @binding(1) var<uniform> globe: Globe;

fn ray_through(clip: vec2<f32>) -> vec3<f32> {
    return draw_view.ray_middle + clip.x * draw_view.ray_right + clip.y * draw_view.ray_up;
}

// Whether the ball may be seen in one of 16 x 12 tiles of the picture: the cone about the tile and that about the ball meet unless their axes are farther apart than both angles.
fn in_tile(place: vec2<f32>, size: vec2<f32>) -> bool {
    let middle = normalize(ray_through((place + 0.5) * size - 1.0));
    var least = 1.0;
    for (var j = 0; j < 4; j++) {
        let ray = ray_through((place + vec2<f32>(f32(j & 1), f32(j >> 1u))) * size - 1.0);
        least = min(least, dot(middle, normalize(ray)));
    }
    let down = dot(middle, -globe.up);
    let apart = acos(clamp(down, -1.0, 1.0)) - acos(clamp(least, -1.0, 1.0)) - acos(clamp(draw_view.rim_cosine, -1.0, 1.0));
    return apart < 2e-3;
}

// The rectangle around all tiles of the picture in which the ball may be seen, as two triangles: more of them would have blocks of pixels along their borders shaded twice.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let size = vec2<f32>(0.125, 0.16666667);
    var low = vec2<f32>(1e3);
    var high = vec2<f32>(-1e3);
    for (var tile = 0; tile < 192; tile++) {
        let place = vec2<f32>(f32(tile % 16), f32(tile / 16));
        let seen = in_tile(place, size);
        low = select(low, min(low, place), seen);
        high = select(high, max(high, place + 1.0), seen);
    }
    let k = select(index, 6u - index, index > 3u);
    let corner = select(low, high, vec2<bool>((k & 1u) == 1u, (k >> 1u) == 1u));
    let clip = select(vec2<f32>(0.0), corner * size - 1.0, low.x < high.x);
    return Corner(vec4<f32>(clip, 0.5, 1.0), ray_through(clip));
}
    }#
}#

#FRAGMENT{
    #CODE{
#import veduta::terrain::field::{height_spread}
#import veduta::terrain::globe::{Globe, globe_up, globe_at}
#import veduta::terrain::orbit::{globe_hit, globe_border, globe_shadow, globe_sky_share}
#import veduta::terrain::material::{Rock, faded_noise, snow_blend}
#import veduta::terrain::shading::{ThreeLights, shade_rough}
#import veduta::post::display::{displayed}
    }#
    #USE{ VARYING }#
    #CODE{
@group(0) @binding(1) var<uniform> globe: Globe;
@group(0) @binding(2) var<uniform> rock: Rock;

override FIELD_KIND: i32 = 2;
override OUTPUT: i32 = 0;
override GLOBE_STEPS: i32 = 600;
override GLOBE_STEPS_SHADOW: i32 = 40;
override ROCK_CHEAP: i32 = 0;
override SKY_SECTORS: i32 = 0;

const INVERSE_PI: f32 = 0.31830988618;

struct Shown {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

// The lights where the sun has a zenith cosine.
fn lights_at(mu: f32) -> ThreeLights {
    let x = 31.0 * sqrt(clamp((mu + 0.2) / 1.2, 0.0, 1.0));
    let k = min(i32(x), 30);
    let share = x - f32(k);
    return ThreeLights(
        mix(draw_view.lights[k].sun, draw_view.lights[k + 1].sun, share),
        mix(draw_view.lights[k].sky, draw_view.lights[k + 1].sky, share),
        mix(draw_view.lights[k].bounce, draw_view.lights[k + 1].bounce, share),
    );
}

// Rock on a ball, in two qualities as on the plane: one fractal sum, or four. Veins stand where the plane has strata, since no way is up all around a ball. Places go by the lattice of the eye's foot point.
fn ball_rock(place: vec3<f32>, up: vec3<f32>, footprint: f32) -> vec3<f32> {
    let bulk = faded_noise(rock, place, vec3<i32>(1, 1, 1), 0u, footprint);
    if ROCK_CHEAP != 0 {
        return mix(rock.dark, rock.light, clamp(0.5 + 0.9 * bulk, 0.0, 1.0));
    }
    let bent = place + (0.5 * bulk * rock.wavelength) * up;
    let veins = faded_noise(rock, bent, vec3<i32>(3, 3, 3), 1u, footprint);
    let grain = faded_noise(rock, place, vec3<i32>(8, 8, 8), 2u, footprint);
    let stains = faded_noise(rock, place, vec3<i32>(2, 2, 2), 3u, footprint);
    let tone = clamp(0.5 + 0.75 * bulk + 0.3 * veins + 0.2 * grain, 0.0, 1.0);
    return mix(mix(rock.dark, rock.light, tone), rock.stain, 0.6 * smoothstep(0.05, 0.6, stains));
}

@fragment
fn draw(in: Corner) -> Shown {
    let dir = normalize(in.ray);
    let angle = draw_view.pixel_angle;
    let hit = globe_hit(globe, FIELD_KIND, dir, 0.0, draw_view.far, angle, GLOBE_STEPS);
    let is_met = hit.distance >= 0.0;
    let point = dir * max(hit.distance, 0.0);
    // Where nothing is met the rest takes no rounds of any loop.
    let footprint = select(1e30, angle * hit.distance, is_met);
    let up = globe_up(globe, point);
    let mu = dot(up, draw_view.to_sun);
    // The frame of the place: east, up, and across both.
    let aside = select(vec3<f32>(0.0, 1.0, 0.0), vec3<f32>(1.0, 0.0, 0.0), abs(up.y) > 0.9);
    let east = normalize(cross(aside, up));
    let south = cross(east, up);
    // The ground without the sea, to blend their border over the heights that a footprint holds.
    var bare = globe;
    bare.sea = -1e30;
    let ground = globe_at(bare, FIELD_KIND, point, footprint);
    // As on the plane. Wider than the lattice nothing differs more.
    let bare_slope = vec2<f32>(dot(ground.slope, east), dot(ground.slope, south));
    let within = min(footprint, globe.wavelength);
    let left = clamp(f32(globe.octaves) - log2(globe.wavelength / within), 0.0, f32(globe.octaves));
    let tidal = max(2.24 * height_spread(bare_slope, ground.lost, within, left, globe.fall), 0.01);
    let land = smoothstep(-tidal, tidal, ground.height - globe.sea);
    let lost = land * ground.lost;
    // The ball falls away behind the terminator: farther than what its highest ground sees over it there is no sun.
    let facing = dot(hit.normal, draw_view.to_sun) + sqrt(lost);
    let dusk = -sqrt(2.0 * max(globe.high - globe.low, 0.0) / globe.ground_radius) - draw_view.sun_width;
    let rounds = select(0, GLOBE_STEPS_SHADOW, is_met && facing > 0.0 && mu > dusk);
    let blurred = globe_border(up, land * ground.slope, draw_view.to_sun, dir, footprint);
    let light = globe_shadow(globe, FIELD_KIND, point, draw_view.to_sun, draw_view.sun_width, footprint, blurred, rounds);
    let lit = select(0.0, light, mu > dusk);
    let slope = land * bare_slope;
    let to_sun = vec3<f32>(dot(draw_view.to_sun, east), mu, dot(draw_view.to_sun, south));
    // From the eye's foot point.
    let place = point + globe.up * globe.eye_altitude;
    let border = faded_noise(rock, place, vec3<i32>(4, 4, 4), 7u, footprint);
    var albedo = ball_rock(place, up, footprint);
    let level = inverseSqrt(1.0 + dot(slope, slope) + lost);
    let blur = 0.5 * level * level * sqrt(lost * (1.0 - level * level));
    // Degrees of latitude, times 80 m.
    let line = draw_view.snow_line - 4583.66 * asin(clamp(abs(up.y), 0.0, 1.0)) + 800.0 * border;
    let high = smoothstep(line - 300.0, line + 300.0, ground.height);
    let snow = high * snow_blend(level, border, draw_view.snow_edge_low - blur, draw_view.snow_edge_high + blur, draw_view.snow_noise);
    albedo = mix(albedo, draw_view.snow_albedo, snow);
    // Without a line there is no ice.
    let ice = select(0.0, smoothstep(line - 300.0, line + 300.0, globe.sea - 200.0), draw_view.snow_line > -9e4);
    albedo = mix(mix(draw_view.sea_albedo, draw_view.snow_albedo, ice), albedo, land);
    var lights = lights_at(mu);
    if SKY_SECTORS > 0 {
        lights.sky_color *= globe_sky_share(globe, FIELD_KIND, point, east, south, slope, footprint, select(0, SKY_SECTORS, is_met));
    }
    let radiance = INVERSE_PI * albedo * shade_rough(lights, slope, lost, to_sun, lit);
    if !is_met {
        discard;
    }
    let linear = max(dot(point, draw_view.forward), 1e-6);
    return Shown(displayed(OUTPUT, radiance, draw_view.exposure, vec2<u32>(in.position.xy)), clamp(draw_view.depth_numerator / linear - draw_view.depth_offset, 0.0, 1.0));
}
    }#
}#
