//! The cloud layer: density and single scattering.

use super::fractal::fbm_value_3d_periodic;
use super::math::{add, dot, scale};
use super::noise::{
    gradient_noise_2d_periodic, gradient_noise_3d_periodic, octave_seed, worley::cell_point_3d,
};
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

impl CloudLayer {
    /// The layer of a deck, where no wind has moved it; without the deck's forms.
    pub fn of(deck: &crate::clouds::CloudDeck) -> CloudLayer {
        CloudLayer {
            cell: [0; 3],
            frac: [0.0; 3],
            wavelength: deck.wavelength,
            period: 1 << deck.period_doublings,
            octaves: 6,
            hurst: 1.0,
            bottom: deck.bottom,
            thickness: deck.thickness,
            coverage: deck.coverage,
            uniformity: deck.uniformity,
            extinction: deck.extinction,
            albedo: deck.albedo,
            g_forward: deck.g_forward,
            g_backward: deck.g_backward,
            backward_share: deck.backward_share,
            seed: deck.seed,
        }
    }
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

/// What forms the clouds of a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudShape {
    /// 0 stratus, 1/2 cumulus, 1 cumulonimbus.
    pub kind: f64,
    /// What the weather adds to the kind.
    pub kind_spread: f64,
    /// What the weather adds to the coverage.
    pub coverage_spread: f64,
    /// How far finer billows fray the edges.
    pub detail: f64,
    /// Density over what the noise exceeds its threshold by.
    pub sharpness: f64,
    /// The weather has 2 to this power cells over the period.
    pub weather_doublings: u32,
}

/// A place on a torus as a cell and a fraction, where the torus has 2^bits cells an axis; `place` is in turns.
fn torus_place<const N: usize>(place: [f64; N], bits: u32) -> ([i32; N], [f64; N]) {
    let count = f64::from(bits).exp2();
    let at = place.map(|p| (p - p.floor()) * count);
    (at.map(|a| a.floor() as i32), at.map(|a| a - a.floor()))
}

/// Billows on a torus of 2^bits cells: 1 at scattered points in the middle half of cells, falling evenly to 0 at three quarters of a cell from them.
pub fn billows(place: [f64; 3], bits: u32, seed: u32) -> f64 {
    let (cell, frac) = torus_place(place, bits);
    let mask = (1 << bits) - 1;
    let mut nearest = f64::INFINITY;
    // All cells about: those beyond the eight of the device have no point within reach.
    for k in 0..27 {
        let offset = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
        let near: [i32; 3] = std::array::from_fn(|a| (cell[a] + offset[a]) & mask);
        let point = cell_point_3d(near, seed);
        let square: f64 = (0..3)
            .map(|a| (frac[a] - f64::from(offset[a]) - 0.25 - 0.5 * point[a]).powi(2))
            .sum();
        nearest = nearest.min(square);
    }
    1.0 - (nearest.sqrt() / 0.75).min(1.0)
}

fn smooth_rise(x: f64) -> f64 {
    let t = x.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// How much cloud a kind has at a share `height` of the layer.
pub fn kind_profile(kind: f64, height: f64) -> f64 {
    let wane = 0.08 + kind * (0.34 + 0.3 * kind);
    let end = 0.22 + kind * (0.8 - 0.02 * kind);
    smooth_rise(height / (0.05 + 0.05 * kind)) * (1.0 - smooth_rise((height - wane) / (end - wane)))
}

/// A place relative to the eye on the torus of a layer, in turns.
fn torus_turns(layer: &CloudLayer, relative: [f64; 3], altitude: f64) -> [f64; 3] {
    let period = f64::from(layer.period);
    let cells = scale([relative[0], altitude, relative[2]], 1.0 / layer.wavelength);
    std::array::from_fn(|k| (f64::from(layer.cell[k]) + layer.frac[k] + cells[k]) / period)
}

/// Density before its cut of a layer with forms.
pub fn shaped_density(
    layer: &CloudLayer,
    shape: &CloudShape,
    relative: [f64; 3],
    altitude: f64,
) -> f64 {
    let place = torus_turns(layer, relative, altitude);
    let seed = |i: i32| octave_seed(layer.seed, i);
    let flat = |bits: u32, seed: u32| {
        let (cell, frac) = torus_place([place[0], place[2]], bits);
        gradient_noise_2d_periodic(cell, frac, [1 << bits; 2], seed)
    };
    let wide = shape.weather_doublings;
    let fronts = flat(wide, seed(8)) + 0.5 * flat(wide + 1, seed(9));
    let cover = (layer.coverage + shape.coverage_spread * fronts).clamp(0.0, 1.0);
    let kind = (shape.kind + shape.kind_spread * flat(wide, seed(10))).clamp(0.0, 1.0);
    formed_density(layer, shape, place, altitude, cover, kind)
}

/// Coverage and kind of a map at a place in turns of it.
pub fn map_weather(map: &crate::clouds::WeatherTexels, place: [f64; 2]) -> [f64; 2] {
    map.at(place)
}

/// Density before its cut of a layer with forms where a map that lies `repeats` times along the period tells the weather.
pub fn mapped_density(
    layer: &CloudLayer,
    shape: &CloudShape,
    map: &crate::clouds::WeatherTexels,
    repeats: u32,
    relative: [f64; 3],
    altitude: f64,
) -> f64 {
    let place = torus_turns(layer, relative, altitude);
    let [cover, kind] = map_weather(map, [place[0], place[2]].map(|p| p * f64::from(repeats)));
    let (cover, kind) = (layer.coverage * cover, shape.kind * kind);
    formed_density(layer, shape, place, altitude, cover, kind)
}

/// Density before its cut at a place on the torus, where coverage and kind are these.
fn formed_density(
    layer: &CloudLayer,
    shape: &CloudShape,
    place: [f64; 3],
    altitude: f64,
    cover: f64,
    kind: f64,
) -> f64 {
    let bits = layer.period.ilog2();
    let seed = |i: i32| octave_seed(layer.seed, i);
    let swelling = |bits: u32, seed: u32| {
        let (cell, frac) = torus_place(place, bits);
        gradient_noise_3d_periodic(cell, frac, [1 << bits; 3], seed)
    };
    let height = ((altitude - layer.bottom) / layer.thickness.max(1e-3)).clamp(0.0, 1.0);
    let heap = 0.6 * billows(place, bits, seed(1))
        + 0.28 * billows(place, bits + 1, seed(2))
        + 0.12 * billows(place, bits + 2, seed(3));
    let swell = swelling(bits, seed(4)) + 0.5 * swelling(bits + 1, seed(5));
    let base = (0.175 + 0.21 * swell + 0.8125 * heap).clamp(0.0, 1.0);
    let base = base + (1.0 - base) * layer.uniformity;
    let whole = shape.sharpness * (base + cover * kind_profile(kind, height) - 1.0);
    let fine = 0.65 * billows(place, bits + 3, seed(6)) + 0.35 * billows(place, bits + 4, seed(7));
    let above = (8.0 * height).clamp(0.0, 1.0);
    let frayed = fine + (1.0 - 2.0 * fine) * above;
    whole - 0.35 * shape.detail * shape.sharpness * frayed * (1.0 - whole.clamp(0.0, 1.0))
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
