//! The density field of the cloud layer: value-noise fBm shaped by coverage.
//! source   Leitner2022 ch. 4.5; coverage: ours
//! symbols  relative position relative to the eye [m] · altitude [m] · density relative to a full cloud [1]
#define_import_path veduta::clouds::field

#import veduta::fractal::fbm::{fbm_value_3d_periodic_six}

/// The period that stands for none: 2^20 cells, which eleven octaves still hold.
const NO_PERIOD: i32 = 1048576;

/// A layer of clouds between two spheres around the planet.
struct CloudLayer {
    /// Lattice cell of the eye's foot point (altitude 0), in units of the wavelength.
    cell: vec3<i32>,
    /// Fraction within that cell, in [0, 1).
    frac: vec3<f32>,
    /// Wavelength of the first octave [m], > 0.
    wavelength: f32,
    /// Period of the lattice on every axis [cells]; 0: none (see NO_PERIOD).
    period: i32,
    /// Hurst exponent of the noise.
    hurst: f32,
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
/// error   1e-5 abs of reference::clouds::shape_coverage
/// monotone n
/// source  the usual remapping max(0, (n - (1 - coverage)) / coverage); floor 1e-6 under the divisor
fn shape_coverage(n: f32, coverage: f32, uniformity: f32) -> f32 {
    let filled = mix(n, 1.0, uniformity);
    return clamp((filled - (1.0 - coverage)) / max(coverage, 1e-6), 0.0, 1.0);
}

/// Density of the layer at a point given relative to the eye, whose altitude is `altitude`; 0 outside the layer.
///
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [0, 2e4] m lin
/// range   [0, 1] 1
/// error   2e-5 abs of reference::clouds::cloud_density
/// source  Leitner2022 ch. 4.5 (six octaves of value noise)
fn cloud_density(layer: CloudLayer, relative: vec3<f32>, altitude: f32) -> f32 {
    let place = layer.frac + vec3<f32>(relative.x, altitude, relative.z) / layer.wavelength;
    let period = select(NO_PERIOD, layer.period, layer.period > 0);
    let n = fbm_value_3d_periodic_six(layer.cell, place, vec3<i32>(period), layer.hurst, layer.seed);
    let inside = altitude >= layer.bottom && altitude <= layer.bottom + layer.thickness;
    return select(0.0, shape_coverage(n, layer.coverage, layer.uniformity), inside);
}
