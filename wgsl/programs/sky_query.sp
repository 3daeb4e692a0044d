Light at places in the air, for a host that asks: sunlight across its direction, and light of the sky on a plane. A workgroup a place;
its invocations share the directions. Nothing is drawn.

#PROGRAM{ sky_query }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::columns::{sun_depth, sun_above_horizon}
#import veduta::atmosphere::ray::{air_ray}
#import veduta::atmosphere::irradiance::{SPHERE_NODES, sphere_node, seen_radiance}

const SHARERS: u32 = 64u;
// Steps on each stretch of a ray.
const STEPS: i32 = 10;

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

var<workgroup> shares: array<vec3<f32>, SHARERS>;

@compute @workgroup_size(64)
fn query(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) me: u32) {
    let place = places[group.x];
    let h = clamp(place.altitude, 0.0, air.top);
    // In a frame whose x is the sun's azimuth.
    let flat = length(place.to_sun.xz);
    let ahead = select(vec2<f32>(1.0, 0.0), place.to_sun.xz / max(flat, 1e-20), flat > 1e-20);
    let to_sun = vec3<f32>(flat, place.to_sun.y, 0.0);
    let normal = vec3<f32>(dot(ahead, place.normal.xz), place.normal.y, ahead.x * place.normal.z - ahead.y * place.normal.x);
    var sum = vec3<f32>(0.0);
    for (var i = i32(me); i < SPHERE_NODES; i += i32(SHARERS)) {
        let node = sphere_node(air.ground_radius, h, i);
        let sine = sqrt(max(1.0 - node.mu * node.mu, 0.0));
        let aside = sine * sqrt(max(1.0 - node.cos_phi * node.cos_phi, 0.0));
        let dir = vec3<f32>(sine * node.cos_phi, node.mu, aside);
        let across = normal.x * dir.x + normal.y * dir.y;
        let weight = node.solid * (max(across + normal.z * aside, 0.0) + max(across - normal.z * aside, 0.0));
        if weight > 0.0 {
            let ray = air_ray(air.ground_radius, air.top, h, dir, to_sun, 1e9);
            sum += weight * seen_radiance(columns, moments, linear, air, ray, place.sun_angular_radius, STEPS);
        }
    }
    shares[me] = sum;
    workgroupBarrier();
    if me == 0u {
        for (var i = 1u; i < SHARERS; i++) {
            sum += shares[i];
        }
        let seen = sun_above_horizon(air.ground_radius, h, place.to_sun.y, place.sun_angular_radius);
        let sun = seen * exp(-sun_depth(columns, linear, air, h, place.to_sun.y));
        results[group.x] = PlaceLight(sun, sum);
    }
}
    }#
}#
