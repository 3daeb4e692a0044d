Where given rays meet a terrain, one invocation a ray: over baked heights with a last step on the field itself, or over the field itself, from any number of origins.

#PROGRAM{ terrain_rays }#

#COMPUTE{
    #CODE{
#import veduta::terrain::field::{Field}
#import veduta::terrain::relief::{land_at}
#import veduta::planet::shell::{altitude_of, up_at}
#ifdef TERRAIN_FAST
#import veduta::terrain::clipmap::{Clip}
#import veduta::terrain::refine::{found_hit}
#else
#import veduta::terrain::clipmap::{likely_end}
#endif

override FIELD_KIND: i32 = 2;
override REFINE_STEPS: i32 = 2;
override SEARCH_STEPS: i32 = 48;
override MAX_MARCHING_STEPS: i32 = 200;
override STEP_FACTOR: f32 = 0.5;
override MARCH_EPSILON: f32 = 1.0;
// Whether rays over the field itself are bracketed with steps that the slope's bound allows; else the textbook march.
override RAY_BRACKET: i32 = 0;

struct HitRow {
    distance: f32,
    normal: vec3<f32>,
    height: f32,
    steps: i32,
}

@group(0) @binding(0) var<uniform> field: Field;
#ifdef TERRAIN_FAST
struct RayRow {
    // Relative to the eye.
    origin: vec3<f32>,
    far: f32,
    dir: vec3<f32>,
    pixel_angle: f32,
}

@group(0) @binding(1) var<uniform> clip: Clip;
@group(1) @binding(0) var<storage, read> rays: array<RayRow>;
@group(1) @binding(1) var heights: texture_2d_array<f32>;
@group(1) @binding(2) var sectors: texture_2d<f32>;
@group(1) @binding(3) var places: texture_2d<f32>;
@group(1) @binding(4) var wrapping: sampler;
@group(1) @binding(5) var relief: texture_2d<f32>;
#else
struct LooseRay {
    dir: vec3<f32>,
    far: f32,
    // Where its origin lies on the field's lattice.
    cell: vec2<i32>,
    frac: vec2<f32>,
    eye_altitude: f32,
    // There is no ground before it.
    near: f32,
    pixel_angle: f32,
}

struct Course {
    ground_radius: f32,
    // No ground is above.
    top: f32,
    // Steepest slope of the field while so many octaves count.
    steep: array<vec4<f32>, 5>,
}

@group(0) @binding(1) var<uniform> course: Course;
@group(1) @binding(0) var<storage, read> rays: array<LooseRay>;
@group(1) @binding(1) var relief: texture_2d<f32>;
#endif
@group(2) @binding(0) var<storage, read_write> results: array<HitRow>;

#ifndef TERRAIN_FAST
// No slope of the field is steeper where a sample is at least so wide.
fn steepest(footprint: f32, pixel_angle: f32) -> f32 {
    let count = u32(clamp(ceil(log2(field.wavelength / max(footprint, 1e-6)) + 1.001), 0.0, 16.0));
    return course.steep[count >> 2u][count & 3u] * (1.0 + 8.0 * pixel_angle);
}
#endif

@compute @workgroup_size(64)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&rays) {
        return;
    }
    let ray = rays[id.x];
#ifdef TERRAIN_FAST
    let hit = found_hit(heights, wrapping, sectors, places, relief, clip, field, FIELD_KIND, ray.dir, ray.far, ray.pixel_angle, MAX_MARCHING_STEPS, REFINE_STEPS, SEARCH_STEPS);
    let found = max(hit.distance, 0.0);
    // The ground at the hit itself.
    let at = ray.dir * found;
    let ground = land_at(relief, field, FIELD_KIND, at.xz, ray.pixel_angle * found);
    let gradient = up_at(clip.ground_radius, clip.eye_altitude, at) - vec3<f32>(ground.slope.x, 0.0, ground.slope.y);
    results[id.x] = HitRow(hit.distance, normalize(gradient), ground.height, select(hit.steps, -1, hit.capped));
#else
    var here = field;
    here.cell = ray.cell;
    here.frac = ray.frac;
    let level = length(ray.dir.xz);
    var t = ray.near;
    var clear = t;
    var clear_by = 0.0;
    var below = -1.0;
    var below_by = 0.0;
    var clearance = 0.0;
    var reached = t;
    var distance = -1.0;
    var steps = 0;
    var done = false;
    while steps < MAX_MARCHING_STEPS && !done {
        let at = ray.dir * t;
        let footprint = ray.pixel_angle * t;
        let altitude = altitude_of(course.ground_radius, ray.eye_altitude, at);
        let rise = dot(up_at(course.ground_radius, ray.eye_altitude, at), ray.dir);
        clearance = altitude - land_at(relief, here, FIELD_KIND, at.xz, footprint).height;
        reached = t;
        steps += 1;
        let gone = t >= ray.far || (altitude > course.top && rise >= 0.0);
        if RAY_BRACKET == 0 {
            if clearance < MARCH_EPSILON * 0.001 * t {
                distance = t;
                done = true;
            } else {
                done = gone;
                t += STEP_FACTOR * clearance;
                done = done || t > ray.far;
            }
            continue;
        }
        if clearance <= 0.0 {
            below = t;
            below_by = clearance;
        } else {
            clear = t;
            clear_by = clearance;
        }
        if below >= 0.0 {
            // Half of what is left is the error.
            done = below - clear < max(0.005 * footprint, 3e-7 * t + 1e-4);
            distance = select(distance, clear, done);
            t = clear + (below - clear) * clamp(clear_by / max(clear_by - below_by, 1e-9), 0.1, 0.9);
        } else {
            done = gone;
            let safe = (clearance - 0.01) / max(steepest(footprint, ray.pixel_angle) * level - rise, 1e-3);
            t = min(t + max(safe, max(max(0.5 * footprint, 0.0005 * t), 0.05)), ray.far);
        }
    }
    // Out of steps: within the bracket, or where the ground most likely is.
    let likely = select(likely_end(course.ground_radius, ray.eye_altitude, ray.dir.y, reached, clearance, ray.far), clear, below >= 0.0);
    distance = select(likely, distance, done);
    let at = ray.dir * max(distance, 0.0);
    let ground = land_at(relief, here, FIELD_KIND, at.xz, ray.pixel_angle * max(distance, 0.0));
    let gradient = up_at(course.ground_radius, ray.eye_altitude, at) - vec3<f32>(ground.slope.x, 0.0, ground.slope.y);
    results[id.x] = HitRow(distance, normalize(gradient), ground.height, select(-1, steps, done));
#endif
}
    }#
}#
