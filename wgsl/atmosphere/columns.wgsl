//! The table of columns: what lies between a place in the air and the sun, layer by layer and without a wavelength.
//! source   Afra2007 sec. 3 (height by zenith angle); means relative to the density at the lowest point, the exact split at horizon and level, and ramps in closed form: ours
//! symbols  h altitude [m] · mu zenith cosine · x, y coordinates in [0, 1] · lane a layer of the air
//!
//! A texel of the table belongs to the path from altitude h along zenith cosine mu to the top of the air and holds, for up to four lanes (further
//! lanes in a second array layer), one over the root of the lane's mean density along that path, over its density at the path's lowest point: a
//! number from 1 up that varies little. Lanes that are not exponential hold 1 and are summed up in closed form. Paths end at the top; the table
//! has none that meet the ground.
#define_import_path veduta::atmosphere::columns

#import veduta::atmosphere::medium::{Air, FourLayers, Lanes, air_extinction}
#import veduta::planet::shell::{altitude_along}
#import veduta::math::squared::{squared_node}

/// Points of the quadrature of exponential layers.
const COLUMN_STEPS: i32 = 24;

/// Zenith cosine of the horizon of the ground sphere, seen from altitude `h`.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  h in [0, 1e6] m lin
/// range   [-1, 0] 1
/// error   2e-7 abs of reference::air_tables::horizon_cosine
/// outside undefined
/// source  elementary
fn horizon_cosine(ground_radius: f32, h: f32) -> f32 {
    let above = max(h, 0.0);
    return -sqrt(above * (2.0 * ground_radius + above)) / (ground_radius + above);
}

/// Where level paths are in the table: below are those that fall first.
const LEVEL: f32 = 0.33333334;
/// Zenith cosine up to which rising paths are dense.
const RISE_BEND: f32 = 0.1;

/// Coordinates in the table of columns of altitude `h` and zenith cosine `mu`; below the horizon those of the horizon.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  h in [0, top] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1] 1
/// error   4e-7 abs of reference::air_tables::column_coordinates
/// source  dense at the level, by a root below and a fraction above it, and at the ground: ours
fn column_coordinates(ground_radius: f32, top: f32, h: f32, mu: f32) -> vec2<f32> {
    let horizon = min(horizon_cosine(ground_radius, h), -1e-20);
    let falling = LEVEL * (1.0 - sqrt(clamp(mu / horizon, 0.0, 1.0)));
    let up = clamp(mu, 0.0, 1.0);
    let rising = LEVEL + (1.0 - LEVEL) * (1.0 + RISE_BEND) * up / (up + RISE_BEND);
    return vec2<f32>(select(rising, falling, mu < 0.0), sqrt(clamp(h / top, 0.0, 1.0)));
}

/// Altitude [m] and zenith cosine of coordinates in the table of columns: the inverse of `column_coordinates`. The error is that of the altitude.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  place in [0, 1] 1 lin
/// range   [-1, 2e5] 1
/// error   0.02 abs of reference::air_tables::column_place
/// outside undefined
/// source  as column_coordinates
fn column_place(ground_radius: f32, top: f32, place: vec2<f32>) -> vec2<f32> {
    let h = top * place.y * place.y;
    let below = 1.0 - place.x / LEVEL;
    let above = (place.x - LEVEL) / (1.0 - LEVEL);
    return vec2<f32>(h, select(above * RISE_BEND / (1.0 + RISE_BEND - above), horizon_cosine(ground_radius, h) * (below * below), place.x < LEVEL));
}

/// A path to the top of the air, outwards from its lowest point.
struct TopPath {
    /// Altitude of the lowest point [m].
    lowest: f32,
    /// Distance of the lowest point from that of the whole line, 0 when the path has fallen to it [m].
    along: f32,
    /// Length from the lowest point to the top [m].
    rises: f32,
    /// Length from the start to the lowest point [m].
    falls: f32,
}

/// The path from altitude `h` along zenith cosine `mu` to the top of the air; what would lie below the ground is taken to run along it.
///
/// domain  ground_radius in [3e6, 1e7] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  h in [0, top] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1.1e7] m
/// error   2 abs of reference::air_tables::path_to_top
/// outside undefined
/// source  elementary; what the path rises by as a sum, so that short paths at the top keep their length: ours
fn path_to_top(ground_radius: f32, top: f32, h: f32, mu: f32) -> TopPath {
    let r = ground_radius + h;
    let down = min(mu, 0.0);
    let below = min(r * (down * down) / (1.0 + sqrt(max((1.0 - down) * (1.0 + down), 0.0))), h);
    let lowest = h - below;
    let along = (ground_radius + lowest) * max(mu, 0.0);
    let square = max((top - h) + below, 0.0) * (2.0 * ground_radius + top + lowest);
    return TopPath(lowest, along, square / max(along + sqrt(along * along + square), 1e-20), -r * down);
}

/// What the columns of the table are relative to: densities at the lowest point of the path from altitude `h` along zenith
/// cosine `mu` for exponential lanes, 1 for others.
///
/// domain  h in [0, air.top] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1] 1
/// error   1e-5 abs of reference::air_tables::column_scale
/// outside undefined
/// source  ours
fn column_scale(air: Air, h: f32, mu: f32) -> Lanes {
    let lowest = path_to_top(air.ground_radius, air.top, h, mu).lowest;
    var scale = Lanes(exp(air.low.fall * lowest), vec4<f32>(1.0));
#ifdef AIR_EIGHT_LANES
    scale.high = exp(air.high.fall * lowest);
#endif
    return scale;
}

/// Column of a layer of two ramps (slope and level at altitude 0 of each) on a rising line, whose levels at the ends of the ramps are `levels`
/// at the distances `t`. On a ramp Simpson's rule misses nothing but the fourth power of the distance.
///
/// internal
fn ramps_between(r: f32, path: TopPath, ramps: vec4<f32>, levels: vec4<f32>, t: vec4<f32>) -> f32 {
    let middle = 0.5 * (t.xz + t.yw);
    let gain = middle * (middle + 2.0 * path.along) / (r * r);
    let altitude = path.lowest + r * gain * (0.5 - gain * (0.125 - gain * 0.0625));
    let none = vec2<f32>(0.0);
    let full = vec2<f32>(1.0);
    let sum = clamp(ramps.xz * levels.xz + ramps.yw, none, full) + 4.0 * clamp(ramps.xz * altitude + ramps.yw, none, full)
        + clamp(ramps.xz * levels.yw + ramps.yw, none, full);
    return (t.z - t.y) + dot(t.yw - t.xz, sum) * 0.16666667;
}

/// Column [m] of a layer of two ramps along a path from altitude `h`.
///
/// internal
fn ramp_column(ground_radius: f32, top: f32, h: f32, path: TopPath, ramps: vec4<f32>) -> f32 {
    let r = ground_radius + path.lowest;
    let edges = vec4<f32>(-ramps.y, 1.0 - ramps.y, 1.0 - ramps.w, -ramps.w) / vec4<f32>(ramps.xx, ramps.zz);
    let levels = clamp(edges, vec4<f32>(path.lowest), vec4<f32>(max(top, path.lowest)));
    let gain = (levels - path.lowest) * (2.0 * ground_radius + levels + path.lowest);
    let t = gain / max(path.along + sqrt(path.along * path.along + gain), vec4<f32>(1e-20));
    return ramps_between(r, path, ramps, levels, t)
        + ramps_between(r, path, ramps, min(levels, vec4<f32>(h)), min(t, vec4<f32>(path.falls)));
}

/// Columns of four layers that are not exponential, and those of `others` for the others.
///
/// internal
fn ramp_columns(layers: FourLayers, ground_radius: f32, top: f32, h: f32, path: TopPath, others: vec4<f32>) -> vec4<f32> {
    let rise = max(layers.rise, vec4<f32>(1e-30));
    let sink = min(layers.sink, vec4<f32>(-1e-30));
    let columns = vec4<f32>(
        ramp_column(ground_radius, top, h, path, vec4<f32>(rise.x, layers.rise_offset.x, sink.x, layers.sink_offset.x)),
        ramp_column(ground_radius, top, h, path, vec4<f32>(rise.y, layers.rise_offset.y, sink.y, layers.sink_offset.y)),
        ramp_column(ground_radius, top, h, path, vec4<f32>(rise.z, layers.rise_offset.z, sink.z, layers.sink_offset.z)),
        ramp_column(ground_radius, top, h, path, vec4<f32>(rise.w, layers.rise_offset.w, sink.w, layers.sink_offset.w)),
    );
    return select(others, columns, layers.rise > vec4<f32>(0.0));
}

/// Puts the columns of lanes that are not exponential, which come first, in their places. Air with more than one of them needs AIR_EIGHT_LANES, so
/// that other air does not pay for more.
///
/// internal
fn with_ramps(air: Air, h: f32, path: TopPath, exponential: Lanes) -> Lanes {
    var lanes = exponential;
#ifdef AIR_EIGHT_LANES
    lanes.low = ramp_columns(air.low, air.ground_radius, air.top, h, path, lanes.low);
    lanes.high = ramp_columns(air.high, air.ground_radius, air.top, h, path, lanes.high);
#else
    let ramps = vec4<f32>(max(air.low.rise.x, 1e-30), air.low.rise_offset.x, min(air.low.sink.x, -1e-30), air.low.sink_offset.x);
    lanes.low.x = select(lanes.low.x, ramp_column(air.ground_radius, air.top, h, path, ramps), air.low.rise.x > 0.0);
#endif
    return lanes;
}

/// Columns of all lanes [m], as if they were exponential, over the distance `far` of a ray that does not fall.
///
/// internal
fn outward_columns(air: Air, h: f32, mu: f32, far: f32) -> Lanes {
    var sum = Lanes(vec4<f32>(0.0), vec4<f32>(0.0));
    for (var i = 0; i < COLUMN_STEPS; i++) {
        let node = squared_node(COLUMN_STEPS, i);
        let altitude = altitude_along(air.ground_radius, h, mu, far * node.x);
        sum.low += exp(air.low.fall * altitude) * (node.y * far);
#ifdef AIR_EIGHT_LANES
        sum.high += exp(air.high.fall * altitude) * (node.y * far);
#endif
    }
    return sum;
}

/// Columns of all lanes [m] to the top of the air, outwards from the lowest point of the path; those of lanes that are not used are its length.
///
/// internal
fn every_column(air: Air, h: f32, seen: f32) -> Lanes {
    let path = path_to_top(air.ground_radius, air.top, h, seen);
    let before = outward_columns(air, path.lowest, 0.0, path.falls);
    let beyond = outward_columns(air, path.lowest, max(seen, 0.0), path.rises);
    return with_ramps(air, h, path, Lanes(before.low + beyond.low, before.high + beyond.high));
}

/// Columns of all lanes [m] from altitude `h` along zenith cosine `mu` to the top of the air; below the horizon those along the horizon.
///
/// domain  h in [0, air.top] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1e7] m
/// error   3e-4 rel of reference::air_tables::columns_to_top
/// outside undefined
/// source  veduta::math::squared for exponential layers; between the bends of others Simpson's rule
fn columns_to_top(air: Air, h: f32, mu: f32) -> Lanes {
    let columns = every_column(air, h, max(mu, horizon_cosine(air.ground_radius, h)));
    let used = vec4<u32>(air.lane_count);
    let none = vec4<f32>(0.0);
    return Lanes(select(none, columns.low, vec4<u32>(0u, 1u, 2u, 3u) < used), select(none, columns.high, vec4<u32>(4u, 5u, 6u, 7u) < used));
}

/// The texel layers of the table for altitude `h` and zenith cosine `mu`.
///
/// domain  h in [0, air.top] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [1, 1e3] 1
/// error   1e-4 rel of reference::air_tables::column_code
/// outside undefined
/// source  ours
fn column_code(air: Air, h: f32, mu: f32) -> Lanes {
    let seen = max(mu, horizon_cosine(air.ground_radius, h));
    let path = path_to_top(air.ground_radius, air.top, h, seen);
    let columns = every_column(air, h, seen);
    let scale = column_scale(air, h, seen);
    let long = path.rises + path.falls;
    let floor = vec4<f32>(1e-30);
    // At the very top nothing lies before the sun, at the density of the top.
    let low = select(columns.low / max(scale.low * long, floor), vec4<f32>(1.0), (air.low.rise > vec4<f32>(0.0)) | vec4<bool>(long < 1e-3));
    let high = select(columns.high / max(scale.high * long, floor), vec4<f32>(1.0), (air.high.rise > vec4<f32>(0.0)) | vec4<bool>(long < 1e-3));
    return Lanes(inverseSqrt(clamp(low, vec4<f32>(1e-6), vec4<f32>(1.0))), inverseSqrt(clamp(high, vec4<f32>(1e-6), vec4<f32>(1.0))));
}

/// Place of coordinates in [0, 1] in a texture of `size` texels whose outermost texels' centres are 0 and 1.
///
/// domain  coordinates in [0, 1] 1 lin
/// domain  size in [2, 1024] 1 log
/// range   [0, 1] 1
/// error   2e-7 abs of reference::air_tables::texture_place
/// outside undefined
/// source  elementary
fn texture_place(coordinates: vec2<f32>, size: vec2<f32>) -> vec2<f32> {
    return (coordinates * (size - 1.0) + 0.5) / size;
}

/// Coordinates of the centre of a texel; the inverse of `texture_place`.
///
/// domain  texel in [0, 1024] 1 lin
/// domain  size in [2, 1024] 1 log
/// range   [0, 1024] 1
/// error   2e-7 rel of reference::air_tables::texel_coordinates
/// outside undefined
/// source  elementary
fn texel_coordinates(texel: vec2<f32>, size: vec2<f32>) -> vec2<f32> {
    return texel / (size - 1.0);
}

/// Optical depth from altitude `h` to the sun, whose zenith cosine is `mu` there, read from the table of columns; of a sun
/// below the horizon that along the horizon.
///
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1e4] 1
/// error   5e-3 rel of reference::air_tables::sun_depth
/// source  Afra2007 sec. 3
fn sun_depth(columns: texture_2d_array<f32>, linear: sampler, air: Air, h: f32, mu: f32) -> vec3<f32> {
    let seen = max(mu, horizon_cosine(air.ground_radius, h));
    let size = vec2<f32>(textureDimensions(columns));
    let place = texture_place(column_coordinates(air.ground_radius, air.top, h, seen), size);
    let path = path_to_top(air.ground_radius, air.top, h, seen);
    let long = path.rises + path.falls;
    var lanes = column_scale(air, h, seen);
    let low = max(textureSampleLevel(columns, linear, place, 0, 0.0), vec4<f32>(1.0));
    lanes.low *= long / (low * low);
#ifdef AIR_EIGHT_LANES
    let high = max(textureSampleLevel(columns, linear, place, 1, 0.0), vec4<f32>(1.0));
    lanes.high *= long / (high * high);
#endif
    return air_extinction(air, with_ramps(air, h, path, lanes));
}

/// Share of the sun's disc above the horizon, for the sun's zenith cosine `mu` at altitude `h`; a point sun is there or not.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// domain  angular_radius in [0, 0.1] rad lin
/// range   [0, 1] 1
/// error   0.05 abs of reference::air_tables::sun_above_horizon
/// source  area of a segment of the disc, by a cubic
fn sun_above_horizon(ground_radius: f32, h: f32, mu: f32, angular_radius: f32) -> f32 {
    let horizon = horizon_cosine(ground_radius, h);
    // Cosines differ by the angle times the sine, which is that of the horizon.
    let x = clamp(0.5 + (mu - horizon) / (2.0 * max(angular_radius, 1e-7) * sqrt(max(1.0 - horizon * horizon, 1e-6))), 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
}
