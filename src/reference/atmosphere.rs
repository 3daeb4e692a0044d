//! Single scattering of sunlight in a spherical atmosphere. Radiance is relative to the sun's irradiance outside the air.

use super::math::{dot, gauss_legendre, length};
use super::phase::{phase_cornette_shanks, phase_rayleigh};
use super::planet::{
    altitude_along, direction_cosine_along, ground_distance, sphere_span, top_distance,
};
use std::f64::consts::PI;

/// The planet's air; metres and 1/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Atmosphere {
    /// Radius of the ground sphere.
    pub ground_radius: f64,
    /// Thickness of the shell.
    pub top: f64,
    /// Rayleigh scattering at sea level.
    pub rayleigh_scattering: [f64; 3],
    /// Scale height of the air.
    pub rayleigh_height: f64,
    /// Mie scattering at sea level.
    pub mie_scattering: f64,
    /// Mie extinction at sea level.
    pub mie_extinction: f64,
    /// Scale height of the aerosol.
    pub mie_height: f64,
    /// Asymmetry of the aerosol's phase function.
    pub mie_g: f64,
}

impl Default for Atmosphere {
    /// The Earth of Leitner 2022, table 3.1, with a ground radius of 6360 km.
    fn default() -> Self {
        Self {
            ground_radius: 6_360_000.0,
            top: 100_000.0,
            rayleigh_scattering: [5.8e-6, 13.5e-6, 33.1e-6],
            rayleigh_height: 8000.0,
            mie_scattering: 2e-6,
            mie_extinction: 2.22e-6,
            mie_height: 1200.0,
            mie_g: 0.76,
        }
    }
}

impl From<Atmosphere> for crate::Atmosphere {
    /// The same air as layers, over black ground.
    fn from(air: Atmosphere) -> Self {
        use crate::atmosphere::{Layer, Phase, Profile};
        let layer = |name: &str, scale_height, scattering, absorption, phase| Layer {
            name: name.to_owned(),
            profile: Profile::Exponential { scale_height },
            scattering,
            absorption,
            phase,
        };
        let absorption = (air.mie_extinction - air.mie_scattering).max(0.0);
        Self {
            planet_radius: air.ground_radius,
            thickness: air.top,
            ground_albedo: [0.0; 3],
            sun: Default::default(),
            layers: vec![
                layer(
                    "molecules",
                    air.rayleigh_height,
                    air.rayleigh_scattering,
                    [0.0; 3],
                    Phase::Rayleigh,
                ),
                layer(
                    "haze",
                    air.mie_height,
                    [air.mie_scattering; 3],
                    [absorption; 3],
                    Phase::CornetteShanks { g: air.mie_g },
                ),
            ],
        }
    }
}

/// Light added and light left along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyLight {
    /// Radiance scattered into the ray [1/sr].
    pub in_scatter: [f64; 3],
    /// Transmittance of the ray.
    pub transmittance: [f64; 3],
}

/// Densities of air and aerosol, relative to sea level.
pub fn air_density(atmosphere: &Atmosphere, h: f64) -> [f64; 2] {
    let h = h.max(0.0);
    [
        (-h / atmosphere.rayleigh_height).exp(),
        (-h / atmosphere.mie_height).exp(),
    ]
}

/// Density integrals to the top of the shell (m) by the midpoint rule with `steps` points.
pub fn air_column(atmosphere: &Atmosphere, h: f64, mu: f64, steps: i32) -> [f64; 2] {
    let count = steps.max(1);
    let dt = top_distance(atmosphere.ground_radius, atmosphere.top, h, mu) / f64::from(count);
    let mut sum = [0.0; 2];
    for i in 0..count {
        let density = air_density(
            atmosphere,
            altitude_along(atmosphere.ground_radius, h, mu, (f64::from(i) + 0.5) * dt),
        );
        sum[0] += density[0] * dt;
        sum[1] += density[1] * dt;
    }
    sum
}

/// Transmittance of a pair of columns, per channel.
fn column_transmittance(atmosphere: &Atmosphere, column: [f64; 2]) -> [f64; 3] {
    atmosphere
        .rayleigh_scattering
        .map(|rayleigh| (-(rayleigh * column[0] + atmosphere.mie_extinction * column[1])).exp())
}

/// Share of sunlight that reaches an altitude, by the midpoint rule; 0 in the planet's shadow.
pub fn sun_transmittance(atmosphere: &Atmosphere, h: f64, mu: f64, steps: i32) -> [f64; 3] {
    if ground_distance(atmosphere.ground_radius, h, mu) >= 0.0 {
        return [0.0; 3];
    }
    column_transmittance(atmosphere, air_column(atmosphere, h, mu, steps))
}

/// Start and end of a view ray within the air.
fn view_span(atmosphere: &Atmosphere, eye_altitude: f64, mu: f64, distance: f64) -> (f64, f64) {
    let shell = sphere_span(atmosphere.ground_radius, atmosphere.top, eye_altitude, mu);
    let ground = ground_distance(atmosphere.ground_radius, eye_altitude, mu);
    let near = shell.near.max(0.0);
    let mut end = shell.far.min(distance);
    if ground >= 0.0 {
        end = end.min(ground);
    }
    (near, end.max(near))
}

/// Sky light by the midpoint rule with `steps` points on the ray and `light_steps` towards the sun.
pub fn march_sky(
    atmosphere: &Atmosphere,
    eye_altitude: f64,
    dir: [f64; 3],
    to_sun: [f64; 3],
    distance: f64,
    steps: i32,
    light_steps: i32,
) -> SkyLight {
    let radius = atmosphere.ground_radius;
    let nu = dot(dir, to_sun);
    let (near, end) = view_span(atmosphere, eye_altitude, dir[1], distance);
    let dt = (end - near) / f64::from(steps.max(1));
    let mut column = [0.0; 2];
    let mut rayleigh = [0.0; 3];
    let mut mie = [0.0; 3];
    for i in 0..steps.max(1) {
        let t = near + (f64::from(i) + 0.5) * dt;
        let h = altitude_along(radius, eye_altitude, dir[1], t).max(0.0);
        let density = air_density(atmosphere, h);
        let mu = direction_cosine_along(radius, eye_altitude, h, to_sun[1], nu, t);
        let sun = sun_transmittance(atmosphere, h, mu, light_steps);
        let view = column_transmittance(
            atmosphere,
            [
                column[0] + 0.5 * density[0] * dt,
                column[1] + 0.5 * density[1] * dt,
            ],
        );
        for k in 0..3 {
            rayleigh[k] += sun[k] * view[k] * density[0] * dt;
            mie[k] += sun[k] * view[k] * density[1] * dt;
        }
        column = [column[0] + density[0] * dt, column[1] + density[1] * dt];
    }
    SkyLight {
        in_scatter: radiance(atmosphere, nu, rayleigh, mie),
        transmittance: column_transmittance(atmosphere, column),
    }
}

/// Radiance of the two integrals.
fn radiance(atmosphere: &Atmosphere, nu: f64, rayleigh: [f64; 3], mie: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        rayleigh[k] * atmosphere.rayleigh_scattering[k] * phase_rayleigh(nu)
            + mie[k] * atmosphere.mie_scattering * phase_cornette_shanks(nu, atmosphere.mie_g)
    })
}

/// Density integrals over 0 to `distance` of a ray (m) by a composite Gauss-Legendre rule, split where the ray is lowest.
pub fn air_column_exact(atmosphere: &Atmosphere, h: f64, mu: f64, distance: f64) -> [f64; 2] {
    let rule = gauss_legendre(16);
    let lowest = (-(atmosphere.ground_radius + h) * mu).clamp(0.0, distance);
    let mut sum = [0.0; 2];
    for (from, to) in [(lowest, 0.0), (lowest, distance)] {
        // Panels that grow with the square of the distance from the lowest point, where the density changes fastest.
        let panels = 12;
        for i in 0..panels {
            let edge = |i: i32| from + (to - from) * (f64::from(i) / f64::from(panels)).powi(2);
            let (a, b) = (edge(i), edge(i + 1));
            for &(x, w) in &rule {
                let t = 0.5 * (a + b) + 0.5 * (b - a) * x;
                let density = air_density(
                    atmosphere,
                    altitude_along(atmosphere.ground_radius, h, mu, t),
                );
                sum[0] += 0.5 * w * (b - a).abs() * density[0];
                sum[1] += 0.5 * w * (b - a).abs() * density[1];
            }
        }
    }
    sum
}

/// Radiance of the sun's disc for an irradiance of 1, with a linear ramp of `pixel_angle` across the limb.
pub fn sun_disc(dir: [f64; 3], to_sun: [f64; 3], angular_radius: f64, pixel_angle: f64) -> f64 {
    let ramp = pixel_angle.max(1e-7);
    let cross = [
        dir[1] * to_sun[2] - dir[2] * to_sun[1],
        dir[2] * to_sun[0] - dir[0] * to_sun[2],
        dir[0] * to_sun[1] - dir[1] * to_sun[0],
    ];
    let coverage = |angle: f64| (0.5 + (angular_radius - angle) / ramp).clamp(0.0, 1.0);
    // Area of the ramped disc, by quadrature on both of its pieces.
    let (inner, outer) = (
        (angular_radius - 0.5 * ramp).max(0.0),
        angular_radius + 0.5 * ramp,
    );
    let mut area = PI * inner * inner;
    for (x, w) in gauss_legendre(4) {
        let angle = 0.5 * (inner + outer) + 0.5 * (outer - inner) * x;
        area += PI * w * (outer - inner) * angle * coverage(angle);
    }
    coverage(length(cross).atan2(dot(dir, to_sun))) / area
}

/// Area of a disc within the unit square about the origin, by quadrature over the square's height between the places where the disc's edge crosses its
/// sides.
pub fn disc_in_pixel(centre: [f64; 2], radius: f64) -> f64 {
    let edges = |k: usize| [-0.5, 0.5].map(|e: f64| ((e - centre[k]) / radius).clamp(-1.0, 1.0));
    let ([left, right], [low, high]) = (edges(0), edges(1));
    // In angles about the disc's centre chords are smooth up to their ends.
    let mut angles = vec![low.asin(), high.asin()];
    for x in [left, right] {
        let at = x.clamp(-1.0, 1.0).acos().sin().asin();
        angles.extend([-at, at]);
    }
    angles.sort_by(f64::total_cmp);
    let within = |a: &f64| (low.asin()..=high.asin()).contains(a);
    let angles: Vec<f64> = angles.into_iter().filter(within).collect();
    let mut area = 0.0;
    for ends in angles.windows(2) {
        let half = 0.5 * (ends[1] - ends[0]);
        for (x, w) in gauss_legendre(12) {
            let chord = (0.5 * (ends[0] + ends[1]) + half * x).cos();
            let width = right.clamp(-chord, chord) - left.clamp(-chord, chord);
            area += half * w * width * chord;
        }
    }
    area * radius * radius
}
