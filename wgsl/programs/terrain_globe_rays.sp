Where given rays meet a ball, one invocation a ray: the textbook march, or steps that the slope's bound allows and a bracket.

#PROGRAM{ terrain_globe_rays }#

#COMPUTE{
    #CODE{
#import veduta::terrain::globe::{Globe, globe_altitude, globe_at, globe_up}
#ifdef TERRAIN_FAST
#import veduta::terrain::orbit::{globe_hit}
#else
#import veduta::terrain::clipmap::{likely_end}
#endif

override FIELD_KIND: i32 = 2;
override MAX_MARCHING_STEPS: i32 = 200;
override STEP_FACTOR: f32 = 0.5;
override MARCH_EPSILON: f32 = 1.0;

// From where the ray comes below the highest ground, which the host finds: what of `Globe` depends on the place, and how far that is from the ray's origin.
struct GlobeRayRow {
    cell: vec3<i32>,
    near: f32,
    frac: vec3<f32>,
    far: f32,
    up: vec3<f32>,
    eye_altitude: f32,
    dir: vec3<f32>,
    pixel_angle: f32,
}

struct GlobeHitRow {
    normal: vec3<f32>,
    distance: f32,
    height: f32,
    steps: i32,
}

@group(0) @binding(0) var<uniform> ball: Globe;
@group(1) @binding(0) var<storage, read> rays: array<GlobeRayRow>;
@group(2) @binding(0) var<storage, read_write> results: array<GlobeHitRow>;

@compute @workgroup_size(64)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&rays) {
        return;
    }
    let ray = rays[id.x];
    var globe = ball;
    globe.cell = ray.cell;
    globe.frac = ray.frac;
    globe.up = ray.up;
    globe.eye_altitude = ray.eye_altitude;
#ifdef TERRAIN_FAST
    let hit = globe_hit(globe, FIELD_KIND, ray.dir, ray.near, ray.far, ray.pixel_angle, MAX_MARCHING_STEPS);
    results[id.x] = GlobeHitRow(hit.normal, hit.distance, hit.ground.height, select(hit.steps, -1, hit.steps == MAX_MARCHING_STEPS));
#else
    var t = 0.0;
    var distance = -1.0;
    var steps = -1;
    var reached = 0.0;
    var last = 0.0;
    for (var i = 0; i < MAX_MARCHING_STEPS; i++) {
        let at = ray.dir * t;
        let altitude = globe_altitude(globe, at);
        let clearance = altitude - globe_at(globe, FIELD_KIND, at, ray.pixel_angle * (ray.near + t)).height;
        reached = t;
        last = clearance;
        if clearance < MARCH_EPSILON * 0.001 * (ray.near + t) {
            distance = t;
            steps = i + 1;
            break;
        }
        t += STEP_FACTOR * clearance;
        if t > ray.far || (altitude > globe.high && dot(globe_up(globe, at), ray.dir) > 0.0) {
            steps = i + 1;
            break;
        }
    }
    // Out of steps: where the ground most likely is.
    let mu = dot(globe.up, ray.dir);
    distance = select(distance, likely_end(globe.ground_radius, globe.eye_altitude, mu, reached, last, ray.far), steps < 0);
    let at = ray.dir * max(distance, 0.0);
    let ground = globe_at(globe, FIELD_KIND, at, ray.pixel_angle * (ray.near + max(distance, 0.0)));
    let share = globe.ground_radius / (globe.ground_radius + ground.height);
    results[id.x] = GlobeHitRow(normalize(globe_up(globe, at) - share * ground.slope), distance, ground.height, steps);
#endif
}
    }#
}#
