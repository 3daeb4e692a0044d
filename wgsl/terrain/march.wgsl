//! Intersection of a ray with the terrain: constant steps, and steps as long as the clearance allows.
//! source   Leitner2022 ch. 3.3 and alg. 4, corrected: the distance accumulates and the tolerance is recomputed
//! symbols  t distance along the ray [m] · clearance height above the ground below the sample [m]
#define_import_path veduta::terrain::march

#import veduta::planet::shell::{altitude_along}
#import veduta::terrain::height::{Terrain, height}

/// What a march found.
struct TerrainHit {
    /// Distance of the hit [m]; -1 if there is none.
    distance: f32,
    /// Distance of the last sample [m]; with `clearance` it tells a ray that ran out of steps close to the ground
    /// from one that left.
    reached: f32,
    /// Clearance at the last sample [m].
    clearance: f32,
    /// Height samples taken.
    steps: i32,
}

/// Clearance above the ground at distance `t` along a ray from the eye.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  octaves in [1, 16] 1 lin
/// domain  t in [0, 1e5] m lin
/// range   [-1.1e5, 1e6] m
/// error   4e-2 abs of reference::terrain::ray_clearance
/// outside undefined
/// source  Leitner2022 ch. 4.2, on the sphere
fn ray_clearance(terrain: Terrain, ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, t: f32, octaves: i32) -> f32 {
    return altitude_along(ground_radius, eye_altitude, dir.y, t) - height(terrain, dir.xz * t, octaves);
}

/// First sample below the ground on a ray walked in equal steps from `near`; `interpolate` places the hit on the
/// straight line between the last two clearances. Ends without a hit past `far` or after `max_steps` samples.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  near in [0, 1e3] m lin
/// domain  far in [1e3, 1e5] m lin
/// domain  step in [1, 100] m log
/// domain  max_steps in [0, 4000] 1 lin
/// domain  octaves in [1, 16] 1 lin
/// range   [-1, 1e5] m
/// error   5e-3 abs of reference::terrain::march_constant
/// outside undefined
/// source  Leitner2022 ch. 3.3
fn march_constant(terrain: Terrain, ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, near: f32, far: f32, step: f32,
    max_steps: i32, octaves: i32, interpolate: bool) -> TerrainHit {
    var hit = TerrainHit(-1.0, near, 0.0, 0);
    for (var i = 0; i < max_steps; i++) {
        let t = near + f32(i) * step;
        if t > far {
            break;
        }
        let clearance = ray_clearance(terrain, ground_radius, eye_altitude, dir, t, octaves);
        let previous = hit.clearance;
        hit.reached = t;
        hit.clearance = clearance;
        hit.steps = i + 1;
        if clearance < 0.0 {
            let back = select(0.0, step * clearance / (clearance - previous), interpolate && i > 0);
            hit.distance = t - back;
            break;
        }
    }
    return hit;
}

/// Hit of a ray with the ground, stepped by `step_factor` times the clearance until that is below the tolerance
/// epsilon * 0.001 * t, which grows in proportion to the distance as detail on the screen shrinks.
/// A factor of 1 / sqrt(1 + slope^2) or less cannot pass a slope; never returns a distance beyond `far`.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// domain  near in [0, 1e3] m lin
/// domain  far in [1e3, 1e5] m lin
/// domain  step_factor in [0.05, 1] 1 lin
/// domain  epsilon in [0.01, 10] 1 log
/// domain  max_steps in [0, 4000] 1 lin
/// domain  octaves in [1, 16] 1 lin
/// range   [-1, 1e5] m
/// error   0.05 abs of reference::terrain::march
/// outside undefined
/// source  Leitner2022 alg. 4; departs: corrected lines 13 and 19
fn march(terrain: Terrain, ground_radius: f32, eye_altitude: f32, dir: vec3<f32>, near: f32, far: f32, step_factor: f32,
    epsilon: f32, max_steps: i32, octaves: i32) -> TerrainHit {
    let tolerance = epsilon * 0.001;
    var t = near;
    var hit = TerrainHit(-1.0, near, 0.0, 0);
    for (var i = 0; i < max_steps; i++) {
        let clearance = ray_clearance(terrain, ground_radius, eye_altitude, dir, t, octaves);
        hit.reached = t;
        hit.clearance = clearance;
        hit.steps = i + 1;
        if clearance < tolerance * t {
            hit.distance = t;
            break;
        }
        t += step_factor * clearance;
        if t > far {
            break;
        }
    }
    return hit;
}
