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
    /// The field at the place that the last step started from.
    ground: Ground,
}

/// A hit moved onto the field, by at most `most` metres, in so many steps.
///
/// domain  kind in [0, 4] 1 lin
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  origin in [-1e5, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  t in [0, 1e5] m lin
/// domain  pixel_angle in [1e-5, 0.1] 1 log
/// domain  most in [0, 1e4] m lin
/// domain  steps in [0, 4] 1 lin
/// range   [-1e5, 2e5] 1
/// error   0.8 abs of reference::field::refined
/// outside undefined
/// source  Newton's method
fn refined_hit(field: Field, kind: i32, ground_radius: f32, eye_altitude: f32, origin: vec3<f32>, dir: vec3<f32>, t: f32, pixel_angle: f32, most: f32, steps: i32) -> RefinedHit {
    var distance = t;
    var ground = Ground(0.0, vec2<f32>(0.0), 0.0);
    var gradient = vec3<f32>(0.0, 1.0, 0.0);
    for (var i = 0; i < steps; i++) {
        let at = origin + dir * distance;
        ground = ground_at(field, kind, at.xz, pixel_angle * distance);
        gradient = up_at(ground_radius, eye_altitude, at) - vec3<f32>(ground.slope.x, 0.0, ground.slope.y);
        let clearance = altitude_of(ground_radius, eye_altitude, at) - ground.height;
        // The clearance falls along a ray that meets the ground.
        let fall = max(-dot(gradient, dir), 0.02);
        distance = clamp(distance + clearance / fall, max(t - most, 0.0), t + most);
    }
    return RefinedHit(distance, gradient * inverseSqrt(max(dot(gradient, gradient), 1e-12)), ground);
}
