Light along given rays of one eye, read from its tables. Nothing is drawn.

#PROGRAM{ sky_probe }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::ray::{air_ray}
#import veduta::atmosphere::sky_view::{SkyEye, sky_coded, sky_place, sky_radiance}
#import veduta::atmosphere::aerial::{aerial_light}
#import veduta::atmosphere::columns::{sun_depth}
#import veduta::atmosphere::textbook::{march_air_columns}

// Steps of a march along every ray through the tables of the air alone; 0: the tables of the eye are read.
override PROBE_MARCH: i32 = 0;
// Whether the march adds light of all orders; the tables of the eye have it or not.
override ALL_ORDERS: i32 = 1;

struct EyeRay {
    dir: vec3<f32>,
    distance: f32,
}

struct ProbeLight {
    in_scatter: vec3<f32>,
    transmittance: vec3<f32>,
}

@group(0) @binding(0) var<uniform> air: Air;
@group(0) @binding(1) var<uniform> eye: SkyEye;
@group(1) @binding(0) var linear: sampler;
@group(1) @binding(1) var sky: texture_2d_array<f32>;
@group(1) @binding(2) var light: texture_2d_array<f32>;
@group(1) @binding(3) var depths: texture_2d<f32>;
@group(1) @binding(4) var<storage, read> rays: array<EyeRay>;
@group(1) @binding(5) var columns: texture_2d_array<f32>;
@group(1) @binding(6) var moments: texture_2d_array<f32>;
@group(2) @binding(0) var<storage, read_write> results: array<ProbeLight>;

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&rays) {
        return;
    }
    let dir = rays[id.x].dir;
    let ray = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, 1e9);
    if ray.length <= 0.0 || rays[id.x].distance <= ray.from_eye {
        results[id.x] = ProbeLight(vec3<f32>(0.0), vec3<f32>(1.0));
        return;
    }
    if PROBE_MARCH > 0 {
        let short = air_ray(air.ground_radius, air.top, eye.altitude, dir, eye.to_sun, rays[id.x].distance);
        let marched = march_air_columns(columns, moments, linear, air, short, ALL_ORDERS != 0, PROBE_MARCH);
        results[id.x] = ProbeLight(marched.in_scatter, marched.transmittance);
        return;
    }
    // A ray ends on the ground.
    let t = min(rays[id.x].distance - ray.from_eye, ray.length);
    let place = sky_place(eye, dir);
    var found = aerial_light(light, depths, linear, air, eye, place, t, ray.length);
    if t >= ray.length {
        if ray.meets_ground == 0u {
            found.transmittance = exp(-sun_depth(columns, linear, air, ray.altitude, ray.mu));
        }
        found.in_scatter = sky_radiance(sky, linear, air, eye, place, sky_coded(eye));
    }
    results[id.x] = ProbeLight(found.in_scatter, found.transmittance);
}
    }#
}#
