The sky behind a host's own picture, and the air before it. Without AERIAL one triangle at the far plane that the host's depth test lets through where
nothing stands; with AERIAL a pass over the whole target that reads the host's depth.

#PROGRAM{ sky }#

#DEFINE{
    #VARYING{
struct Corner {
    @builtin(position) position: vec4<f32>,
    // The ray through the pixel, at the depth 1; for parallel rays the place in the plane of the eye [m].
    @location(0) ray: vec3<f32>,
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
}

@group(0) @binding(2) var<uniform> draw_view: SkyDraw;
    }#
}#

#VERTEX{
    #USE{ VARYING }#
    #CODE{
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let clip = vec2<f32>(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u));
    let ray = draw_view.ray_middle + clip.x * draw_view.ray_right + clip.y * draw_view.ray_up;
    return Corner(vec4<f32>(clip, draw_view.far_depth, 1.0), ray);
}
    }#
}#

#FRAGMENT{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::ray::{AirLight, air_ray}
#import veduta::atmosphere::columns::{sun_depth, sun_above_horizon}
#import veduta::atmosphere::diffuse::{diffuse_moments, level_irradiance}
#import veduta::atmosphere::sky_view::{SkyEye, sky_place, sky_radiance}
#import veduta::atmosphere::aerial::{aerial_light}
#import veduta::atmosphere::sun_disc::{sun_disc}
#import veduta::tone_map::exponential::{exponential}
#import veduta::post::srgb::{encode_srgb, decode_srgb}
#import veduta::post::dither::{dither}
    }#
    #USE{ VARYING }#
    #CODE{
@group(0) @binding(0) var<uniform> air: Air;
@group(0) @binding(1) var<uniform> eye: SkyEye;
@group(1) @binding(0) var linear: sampler;
@group(1) @binding(1) var sky: texture_2d_array<f32>;
@group(1) @binding(2) var columns: texture_2d_array<f32>;
@group(1) @binding(3) var moments: texture_2d_array<f32>;
@group(1) @binding(4) var light: texture_2d_array<f32>;
@group(1) @binding(5) var depths: texture_2d<f32>;
#ifdef AERIAL
@group(2) @binding(0) var depth: texture_depth_2d;
#ifndef AERIAL_TARGETS
@group(2) @binding(1) var picture: texture_2d<f32>;
#endif
#endif

override OUTPUT: i32 = 0;

// Behind the host's things: the sky with the sun's disc, or the bare ground and the air before it.
fn background(dir: vec3<f32>, pixel_angle: f32) -> vec3<f32> {
    let place = sky_place(eye, dir);
    if place.below {
        let ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
        let front = aerial_light(light, depths, linear, air, eye, place, ray.length, ray.length);
        let sun_mu = clamp(((air.ground_radius + ray.altitude) * ray.sun_mu + ray.length * ray.nu) / air.ground_radius, -1.0, 1.0);
        let sun = max(sun_mu, 0.0) * exp(-sun_depth(columns, linear, air, 0.0, sun_mu)) * sun_above_horizon(air.ground_radius, 0.0, sun_mu, eye.sun_angular_radius);
        let around = level_irradiance(diffuse_moments(moments, linear, air.top, 0.0, sun_mu));
        var radiance = front.in_scatter;
        if eye.altitude > eye.top {
            radiance = sky_radiance(sky, linear, air, eye, place);
        }
        return radiance + front.transmittance * air.ground_albedo * (0.31830989 * (sun + around));
    }
    var radiance = sky_radiance(sky, linear, air, eye, place);
    if place.nu > cos(eye.sun_angular_radius + pixel_angle) {
        let ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
        let front = aerial_light(light, depths, linear, air, eye, place, ray.length, ray.length);
        radiance += front.transmittance * sun_disc(dir, eye.to_sun, eye.sun_angular_radius, pixel_angle);
    }
    return radiance;
}

#ifdef AERIAL
// Light and transmittance before what stands at a depth of the host's depth buffer.
fn before(ray_at: vec3<f32>, seen: f32) -> AirLight {
    var relative = ray_at * (draw_view.depth_numerator / (seen + draw_view.depth_offset));
    if draw_view.parallel != 0u {
        relative = ray_at + draw_view.forward * ((seen - draw_view.depth_offset) * draw_view.depth_numerator);
    }
    let distance = length(relative);
    let dir = relative / max(distance, 1e-20);
    let place = sky_place(eye, dir);
    let ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
    if ray.length <= 0.0 {
        return AirLight(vec3<f32>(0.0), vec3<f32>(1.0));
    }
    return aerial_light(light, depths, linear, air, eye, place, distance - ray.from_eye, ray.length);
}
#endif

// What is written for a radiance.
fn shown(radiance: vec3<f32>, pixel: vec2<f32>) -> vec4<f32> {
    if OUTPUT == 2 {
        return vec4<f32>(radiance, 1.0);
    }
    let signal = dither(encode_srgb(exponential(radiance, draw_view.exposure)), vec2<u32>(pixel), 255.0);
    if OUTPUT == 1 {
        return vec4<f32>(decode_srgb(signal), 1.0);
    }
    return vec4<f32>(signal, 1.0);
}

#ifdef AERIAL
#ifdef AERIAL_TARGETS
struct Layers {
    @location(0) in_scatter: vec4<f32>,
    @location(1) transmittance: vec4<f32>,
}

@fragment
fn draw(in: Corner) -> Layers {
    let dir = select(normalize(in.ray), draw_view.forward, draw_view.parallel != 0u);
    let pixel_angle = length(dpdx(dir));
    let seen = textureLoad(depth, vec2<i32>(in.position.xy), 0);
    if seen == draw_view.far_depth {
        return Layers(vec4<f32>(background(dir, pixel_angle) * draw_view.sun_irradiance, 1.0), vec4<f32>(0.0, 0.0, 0.0, 1.0));
    }
    let front = before(in.ray, seen);
    return Layers(vec4<f32>(front.in_scatter * draw_view.sun_irradiance, 1.0), vec4<f32>(front.transmittance, 1.0));
}
#else
@fragment
fn draw(in: Corner) -> @location(0) vec4<f32> {
    let dir = select(normalize(in.ray), draw_view.forward, draw_view.parallel != 0u);
    let pixel_angle = length(dpdx(dir));
    let texel = vec2<i32>(in.position.xy);
    let seen = textureLoad(depth, texel, 0);
    if seen == draw_view.far_depth {
        return shown(background(dir, pixel_angle) * draw_view.sun_irradiance, in.position.xy);
    }
    let front = before(in.ray, seen);
    let radiance = front.in_scatter * draw_view.sun_irradiance + front.transmittance * textureLoad(picture, texel, 0).rgb;
    return shown(radiance, in.position.xy);
}
#endif
#else
@fragment
fn draw(in: Corner) -> @location(0) vec4<f32> {
    let dir = select(normalize(in.ray), draw_view.forward, draw_view.parallel != 0u);
    return shown(background(dir, length(dpdx(dir))) * draw_view.sun_irradiance, in.position.xy);
}
#endif
    }#
}#
