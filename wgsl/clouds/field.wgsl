//! The density field of the cloud layer: value-noise fBm shaped by coverage.
//! source   Leitner2022 ch. 4.5; coverage: ours
//! symbols  relative position relative to the eye [m] · altitude [m] · density relative to a full cloud [1]
#define_import_path veduta::clouds::field

#import veduta::fractal::fbm::{fbm_value_3d_torus_six}
#import veduta::noise::lattice::{turn_3d}

/// A layer of clouds between two spheres around the planet.
struct CloudLayer {
    /// Where the eye's foot point (altitude 0) lies on the torus on which the clouds repeat, in turns of 2^32.
    turn: vec3<u32>,
    /// Turns a metre: 1 / (wavelength of the first octave times 2^period_doublings) [1/m].
    turns_per_metre: f32,
    /// The clouds repeat after 2 to this power cells of the first octave, in [1, 16].
    period_doublings: u32,
    /// What the amplitude falls by from octave to octave, in [0.0625, 1].
    fall: f32,
    /// Altitude of the lower sphere [m].
    bottom: f32,
    /// Distance between the spheres [m].
    thickness: f32,
    /// Share of the sky that the clouds cover, in [0, 1].
    coverage: f32,
    /// How far the noise is filled up, in [0, 1]: 0 separate clouds, 1 a homogeneous deck of full density.
    uniformity: f32,
    /// Extinction at full density [1/m].
    extinction: f32,
    /// Scattered share of the extinction, in [0, 1].
    albedo: f32,
    /// Asymmetry of the forward lobe, in [0, 1).
    g_forward: f32,
    /// Asymmetry of the backward lobe, in (-1, 0].
    g_backward: f32,
    /// Share of the backward lobe, in [0, 1].
    backward_share: f32,
    /// Seed of the lattice.
    seed: u32,
}

/// Density after the noise value `n` has been filled up by `uniformity` and cut by `coverage`: no cloud at coverage 0.
///
/// domain  n in [0, 1] 1 lin
/// domain  coverage in [0.01, 1] 1 lin
/// domain  uniformity in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   2e-5 abs of reference::clouds::shape_coverage
/// monotone n
/// source  the usual remapping max(0, (n - (1 - coverage)) / coverage); floor 1e-6 under the divisor
fn shape_coverage(n: f32, coverage: f32, uniformity: f32) -> f32 {
    let filled = mix(n, 1.0, uniformity);
    return clamp((filled - (1.0 - coverage)) * (1.0 / max(coverage, 1e-6)), 0.0, 1.0);
}

/// Density of the layer at a point given relative to the eye, whose altitude is `altitude`; 0 outside the layer.
///
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [0, 2e4] m lin
/// range   [0, 1] 1
/// error   2e-5 abs of reference::clouds::cloud_density
/// source  Leitner2022 ch. 4.5 (six octaves of value noise)
fn cloud_density(layer: CloudLayer, relative: vec3<f32>, altitude: f32) -> f32 {
    let turn = layer.turn + turn_3d(vec3<f32>(relative.x, altitude, relative.z) * layer.turns_per_metre);
    let n = fbm_value_3d_torus_six(turn, layer.period_doublings, layer.fall, layer.seed);
    let inside = altitude >= layer.bottom && altitude <= layer.bottom + layer.thickness;
    return select(0.0, shape_coverage(n, layer.coverage, layer.uniformity), inside);
}

/// Density of the layer before its cut: below 0 where there is no cloud, the more the farther from one; not cut at the layer's spheres either.
///
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [4000, 5500] m lin
/// range   [-1e6, 1.00001] 1
/// error   3e-4 abs of reference::clouds::uncut_density
/// outside undefined
/// source  as cloud_density
fn uncut_density(layer: CloudLayer, relative: vec3<f32>, altitude: f32) -> f32 {
    let turn = layer.turn + turn_3d(vec3<f32>(relative.x, altitude, relative.z) * layer.turns_per_metre);
    let n = fbm_value_3d_torus_six(turn, layer.period_doublings, layer.fall, layer.seed);
    return (mix(n, 1.0, layer.uniformity) - (1.0 - layer.coverage)) * (1.0 / max(layer.coverage, 1e-6));
}
