Where given rays meet a terrain, one invocation a ray: the textbook march, or the baked heights with a last step on the field itself.

#PROGRAM{ terrain_rays }#

#COMPUTE{
    #CODE{
#import veduta::terrain::field::{Field}
#import veduta::terrain::relief::{land_at}
#import veduta::planet::shell::{altitude_of, up_at}
#ifdef TERRAIN_FAST
#import veduta::terrain::clipmap::{Clip, clip_hit, likely_distance}
#import veduta::terrain::refine::{refined_hit}
#endif

override FIELD_KIND: i32 = 2;
override REFINE_STEPS: i32 = 1;
override MAX_MARCHING_STEPS: i32 = 200;
override STEP_FACTOR: f32 = 0.5;
override MARCH_EPSILON: f32 = 1.0;

struct RayRow {
    // Relative to the eye.
    origin: vec3<f32>,
    far: f32,
    dir: vec3<f32>,
    pixel_angle: f32,
}

struct HitRow {
    distance: f32,
    normal: vec3<f32>,
    height: f32,
    steps: i32,
}

struct Planet {
    ground_radius: f32,
    eye_altitude: f32,
}

@group(0) @binding(0) var<uniform> field: Field;
#ifdef TERRAIN_FAST
@group(0) @binding(1) var<uniform> clip: Clip;
@group(1) @binding(0) var<storage, read> rays: array<RayRow>;
@group(1) @binding(1) var heights: texture_2d_array<f32>;
@group(1) @binding(2) var sectors: texture_2d<f32>;
@group(1) @binding(3) var places: texture_2d<f32>;
@group(1) @binding(4) var wrapping: sampler;
@group(1) @binding(5) var relief: texture_2d<f32>;
#else
@group(0) @binding(1) var<uniform> planet: Planet;
@group(1) @binding(0) var<storage, read> rays: array<RayRow>;
@group(1) @binding(1) var relief: texture_2d<f32>;
#endif
@group(2) @binding(0) var<storage, read_write> results: array<HitRow>;

@compute @workgroup_size(64)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&rays) {
        return;
    }
    let ray = rays[id.x];
#ifdef TERRAIN_FAST
    let hit = clip_hit(heights, wrapping, sectors, places, clip, ray.dir, ray.far, MAX_MARCHING_STEPS);
    let capped = hit.steps == MAX_MARCHING_STEPS && hit.distance < 0.0;
    let met = likely_distance(clip, ray.dir, hit, ray.far, MAX_MARCHING_STEPS);
    let found = refined_hit(relief, field, FIELD_KIND, clip.ground_radius, clip.eye_altitude, ray.origin, ray.dir, max(met, 0.0), ray.pixel_angle, hit.slope, 2.0 * hit.spacing, REFINE_STEPS).distance;
    // The ground at the hit itself.
    let at = ray.dir * max(found, 0.0);
    let ground = land_at(relief, field, FIELD_KIND, at.xz, ray.pixel_angle * max(found, 0.0));
    let gradient = up_at(clip.ground_radius, clip.eye_altitude, at) - vec3<f32>(ground.slope.x, 0.0, ground.slope.y);
    results[id.x] = HitRow(select(found, -1.0, met < 0.0), normalize(gradient), ground.height, select(hit.steps, -1, capped));
#else
    var t = 0.0;
    var distance = -1.0;
    var steps = -1;
    for (var i = 0; i < MAX_MARCHING_STEPS; i++) {
        let at = ray.origin + ray.dir * t;
        let ground = land_at(relief, field, FIELD_KIND, at.xz, ray.pixel_angle * t);
        let clearance = altitude_of(planet.ground_radius, planet.eye_altitude, at) - ground.height;
        if clearance < MARCH_EPSILON * 0.001 * t {
            distance = t;
            steps = i + 1;
            break;
        }
        t += STEP_FACTOR * clearance;
        if t > ray.far {
            steps = i + 1;
            break;
        }
    }
    let at = ray.origin + ray.dir * max(distance, 0.0);
    let ground = land_at(relief, field, FIELD_KIND, at.xz, ray.pixel_angle * max(distance, 0.0));
    let gradient = up_at(planet.ground_radius, planet.eye_altitude, at) - vec3<f32>(ground.slope.x, 0.0, ground.slope.y);
    results[id.x] = HitRow(distance, normalize(gradient), ground.height, steps);
#endif
}
    }#
}#
