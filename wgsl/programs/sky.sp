The sky behind a host's own picture, and the air before it. Without AERIAL one triangle at the far plane that the host's depth test lets through where
nothing stands, and with SUN_DISC a square about the sun's disc; with AERIAL a pass over the whole target that reads the host's depth.

#PROGRAM{ sky }#

#DEFINE{
    #VARYING{
struct Corner {
    @builtin(position) position: vec4<f32>,
    // The ray through the pixel, at the depth 1; for parallel rays the place in the plane of the eye [m].
    @location(0) @interpolate(linear) ray: vec3<f32>,
}

struct SkyDraw {
    ray_middle: vec3<f32>,
    // Depth of the far plane.
    far_depth: f32,
    ray_right: vec3<f32>,
    // With the next: linear depth is depth_numerator / (depth + depth_offset), for parallel rays (depth - depth_offset) * depth_numerator.
    depth_numerator: f32,
    ray_up: vec3<f32>,
    depth_offset: f32,
    // Where the view looks.
    forward: vec3<f32>,
    exposure: f32,
    // Of the sun at the top of the air.
    sun_irradiance: vec3<f32>,
    // 1 for parallel rays.
    parallel: u32,
    // What linear depth in the picture's alpha is divided by [m].
    greatest_depth: f32,
}

@group(0) @binding(2) var<uniform> draw_view: SkyDraw;
    }#
}#

#VERTEX{
    #CODE{
#ifdef SUN_DISC
#import veduta::atmosphere::sky_view::{SkyEye}
#endif
    }#
    #USE{ VARYING }#
    #CODE{
#ifdef SUN_DISC
@group(0) @binding(1) var<uniform> eye: SkyEye;
#endif
    }#
    #CODE{
#ifdef SUN_DISC
// A square around the sun's disc: two triangles.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let side = vec2<f32>(select(-1.0, 1.0, (index & 1u) == 1u), select(-1.0, 1.0, index >= 2u && index <= 4u));
    let to_sun = eye.to_sun;
    let ahead = dot(to_sun, draw_view.forward);
    let aside = to_sun / max(ahead, 1e-6) - draw_view.ray_middle;
    let width = dot(draw_view.ray_right, draw_view.ray_right);
    let height = dot(draw_view.ray_up, draw_view.ray_up);
    let middle = vec2<f32>(dot(aside, draw_view.ray_right) / width, dot(aside, draw_view.ray_up) / height);
    // Away from the middle of the picture the disc is stretched.
    let reach = tan(eye.sun_angular_radius) / max(ahead * ahead, 1e-6);
    let extent = vec2<f32>(reach * inverseSqrt(width), reach * inverseSqrt(height)) * 1.1 + 0.03;
    // Beyond the picture when the sun is behind the eye.
    let clip = select(middle + side * extent, vec2<f32>(2.0), ahead <= 1e-3 || draw_view.parallel != 0u);
    let ray = draw_view.ray_middle + clip.x * draw_view.ray_right + clip.y * draw_view.ray_up;
    return Corner(vec4<f32>(clip, draw_view.far_depth, 1.0), ray);
}
#else
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let clip = vec2<f32>(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u));
    let ray = draw_view.ray_middle + clip.x * draw_view.ray_right + clip.y * draw_view.ray_up;
    return Corner(vec4<f32>(clip, draw_view.far_depth, 1.0), ray);
}
#endif
    }#
}#

#FRAGMENT{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::sky_view::{SkyEye, SkyPlace, SkyLook, sky_place_shown, sky_place_outside, sky_radiance, sky_seen}
#ifndef AERIAL
#import veduta::atmosphere::sky_view::{sky_seen_by_pair}
#endif
#ifdef SKY_MARCH
#import veduta::atmosphere::textbook::{march_sky, march_sky_columns}
#endif
#ifdef AERIAL
#import veduta::atmosphere::ray::{AirLight, air_ray}
#import veduta::atmosphere::aerial::{aerial_light}
#import veduta::atmosphere::scatter::{space_transmittance}
#import veduta::atmosphere::sun_disc::{sun_disc, disc_in_pixel}
#else
#ifdef SUN_DISC
#import veduta::atmosphere::ray::{air_ray}
#import veduta::atmosphere::scatter::{space_transmittance}
#import veduta::atmosphere::sun_disc::{sun_disc, disc_in_pixel}
#endif
#endif
#import veduta::post::display::{displayed}
    }#
    #USE{ VARYING }#
    #CODE{
@group(0) @binding(0) var<uniform> air: Air;
@group(0) @binding(1) var<uniform> eye: SkyEye;
@group(0) @binding(3) var<uniform> look: SkyLook;
@group(1) @binding(0) var linear: sampler;
@group(1) @binding(1) var sky: texture_2d_array<f32>;
@group(1) @binding(2) var light: texture_2d_array<f32>;
@group(1) @binding(3) var depths: texture_2d<f32>;
@group(1) @binding(4) var columns: texture_2d_array<f32>;
#ifdef SKY_MARCH
@group(1) @binding(5) var moments: texture_2d_array<f32>;
#endif
#ifdef AERIAL
#ifdef AERIAL_TARGETS
@group(2) @binding(0) var depth: texture_depth_2d;
#else
#ifndef AERIAL_ALPHA
@group(2) @binding(0) var depth: texture_depth_2d;
#endif
@group(2) @binding(1) var picture: texture_2d<f32>;
#endif
#endif

override OUTPUT: i32 = 0;

// Where the eye is: 0 low in the air, 1 so high that its table holds codes, 2 above the air.
override EYE_PLACE: i32 = 0;

#ifdef SKY_MARCH
override MARCH_STEPS: i32 = 16;
override MARCH_LIGHT_STEPS: i32 = 8;
#endif

fn place_of(dir: vec3<f32>) -> SkyPlace {
    if EYE_PLACE == 2 {
        return sky_place_outside(eye, dir);
    }
    return sky_place_shown(eye, dir);
}

// Behind the host's things: the sky, or the bare ground and the air before it.
fn background(ray: vec3<f32>) -> vec3<f32> {
#ifdef SKY_MARCH
    if MARCH_LIGHT_STEPS == 0 {
        return march_sky_columns(columns, moments, linear, air, eye.altitude, normalize(ray), eye.to_sun, MARCH_STEPS);
    }
    return march_sky(air, eye.altitude, normalize(ray), eye.to_sun, MARCH_STEPS, MARCH_LIGHT_STEPS);
#else
    if EYE_PLACE != 0 {
        return sky_radiance(sky, linear, air, eye, place_of(normalize(ray)), true);
    }
    return sky_seen(sky, linear, look, ray);
#endif
}

#ifdef AERIAL
// Radiance of the sun's disc without the air before it; `right` and `down` are what the direction differs by at the next pixels. Discs of a few pixels are
// the area of a circle within the pixel, so that their irradiance does not depend on where they stand among pixels.
fn disc_seen(dir: vec3<f32>, right: vec3<f32>, down: vec3<f32>) -> f32 {
    let beside = eye.to_sun - dir;
    let across = dot(right, right);
    let along = dot(down, down);
    let both = dot(right, down);
    let square = max(across * along - both * both, 1e-28);
    let pixel = sqrt(sqrt(square));
    let radius = eye.sun_angular_radius / pixel;
    let u = dot(beside, right);
    let v = dot(beside, down);
    let centre = clamp(vec2<f32>(along * u - both * v, across * v - both * u) / square, vec2<f32>(-64.0), vec2<f32>(64.0));
    let covered = disc_in_pixel(centre, clamp(radius, 1e-3, 16.0)) / (3.14159265 * max(eye.sun_angular_radius * eye.sun_angular_radius, 1e-14));
    let small = select(0.0, covered, dot(dir, eye.to_sun) > 0.0);
    return select(sun_disc(dir, eye.to_sun, eye.sun_angular_radius, pixel), small, radius < 4.0);
}

#else
#ifdef SUN_DISC
// Radiance of the sun's disc without the air before it; `right` and `down` are what the direction differs by at the next pixels. Discs of a few pixels are
// the area of a circle within the pixel, so that their irradiance does not depend on where they stand among pixels.
fn disc_seen(dir: vec3<f32>, right: vec3<f32>, down: vec3<f32>) -> f32 {
    let beside = eye.to_sun - dir;
    let across = dot(right, right);
    let along = dot(down, down);
    let both = dot(right, down);
    let square = max(across * along - both * both, 1e-28);
    let pixel = sqrt(sqrt(square));
    let radius = eye.sun_angular_radius / pixel;
    let u = dot(beside, right);
    let v = dot(beside, down);
    let centre = clamp(vec2<f32>(along * u - both * v, across * v - both * u) / square, vec2<f32>(-64.0), vec2<f32>(64.0));
    let covered = disc_in_pixel(centre, clamp(radius, 1e-3, 16.0)) / (3.14159265 * max(eye.sun_angular_radius * eye.sun_angular_radius, 1e-14));
    let small = select(0.0, covered, dot(dir, eye.to_sun) > 0.0);
    return select(sun_disc(dir, eye.to_sun, eye.sun_angular_radius, pixel), small, radius < 4.0);
}

#endif
#endif
#ifdef AERIAL
// Radiance of the sun's disc; parallel rays have none, since all would meet it or none.
fn disc(dir: vec3<f32>, right: vec3<f32>, down: vec3<f32>) -> vec3<f32> {
    let seen = select(1.0, 0.0, draw_view.parallel != 0u) * disc_seen(dir, right, down);
    return seen * from_space(dir);
}

// What the air leaves of light from space.
fn from_space(dir: vec3<f32>) -> vec3<f32> {
    let ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
    return space_transmittance(columns, linear, air, ray);
}
#else
#ifdef SUN_DISC
// Radiance of the sun's disc.
fn disc(dir: vec3<f32>, right: vec3<f32>, down: vec3<f32>) -> vec3<f32> {
    let ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
    return disc_seen(dir, right, down) * space_transmittance(columns, linear, air, ray);
}
#endif
#endif

#ifdef AERIAL
// Where something stands whose depth in the host's picture is `seen`, from the eye.
#ifdef AERIAL_ALPHA
fn place_seen(ray_at: vec3<f32>, seen: f32) -> vec3<f32> {
    let along = seen * draw_view.greatest_depth;
    return select(ray_at * along, ray_at + draw_view.forward * along, draw_view.parallel != 0u);
}
#else
fn place_seen(ray_at: vec3<f32>, seen: f32) -> vec3<f32> {
    if draw_view.parallel != 0u {
        return ray_at + draw_view.forward * ((seen - draw_view.depth_offset) * draw_view.depth_numerator);
    }
    return ray_at * (draw_view.depth_numerator / (seen + draw_view.depth_offset));
}
#endif

// Light and transmittance before what stands at a depth of the host's.
fn before(ray_at: vec3<f32>, seen: f32) -> AirLight {
    let relative = place_seen(ray_at, seen);
    let distance = length(relative);
    let dir = relative / max(distance, 1e-20);
    let place = place_of(dir);
    let ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
    if ray.length <= 0.0 && ray.meets_ground == 0u {
        return AirLight(vec3<f32>(0.0), vec3<f32>(1.0));
    }
    var front = aerial_light(light, depths, linear, air, eye, place, distance - ray.from_eye, ray.length);
    if distance - ray.from_eye >= ray.length && !place.below {
        // Beyond the air: no seam with the sky beside it.
        front.in_scatter = background(dir);
    }
    return front;
}
#endif

#ifdef AERIAL
#ifdef AERIAL_TARGETS
struct Layers {
    @location(0) in_scatter: vec4<f32>,
    @location(1) transmittance: vec4<f32>,
}

@fragment
fn draw(in: Corner) -> Layers {
    let dir = select(normalize(in.ray), draw_view.forward, draw_view.parallel != 0u);
    let right = dpdx(dir);
    let down = dpdy(dir);
    let seen = textureLoad(depth, vec2<i32>(in.position.xy), 0);
    if seen == draw_view.far_depth {
        return Layers(vec4<f32>((background(dir) + disc(dir, right, down)) * draw_view.sun_irradiance, 1.0), vec4<f32>(from_space(dir), 1.0));
    }
    let front = before(in.ray, seen);
    return Layers(vec4<f32>(front.in_scatter * draw_view.sun_irradiance, 1.0), vec4<f32>(front.transmittance, 1.0));
}
#else
@fragment
fn draw(in: Corner) -> @location(0) vec4<f32> {
    let dir = select(normalize(in.ray), draw_view.forward, draw_view.parallel != 0u);
    let right = dpdx(dir);
    let down = dpdy(dir);
    let texel = vec2<i32>(in.position.xy);
    let held = textureLoad(picture, texel, 0);
#ifdef AERIAL_ALPHA
    let seen = held.a;
    let nothing = seen >= 1.0;
#else
    let seen = textureLoad(depth, texel, 0);
    let nothing = seen == draw_view.far_depth;
#endif
    if nothing {
        // The host's picture holds what is in space: its stars shine through the air.
        return displayed(OUTPUT, (background(dir) + disc(dir, right, down)) * draw_view.sun_irradiance + held.rgb * from_space(dir), draw_view.exposure, vec2<u32>(in.position.xy));
    }
    let front = before(in.ray, seen);
    let radiance = front.in_scatter * draw_view.sun_irradiance + front.transmittance * held.rgb;
    return displayed(OUTPUT, radiance, draw_view.exposure, vec2<u32>(in.position.xy));
}
#endif
#else
@fragment
fn draw(in: Corner) -> @location(0) vec4<f32> {
    let ray = select(in.ray, draw_view.forward, draw_view.parallel != 0u);
#ifdef SUN_DISC
    let dir = normalize(ray);
    let radiance = background(dir) + disc(dir, dpdx(dir), dpdy(dir));
#else
    var radiance = vec3<f32>(0.0);
#ifdef SKY_MARCH
    radiance = background(ray);
#else
    if EYE_PLACE != 0 {
        radiance = background(ray);
    } else {
        radiance = sky_seen_by_pair(sky, linear, look, ray, in.position.xy);
    }
#endif
#endif
    return displayed(OUTPUT, radiance * draw_view.sun_irradiance, draw_view.exposure, vec2<u32>(in.position.xy));
}
#endif
    }#
}#
