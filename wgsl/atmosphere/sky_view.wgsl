//! The table of the sky as seen from one eye: directions that leave the air, by height above the horizon and by azimuth from the sun.
//! source   Hillaire2020 (a table per eye); half-angle tangents, exact horizon, cosine of the azimuth: ours
//! symbols  mu zenith cosine · x, y coordinates in [0, 1]: azimuth from the sun, and height above the horizon
//!
//! The first rows hold directions above the horizon, the others those below: of an eye within the air the last quarter, of an eye above it the last two thirds.
//!
//! A texel holds radiance for a sun of irradiance 1, times the scale of the eye: layer 0 but for peaked light [1/sr], layer 1 peaked light over the peaked
//! phase function [1].
#define_import_path veduta::atmosphere::sky_view

#import veduta::atmosphere::ray::{tangent_altitude}
#import veduta::atmosphere::medium::{Air, peak_phase}

/// What the tables of one eye belong to.
struct SkyEye {
    /// Unit vector to the sun, y up at the eye.
    to_sun: vec3<f32>,
    /// Altitude of the eye [m].
    altitude: f32,
    /// Tangent of half the zenith angle of the horizon.
    horizon: f32,
    /// Radius of the ground sphere [m].
    ground_radius: f32,
    /// Thickness of the air [m].
    top: f32,
    /// What radiance in the tables is multiplied with.
    scale: f32,
    /// Angular radius of the sun [rad].
    sun_angular_radius: f32,
}

/// A direction's place in the tables of an eye.
struct SkyPlace {
    /// Azimuth from the sun: (1 - cos phi) / 2.
    x: f32,
    /// Height above, or depth below, the horizon: 0 at the horizon, 1 at zenith, nadir or the top of the air; above 1 for a direction that misses the air.
    y: f32,
    /// Whether the direction is below the horizon.
    below: bool,
    /// Cosine of the angle to the sun.
    nu: f32,
}

/// Azimuth coordinate of a direction with the horizontal part `aside`.
///
/// internal
fn azimuth_place(eye: SkyEye, aside: vec2<f32>) -> f32 {
    let both = dot(aside, aside) * dot(eye.to_sun.xz, eye.to_sun.xz);
    return 0.5 - 0.5 * clamp(dot(aside, eye.to_sun.xz) * inverseSqrt(max(both, 1e-20)), -1.0, 1.0);
}

/// Place of a unit vector `dir` in the tables of an eye within the air.
///
/// domain  eye.to_sun in [-1, 1] 1 lin
/// domain  eye.altitude in [0, 1e8] m lin
/// domain  dir in [-1, 1] 1 lin
/// range   [-1, 1] 1
/// error   1e-3 abs of reference::air_tables::sky_place_inside
/// outside undefined
/// source  ours
fn sky_place_inside(eye: SkyEye, dir: vec3<f32>) -> SkyPlace {
    // Tangent of half the zenith angle over that of the horizon, or the same from the nadir.
    let aside = dot(dir.xz, dir.xz);
    let over = inverseSqrt(max(aside, 1e-20));
    let ratio = max(aside, 1e-20) * over / max((1.0 + dir.y) * eye.horizon, 1e-20);
    let flat = inverseSqrt(max(dot(eye.to_sun.xz, eye.to_sun.xz), 1e-20));
    let azimuth = clamp(dot(dir.xz, eye.to_sun.xz) * (over * flat), -1.0, 1.0);
    let y = sqrt(max(1.0 - min(ratio, 1.0 / ratio), 0.0));
    return SkyPlace(0.5 - 0.5 * azimuth, y, ratio > 1.0, dot(dir, eye.to_sun));
}

/// Place of a unit vector `dir` in the tables of an eye above the air.
///
/// domain  eye.to_sun in [-1, 1] 1 lin
/// domain  eye.altitude in [1e5, 1e8] m log
/// domain  dir in [-1, 1] 1 lin
/// range   [-1, 2] 1
/// error   1e-3 abs of reference::air_tables::sky_place_outside
/// outside undefined
/// source  ours
fn sky_place_outside(eye: SkyEye, dir: vec3<f32>) -> SkyPlace {
    let lowest = tangent_altitude(eye.ground_radius, eye.altitude, dir);
    let nadir = length(dir.xz) / (1.0 - dir.y) * eye.horizon;
    let below = lowest < 0.0 && dir.y < 0.0;
    let y = select(select(4.0, lowest / eye.top, dir.y < 0.0), 1.0 - nadir, below);
    return SkyPlace(azimuth_place(eye, dir.xz), sqrt(clamp(y, 0.0, 4.0)), below, dot(dir, eye.to_sun));
}

/// Place of a unit vector `dir` in the tables of an eye.
///
/// domain  eye.to_sun in [-1, 1] 1 lin
/// domain  eye.altitude in [0, 1e5] m lin
/// domain  dir in [-1, 1] 1 lin
/// range   [-1, 2] 1
/// error   1e-3 abs of reference::air_tables::sky_place
/// outside undefined
/// source  ours
fn sky_place(eye: SkyEye, dir: vec3<f32>) -> SkyPlace {
    if eye.altitude > eye.top {
        return sky_place_outside(eye, dir);
    }
    return sky_place_inside(eye, dir);
}

/// Direction of coordinates in the tables of an eye: the inverse of `sky_place`. The sun's azimuth is that of -z when it stands in the zenith.
///
/// domain  eye.to_sun in [-1, 1] 1 lin
/// domain  eye.altitude in [0, 1e8] m lin
/// domain  place in [0, 1] 1 lin
/// range   [-1, 1] 1
/// error   1e-3 abs of reference::air_tables::sky_direction
/// outside undefined
/// source  ours
fn sky_direction(eye: SkyEye, place: vec2<f32>, below: bool) -> vec3<f32> {
    // The horizon itself belongs to neither side: keep off it by more than rounding.
    let y = max(place.y, 4e-3);
    let ratio = 1.0 - y * y;
    var sine = 0.0;
    var mu = 0.0;
    if eye.altitude > eye.top && !below {
        let lowest = eye.top * y * y;
        sine = (eye.ground_radius + lowest) / (eye.ground_radius + eye.altitude);
        mu = -sqrt(max((eye.altitude - lowest) * (2.0 * eye.ground_radius + eye.altitude + lowest), 0.0)) / (eye.ground_radius + eye.altitude);
    } else {
        let half = select(eye.horizon * ratio, ratio / eye.horizon, below);
        sine = 2.0 * half / (1.0 + half * half);
        mu = (1.0 - half * half) / (1.0 + half * half);
        mu = select(mu, -mu, below);
    }
    let azimuth = clamp(1.0 - 2.0 * place.x, -1.0, 1.0);
    let across = sqrt(max(1.0 - azimuth * azimuth, 0.0));
    let flat = length(eye.to_sun.xz);
    let ahead = select(vec2<f32>(0.0, -1.0), eye.to_sun.xz / max(flat, 1e-20), flat > 1e-10);
    let aside = ahead * azimuth + vec2<f32>(-ahead.y, ahead.x) * across;
    return vec3<f32>(aside.x * sine, mu, aside.y * sine);
}

/// How many rows of a table of the sky with `rows` rows hold directions above the horizon.
///
/// domain  eye.altitude in [0, 1e8] m lin
/// domain  rows in [6, 1024] 1 log
/// range   [2, 1024] 1
/// error   0 abs of reference::air_tables::sky_rows
/// source  ours
fn sky_rows(eye: SkyEye, rows: f32) -> f32 {
    return floor(rows * select(0.75, 0.33333333, eye.altitude > eye.top));
}

/// Row of the table of the sky, in [0, 1], of a height above or depth below the horizon in [0, 1]; the parts never mix.
///
/// domain  eye.altitude in [0, 1e8] m lin
/// domain  y in [0, 1] 1 lin
/// domain  rows in [6, 1024] 1 log
/// range   [0, 1] 1
/// error   2e-7 abs of reference::air_tables::sky_row
/// outside undefined
/// source  elementary
fn sky_row(eye: SkyEye, y: f32, below: bool, rows: f32) -> f32 {
    let above = sky_rows(eye, rows);
    let first = select(0.0, above, below);
    let count = select(above, rows - above, below);
    return (first + min(y, 1.0) * (count - 1.0) + 0.5) / rows;
}

/// Radiance of the sky, or of the air before the ground, for a sun of irradiance 1 and without its disc, read from the table.
///
/// domain  place.x in [0, 1] 1 lin
/// domain  place.y in [0, 1] 1 lin
/// domain  place.nu in [-1, 1] 1 lin
/// domain  eye.scale in [1, 1e6] 1 log
/// range   [0, 1e6] 1/sr
/// error   0.02 rel of reference::sky::Sky::single_scatter
/// source  Hillaire2020
fn sky_radiance(sky: texture_2d_array<f32>, linear: sampler, air: Air, eye: SkyEye, place: SkyPlace) -> vec3<f32> {
    let size = vec2<f32>(textureDimensions(sky));
    let at = vec2<f32>((place.x * (size.x - 1.0) + 0.5) / size.x, sky_row(eye, place.y, place.below, size.y));
    let smooth_light = textureSampleLevel(sky, linear, at, 0, 0.0).rgb;
    let peaked = textureSampleLevel(sky, linear, at, 1, 0.0).rgb;
    let within = select(1.0, 0.0, place.y > 1.0);
    return (smooth_light + peaked * peak_phase(air, place.nu)) * (within / eye.scale);
}
