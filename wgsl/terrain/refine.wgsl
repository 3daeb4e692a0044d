//! The last step to a hit: from the baked ground to the field itself, as the pixel's footprint filters it.
//! source   Newton's method
//! symbols  t distance along the ray [m] · pixel_angle angle of a pixel [rad], so that the footprint is pixel_angle t
#define_import_path veduta::terrain::refine

#import veduta::planet::shell::{up_at, altitude_of}
#import veduta::terrain::field::{Field, Ground, ground_at}

/// A hit with the ground there.
struct RefinedHit {
    /// Distance [m].
    distance: f32,
    /// Upward unit normal in the eye's frame.
    normal: vec3<f32>,
    /// The field at the place that the step started from.
    ground: Ground,
}

/// A hit moved onto the field, by at most `most` metres.
///
/// domain  kind in [0, 4] 1 lin
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  origin in [-1e5, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  t in [0, 1e5] m lin
/// domain  pixel_angle in [1e-5, 0.1] 1 log
/// domain  most in [0, 1e4] m lin
/// range   [-1e5, 2e5] 1
/// error   1 abs of reference::field::refined
/// outside undefined
/// source  Newton's method, one step
fn refined_hit(field: Field, kind: i32, ground_radius: f32, eye_altitude: f32, origin: vec3<f32>, dir: vec3<f32>, t: f32, pixel_angle: f32, most: f32) -> RefinedHit {
    let at = origin + dir * t;
    let ground = ground_at(field, kind, at.xz, pixel_angle * t);
    let up = up_at(ground_radius, eye_altitude, at);
    let clearance = altitude_of(ground_radius, eye_altitude, at) - ground.height;
    let gradient = up - vec3<f32>(ground.slope.x, 0.0, ground.slope.y);
    // The clearance falls along a ray that meets the ground.
    let fall = max(-dot(gradient, dir), 0.02);
    let distance = max(t + clamp(clearance / fall, -most, most), 0.0);
    return RefinedHit(distance, gradient * inverseSqrt(max(dot(gradient, gradient), 1e-12)), ground);
}
