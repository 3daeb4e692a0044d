The tables of the air before things as one eye sees it: every direction, by distance. Made anew when the sun or the eye's altitude changes. One
invocation marches one direction from the eye to its end and leaves a texel at every slice.

#PROGRAM{ sky_aerial }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::ray::{air_ray, ray_altitude, ray_sun_cosine}
#import veduta::atmosphere::columns::{texel_coordinates}
#import veduta::atmosphere::scatter::{split_phases, air_source, step_share}
#import veduta::atmosphere::sky_view::{SkyEye, sky_direction}
#import veduta::atmosphere::aerial::{aerial_distance, aerial_spacing}

override ALL_ORDERS: i32 = 1;
override AERIAL_STEPS: i32 = 1;
override AERIAL_SLICES: i32 = 24;

@group(0) @binding(0) var<uniform> air: Air;
@group(0) @binding(1) var<uniform> eye: SkyEye;
@group(1) @binding(0) var linear: sampler;
@group(1) @binding(1) var columns: texture_2d_array<f32>;
@group(1) @binding(2) var moments: texture_2d_array<f32>;
@group(2) @binding(0) var light: texture_storage_2d_array<rgba16float, write>;
@group(2) @binding(1) var depths: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(4, 8)
fn bake(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(light);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let slices = AERIAL_SLICES;
    let half = size.y / 2u;
    let below = id.y >= half;
    let place = texel_coordinates(vec2<f32>(f32(id.x), f32(id.y % half)), vec2<f32>(f32(size.x), f32(half)));
    let dir = sky_direction(eye, place, below);
    let ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
    let spacing = aerial_spacing(eye, below);
    let phases = split_phases(air, ray.nu);
    var smooth_light = vec3<f32>(0.0);
    var peaked_light = vec3<f32>(0.0);
    var depth = vec3<f32>(0.0);
    var left = vec3<f32>(1.0);
    var t = 0.0;
    var first_smooth = vec3<f32>(0.0);
    var first_peaked = vec3<f32>(0.0);
    var first_depth = vec3<f32>(0.0);
    for (var slice = 0; slice < slices; slice++) {
        let end = aerial_distance(spacing, f32(slice) / f32(slices - 1), ray.length);
        var mean_smooth = vec3<f32>(0.0);
        var mean_peaked = vec3<f32>(0.0);
        var mean_depth = vec3<f32>(0.0);
        let count = select(AERIAL_STEPS, 1, slice == 0);
        let distance = (end - t) / f32(count);
        for (var step = 0; step < count; step++) {
            let at = t + (f32(step) + 0.5) * distance;
            let h = max(ray_altitude(air.ground_radius, ray, at), 0.0);
            let mu = clamp(((air.ground_radius + ray.altitude) * ray.mu + at) / (air.ground_radius + h), -1.0, 1.0);
            let sun_mu = ray_sun_cosine(air.ground_radius, ray, h, at);
            let source = air_source(columns, moments, linear, air, phases, h, mu, sun_mu, ray.nu, eye.sun_angular_radius, ALL_ORDERS != 0);
            if slice == 0 {
                mean_smooth = source.smooth_light;
                mean_peaked = source.peaked_light;
                mean_depth = source.extinction;
            } else {
                let passed = source.extinction * distance;
                let share = exp(-passed);
                let weight = left * step_share(passed, share) * distance;
                smooth_light += source.smooth_light * weight;
                peaked_light += source.peaked_light * weight;
                depth += passed;
                left *= share;
            }
        }
        if slice == 0 {
            first_smooth = mean_smooth;
            first_peaked = mean_peaked;
            first_depth = mean_depth;
        } else {
            // A ray from the ground into the ground has a place but no length.
            let none = end < 1e-3;
            let over = 1.0 / max(end, 1e-3);
            mean_smooth = select(smooth_light * over, first_smooth, none);
            mean_peaked = select(peaked_light * over, first_peaked, none);
            mean_depth = select(depth * over, first_depth, none);
        }
        let factor = eye.scale * air.top;
        textureStore(light, id.xy, slice, vec4<f32>(mean_smooth * factor, 1.0));
        textureStore(light, id.xy, slices + slice, vec4<f32>(mean_peaked * factor, 1.0));
        if id.x == 0u {
            textureStore(depths, vec2<u32>(u32(slice), id.y), vec4<f32>(log2(max(mean_depth * air.top, vec3<f32>(1e-12))), 1.0));
        }
        t = end;
    }
}
    }#
}#
