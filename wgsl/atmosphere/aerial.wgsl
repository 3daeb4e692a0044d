//! The table of the air before things, as seen from one eye: by direction and by distance.
//! source   Hillaire2020 (a volume per eye); in the sky's own directions, so that turning the eye costs nothing, and means over the distance, which vary little: ours
//! symbols  t distance from the start of the ray in the air [m] · length that to the ray's end [m] · slice a coordinate in [0, 1] along it
//!
//! A texel of the light's table belongs to an azimuth from the sun (x), a height above or depth below the horizon (y: the lower half of the rows is above the
//! horizon, the upper below) and a slice, and holds radiance scattered in between for a sun of irradiance 1, over the distance and times scale and thickness of the air:
//! in the first half of the array layers but for peaked light [1/sr], in the second peaked light over the peaked phase function [1]. The table of depths holds, by
//! slice (x) and height (y), log2 of the mean extinction times the thickness of the air.
#define_import_path veduta::atmosphere::aerial

#import veduta::atmosphere::medium::{Air, peak_phase}
#import veduta::atmosphere::ray::{AirLight}
#import veduta::atmosphere::sky_view::{SkyEye, SkyPlace}
#import veduta::atmosphere::scatter::{step_share}

/// Row of the tables, in [0, 1], of a height above or below the horizon in [0, 1], when there are `rows` rows: the halves never mix.
///
/// domain  y in [0, 1] 1 lin
/// domain  rows in [4, 1024] 1 log
/// range   [0, 1] 1
/// error   2e-7 abs of reference::air_tables::aerial_row
/// outside undefined
/// source  elementary
fn aerial_row(y: f32, below: bool, rows: f32) -> f32 {
    let half = 0.5 * rows;
    return (min(y, 1.0) * (half - 1.0) + 0.5 + select(0.0, half, below)) / rows;
}

/// Where on a ray slices are dense: 0 at its start, for an eye in the lower air; of a higher eye's rays 1 at the end, when they meet the ground, and 2 in the middle.
///
/// domain  eye.altitude in [0, 1e8] m lin
/// range   [0, 2] 1
/// error   0 abs of reference::air_tables::aerial_spacing
/// source  ours
fn aerial_spacing(eye: SkyEye, below: bool) -> i32 {
    return select(0, select(2, 1, below), eye.altitude > 0.15 * eye.top);
}

/// Distance of a slice, in [0, 1], of a ray; `spacing` is 0, 1 or 2.
///
/// domain  spacing in [0, 2] 1 lin
/// domain  slice in [0, 1] 1 lin
/// domain  length in [0, 2e6] m lin
/// range   [0, 2e6] m
/// error   0.4 abs of reference::air_tables::aerial_distance
/// outside undefined
/// monotone slice
/// source  Hillaire2020 (squared slices); the others: ours
fn aerial_distance(spacing: i32, slice: f32, length: f32) -> f32 {
    let rest = 1.0 - slice;
    let aside = 2.0 * slice - 1.0;
    if spacing == 1 {
        return length * (1.0 - rest * rest);
    }
    if spacing == 2 {
        return length * (0.5 + 0.5 * aside * abs(aside));
    }
    return length * slice * slice;
}

/// Slice of a distance: the inverse of `aerial_distance`; 1 beyond the end.
///
/// domain  spacing in [0, 2] 1 lin
/// domain  t in [0, 2e6] m lin
/// domain  length in [1, 2e6] m log
/// range   [0, 1] 1
/// error   2.5e-4 abs of reference::air_tables::aerial_slice
/// monotone t
/// source  as aerial_distance
fn aerial_slice(spacing: i32, t: f32, length: f32) -> f32 {
    let share = clamp(t / max(length, 1e-20), 0.0, 1.0);
    if spacing == 1 {
        return 1.0 - sqrt(1.0 - share);
    }
    if spacing == 2 {
        let aside = 2.0 * share - 1.0;
        return 0.5 + 0.5 * sign(aside) * sqrt(abs(aside));
    }
    return sqrt(share);
}

/// How far along a ray of the length `length` the air reaches that lies before the distance `t`: to the top of the air, and below the horizon as far as it goes, since a host's
/// ground may lie below the ground sphere.
///
/// internal
fn aerial_reached(place: SkyPlace, t: f32, length: f32) -> f32 {
    return max(select(min(t, length), t, place.below), 0.0);
}

/// Optical depth of the air from an eye to the distance `t` from where the ray enters the air; the other arguments are those of `aerial_light`.
///
/// domain  t in [0, 2e6] m lin
/// domain  length in [1, 2e6] m log
/// domain  place.x in [0, 1] 1 lin
/// domain  place.y in [0, 1] 1 lin
/// domain  place.nu in [-1, 1] 1 lin
/// range   [0, 1e6] 1
/// error   0.02 rel of reference::sky::Sky::single_scatter
/// source  ours
fn aerial_depth(depths: texture_2d<f32>, linear: sampler, air: Air, eye: SkyEye, place: SkyPlace, t: f32, length: f32) -> vec3<f32> {
    let reached = aerial_reached(place, t, length);
    let slice = aerial_slice(aerial_spacing(eye, place.below), reached, length);
    let size = vec2<f32>(textureDimensions(depths));
    let at = vec2<f32>((slice * (size.x - 1.0) + 0.5) / size.x, aerial_row(place.y, place.below, size.y));
    return exp2(textureSampleLevel(depths, linear, at, 0.0).rgb) * (reached / air.top);
}

/// Light and transmittance of the air from an eye to the distance `t` from where the ray enters the air, for the direction's place in the tables of the eye and the whole length
/// of the ray. Beyond the end it is that of the end, and below the horizon that of air as dense as the mean before it.
///
/// domain  t in [0, 2e6] m lin
/// domain  length in [1, 2e6] m log
/// domain  place.x in [0, 1] 1 lin
/// domain  place.y in [0, 1] 1 lin
/// domain  place.nu in [-1, 1] 1 lin
/// domain  eye.scale in [0.0625, 1.1e12] 1 log
/// range   [0, 1e6] 1/sr
/// error   0.02 rel of reference::sky::Sky::single_scatter
/// source  Hillaire2020
fn aerial_light(light: texture_2d_array<f32>, depths: texture_2d<f32>, linear: sampler, air: Air, eye: SkyEye, place: SkyPlace, t: f32, length: f32) -> AirLight {
    let reached = aerial_reached(place, t, length);
    let slice = aerial_slice(aerial_spacing(eye, place.below), reached, length);
    let size = vec2<f32>(textureDimensions(light));
    let slices = i32(textureNumLayers(light)) / 2;
    let row = aerial_row(place.y, place.below, size.y);
    let at = vec2<f32>((place.x * (size.x - 1.0) + 0.5) / size.x, row);
    let between = slice * f32(slices - 1);
    let near = min(i32(between), slices - 2);
    let far_share = between - f32(near);
    let smooth_light = mix(textureSampleLevel(light, linear, at, near, 0.0).rgb, textureSampleLevel(light, linear, at, near + 1, 0.0).rgb, far_share);
    let peaked = mix(textureSampleLevel(light, linear, at, slices + near, 0.0).rgb, textureSampleLevel(light, linear, at, slices + near + 1, 0.0).rgb, far_share);
    let depth = aerial_depth(depths, linear, air, eye, place, t, length);
    // Beyond the ground sphere the air is as dense as the mean before it, and dims what it scatters.
    let within = depth * (min(reached, length) / max(reached, 1e-20));
    let dimmed = step_share(depth, exp(-depth)) / step_share(within, exp(-within));
    let share = reached / air.top;
    return AirLight((smooth_light + peaked * peak_phase(air, place.nu)) * dimmed * (share / eye.scale), exp(-depth));
}
