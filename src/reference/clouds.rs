//! The cloud layer: density and single scattering.

use super::fractal::fbm_value_3d_periodic;
use super::math::{add, dot, scale};
use super::phase::phase_double_henyey_greenstein;
use super::planet::{
    altitude_along, altitude_of, clip_segment, direction_cosine_along, ground_distance,
    segment_distance, segment_length, shell_segment, sphere_span, top_distance,
};

/// A layer of clouds between two spheres around the planet; metres and 1/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudLayer {
    /// Lattice cell of the eye's foot point.
    pub cell: [i32; 3],
    /// Fraction within that cell.
    pub frac: [f64; 3],
    /// Wavelength of the first octave.
    pub wavelength: f64,
    /// Period of the lattice (cells).
    pub period: i32,
    /// Octaves of the noise.
    pub octaves: i32,
    /// Hurst exponent of the noise.
    pub hurst: f64,
    /// Altitude of the lower sphere.
    pub bottom: f64,
    /// Distance between the spheres.
    pub thickness: f64,
    /// Share of the sky that the clouds cover.
    pub coverage: f64,
    /// 0 separate clouds, 1 a homogeneous deck.
    pub uniformity: f64,
    /// Extinction at full density.
    pub extinction: f64,
    /// Scattered share of the extinction.
    pub albedo: f64,
    /// Asymmetry of the forward lobe.
    pub g_forward: f64,
    /// Asymmetry of the backward lobe.
    pub g_backward: f64,
    /// Share of the backward lobe.
    pub backward_share: f64,
    /// Seed of the lattice.
    pub seed: u32,
}

/// Light of the clouds along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudLight {
    /// Radiance scattered into the ray for a sun of irradiance 1 [1/sr].
    pub scatter: f64,
    /// Transmittance of the ray.
    pub transmittance: f64,
    /// Mean distance of what is seen (m).
    pub mean_distance: f64,
}

/// Density after filling by `uniformity` and cutting by `coverage`.
pub fn shape_coverage(n: f64, coverage: f64, uniformity: f64) -> f64 {
    let filled = n + (1.0 - n) * uniformity;
    ((filled - (1.0 - coverage)) / coverage.max(1e-6)).clamp(0.0, 1.0)
}

/// Density of the layer at a point; 0 outside the layer.
pub fn cloud_density(layer: &CloudLayer, relative: [f64; 3], altitude: f64) -> f64 {
    if altitude < layer.bottom || altitude > layer.bottom + layer.thickness {
        return 0.0;
    }
    let n = noise(layer, relative, altitude);
    shape_coverage(n, layer.coverage, layer.uniformity)
}

/// Density of the layer before its cut: below 0 where there is no cloud; not cut at the layer's spheres either.
pub fn uncut_density(layer: &CloudLayer, relative: [f64; 3], altitude: f64) -> f64 {
    let n = noise(layer, relative, altitude);
    let filled = n + (1.0 - n) * layer.uniformity;
    (filled - (1.0 - layer.coverage)) / layer.coverage.max(1e-6)
}

/// Mean of a density that changes evenly from one value to another, where what is below 0 is none.
pub fn mean_density(here: f64, next: f64) -> f64 {
    let full = here.max(0.0) + next.max(0.0);
    0.5 * full * full / (here.abs() + next.abs()).max(1e-9)
}

fn noise(layer: &CloudLayer, relative: [f64; 3], altitude: f64) -> f64 {
    let place = add(
        layer.frac,
        scale([relative[0], altitude, relative[2]], 1.0 / layer.wavelength),
    );
    let period = if layer.period > 0 {
        layer.period
    } else {
        1 << 20
    };
    fbm_value_3d_periodic(
        layer.cell,
        place,
        [period; 3],
        layer.octaves,
        layer.hurst,
        layer.seed,
    )
}

/// Distance from a point within the layer to the layer's edge.
pub fn layer_exit(layer: &CloudLayer, ground_radius: f64, altitude: f64, mu: f64) -> f64 {
    let below = sphere_span(ground_radius, layer.bottom, altitude, mu);
    if mu < 0.0 && below.near <= below.far {
        below.near.max(0.0)
    } else {
        top_distance(ground_radius, layer.bottom + layer.thickness, altitude, mu)
    }
}

/// Optical depth from a point within the layer towards the sun, by the midpoint rule.
pub fn sun_depth(
    layer: &CloudLayer,
    ground_radius: f64,
    relative: [f64; 3],
    altitude: f64,
    to_sun: [f64; 3],
    mu: f64,
    steps: i32,
) -> f64 {
    let count = steps.max(1);
    let ds = layer_exit(layer, ground_radius, altitude, mu) / f64::from(count);
    let density = |i: i32| {
        let s = (f64::from(i) + 0.5) * ds;
        cloud_density(
            layer,
            add(relative, scale(to_sun, s)),
            altitude_along(ground_radius, altitude, mu, s),
        )
    };
    (0..count).map(density).sum::<f64>() * ds * layer.extinction
}

/// Light of the cloud layer along a view ray: the sum of eq. 3.14 over `steps` equal steps within the layer.
#[allow(clippy::too_many_arguments)]
pub fn march_clouds(
    layer: &CloudLayer,
    ground_radius: f64,
    eye_altitude: f64,
    dir: [f64; 3],
    to_sun: [f64; 3],
    max_distance: f64,
    steps: i32,
    light_steps: i32,
    jitter: f64,
) -> CloudLight {
    let count = steps.max(1);
    let top = layer.bottom + layer.thickness;
    let segment = clip_segment(
        shell_segment(ground_radius, layer.bottom, top, eye_altitude, dir[1]),
        max_distance,
    );
    let ds = segment_length(segment) / f64::from(count);
    let nu = dot(dir, to_sun);
    let (mut depth, mut scatter, mut weight, mut weighted) = (0.0f64, 0.0, 0.0, 0.0);
    for i in 0..count {
        let t = segment_distance(segment, (f64::from(i) + jitter) * ds);
        let relative = scale(dir, t);
        let altitude = altitude_of(ground_radius, eye_altitude, relative);
        let step_depth = cloud_density(layer, relative, altitude) * layer.extinction * ds;
        if step_depth > 0.0 {
            let mu =
                direction_cosine_along(ground_radius, eye_altitude, altitude, to_sun[1], nu, t);
            if ground_distance(ground_radius, altitude, mu) < 0.0 {
                let sun = sun_depth(
                    layer,
                    ground_radius,
                    relative,
                    altitude,
                    to_sun,
                    mu,
                    light_steps,
                );
                scatter += (-depth - sun).exp() * step_depth;
            }
            let seen = (-depth).exp() - (-depth - step_depth).exp();
            weight += seen;
            weighted += seen * t;
            depth += step_depth;
        }
    }
    let phase =
        phase_double_henyey_greenstein(nu, layer.g_forward, layer.g_backward, layer.backward_share);
    CloudLight {
        scatter: scatter * layer.albedo * phase,
        transmittance: (-depth).exp(),
        mean_distance: if weight > 1e-12 {
            weighted / weight
        } else {
            segment.near
        },
    }
}

/// Share of the light that a step of even extinction scatters towards its start, where the depth towards the light changes evenly.
pub fn step_light(depth: f64, near: f64, far: f64) -> f64 {
    let end = depth + far;
    depth * (-near.min(end)).exp() * super::math::one_minus_exp_over_x((end - near).abs())
}

/// Real spherical harmonics up to the third degree, orthonormal over the sphere, in the order of the module.
pub fn harmonics([x, y, z]: [f64; 3]) -> [f64; 16] {
    let root = |v: f64| (v / std::f64::consts::PI).sqrt();
    [
        root(0.25),
        root(0.75) * y,
        root(0.75) * z,
        root(0.75) * x,
        root(3.75) * x * y,
        root(3.75) * y * z,
        root(0.3125) * (3.0 * z * z - 1.0),
        root(3.75) * x * z,
        root(0.9375) * (x * x - y * y),
        root(1.09375) * y * (3.0 * x * x - y * y),
        root(26.25) * x * y * z,
        root(0.65625) * y * (5.0 * z * z - 1.0),
        root(0.4375) * z * (5.0 * z * z - 3.0),
        root(0.65625) * x * (5.0 * z * z - 1.0),
        root(6.5625) * z * (x * x - y * y),
        root(1.09375) * x * (x * x - 3.0 * y * y),
    ]
}

/// Radiance, seen from below, of a plane homogeneous slab of optical thickness `depth` that is lit from above by an
/// irradiance of 1 and scatters once: zenith cosines `view_mu` and `sun_mu` > 0, phase function value `phase` [1/sr].
pub fn slab_single_scatter(depth: f64, albedo: f64, phase: f64, view_mu: f64, sun_mu: f64) -> f64 {
    let slope = 1.0 / view_mu - 1.0 / sun_mu;
    albedo * phase / view_mu
        * depth
        * (-depth / sun_mu).exp()
        * super::math::one_minus_exp_over_x(slope * depth)
}

/// Radiance with clouds: the air before them (`front`), their own light, and what they let through.
pub fn composite_clouds(
    clouds: CloudLight,
    sun_light: [f64; 3],
    front: super::atmosphere::SkyLight,
    background: [f64; 3],
) -> [f64; 3] {
    std::array::from_fn(|k| {
        let air = front.in_scatter[k];
        air + front.transmittance[k] * clouds.scatter * sun_light[k]
            + clouds.transmittance * (background[k] - air).max(0.0)
    })
}
