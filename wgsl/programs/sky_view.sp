The table of the sky as one eye sees it: every direction that leaves the air. Made anew when the sun or the eye's altitude changes; `sky_refine` puts further rows between its rows.

#PROGRAM{ sky_view }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::ray::{air_ray}
#import veduta::atmosphere::columns::{texel_coordinates, sun_depth, sun_above_horizon}
#import veduta::atmosphere::diffuse::{diffuse_moments, level_irradiance}
#import veduta::atmosphere::scatter::{scatter_along}
#import veduta::atmosphere::sky_view::{SkyEye, encode_dusk, sky_coded, sky_direction, sky_place, sky_rows}

override SKY_STEPS: i32 = 16;
override ALL_ORDERS: i32 = 1;
// Whether directions below the horizon show the ground too.
override SKY_GROUND: i32 = 0;

@group(0) @binding(0) var<uniform> air: Air;
@group(0) @binding(1) var<uniform> eye: SkyEye;
@group(1) @binding(0) var linear: sampler;
@group(1) @binding(1) var columns: texture_2d_array<f32>;
@group(1) @binding(2) var moments: texture_2d_array<f32>;
@group(2) @binding(0) var sky: texture_storage_2d_array<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(sky);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let above = sky_rows(eye, f32(size.y));
    let below = f32(id.y) >= above;
    let row = vec2<f32>(f32(id.y) - select(0.0, above, below), select(above, f32(size.y) - above, below));
    let place = texel_coordinates(vec2<f32>(f32(id.x), row.x), vec2<f32>(f32(size.x), row.y));
    let dir = sky_direction(eye, place, below);
    var ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
    // From high up the ends of a stretch are far apart.
    let steps = select(SKY_STEPS, SKY_STEPS + SKY_STEPS / 2, sky_coded(eye));
    var light = scatter_along(columns, moments, linear, air, ray, eye.sun_angular_radius, ALL_ORDERS != 0, steps);
    if SKY_GROUND != 0 && ray.meets_ground != 0u {
        let sun_mu = clamp(((air.ground_radius + ray.altitude) * ray.sun_mu + ray.length * ray.nu) / air.ground_radius, -1.0, 1.0);
        let sun = max(sun_mu, 0.0) * exp(-sun_depth(columns, linear, air, 0.0, sun_mu)) * sun_above_horizon(air.ground_radius, 0.0, sun_mu, eye.sun_angular_radius);
        let around = level_irradiance(diffuse_moments(moments, linear, air.top, 0.0, sun_mu));
        light.smooth_light += light.transmittance * air.ground_albedo * (0.31830989 * (sun + around));
    }
    let factor = eye.scale / max(sky_place(eye, dir).reach, 1e-9);
    var smooth_light = light.smooth_light * (factor / (1.0 + ray.nu * ray.nu));
    var peaked_light = light.peaked_light * factor;
    if sky_coded(eye) {
        smooth_light = encode_dusk(smooth_light);
        peaked_light = encode_dusk(peaked_light);
    }
    textureStore(sky, id.xy, 0, vec4<f32>(smooth_light, 1.0));
    textureStore(sky, id.xy, 1, vec4<f32>(peaked_light, 1.0));
}
    }#
}#
