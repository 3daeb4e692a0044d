//! The last step to a hit: from the baked ground to the field itself, as the pixel's footprint filters it.
//! source   Newton's method
//! symbols  t distance along the ray [m] · pixel_angle angle of a pixel [rad], so that the footprint is pixel_angle t
#define_import_path veduta::terrain::refine

#import veduta::planet::shell::{up_at, altitude_of}
#import veduta::terrain::field::{Field}
#import veduta::terrain::relief::{land_at}

/// A hit with the slope where the last step to it began.
struct RefinedHit {
    /// Distance [m].
    distance: f32,
    /// Slope along x and z.
    slope: vec2<f32>,
}

/// A hit moved onto the field, by at most `most` metres, in so many steps. `slope` is that of what was hit; without a step it stays.
///
/// domain  kind in [0, 7] 1 lin
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  origin in [-1e5, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  t in [0, 1e5] m lin
/// domain  pixel_angle in [1e-5, 0.1] 1 log
/// domain  slope in [-100, 100] 1 lin
/// domain  most in [0, 1e4] m lin
/// domain  steps in [0, 4] 1 lin
/// range   [-1e4, 2e5] 1
/// error   1 abs of reference::intersect::first_crossing
/// outside undefined
/// source  Newton's method
fn refined_hit(relief: texture_2d<f32>, field: Field, kind: i32, ground_radius: f32, eye_altitude: f32, origin: vec3<f32>, dir: vec3<f32>, t: f32, pixel_angle: f32, slope: vec2<f32>, most: f32, steps: i32) -> RefinedHit {
    var hit = RefinedHit(t, slope);
    for (var i = 0; i < steps; i++) {
        let at = origin + dir * hit.distance;
        let ground = land_at(relief, field, kind, at.xz, pixel_angle * hit.distance);
        let gradient = up_at(ground_radius, eye_altitude, at) - vec3<f32>(ground.slope.x, 0.0, ground.slope.y);
        let clearance = altitude_of(ground_radius, eye_altitude, at) - ground.height;
        hit.slope = ground.slope;
        // The clearance falls along a ray that meets the ground.
        let fall = max(-dot(gradient, dir), 0.02);
        hit.distance = clamp(hit.distance + clearance / fall, max(t - most, 0.0), t + most);
    }
    return hit;
}
