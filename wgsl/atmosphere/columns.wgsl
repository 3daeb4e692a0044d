//! The table of columns: what lies between a place in the air and the sun, layer by layer and without a wavelength.
//! source   Afra2007 sec. 3 (height by zenith angle); lengths relative to the density at the lowest point, and the exact split at the horizon: ours
//! symbols  h altitude [m] · mu zenith cosine · x, y coordinates in [0, 1] · lane a layer of the air
//!
//! A texel of the table holds, for up to four lanes (further lanes in a second array layer), the column [m] from altitude h along zenith cosine mu
//! to the top of the air, over the lane's density at the lowest point of that path and over the thickness of the air. Lanes that are not
//! exponential are not divided by a density. Paths end at the top; the table has none that meet the ground.
#define_import_path veduta::atmosphere::columns

#import veduta::atmosphere::medium::{Air, Lanes, air_densities, air_extinction}
#import veduta::planet::shell::{altitude_along, top_distance}
#import veduta::math::squared::{squared_node}

/// Zenith cosine of the horizon of the ground sphere, seen from altitude `h`.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  h in [0, 1e6] m lin
/// range   [-1, 0] 1
/// error   2e-7 abs of reference::air_tables::horizon_cosine
/// source  elementary
fn horizon_cosine(ground_radius: f32, h: f32) -> f32 {
    let above = max(h, 0.0);
    return -sqrt(above * (2.0 * ground_radius + above)) / (ground_radius + above);
}

/// Coordinates in the table of columns of altitude `h` and zenith cosine `mu`; below the horizon those of the horizon.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  h in [0, 5e4] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1] 1
/// error   4e-4 abs of reference::air_tables::column_coordinates
/// source  roots that are dense at the horizon and at the ground: ours
fn column_coordinates(ground_radius: f32, top: f32, h: f32, mu: f32) -> vec2<f32> {
    let horizon = horizon_cosine(ground_radius, h);
    let x = sqrt(clamp((mu - horizon) / (1.0 - horizon), 0.0, 1.0));
    return vec2<f32>(x, sqrt(clamp(h / top, 0.0, 1.0)));
}

/// Altitude [m] and zenith cosine of coordinates in the table of columns: the inverse of `column_coordinates`.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  place in [0, 1] 1 lin
/// range   [-1, 2e5] 1
/// error   3e-7 rel of reference::air_tables::column_place
/// source  as column_coordinates
fn column_place(ground_radius: f32, top: f32, place: vec2<f32>) -> vec2<f32> {
    let h = top * place.y * place.y;
    let horizon = horizon_cosine(ground_radius, h);
    return vec2<f32>(h, horizon + (1.0 - horizon) * place.x * place.x);
}

/// What the columns of the table are relative to: densities at the lowest point of the path from altitude `h` along zenith
/// cosine `mu` for exponential lanes, 1 for others.
///
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1] 1
/// error   2e-4 abs of reference::air_tables::column_scale
/// source  ours
fn column_scale(air: Air, h: f32, mu: f32) -> Lanes {
    let below = (air.ground_radius + h) * mu * mu / (1.0 + sqrt(max((1.0 - mu) * (1.0 + mu), 0.0)));
    let lowest = max(select(h, h - below, mu < 0.0), 0.0);
    var scale = Lanes(exp(air.low.fall * lowest), vec4<f32>(1.0));
#ifdef AIR_EIGHT_LANES
    scale.high = exp(air.high.fall * lowest);
#endif
    return scale;
}

/// Columns of all lanes [m] from altitude `h` along zenith cosine `mu` to the top of the air, by a quadrature
/// that is dense at the lowest point; the ground does not end the path.
///
/// domain  h in [0, 1e5] m lin
/// domain  mu in [0, 1] 1 lin
/// range   [0, 1e7] m
/// error   1e-3 rel of reference::air_tables::columns_to_top
/// source  veduta::math::squared
fn columns_to_top(air: Air, h: f32, mu: f32) -> Lanes {
    let end = top_distance(air.ground_radius, air.top, h, mu);
    let lowest = clamp(-(air.ground_radius + h) * mu, 0.0, end);
    var sum = Lanes(vec4<f32>(0.0), vec4<f32>(0.0));
    for (var i = 0; i < 32; i++) {
        let node = squared_node(32, i);
        let share = node.x;
        let weight = node.y;
        let beyond = air_densities(air, altitude_along(air.ground_radius, h, mu, lowest + (end - lowest) * share));
        sum.low += beyond.low * (weight * (end - lowest));
        sum.high += beyond.high * (weight * (end - lowest));
        if lowest > 0.0 {
            let before = air_densities(air, altitude_along(air.ground_radius, h, mu, lowest - lowest * share));
            sum.low += before.low * (weight * lowest);
            sum.high += before.high * (weight * lowest);
        }
    }
    return sum;
}

/// Place of coordinates in [0, 1] in a texture of `size` texels whose outermost texels' centres are 0 and 1.
///
/// domain  coordinates in [0, 1] 1 lin
/// domain  size in [2, 1024] 1 log
/// range   [0, 1] 1
/// error   2e-7 abs of reference::air_tables::texture_place
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
    var lanes = column_scale(air, h, seen);
    lanes.low *= textureSampleLevel(columns, linear, place, 0, 0.0) * air.top;
#ifdef AIR_EIGHT_LANES
    lanes.high *= textureSampleLevel(columns, linear, place, 1, 0.0) * air.top;
#endif
    return air_extinction(air, lanes);
}

/// Share of the sun's disc above the horizon, for the sun's zenith cosine `mu` at altitude `h`; a point sun is there or not.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  h in [0, 1e5] m lin
/// domain  mu in [-1, 1] 1 lin
/// domain  angular_radius in [1e-3, 0.1] rad log
/// range   [0, 1] 1
/// error   0.02 abs of reference::air_tables::sun_above_horizon
/// source  area of a segment of the disc, by a cubic
fn sun_above_horizon(ground_radius: f32, h: f32, mu: f32, angular_radius: f32) -> f32 {
    let horizon = horizon_cosine(ground_radius, h);
    // Cosines differ by the angle times the sine, which is that of the horizon.
    let x = clamp(0.5 + (mu - horizon) / (2.0 * max(angular_radius, 1e-7) * sqrt(max(1.0 - horizon * horizon, 1e-6))), 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
}
