Light along given rays, one invocation a ray: the textbook march through the air. Nothing is drawn; the rays are made in
f64 by the host, so that even those from far above the air run where they should.

#PROGRAM{ probe }#

#COMPUTE{
    #CODE{
#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::ray::{AirRay}
#import veduta::atmosphere::textbook::{march_air}

override PROBE_STEPS: i32 = 96;
override PROBE_LIGHT_STEPS: i32 = 24;

struct ProbeLight {
    in_scatter: vec3<f32>,
    transmittance: vec3<f32>,
}

@group(1) @binding(0) var<uniform> air: Air;
@group(1) @binding(1) var<storage, read> rays: array<AirRay>;
@group(2) @binding(0) var<storage, read_write> results: array<ProbeLight>;

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&rays) {
        return;
    }
    let light = march_air(air, rays[id.x], PROBE_STEPS, PROBE_LIGHT_STEPS);
    results[id.x] = ProbeLight(light.in_scatter, light.transmittance);
}
    }#
}#
