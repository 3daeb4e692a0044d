//! Light scattered more than once: the radiance of the air's own glow around every place, as moments over directions.
//! source   solved by orders of scattering, each by quadrature over directions and along rays; moments to degree two, which is exact for molecules: ours
//! symbols  h altitude [m] · mu zenith cosine of a direction · sun_mu zenith cosine of the sun · nu cosine between direction and sun · x = nu - mu sun_mu
//!
//! A texel of the table belongs to an altitude and a zenith cosine of the sun and holds moments of the radiance (of a sun of irradiance 1)
//! over the sphere: layer 0 log2 of the mean over the channels of the integral, and red and green over that mean; layer 1 per channel the integral of
//! mu over that of 1; layer 2 per channel that of (3 mu^2 - 1) / 2; the last places of the three layers, for the mean of the channels, those of s cos(phi) / sun_s,
//! mu s cos(phi) / sun_s and s^2 cos(2 phi) / sun_s^2, with s and sun_s the zenith sines and phi the azimuth from the sun.
#define_import_path veduta::atmosphere::diffuse

#import veduta::atmosphere::medium::{Air, Lanes, air_scattering}
#import veduta::atmosphere::columns::{texture_place}

/// Moments of radiance over the sphere.
struct Moments {
    /// Integral of the radiance.
    whole: vec3<f32>,
    /// The integral weighted with mu, over the integral.
    up: vec3<f32>,
    /// Weighted with (3 mu^2 - 1) / 2, over the integral.
    level: vec3<f32>,
    /// Weighted with s cos(phi) / sun_s, mu s cos(phi) / sun_s and s^2 cos(2 phi) / sun_s^2, each over the integral; for the mean of the channels.
    aside: vec3<f32>,
}

/// Where the sun's zenith cosine is densest in the table, and how dense.
const SUN_BEND: f32 = 0.06;
/// The lowest sun of the table.
const LOWEST_SUN: f32 = -0.4;

/// Bends a zenith cosine of the sun.
///
/// internal
fn bend_sun(mu: f32) -> f32 {
    return sign(mu) * log(1.0 + abs(mu) / SUN_BEND);
}

/// Coordinates in the table of altitude `h` and zenith cosine `sun_mu` of the sun.
///
/// domain  top in [5e4, 2e5] m lin
/// domain  h in [0, 2e5] m lin
/// domain  sun_mu in [-1, 1] 1 lin
/// range   [0, 1] 1
/// error   3e-7 abs of reference::air_tables::diffuse_coordinates
/// source  logarithm dense at the horizon, root dense at the ground: ours
fn diffuse_coordinates(top: f32, h: f32, sun_mu: f32) -> vec2<f32> {
    let low = bend_sun(LOWEST_SUN);
    let x = (bend_sun(sun_mu) - low) / (bend_sun(1.0) - low);
    return vec2<f32>(clamp(x, 0.0, 1.0), sqrt(clamp(h / top, 0.0, 1.0)));
}

/// Altitude [m] and zenith cosine of the sun of coordinates: the inverse of `diffuse_coordinates`. The error is that of the altitude.
///
/// domain  top in [5e4, 2e5] m lin
/// domain  place in [0, 1] 1 lin
/// range   [-1, 2e5] 1
/// error   0.02 abs of reference::air_tables::diffuse_place
/// outside undefined
/// source  as diffuse_coordinates
fn diffuse_place(top: f32, place: vec2<f32>) -> vec2<f32> {
    let low = bend_sun(LOWEST_SUN);
    let bent = low + (bend_sun(1.0) - low) * place.x;
    return vec2<f32>(top * place.y * place.y, clamp(sign(bent) * SUN_BEND * (exp(abs(bent)) - 1.0), -1.0, 1.0));
}

/// The first texel layer of moments; the others are `up` and `level`, with the second and third of `aside` in the last place.
///
/// domain  moments.whole in [0, 100] 1 lin
/// domain  moments.up in [-1, 1] 1 lin
/// domain  moments.level in [-1, 1] 1 lin
/// domain  moments.aside in [-1, 1] 1 lin
/// range   [-200, 10] 1
/// error   1e-5 abs of reference::air_tables::encode_moments
/// outside undefined
/// source  logarithm of the mean, so that night and day have the same relative precision: ours
fn encode_moments(moments: Moments) -> vec4<f32> {
    let mean = max(dot(moments.whole, vec3<f32>(1.0 / 3.0)), 1e-30);
    return vec4<f32>(log2(mean), moments.whole.r / mean, moments.whole.g / mean, moments.aside.x);
}

/// Moments of three texel layers.
///
/// domain  first in [-3, 3] 1 lin
/// domain  second in [-1, 1] 1 lin
/// domain  third in [-1, 1] 1 lin
/// range   [-10, 100] 1
/// error   2e-5 abs of reference::air_tables::decode_moments
/// outside undefined
/// source  as encode_moments
fn decode_moments(first: vec4<f32>, second: vec4<f32>, third: vec4<f32>) -> Moments {
    let chroma = max(vec3<f32>(first.y, first.z, 3.0 - first.y - first.z), vec3<f32>(0.0));
    return Moments(chroma * exp2(first.x), second.xyz, third.xyz, vec3<f32>(first.w, second.w, third.w));
}

/// Moments read from the table.
///
/// domain  top in [5e4, 2e5] m lin
/// domain  h in [0, 1e5] m lin
/// domain  sun_mu in [-1, 1] 1 lin
/// range   [-10, 100] 1
/// error   0.12 rel of reference::air_tables::diffuse_moments
/// source  bilinear
fn diffuse_moments(moments: texture_2d_array<f32>, linear: sampler, top: f32, h: f32, sun_mu: f32) -> Moments {
    let size = vec2<f32>(textureDimensions(moments));
    let place = texture_place(diffuse_coordinates(top, h, sun_mu), size);
    return decode_moments(
        textureSampleLevel(moments, linear, place, 0, 0.0),
        textureSampleLevel(moments, linear, place, 1, 0.0),
        textureSampleLevel(moments, linear, place, 2, 0.0),
    );
}

/// Light scattered, where the lanes' densities are `densities`, out of a field of light given by its moments, into the direction of
/// zenith cosine `mu` with the cosine `nu` to the sun.
///
/// domain  densities.low in [0, 1] 1 lin
/// domain  densities.high in [0, 1] 1 lin
/// domain  moments.whole in [0, 10] 1 lin
/// domain  moments.up in [-1, 1] 1 lin
/// domain  moments.level in [-1, 1] 1 lin
/// domain  moments.aside in [-1, 1] 1 lin
/// domain  mu in [-1, 1] 1 lin
/// domain  sun_mu in [-1, 1] 1 lin
/// domain  nu in [-1, 1] 1 lin
/// range   [0, 1] 1/m
/// error   4e-9 abs of reference::air_tables::diffuse_source
/// outside undefined
/// source  addition theorem of Legendre's polynomials
fn diffuse_source(air: Air, densities: Lanes, moments: Moments, mu: f32, sun_mu: f32, nu: f32) -> vec3<f32> {
    let x = nu - mu * sun_mu;
    let linear = 3.0 * (mu * moments.up + x * moments.aside.x);
    let across = 2.0 * x * x - (1.0 - mu * mu) * (1.0 - sun_mu * sun_mu);
    let square = 5.0 * ((1.5 * mu * mu - 0.5) * moments.level + (3.0 * mu * x * moments.aside.y + 0.75 * across * moments.aside.z));
    let isotropic = air_scattering(air, densities, Lanes(vec4<f32>(1.0), vec4<f32>(1.0)));
    let first = air_scattering(air, densities, Lanes(air.low.phase_first, air.high.phase_first));
    let second = air_scattering(air, densities, Lanes(air.low.phase_second, air.high.phase_second));
    return max(isotropic + first * linear + second * square, vec3<f32>(0.0)) * moments.whole * 0.079577472;
}

/// Irradiance on a level plane, seen from above, of a field of light given by its moments.
///
/// domain  moments.whole in [0, 10] 1 lin
/// domain  moments.up in [-1, 1] 1 lin
/// domain  moments.level in [-1, 1] 1 lin
/// domain  moments.aside in [-1, 1] 1 lin
/// range   [0, 11] 1
/// error   3e-6 abs of reference::air_tables::level_irradiance
/// outside undefined
/// source  Ramamoorthi2001
fn level_irradiance(moments: Moments) -> vec3<f32> {
    return moments.whole * max(0.25 + 0.5 * moments.up + 0.3125 * moments.level, vec3<f32>(0.0));
}

/// Irradiance on a plane with the unit normal `normal` of a field of light given by its moments; the frame has y up, `to_sun` is the unit
/// vector to the sun.
///
/// domain  moments.whole in [0, 10] 1 lin
/// domain  moments.up in [-1, 1] 1 lin
/// domain  moments.level in [-1, 1] 1 lin
/// domain  moments.aside in [-1, 1] 1 lin
/// domain  normal in [-1, 1] 1 lin
/// domain  to_sun in [-1, 1] 1 lin
/// range   [0, 20] 1
/// error   1e-5 abs of reference::air_tables::plane_irradiance
/// outside undefined
/// source  Ramamoorthi2001
fn plane_irradiance(moments: Moments, normal: vec3<f32>, to_sun: vec3<f32>) -> vec3<f32> {
    let mu = normal.y;
    let x = dot(normal, to_sun) - mu * to_sun.y;
    let linear = mu * moments.up + x * moments.aside.x;
    let across = 2.0 * x * x - (1.0 - mu * mu) * (1.0 - to_sun.y * to_sun.y);
    let square = (1.5 * mu * mu - 0.5) * moments.level + (3.0 * mu * x * moments.aside.y + 0.75 * across * moments.aside.z);
    return moments.whole * max(0.25 + 0.5 * linear + 0.3125 * square, vec3<f32>(0.0));
}

/// Sum of two fields of light.
///
/// domain  a.whole in [0, 10] 1 lin
/// domain  a.up in [-1, 1] 1 lin
/// domain  a.level in [-1, 1] 1 lin
/// domain  a.aside in [-1, 1] 1 lin
/// domain  b.whole in [0, 10] 1 lin
/// domain  b.up in [-1, 1] 1 lin
/// domain  b.level in [-1, 1] 1 lin
/// domain  b.aside in [-1, 1] 1 lin
/// range   [-10, 20] 1
/// error   2e-6 abs of reference::air_tables::add_moments
/// outside undefined
/// source  elementary
fn add_moments(a: Moments, b: Moments) -> Moments {
    let share = b.whole / max(a.whole + b.whole, vec3<f32>(1e-30));
    let mean = dot(b.whole, vec3<f32>(1.0)) / max(dot(a.whole + b.whole, vec3<f32>(1.0)), 1e-30);
    return Moments(a.whole + b.whole, mix(a.up, b.up, share), mix(a.level, b.level, share), mix(a.aside, b.aside, mean));
}
