Light at places in the air, for a host that asks: sunlight across its direction, and light of the sky on a plane. Nothing is drawn.

#PROGRAM{ sky_query }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::columns::{sun_depth, sun_above_horizon}
#import veduta::atmosphere::diffuse::{diffuse_moments, plane_irradiance}

struct LightPlace {
    // Towards the sun, y up at the place.
    to_sun: vec3<f32>,
    altitude: f32,
    normal: vec3<f32>,
    sun_angular_radius: f32,
}

struct PlaceLight {
    sun: vec3<f32>,
    sky: vec3<f32>,
}

@group(0) @binding(0) var<uniform> air: Air;
@group(1) @binding(0) var linear: sampler;
@group(1) @binding(1) var columns: texture_2d_array<f32>;
@group(1) @binding(2) var moments: texture_2d_array<f32>;
@group(1) @binding(3) var<storage, read> places: array<LightPlace>;
@group(2) @binding(0) var<storage, read_write> results: array<PlaceLight>;

@compute @workgroup_size(64)
fn query(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&places) {
        return;
    }
    let place = places[id.x];
    let h = clamp(place.altitude, 0.0, air.top);
    let seen = sun_above_horizon(air.ground_radius, h, place.to_sun.y, place.sun_angular_radius);
    let sun = seen * exp(-sun_depth(columns, linear, air, h, place.to_sun.y));
    let glow = diffuse_moments(moments, linear, air.top, h, place.to_sun.y);
    results[id.x] = PlaceLight(sun, plane_irradiance(glow, place.normal, place.to_sun));
}
    }#
}#
