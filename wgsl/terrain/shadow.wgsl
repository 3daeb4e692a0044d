//! Soft shadows of the terrain: a march towards the sun that remembers how narrowly it passed.
//! source   Leitner2022 ch. 4.2.5; the ratio of clearance to distance: Quilez2010
//! symbols  t distance from the lit point [m] · sharpness inverse of the penumbra's half width as a tangent [1]
#define_import_path veduta::terrain::shadow

#import veduta::planet::shell::{altitude_of}
#import veduta::terrain::height::{Terrain, height}

/// How much sunlight reaches a point.
struct TerrainShadow {
    /// Share of the light that arrives, in [0, 1].
    light: f32,
    /// Height samples taken.
    steps: i32,
}

/// Share of the sun's light that reaches a point: 0 when the ground stands in the way, 1 when the ray stays clear of it,
/// and between them the smallest sharpness * clearance / t on the way, so that shadows harden towards their contact.
/// The ray starts `bias` metres along the normal.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  eye_altitude in [0, 1e5] m lin
/// domain  normal in [-1, 1] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// domain  relative in [-1e5, 1e5] m lin
/// domain  bias in [0, 1e3] m lin
/// domain  far in [1, 1e5] m log
/// domain  sharpness in [1, 1000] 1 log
/// domain  step_factor in [0.05, 1] 1 lin
/// domain  epsilon in [0.01, 10] 1 log
/// domain  max_steps in [0, 10000] 1 lin
/// domain  octaves in [1, 16] 1 lin
/// range   [0, 1] 1
/// error   2e-3 abs of reference::terrain::soft_shadow
/// outside undefined
/// source  Leitner2022 ch. 4.2.5; departs: clearance over distance in place of the bare clearance, which near the
///         surface is small on every ray
fn soft_shadow(terrain: Terrain, ground_radius: f32, eye_altitude: f32, relative: vec3<f32>, normal: vec3<f32>,
    to_sun: vec3<f32>, bias: f32, far: f32, sharpness: f32, step_factor: f32, epsilon: f32, max_steps: i32, octaves: i32) -> TerrainShadow {
    let start = relative + normal * bias;
    let tolerance = epsilon * 0.001;
    var shadow = TerrainShadow(1.0, 0);
    var t = 0.0;
    for (var i = 0; i < max_steps; i++) {
        let sample = start + to_sun * t;
        let clearance = altitude_of(ground_radius, eye_altitude, sample) - height(terrain, sample.xz, octaves);
        shadow.steps = i + 1;
        if clearance < tolerance * t {
            shadow.light = 0.0;
            break;
        }
        shadow.light = min(shadow.light, sharpness * clearance / max(t, 1e-6));
        t += step_factor * max(clearance, 0.0);
        if t > far {
            break;
        }
    }
    return shadow;
}
