//! Mappings, payloads and sums of the tables of air and sky, from what they stand for. Lengths in metres, angles in radians.

use super::air_ray;
use super::math::{dot, mix, one_minus_exp_over_x, scale};
use super::medium::{air_phases, air_scattering, peak_phase};
use super::monte_carlo::Measured;
use super::parallel::parallel_map;
use super::planet::top_distance;
use super::quadrature::squared_node;
use super::sky::{Sky, SkyRay};
use super::sky_paths::{Paths, trace_sky};
use crate::atmosphere::{Atmosphere, Lane, MOST_LANES, Profile};
use std::f64::consts::PI;

/// Zenith cosine of the horizon.
pub fn horizon_cosine(ground_radius: f64, h: f64) -> f64 {
    let h = h.max(0.0);
    -(h * (2.0 * ground_radius + h)).sqrt() / (ground_radius + h)
}

/// Where level paths are in the table of columns.
const LEVEL: f64 = 1.0 / 3.0;
/// Zenith cosine up to which rising paths are dense.
const RISE_BEND: f64 = 0.1;

/// Coordinates in the table of columns.
pub fn column_coordinates(ground_radius: f64, top: f64, h: f64, mu: f64) -> [f64; 2] {
    let x = if mu < 0.0 {
        let horizon = horizon_cosine(ground_radius, h).min(-1e-20);
        LEVEL * (1.0 - (mu / horizon).clamp(0.0, 1.0).sqrt())
    } else {
        let up = mu.min(1.0);
        LEVEL + (1.0 - LEVEL) * (1.0 + RISE_BEND) * up / (up + RISE_BEND)
    };
    [x, (h / top).clamp(0.0, 1.0).sqrt()]
}

/// Altitude and zenith cosine of coordinates in the table of columns.
pub fn column_place(ground_radius: f64, top: f64, place: [f64; 2]) -> [f64; 2] {
    let h = top * place[1] * place[1];
    let mu = if place[0] < LEVEL {
        horizon_cosine(ground_radius, h) * (1.0 - place[0] / LEVEL).powi(2)
    } else {
        let above = (place[0] - LEVEL) / (1.0 - LEVEL);
        above * RISE_BEND / (1.0 + RISE_BEND - above)
    };
    [h, mu]
}

/// A path to the top of the air, outwards from its lowest point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopPath {
    /// Altitude of the lowest point.
    pub lowest: f64,
    /// Distance of the lowest point from that of the whole line.
    pub along: f64,
    /// Length from the lowest point to the top.
    pub rises: f64,
    /// Length from the start to the lowest point.
    pub falls: f64,
}

/// The path from an altitude along a zenith cosine to the top of the air; what would lie below the ground runs along it.
pub fn path_to_top(ground_radius: f64, top: f64, h: f64, mu: f64) -> TopPath {
    let down = mu.min(0.0);
    let sine = ((1.0 - down) * (1.0 + down)).max(0.0).sqrt();
    // A sum, since even here a path of metres at the top of the air is lost in a difference of altitudes.
    let below = ((ground_radius + h) * down * down / (1.0 + sine)).min(h);
    let lowest = h - below;
    let along = (ground_radius + lowest) * mu.max(0.0);
    let square = (top - h + below).max(0.0) * (2.0 * ground_radius + top + lowest);
    TopPath {
        lowest,
        along,
        rises: square / (along + (along * along + square).sqrt()).max(1e-300),
        falls: -(ground_radius + h) * down,
    }
}

/// Densities of exponential lanes at the lowest point of a path that does not go below the ground; 1 for the others.
pub fn column_scale(air: &Atmosphere, h: f64, mu: f64) -> [f64; MOST_LANES] {
    let lowest = if mu < 0.0 {
        let sine = ((1.0 - mu) * (1.0 + mu)).max(0.0).sqrt();
        ((air.planet_radius + h) * sine - air.planet_radius).max(0.0)
    } else {
        h
    };
    let mut scales = [1.0; MOST_LANES];
    for (scale, Lane { profile, .. }) in scales.iter_mut().zip(air.lanes()) {
        if let Profile::Exponential { scale_height } = profile {
            *scale = (-lowest / scale_height).exp();
        }
    }
    scales
}

/// Columns of all lanes to the top of the air; of a direction below the horizon those along the horizon. Nothing for an
/// atmosphere that is not valid.
pub fn columns_to_top(air: &Atmosphere, h: f64, mu: f64) -> [f64; MOST_LANES] {
    let mut columns = [0.0; MOST_LANES];
    let Ok(sky) = Sky::new(air) else {
        return columns;
    };
    let mu = mu.max(horizon_cosine(air.planet_radius, h));
    let end = top_distance(air.planet_radius, air.thickness, h, mu);
    let found = sky.columns(h, mu, end);
    for (column, lane) in columns.iter_mut().zip(air.lanes()) {
        let at = sky.profiles.iter().position(|p| *p == lane.profile);
        *column = at.map_or(0.0, |k| found[k]);
    }
    columns
}

/// What the table of columns holds: one over the root of the mean density along a path over the density at its lowest point; 1 for
/// lanes that are not exponential.
pub fn column_code(air: &Atmosphere, h: f64, mu: f64) -> [f64; MOST_LANES] {
    let seen = mu.max(horizon_cosine(air.planet_radius, h));
    let path = path_to_top(air.planet_radius, air.thickness, h, seen);
    let columns = columns_to_top(air, h, seen);
    let scales = column_scale(air, h, seen);
    let long = path.rises + path.falls;
    let lanes = air.lanes();
    std::array::from_fn(|k| match lanes.get(k).map(|lane| lane.profile) {
        Some(Profile::Exponential { .. }) if long > 1e-3 => {
            (scales[k] * long / columns[k]).max(1.0).sqrt()
        }
        _ => 1.0,
    })
}

/// Optical depth to the sun; that along the horizon of a sun below it. Nothing for an atmosphere that is not valid.
pub fn sun_depth(air: &Atmosphere, h: f64, mu: f64) -> [f64; 3] {
    super::medium::air_extinction(air, columns_to_top(air, h, mu))
}

/// Coordinates in the table of transmittance; below the horizon those of the horizon.
pub fn transmittance_coordinates(ground_radius: f64, top: f64, h: f64, mu: f64) -> [f64; 2] {
    let horizon = horizon_cosine(ground_radius, h);
    [(mu - horizon) / (1.0 - horizon), h / top].map(|share| share.clamp(0.0, 1.0).sqrt())
}

/// Altitude and zenith cosine of coordinates in the table of transmittance.
pub fn transmittance_place(ground_radius: f64, top: f64, place: [f64; 2]) -> [f64; 2] {
    let h = top * place[1] * place[1];
    let horizon = horizon_cosine(ground_radius, h);
    [h, horizon + (1.0 - horizon) * place[0] * place[0]]
}

/// The texel of the table of transmittance.
pub fn transmittance_code(air: &Atmosphere, h: f64, mu: f64) -> [f64; 3] {
    sun_depth(air, h, mu).map(|depth| (-0.5 * depth).exp())
}

/// Place of coordinates in a texture whose outermost texels' centres are 0 and 1.
pub fn texture_place(coordinates: [f64; 2], size: [f64; 2]) -> [f64; 2] {
    std::array::from_fn(|k| (coordinates[k] * (size[k] - 1.0) + 0.5) / size[k])
}

/// Coordinates of the centre of a texel.
pub fn texel_coordinates(texel: [f64; 2], size: [f64; 2]) -> [f64; 2] {
    std::array::from_fn(|k| texel[k] / (size[k] - 1.0))
}

/// Share of the sun's disc above the horizon: the area of a segment.
pub fn sun_above_horizon(ground_radius: f64, h: f64, mu: f64, angular_radius: f64) -> f64 {
    let above = horizon_cosine(ground_radius, h).acos() - mu.clamp(-1.0, 1.0).acos();
    if above.abs() >= angular_radius {
        return f64::from(u8::from(above > 0.0));
    }
    let depth = -above / angular_radius;
    (depth.acos() - depth * (1.0 - depth * depth).max(0.0).sqrt()) / PI
}

/// Moments of radiance over the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Integral of the radiance.
    pub whole: [f64; 3],
    /// Weighted with mu, over the integral.
    pub up: [f64; 3],
    /// Weighted with (3 mu^2 - 1) / 2, over the integral.
    pub level: [f64; 3],
    /// Weighted with s cos(phi) / sun_s, mu s cos(phi) / sun_s and s^2 cos(2 phi) / sun_s^2, over the integral; of the
    /// channels' mean.
    pub aside: [f64; 3],
}

const SUN_BEND: f64 = 0.06;
const LOWEST_SUN: f64 = -0.4;

fn bend_sun(mu: f64) -> f64 {
    (mu.abs() / SUN_BEND).ln_1p().copysign(mu)
}

/// Coordinates in the table of diffuse light.
pub fn diffuse_coordinates(top: f64, h: f64, sun_mu: f64) -> [f64; 2] {
    let low = bend_sun(LOWEST_SUN);
    let x = (bend_sun(sun_mu) - low) / (bend_sun(1.0) - low);
    [x.clamp(0.0, 1.0), (h / top).clamp(0.0, 1.0).sqrt()]
}

/// Altitude and zenith cosine of the sun of coordinates in the table of diffuse light.
pub fn diffuse_place(top: f64, place: [f64; 2]) -> [f64; 2] {
    let low = bend_sun(LOWEST_SUN);
    let bent = low + (bend_sun(1.0) - low) * place[0];
    let mu = (SUN_BEND * bent.abs().exp_m1()).copysign(bent);
    [top * place[1] * place[1], mu.clamp(-1.0, 1.0)]
}

/// The first texel layer of moments.
pub fn encode_moments(moments: Moments) -> [f64; 4] {
    let [r, g, b] = moments.whole;
    let mean = ((r + g + b) / 3.0).max(1e-30);
    [mean.log2(), r / mean, g / mean, moments.aside[0]]
}

/// Moments of three texel layers.
pub fn decode_moments(first: [f64; 4], second: [f64; 4], third: [f64; 4]) -> Moments {
    let chroma = [first[1], first[2], 3.0 - first[1] - first[2]];
    Moments {
        whole: chroma.map(|c| c.max(0.0) * first[0].exp2()),
        up: [second[0], second[1], second[2]],
        level: [third[0], third[1], third[2]],
        aside: [first[3], second[3], third[3]],
    }
}

/// The field's radiance over its mean, up to degree two and but for the factors of degree, in a direction of zenith cosine
/// `mu`; `x` is what the direction shares with the sun across the vertical.
fn degrees(moments: &Moments, mu: f64, x: f64, sun_mu: f64, c: usize) -> [f64; 2] {
    let squares = (1.0 - mu * mu) * (1.0 - sun_mu * sun_mu);
    let [first, second, third] = moments.aside;
    [
        mu * moments.up[c] + x * first,
        0.5 * (3.0 * mu * mu - 1.0) * moments.level[c]
            + 3.0 * mu * x * second
            + 0.75 * (2.0 * x * x - squares) * third,
    ]
}

/// Light scattered out of a field of light.
pub fn diffuse_source(
    air: &Atmosphere,
    densities: [f64; MOST_LANES],
    moments: Moments,
    mu: f64,
    sun_mu: f64,
    nu: f64,
) -> [f64; 3] {
    let weights = |of: fn(&crate::atmosphere::Lobe) -> f64| {
        let mut weights = [1.0; MOST_LANES];
        for (weight, lane) in weights.iter_mut().zip(air.lanes()) {
            *weight = lane.lobe.map_or(0.0, |lobe| of(&lobe));
        }
        air_scattering(air, densities, weights)
    };
    let parts = [
        weights(|_| 1.0),
        weights(|l| l.first),
        weights(|l| l.second),
    ];
    std::array::from_fn(|c| {
        let [first, second] = degrees(&moments, mu, nu - mu * sun_mu, sun_mu, c);
        let sum = parts[0][c] + 3.0 * parts[1][c] * first + 5.0 * parts[2][c] * second;
        sum.max(0.0) * moments.whole[c] / (4.0 * PI)
    })
}

/// Irradiance on a level plane.
pub fn level_irradiance(moments: Moments) -> [f64; 3] {
    std::array::from_fn(|c| {
        let shape = 0.25 + 0.5 * moments.up[c] + 5.0 / 16.0 * moments.level[c];
        moments.whole[c] * shape.max(0.0)
    })
}

/// Irradiance on a plane.
pub fn plane_irradiance(moments: Moments, normal: [f64; 3], to_sun: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| {
        let x = dot(normal, to_sun) - normal[1] * to_sun[1];
        let [first, second] = degrees(&moments, normal[1], x, to_sun[1], c);
        moments.whole[c] * (0.25 + 0.5 * first + 5.0 / 16.0 * second).max(0.0)
    })
}

/// Sum of two fields of light.
pub fn add_moments(a: Moments, b: Moments) -> Moments {
    let sum = |v: [f64; 3]| v[0] + v[1] + v[2];
    let weighted = |x: [f64; 3], y: [f64; 3]| {
        std::array::from_fn(|c| {
            let whole = (a.whole[c] + b.whole[c]).max(1e-30);
            x[c] + (y[c] - x[c]) * (b.whole[c] / whole)
        })
    };
    let mean = sum(b.whole) / (sum(a.whole) + sum(b.whole)).max(1e-30);
    Moments {
        whole: std::array::from_fn(|c| a.whole[c] + b.whole[c]),
        up: weighted(a.up, b.up),
        level: weighted(a.level, b.level),
        aside: mix(a.aside, b.aside, mean),
    }
}

/// The light of an order and of all that follow, when they fall as it has fallen against the one before.
pub fn further_orders(before: Moments, last: Moments) -> Moments {
    Moments {
        whole: std::array::from_fn(|c| {
            let ratio = last.whole[c] / before.whole[c].max(1e-30);
            last.whole[c] / (1.0 - ratio.clamp(0.0, 0.95))
        }),
        ..last
    }
}

/// Light of all orders by paths from evenly drawn directions; the sun stands over +x.
fn light_around(
    sky: &Sky,
    h: f64,
    sun_mu: f64,
    directions: usize,
    seed: u64,
) -> Vec<([f64; 3], Measured)> {
    let paths = Paths {
        samples: 2,
        seed,
        ..Default::default()
    };
    parallel_map(directions, |i| {
        // Points of a sequence that fills the square.
        let [u, v] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3]
            .map(|step: f64| (0.5 + step * (i + 1) as f64).fract());
        let (mu, phi) = (1.0 - 2.0 * u, 2.0 * PI * v);
        let sine = (1.0 - mu * mu).sqrt();
        let ray = SkyRay {
            eye_altitude: h,
            dir: [sine * phi.cos(), mu, sine * phi.sin()],
            to_sun: [(1.0 - sun_mu * sun_mu).max(0.0).sqrt(), sun_mu, 0.0],
            distance: f64::INFINITY,
        };
        (ray.dir, trace_sky(sky, &ray, &paths, i as u64))
    })
}

/// Moments of the light of all orders around a place, and the standard error of its integral, by paths in so many directions
/// drawn evenly.
pub fn diffuse_moments(
    sky: &Sky,
    h: f64,
    sun_mu: f64,
    directions: usize,
    seed: u64,
) -> (Moments, [f64; 3]) {
    let sun_sine = (1.0 - sun_mu * sun_mu).max(1e-3).sqrt();
    let rays = light_around(sky, h, sun_mu, directions, seed);
    let mut moments = Moments {
        whole: [0.0; 3],
        up: [0.0; 3],
        level: [0.0; 3],
        aside: [0.0; 3],
    };
    let mut squares = [0.0; 3];
    let part = 4.0 * PI / directions as f64;
    for ([x, mu, z], light) in rays {
        let across = (x * x - z * z) / (sun_sine * sun_sine);
        let x = x / sun_sine;
        for (c, mean) in light.mean.iter().enumerate() {
            let weighted = part * mean;
            squares[c] += weighted * weighted;
            moments.whole[c] += weighted;
            moments.up[c] += weighted * mu;
            moments.level[c] += weighted * 0.5 * (3.0 * mu * mu - 1.0);
            for (sum, weight) in moments.aside.iter_mut().zip([x, mu * x, across]) {
                *sum += weighted * weight;
            }
        }
    }
    let all: f64 = moments.whole.iter().sum();
    let error = std::array::from_fn(|c| {
        let mean = moments.whole[c];
        moments.up[c] /= mean;
        moments.level[c] /= mean;
        (squares[c] - mean * mean / directions as f64)
            .max(0.0)
            .sqrt()
    });
    moments.aside = moments.aside.map(|sum| sum / all);
    (moments, error)
}

/// Light of all orders, that of the ground included, on planes at a place, each with its standard error: by paths in so many directions
/// drawn evenly. The sun stands over +x; its own light is not counted.
pub fn plane_irradiance_by_paths(
    sky: &Sky,
    h: f64,
    sun_mu: f64,
    normals: &[[f64; 3]],
    directions: usize,
    seed: u64,
) -> Vec<([f64; 3], [f64; 3])> {
    let rays = light_around(sky, h, sun_mu, directions, seed);
    let part = 4.0 * PI / directions as f64;
    normals
        .iter()
        .map(|normal| {
            let (mut sum, mut variance) = ([0.0; 3], [0.0; 3]);
            for (dir, light) in &rays {
                let weight = part * dot(*normal, *dir).max(0.0);
                for c in 0..3 {
                    sum[c] += weight * light.mean[c];
                    variance[c] += (weight * light.standard_error[c]).powi(2);
                }
            }
            (sum, variance.map(f64::sqrt))
        })
        .collect()
}

/// A node of the quadrature over directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereNode {
    /// Zenith cosine.
    pub mu: f64,
    /// Cosine of the azimuth from the sun.
    pub cos_phi: f64,
    /// Solid angle.
    pub solid: f64,
}

/// Node number `i` of 384 around a place: 16 azimuths of 16 heights above and 8 below the horizon.
pub fn sphere_node(ground_radius: f64, h: f64, i: i32) -> SphereNode {
    let horizon = horizon_cosine(ground_radius, h);
    let (row, spoke) = (i / 16, i % 16);
    let (to, [t, weight]) = if row < 16 {
        (1.0, squared_node(16, row))
    } else {
        (-1.0, squared_node(8, row - 16))
    };
    SphereNode {
        mu: horizon + (to - horizon) * t,
        cos_phi: (PI * (f64::from(spoke) + 0.5) / 16.0).cos(),
        solid: (to - horizon).abs() * weight * PI / 16.0,
    }
}

/// The phase functions of a ray, split into those of smooth and peaked layers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplitPhases {
    /// 0 for peaked lanes.
    pub smooth_lanes: [f64; MOST_LANES],
    /// Over the peaked phase function, 0 for smooth lanes.
    pub peaked_lanes: [f64; MOST_LANES],
}

/// Splits the phase functions.
pub fn split_phases(air: &Atmosphere, nu: f64) -> SplitPhases {
    let peak = peak_phase(air, nu).max(1e-9);
    let mut split = SplitPhases {
        smooth_lanes: air_phases(air, nu),
        peaked_lanes: [0.0; MOST_LANES],
    };
    for (k, lane) in air.lanes().iter().enumerate() {
        if lane.peaked() {
            split.peaked_lanes[k] = split.smooth_lanes[k] / peak;
            split.smooth_lanes[k] = 0.0;
        }
    }
    split
}

/// Mean transmittance within steps of an optical depth, of which a share is `left`; that share alone counts for thick steps.
pub fn step_share(depth: [f64; 3], left: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| {
        if depth[c] < f64::from(0.1_f32) {
            one_minus_exp_over_x(depth[c])
        } else {
            (1.0 - left[c]) / depth[c]
        }
    })
}

/// Light scattered into a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattered {
    /// Radiance but for peaked light.
    pub smooth_light: [f64; 3],
    /// Radiance of peaked light over the peaked phase function.
    pub peaked_light: [f64; 3],
    /// What is left of the light behind.
    pub transmittance: [f64; 3],
}

/// Radiance of scattered light.
pub fn scattered_radiance(air: &Atmosphere, scattered: Scattered, nu: f64) -> [f64; 3] {
    let peaked = scale(scattered.peaked_light, peak_phase(air, nu));
    super::math::add(scattered.smooth_light, peaked)
}

/// What the tables of one eye belong to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyEye {
    /// Unit vector to the sun, y up at the eye.
    pub to_sun: [f64; 3],
    /// Altitude of the eye.
    pub altitude: f64,
    /// Tangent of half the zenith angle of the horizon.
    pub horizon: f64,
    /// Radius of the ground sphere.
    pub ground_radius: f64,
    /// Thickness of the air.
    pub top: f64,
    /// What radiance in the tables is multiplied with.
    pub scale: f64,
    /// Angular radius of the sun.
    pub sun_angular_radius: f64,
    /// 1 when the table of the sky shows the ground, else 0.
    pub shows_ground: u32,
}

/// A direction's place in the tables of an eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyPlace {
    /// Azimuth from the sun: (1 - cos phi) / 2.
    pub x: f64,
    /// Height above, or depth below, the horizon.
    pub y: f64,
    /// Whether the direction is below the horizon.
    pub below: bool,
    /// Cosine of the angle to the sun.
    pub nu: f64,
    /// Length of the ray in the air over the air's thickness; 1 where the table shows the ground.
    pub reach: f64,
}

/// Cosine of the azimuth from the sun; 0 for a vertical direction.
fn azimuth_cosine(eye: &SkyEye, dir: [f64; 3]) -> f64 {
    let [sx, _, sz] = eye.to_sun;
    let across = dir[0].hypot(dir[2]).max(1e-10) * sx.hypot(sz).max(1e-10);
    ((dir[0] * sx + dir[2] * sz) / across).clamp(-1.0, 1.0)
}

fn reach(eye: &SkyEye, dir: [f64; 3], below: bool) -> f64 {
    if below && eye.shows_ground != 0 {
        return 1.0;
    }
    let (radius, top) = (eye.ground_radius, eye.top);
    let infinity = f64::INFINITY;
    air_ray::air_ray(radius, top, eye.altitude, dir, eye.to_sun, infinity).length / top
}

const LIMB_BEND: f64 = 0.015;

fn bend_limb(share: f64, bend: f64) -> f64 {
    (share / bend).ln_1p() / bend.recip().ln_1p()
}

fn unbend_limb(y: f64, bend: f64) -> f64 {
    bend * (y * bend.recip().ln_1p()).exp_m1()
}

fn inner_bend(eye: &SkyEye) -> f64 {
    let horizon = (eye.altitude * (2.0 * eye.ground_radius + eye.altitude)).max(1.0);
    LIMB_BEND * eye.top / horizon.sqrt()
}

/// Place of a direction in the tables of an eye within the air.
pub fn sky_place_inside(eye: SkyEye, dir: [f64; 3]) -> SkyPlace {
    // The tangent of half the zenith angle, over that of the horizon.
    let half = 0.5 * dir[0].hypot(dir[2]).max(1e-10).atan2(dir[1]);
    let ratio = half.tan() / eye.horizon;
    let share = (1.0 - ratio.min(1.0 / ratio)).max(0.0);
    SkyPlace {
        x: 0.5 * (1.0 - azimuth_cosine(&eye, dir)),
        y: if sky_coded(eye) != 0.0 && ratio <= 1.0 {
            bend_limb(share, inner_bend(&eye))
        } else {
            share.sqrt()
        },
        below: ratio > 1.0,
        nu: dot(dir, eye.to_sun),
        reach: if eye.shows_ground != 0 {
            1.0
        } else {
            reach(&eye, dir, ratio > 1.0)
        },
    }
}

/// What a picture needs of an eye within the air and its table of the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyLook {
    /// Unit vector to the sun, y up at the eye.
    pub to_sun: [f64; 3],
    /// Tangent of half the zenith angle of the horizon.
    pub horizon: f64,
    /// Azimuth of the sun times what the table's x falls by towards it.
    pub ahead: [f64; 2],
    /// Row at the horizon, above it.
    pub above: f64,
    /// From there to the zenith.
    pub above_rise: f64,
    /// Row at the horizon, below it.
    pub below: f64,
    /// From there to the nadir.
    pub below_rise: f64,
    /// What the table's values are multiplied with.
    pub gain: f64,
    /// 1 + g^2 of the peaked phase function.
    pub peak_base: f64,
    /// Its 2 g.
    pub peak_slope: f64,
    /// Its level.
    pub peak_level: f64,
    /// Its coefficient of nu^2.
    pub peak_square: f64,
}

/// Where a direction is in the table of an eye within the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyTexel {
    /// Column and row.
    pub at: [f64; 2],
    /// Cosine of the angle to the sun.
    pub nu: f64,
}

/// Where a direction, a vector of any length, is in the table of an eye within the air.
pub fn sky_texel(look: SkyLook, ray: [f64; 3]) -> SkyTexel {
    let flat = ray[0].hypot(ray[2]).max(1e-15);
    let ratio = (0.5 * flat.atan2(ray[1])).tan() / look.horizon;
    let height = (1.0 - ratio.min(1.0 / ratio)).max(0.0).sqrt();
    SkyTexel {
        at: [
            0.5 - (ray[0] * look.ahead[0] + ray[2] * look.ahead[1]) / flat,
            if ratio > 1.0 {
                look.below + look.below_rise * height
            } else {
                look.above + look.above_rise * height
            },
        ],
        nu: dot(ray, look.to_sun) / flat.hypot(ray[1]),
    }
}

const TERMINATOR_BEND: f64 = 0.1;
const TERMINATOR: f64 = -0.1;
const DARKEST_SUN: f64 = -0.45;
const LEAST_SUNS: f64 = 1e-3;
const DUSK: f64 = 1.0 / 16_777_216.0;

fn bend_terminator(mu: f64) -> f64 {
    let beyond = mu - TERMINATOR;
    (beyond.abs() / TERMINATOR_BEND).ln_1p().copysign(beyond)
}

/// How the zenith cosine of the sun, where a ray meets the ground or runs lowest, follows from the cosine of its azimuth: factor
/// and offset.
fn seen_suns(eye: &SkyEye, zenith: f64, lowest: f64) -> [f64; 2] {
    let r = eye.ground_radius + eye.altitude;
    let (sine, cosine) = zenith.sin_cos();
    let t = -r * cosine
        - (-lowest * (2.0 * eye.ground_radius + lowest))
            .max(0.0)
            .sqrt();
    let angle = (t * sine).atan2(r + t * cosine);
    let flat = eye.to_sun[0].hypot(eye.to_sun[2]);
    [flat * angle.sin(), eye.to_sun[1] * angle.cos()]
}

/// The bent zenith cosines at both ends of a row.
fn sun_ends([factor, offset]: [f64; 2]) -> [f64; 2] {
    let first = offset + factor;
    let mut last = offset - factor;
    if first > DARKEST_SUN + 0.1 {
        last = last.max(DARKEST_SUN);
    }
    [bend_terminator(first), bend_terminator(last)]
}

/// Place of a direction in the tables of an eye above the air.
pub fn sky_place_outside(eye: SkyEye, dir: [f64; 3]) -> SkyPlace {
    let lowest = air_ray::tangent_altitude(eye.ground_radius, eye.altitude, dir);
    let below = lowest < 0.0 && dir[1] < 0.0;
    let [cosine, sine] = air_ray::zenith_parts(dir);
    let zenith = sine.atan2(cosine);
    let y = if below {
        (1.0 - (0.5 * (PI - zenith)).tan() * eye.horizon)
            .max(0.0)
            .sqrt()
    } else if dir[1] < 0.0 && lowest <= eye.top {
        bend_limb(lowest / eye.top, LIMB_BEND)
    } else {
        2.0
    };
    let suns = seen_suns(&eye, zenith, lowest);
    let ends = sun_ends(suns);
    let cosine = azimuth_cosine(&eye, dir);
    let x = if suns[0] > LEAST_SUNS {
        (ends[0] - bend_terminator(suns[1] + suns[0] * cosine)) / (ends[0] - ends[1])
    } else {
        0.5 * (1.0 - cosine)
    };
    SkyPlace {
        x: x.clamp(0.0, 1.0),
        y: y.clamp(0.0, 2.0),
        below,
        nu: dot(dir, eye.to_sun),
        reach: if y > 1.0 {
            0.0
        } else {
            reach(&eye, dir, below)
        },
    }
}

/// Place of a direction in the tables of an eye.
pub fn sky_place(eye: SkyEye, dir: [f64; 3]) -> SkyPlace {
    if eye.altitude > eye.top {
        sky_place_outside(eye, dir)
    } else {
        sky_place_inside(eye, dir)
    }
}

/// Direction of coordinates in the tables of an eye.
pub fn sky_direction(eye: SkyEye, place: [f64; 2], below: bool) -> [f64; 3] {
    let y = place[1].max(f64::from(4e-3_f32));
    let ratio = 1.0 - y * y;
    let r = eye.ground_radius + eye.altitude;
    let above = eye.altitude > eye.top;
    let zenith = if above && !below {
        let lowest = eye.top * unbend_limb(y, LIMB_BEND).min(0.9999);
        PI - ((eye.ground_radius + lowest) / r).min(1.0).asin()
    } else if below {
        PI - 2.0 * (ratio / eye.horizon).atan()
    } else if sky_coded(eye) != 0.0 {
        2.0 * ((1.0 - unbend_limb(y, inner_bend(&eye))) * eye.horizon).atan()
    } else {
        2.0 * (ratio * eye.horizon).atan()
    };
    let mut cosine = (1.0 - 2.0 * place[0]).clamp(-1.0, 1.0);
    if above {
        // The horizon's own nadir angle stands for the radius of the ground.
        let lowest = if below {
            let horizon = 2.0 * (1.0 / eye.horizon).atan();
            eye.ground_radius * (zenith.sin() / horizon.sin() - 1.0)
        } else {
            eye.top * unbend_limb(y, LIMB_BEND).min(0.9999)
        };
        let suns = seen_suns(&eye, zenith, lowest);
        let ends = sun_ends(suns);
        let bent = ends[0] + (ends[1] - ends[0]) * place[0];
        let sun = TERMINATOR + (TERMINATOR_BEND * bent.abs().exp_m1()).copysign(bent);
        if suns[0] > LEAST_SUNS {
            cosine = ((sun - suns[1]) / suns[0]).clamp(-1.0, 1.0);
        }
    }
    let around = eye.to_sun[2].hypot(eye.to_sun[0]);
    let ahead = if around > 1e-10 {
        eye.to_sun[2].atan2(eye.to_sun[0])
    } else {
        -0.5 * PI
    };
    let azimuth = ahead + cosine.acos();
    [
        zenith.sin() * azimuth.cos(),
        zenith.cos(),
        zenith.sin() * azimuth.sin(),
    ]
}

/// Whether the table of the sky holds codes.
pub fn sky_coded(eye: SkyEye) -> f64 {
    f64::from(u8::from(eye.altitude > f64::from(0.1_f32) * eye.top))
}

/// The code of light in the table of the sky of an eye above the air.
pub fn encode_dusk(light: [f64; 3]) -> [f64; 3] {
    light.map(|l| (l.max(0.0) + DUSK).log2())
}

/// The light of a code.
pub fn decode_dusk(code: [f64; 3]) -> [f64; 3] {
    code.map(|c| (c.exp2() - 1.001 * DUSK).max(0.0))
}

/// Rows of the table of the sky above the horizon.
pub fn sky_rows(eye: SkyEye, rows: f64) -> f64 {
    if sky_coded(eye) != 0.0 {
        (0.5 * rows).floor()
    } else {
        (0.75 * rows).floor()
    }
}

/// Row of the table of the sky.
pub fn sky_row(eye: SkyEye, y: f64, below: bool, rows: f64) -> f64 {
    let above = sky_rows(eye, rows);
    let (first, count) = if below {
        (above, rows - above)
    } else {
        (0.0, above)
    };
    (first + y.min(1.0) * (count - 1.0) + 0.5) / rows
}

/// Row of the tables of the air before things.
pub fn aerial_row(y: f64, below: bool, rows: f64) -> f64 {
    let half = 0.5 * rows;
    let first = if below { half } else { 0.0 };
    (first + y.min(1.0) * (half - 1.0) + 0.5) / rows
}

/// Where on a ray slices are dense.
pub fn aerial_spacing(eye: SkyEye, below: bool) -> i32 {
    match (eye.altitude > 0.15 * eye.top, below) {
        (false, _) => 0,
        (true, true) => 1,
        (true, false) => 2,
    }
}

/// Distance of a slice.
pub fn aerial_distance(spacing: i32, slice: f64, length: f64) -> f64 {
    let aside = 2.0 * slice - 1.0;
    length
        * match spacing {
            1 => slice * (2.0 - slice),
            2 => 0.5 + 0.5 * aside * aside.abs(),
            _ => slice * slice,
        }
}

/// Slice of a distance.
pub fn aerial_slice(spacing: i32, t: f64, length: f64) -> f64 {
    let share = (t / length).clamp(0.0, 1.0);
    let aside = 2.0 * share - 1.0;
    match spacing {
        1 => 1.0 - (1.0 - share).sqrt(),
        2 => 0.5 + 0.5 * aside.abs().sqrt().copysign(aside),
        _ => share.sqrt(),
    }
}
