//! The table of the sky as seen from one eye: directions that leave the air, by height above the horizon and by azimuth from the sun.
//! source   Hillaire2020 (a table per eye); half-angle tangents, exact horizon, cosine of the azimuth: ours
//! symbols  mu zenith cosine · x, y coordinates in [0, 1]: azimuth from the sun, and height above the horizon
//!
//! The first rows hold directions above the horizon, the others those below: the last quarter, or half where `sky_coded`.
//!
//! A texel holds radiance for a sun of irradiance 1, over the reach of its direction and times the scale of the eye (where `sky_coded`, a code of that): layer 0 but for peaked light, over 1 + nu^2, the shape
//! of molecules' phase function [1/sr], layer 1 peaked light over the peaked phase function [1]. Rows and columns between those that are computed are cubics through four of them.
#define_import_path veduta::atmosphere::sky_view

#import veduta::atmosphere::ray::{tangent_altitude}
#import veduta::atmosphere::medium::{Air, peak_phase}

/// How dense coordinates of an eye above the air are at the terminator.
const TERMINATOR_BEND: f32 = 0.1;
/// Where they are densest.
const TERMINATOR: f32 = -0.1;
/// The lowest sun that they hold.
const DARKEST_SUN: f32 = -0.45;
/// Where the sun's height differs less between directions than this, they are azimuths.
const LEAST_SUNS: f32 = 1e-3;

/// Share of the air's thickness above which a table holds codes.
const CODED: f32 = 0.1;

/// How low a limb begins to be less dense than at the ground, over the air's thickness.
const LIMB_BEND: f32 = 0.015;

/// Light below which codes are linear.
const DUSK: f32 = 5.9604645e-8;

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
    /// 1 when the table of the sky shows the ground in directions below the horizon, else 0.
    shows_ground: u32,
}

/// What a picture needs of an eye within the air and its table of the sky: made once for all pixels.
struct SkyLook {
    /// Unit vector to the sun, y up at the eye.
    to_sun: vec3<f32>,
    /// Tangent of half the zenith angle of the horizon.
    horizon: f32,
    /// Azimuth of the sun times what the table's x falls by from the middle to the sun: half of what lies between its outermost columns; 0 for a sun in the zenith.
    ahead: vec2<f32>,
    /// Row of the table at the horizon, above it.
    above: f32,
    /// From there to the zenith.
    above_rise: f32,
    /// Row of the table at the horizon, below it.
    below: f32,
    /// From there to the nadir.
    below_rise: f32,
    /// What the table's values are multiplied with.
    gain: f32,
    /// 1 + g^2 of the peaked phase function.
    peak_base: f32,
    /// Its 2 g.
    peak_slope: f32,
    /// Its level [1/sr].
    peak_level: f32,
    /// Its coefficient of nu^2 [1/sr].
    peak_square: f32,
}

/// Where a direction is in the table of an eye within the air.
struct SkyTexel {
    /// Column and row, in [0, 1].
    at: vec2<f32>,
    /// Cosine of the angle to the sun.
    nu: f32,
}

/// A direction's place in the tables of an eye.
struct SkyPlace {
    /// Azimuth from the sun: (1 - cos phi) / 2; of an eye above the air the sun's height where the ray meets the ground or runs lowest, from the highest on.
    x: f32,
    /// Height above, or depth below, the horizon: 0 at the horizon, 1 at zenith, nadir or the top of the air; above 1 for a direction that misses the air.
    y: f32,
    /// Whether the direction is below the horizon.
    below: bool,
    /// Cosine of the angle to the sun.
    nu: f32,
    /// Length of the ray in the air over the air's thickness, which the table of the sky is divided by; 1 where that shows the ground, and everywhere for an eye within the air whose
    /// table does.
    reach: f32,
}

/// A share of what is above the horizon, bent so that rows are dense where the air is: 0 at the horizon, 1 at the end.
///
/// internal
fn bend_limb(share: f32, bend: f32) -> f32 {
    return log(1.0 + share / bend) / log(1.0 + 1.0 / bend);
}

/// The inverse of `bend_limb`.
///
/// internal
fn unbend_limb(y: f32, bend: f32) -> f32 {
    return bend * (exp(y * log(1.0 + 1.0 / bend)) - 1.0);
}

/// The bend of an eye within the air: rays that run so much above the horizon run as low as LIMB_BEND says.
///
/// internal
fn inner_bend(eye: SkyEye) -> f32 {
    return LIMB_BEND * eye.top * inverseSqrt(max(eye.altitude * (2.0 * eye.ground_radius + eye.altitude), 1.0));
}

/// Bends a zenith cosine of the sun, so that coordinates are dense at the terminator.
///
/// internal
fn bend_terminator(mu: f32) -> f32 {
    let beyond = mu - TERMINATOR;
    return sign(beyond) * log(1.0 + abs(beyond) / TERMINATOR_BEND);
}

/// Zenith cosines of the sun where a ray from an eye above the air meets the ground or runs lowest: half the difference between towards the sun and away
/// from it, and the mean. The ray has the zenith sine `sine` and cosine `mu` and runs as low as `lowest`.
///
/// internal
fn seen_suns(eye: SkyEye, sine: f32, mu: f32, lowest: f32) -> vec2<f32> {
    let r = eye.ground_radius + eye.altitude;
    let half_ground = sqrt(max(-lowest * (2.0 * eye.ground_radius + lowest), 0.0));
    let t = -r * mu - half_ground;
    let below = lowest < 0.0;
    let away = select(-mu, min(t * sine / eye.ground_radius, 1.0), below);
    let along = select(sine, (r + t * mu) / eye.ground_radius, below);
    return vec2<f32>(length(eye.to_sun.xz) * away, eye.to_sun.y * along);
}

/// Ends of the bent coordinate, towards the sun and away from it; what is far behind the terminator is left out.
///
/// internal
fn sun_ends(suns: vec2<f32>) -> vec2<f32> {
    let first = suns.y + suns.x;
    let last = suns.y - suns.x;
    return vec2<f32>(bend_terminator(first), bend_terminator(select(last, max(last, DARKEST_SUN), first > DARKEST_SUN + 0.1)));
}

/// Place of a unit vector `dir` in the tables of an eye within the air that show the ground: the reach is 1.
///
/// internal
fn sky_place_shown(eye: SkyEye, dir: vec3<f32>) -> SkyPlace {
    // Tangent of half the zenith angle over that of the horizon, or the same from the nadir.
    let aside = dot(dir.xz, dir.xz);
    let over = inverseSqrt(max(aside, 1e-20));
    let ratio = max(aside, 1e-20) * over / max((1.0 + dir.y) * eye.horizon, 1e-20);
    let flat = inverseSqrt(max(dot(eye.to_sun.xz, eye.to_sun.xz), 1e-20));
    let azimuth = clamp(dot(dir.xz, eye.to_sun.xz) * (over * flat), -1.0, 1.0);
    let share = max(1.0 - min(ratio, 1.0 / ratio), 0.0);
    // Not by a branch: llvmpipe 22.3 falls over uniforms that it puts into conditions, in programs that are as long as that of clouds with air.
    let y = select(sqrt(share), bend_limb(share, inner_bend(eye)), sky_coded(eye) & (ratio <= 1.0));
    return SkyPlace(0.5 - 0.5 * azimuth, y, ratio > 1.0, clamp(dot(dir, eye.to_sun), -1.0, 1.0), 1.0);
}

/// Where a direction, a vector of any length, is in the table of an eye within the air.
///
/// domain  look.to_sun in [-1, 1] 1 lin
/// domain  look.horizon in [1, 10] 1 log
/// domain  look.ahead in [-0.5, 0.5] 1 lin
/// domain  look.above in [0, 1] 1 lin
/// domain  look.above_rise in [0, 1] 1 lin
/// domain  look.below in [0, 1] 1 lin
/// domain  look.below_rise in [0, 1] 1 lin
/// domain  look.gain in [1e-12, 16] 1 log
/// domain  look.peak_base in [1, 2] 1 lin
/// domain  look.peak_slope in [0, 2] 1 lin
/// domain  look.peak_level in [0, 1] 1/sr lin
/// domain  look.peak_square in [0, 1] 1/sr lin
/// domain  ray in [-1e3, 1e3] 1 lin
/// range   [-2, 2] 1
/// error   1e-3 abs of reference::air_tables::sky_texel
/// outside undefined
/// source  ours
fn sky_texel(look: SkyLook, ray: vec3<f32>) -> SkyTexel {
    // Zenith sine and 1 + cosine, times the ray's length; their quotient is the tangent of half the zenith angle. One division serves all.
    let flat = max(dot(ray.xz, ray.xz), 1e-20);
    let sine = sqrt(flat);
    let length = sqrt(flat + ray.y * ray.y);
    let rest = max((length + ray.y) * look.horizon, 1e-20);
    let most = max(sine, rest);
    let both = sine * length;
    let over = 1.0 / (both * most);
    let height = sqrt(max(1.0 - min(sine, rest) * (over * both), 0.0));
    let row = select(look.above + look.above_rise * height, look.below + look.below_rise * height, sine > rest);
    return SkyTexel(vec2<f32>(0.5 - dot(ray.xz, look.ahead) * (over * (length * most)), row), dot(ray, look.to_sun) * (over * (sine * most)));
}

/// Both parts of a table's light for a cosine `nu` of the angle to the sun.
///
/// internal
fn sky_together(look: SkyLook, smooth_light: vec3<f32>, peaked: vec3<f32>, nu: f32) -> vec3<f32> {
    let base = max(look.peak_base - look.peak_slope * nu, 1e-9);
    let square = nu * nu;
    let phase = (look.peak_level + look.peak_square * square) / (base * sqrt(base));
    return (smooth_light * (1.0 + square) + peaked * phase) * look.gain;
}

/// Radiance of the sky, or of the ground and the air before it, for a sun of irradiance 1 and without its disc, that an eye within the air sees along a vector of any length.
///
/// domain  look.to_sun in [-1, 1] 1 lin
/// domain  ray in [-1e3, 1e3] 1 lin
/// range   [0, 1e6] 1/sr
/// error   0.02 rel of reference::sky::Sky::single_scatter
/// source  Hillaire2020
fn sky_seen(sky: texture_2d_array<f32>, linear: sampler, look: SkyLook, ray: vec3<f32>) -> vec3<f32> {
    let texel = sky_texel(look, ray);
    let smooth_light = textureSampleLevel(sky, linear, texel.at, 0, 0.0).rgb;
    let peaked = textureSampleLevel(sky, linear, texel.at, 1, 0.0).rgb;
    return sky_together(look, smooth_light, peaked, texel.nu);
}

/// As `sky_seen`, with one texture read a pixel: of two neighbours the left reads the one layer and the right the other, and each takes what it lacks from its neighbour. The
/// phase function is each pixel's own, so that what is shared varies little. For fragments, in uniform control flow; `pixel` is the place in the target.
///
/// domain  look.to_sun in [-1, 1] 1 lin
/// domain  ray in [-1e3, 1e3] 1 lin
/// domain  pixel in [0, 16384] 1 lin
/// range   [0, 1e6] 1/sr
/// error   0.02 rel of reference::sky::Sky::single_scatter
/// source  Hillaire2020; shared reads: ours
fn sky_seen_by_pair(sky: texture_2d_array<f32>, linear: sampler, look: SkyLook, ray: vec3<f32>, pixel: vec2<f32>) -> vec3<f32> {
    let texel = sky_texel(look, ray);
    let right = i32(pixel.x) & 1;
    let own = textureSampleLevel(sky, linear, texel.at, right, 0.0).rgb;
    let step = dpdxFine(own);
    let other = select(own - step, own + step, right == 0);
    return sky_together(look, select(other, own, right == 0), select(own, other, right == 0), texel.nu);
}

/// Place of a unit vector `dir` in the tables of an eye within the air.
///
/// domain  eye.to_sun in [-1, 1] 1 lin
/// domain  eye.altitude in [0, eye.top] m lin
/// domain  dir in [-1, 1] 1 lin
/// range   [-1, 1] 1
/// error   1e-3 abs of reference::air_tables::sky_place_inside
/// outside undefined
/// source  ours
fn sky_place_inside(eye: SkyEye, dir: vec3<f32>) -> SkyPlace {
    var place = sky_place_shown(eye, dir);
    let below = place.below;
    let along = (eye.ground_radius + eye.altitude) * dir.y;
    let level = select(eye.top, 0.0, below);
    let gain = (level - eye.altitude) * (2.0 * eye.ground_radius + eye.altitude + level);
    let root = sqrt(max(along * along + gain, 0.0));
    var length = max(abs(gain) / max(root + abs(along), 1e-20), 0.0);
    if !below && along < 0.0 {
        length = root - along;
    }
    place.reach = select(length / eye.top, 1.0, eye.shows_ground != 0u);
    return place;
}

/// Place of a unit vector `dir` in the tables of an eye above the air.
///
/// domain  eye.to_sun in [-1, 1] 1 lin
/// domain  eye.altitude in [1e5, 1e8] m log
/// domain  dir in [-1, 1] 1 lin
/// range   [-1, 2] 1
/// error   4e-3 abs of reference::air_tables::sky_place_outside
/// outside undefined
/// source  ours
fn sky_place_outside(eye: SkyEye, dir: vec3<f32>) -> SkyPlace {
    let lowest = tangent_altitude(eye.ground_radius, eye.altitude, dir);
    let nadir = length(dir.xz) / (1.0 - dir.y) * eye.horizon;
    let below = lowest < 0.0 && dir.y < 0.0;
    let share = lowest / eye.top;
    let limb = select(2.0, bend_limb(max(share, 0.0), LIMB_BEND), dir.y < 0.0 && share <= 1.0);
    let y = select(limb, sqrt(max(1.0 - nadir, 0.0)), below);
    let sine = length(dir.xz);
    let suns = seen_suns(eye, sine, dir.y, lowest);
    let ends = sun_ends(suns);
    let flat = inverseSqrt(max(dot(eye.to_sun.xz, eye.to_sun.xz), 1e-20));
    let cosine = clamp(dot(dir.xz, eye.to_sun.xz) * (flat / max(sine, 1e-10)), -1.0, 1.0);
    var x = 0.5 - 0.5 * cosine;
    if suns.x > LEAST_SUNS {
        x = (ends.x - bend_terminator(suns.y + suns.x * cosine)) / (ends.x - ends.y);
    }
    let half_top = sqrt(max((eye.top - lowest) * (2.0 * eye.ground_radius + eye.top + lowest), 0.0));
    let half_ground = sqrt(max(-lowest * (2.0 * eye.ground_radius + lowest), 0.0));
    let globe = select((2.0 * eye.ground_radius + eye.top) / (half_top + half_ground), 1.0, eye.shows_ground != 0u);
    let reach = select(select(2.0 * half_top / eye.top, 0.0, limb > 1.0), globe, below);
    return SkyPlace(clamp(x, 0.0, 1.0), clamp(y, 0.0, 2.0), below, clamp(dot(dir, eye.to_sun), -1.0, 1.0), reach);
}

/// Place of a unit vector `dir` in the tables of an eye.
///
/// domain  eye.to_sun in [-1, 1] 1 lin
/// domain  eye.altitude in [0, 1e8] m lin
/// domain  dir in [-1, 1] 1 lin
/// range   [-1, 2] 1
/// error   4e-3 abs of reference::air_tables::sky_place
/// outside undefined
/// source  ours
fn sky_place(eye: SkyEye, dir: vec3<f32>) -> SkyPlace {
    if eye.altitude > eye.top {
        return sky_place_outside(eye, dir);
    }
    return sky_place_inside(eye, dir);
}

/// Direction of coordinates in the tables of an eye: the inverse of `sky_place`. The sun's azimuth is that of -z when it stands in the zenith. The error is that
/// of azimuths of an eye above the air where the sun stands almost as high in all of them; elsewhere it is 1e-3.
///
/// domain  eye.to_sun in [-1, 1] 1 lin
/// domain  eye.altitude in [0, 1e8] m lin
/// domain  place in [0, 1] 1 lin
/// range   [-1, 1] 1
/// error   0.03 abs of reference::air_tables::sky_direction
/// outside undefined
/// source  ours
fn sky_direction(eye: SkyEye, place: vec2<f32>, below: bool) -> vec3<f32> {
    // The horizon itself belongs to neither side: keep off it by more than rounding.
    let y = max(place.y, 4e-3);
    var ratio = 1.0 - y * y;
    if sky_coded(eye) && !below {
        ratio = 1.0 - unbend_limb(y, inner_bend(eye));
    }
    var sine = 0.0;
    var mu = 0.0;
    var azimuth = clamp(1.0 - 2.0 * place.x, -1.0, 1.0);
    var lowest = 0.0;
    if eye.altitude > eye.top && !below {
        // Nor is there light at the top itself.
        lowest = eye.top * min(unbend_limb(y, LIMB_BEND), 0.9999);
        sine = (eye.ground_radius + lowest) / (eye.ground_radius + eye.altitude);
        mu = -sqrt(max((eye.altitude - lowest) * (2.0 * eye.ground_radius + eye.altitude + lowest), 0.0)) / (eye.ground_radius + eye.altitude);
    } else {
        let half = select(eye.horizon * ratio, ratio / eye.horizon, below);
        sine = 2.0 * half / (1.0 + half * half);
        mu = (1.0 - half * half) / (1.0 + half * half);
        mu = select(mu, -mu, below);
        let square = 1.0 / (eye.horizon * eye.horizon);
        lowest = -eye.ground_radius * (y * y) * (1.0 - square * ratio) / (1.0 + square * ratio * ratio);
    }
    if eye.altitude > eye.top {
        let suns = seen_suns(eye, sine, mu, lowest);
        let ends = sun_ends(suns);
        let bent = mix(ends.x, ends.y, place.x);
        let sun = TERMINATOR + sign(bent) * TERMINATOR_BEND * (exp(abs(bent)) - 1.0);
        azimuth = select(azimuth, clamp((sun - suns.y) / max(suns.x, 1e-6), -1.0, 1.0), suns.x > LEAST_SUNS);
    }
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
    return floor(rows * select(0.75, 0.5, sky_coded(eye)));
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

/// Whether the table of the sky holds codes: for an eye so high that the air below it thins out along its limb by more than a line between texels can follow, or that sees
/// noon and night at once.
///
/// domain  eye.altitude in [0, 1e8] m lin
/// domain  eye.top in [5e4, 2e5] m lin
/// range   [0, 1] 1
/// error   0 abs of reference::air_tables::sky_coded
/// source  ours
fn sky_coded(eye: SkyEye) -> bool {
    return eye.altitude > CODED * eye.top;
}

/// What such a table holds: a logarithm.
///
/// domain  light in [0, 100] 1 lin
/// range   [-24, 7] 1
/// error   4e-6 abs of reference::air_tables::encode_dusk
/// outside undefined
/// source  ours
fn encode_dusk(light: vec3<f32>) -> vec3<f32> {
    return log2(max(light, vec3<f32>(0.0)) + DUSK);
}

/// The inverse of `encode_dusk`.
///
/// domain  code in [-24, 7] 1 lin
/// range   [0, 130] 1
/// error   4e-5 abs of reference::air_tables::decode_dusk
/// outside undefined
/// source  as encode_dusk
fn decode_dusk(code: vec3<f32>) -> vec3<f32> {
    // A little more than was added, so that no light is none.
    return max(exp2(code) - 1.001 * DUSK, vec3<f32>(0.0));
}

/// Radiance of the sky, or of the air before the ground, for a sun of irradiance 1 and without its disc, read from the table; `coded` is that of the eye.
///
/// domain  place.x in [0, 1] 1 lin
/// domain  place.y in [0, 1] 1 lin
/// domain  place.nu in [-1, 1] 1 lin
/// domain  eye.scale in [0.0625, 1.1e12] 1 log
/// range   [0, 1e6] 1/sr
/// error   0.02 rel of reference::sky::Sky::single_scatter
/// source  Hillaire2020
fn sky_radiance(sky: texture_2d_array<f32>, linear: sampler, air: Air, eye: SkyEye, place: SkyPlace, coded: bool) -> vec3<f32> {
    let size = vec2<f32>(textureDimensions(sky));
    let at = vec2<f32>((place.x * (size.x - 1.0) + 0.5) / size.x, sky_row(eye, place.y, place.below, size.y));
    let smooth_light = textureSampleLevel(sky, linear, at, 0, 0.0).rgb;
    let peaked = textureSampleLevel(sky, linear, at, 1, 0.0).rgb;
    let factor = place.reach / eye.scale;
    if coded {
        return (decode_dusk(smooth_light) * (1.0 + place.nu * place.nu) + decode_dusk(peaked) * peak_phase(air, place.nu)) * factor;
    }
    return (smooth_light * (1.0 + place.nu * place.nu) + peaked * peak_phase(air, place.nu)) * factor;
}
