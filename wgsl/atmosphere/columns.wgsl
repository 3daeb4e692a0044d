//! The table of columns: what lies between a place in the air and the sun, layer by layer and without a wavelength.
//! source   Afra2007 sec. 3 (height by zenith angle); lengths relative to the density at the lowest point, and the exact split at the horizon: ours
//! symbols  h altitude [m] · mu zenith cosine · x, y coordinates in [0, 1] · lane a layer of the air
//!
//! A texel of the table holds, for up to four lanes (further lanes in a second array layer), the column [m] from altitude h along zenith cosine mu
//! to the top of the air, over the lane's density at the lowest point of that path and over the thickness of the air. Lanes that are not
//! exponential are not divided by a density. Paths end at the top; the table has none that meet the ground.
#define_import_path veduta::atmosphere::columns

#import veduta::atmosphere::medium::{Air, FourLayers, Lanes, air_extinction}
#import veduta::planet::shell::{altitude_along, top_distance}
#import veduta::math::gauss::{gauss_four}
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

/// Coordinates in the table of columns of altitude `h` and zenith cosine `mu`; below the horizon those of the horizon.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  top in [5e4, 2e5] m lin
/// domain  h in [0, top] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1] 1
/// error   4e-4 abs of reference::air_tables::column_coordinates
/// source  roots that are dense at the horizon and at the ground: ours
fn column_coordinates(ground_radius: f32, top: f32, h: f32, mu: f32) -> vec2<f32> {
    let horizon = horizon_cosine(ground_radius, h);
    let x = sqrt(clamp((mu - horizon) / (1.0 - horizon), 0.0, 1.0));
    return vec2<f32>(x, sqrt(clamp(h / top, 0.0, 1.0)));
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
    let horizon = horizon_cosine(ground_radius, h);
    return vec2<f32>(h, horizon + (1.0 - horizon) * place.x * place.x);
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
    let below = (air.ground_radius + h) * mu * mu / (1.0 + sqrt(max((1.0 - mu) * (1.0 + mu), 0.0)));
    let lowest = max(select(h, h - below, mu < 0.0), 0.0);
    var scale = Lanes(exp(air.low.fall * lowest), vec4<f32>(1.0));
#ifdef AIR_EIGHT_LANES
    scale.high = exp(air.high.fall * lowest);
#endif
    return scale;
}

/// Columns of four layers that are not exponential, over the distance `far` of a ray that does not fall; 0 for others. Between the altitudes
/// where densities bend they are smooth along the ray.
///
/// internal
fn ramp_columns(layers: FourLayers, ground_radius: f32, h: f32, mu: f32, far: f32) -> vec4<f32> {
    let rise = max(layers.rise, vec4<f32>(1e-30));
    let sink = max(-layers.sink, vec4<f32>(1e-30));
    var edges = array<vec4<f32>, 4>(
        -layers.rise_offset / rise,
        (1.0 - layers.rise_offset) / rise,
        (layers.sink_offset - 1.0) / sink,
        layers.sink_offset / sink,
    );
    let along = (ground_radius + h) * mu;
    for (var i = 0; i < 4; i++) {
        let level = min(edges[i], vec4<f32>(1e9));
        let gain = max(level - h, vec4<f32>(0.0)) * (2.0 * ground_radius + level + h);
        edges[i] = min(gain / max(sqrt(along * along + gain) + along, vec4<f32>(1e-20)), vec4<f32>(far));
    }
    var sum = max(edges[2] - edges[1], vec4<f32>(0.0));
    for (var side = 0; side < 2; side++) {
        let from_edge = edges[2 * side];
        let long = edges[2 * side + 1] - from_edge;
        for (var i = 0; i < 4; i++) {
            let node = gauss_four(i);
            let t = from_edge + long * node.x;
            let gain = t * (t + 2.0 * along);
            let r = ground_radius + h;
            let altitude = h + gain / (r + sqrt(r * r + gain));
            let ramps = min(layers.rise * altitude + layers.rise_offset, layers.sink * altitude + layers.sink_offset);
            sum += clamp(ramps, vec4<f32>(0.0), vec4<f32>(1.0)) * (long * node.y);
        }
    }
    return select(vec4<f32>(0.0), sum, layers.rise > vec4<f32>(0.0));
}

/// Columns of all lanes [m] over the distance `far` of a ray that does not fall.
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
    let none = vec4<f32>(0.0);
    sum.low = select(ramp_columns(air.low, air.ground_radius, h, mu, far), sum.low, air.low.fall < none);
#ifdef AIR_EIGHT_LANES
    sum.high = select(ramp_columns(air.high, air.ground_radius, h, mu, far), sum.high, air.high.fall < none);
#endif
    return sum;
}

/// Columns of all lanes [m] from altitude `h` along zenith cosine `mu` to the top of the air, outwards from the lowest point; below the horizon those
/// along the horizon.
///
/// domain  h in [0, air.top] m lin
/// domain  mu in [-1, 1] 1 lin
/// range   [0, 1e7] m
/// error   3e-4 rel of reference::air_tables::columns_to_top
/// outside undefined
/// source  veduta::math::squared for exponential layers; between the bends of others Abramowitz1964 table 25.4
fn columns_to_top(air: Air, h: f32, mu: f32) -> Lanes {
    let seen = max(mu, horizon_cosine(air.ground_radius, h));
    if seen >= 0.0 {
        return outward_columns(air, h, seen, top_distance(air.ground_radius, air.top, h, seen));
    }
    let below = (air.ground_radius + h) * seen * seen / (1.0 + sqrt((1.0 - seen) * (1.0 + seen)));
    let lowest = max(h - below, 0.0);
    let before = outward_columns(air, lowest, 0.0, -(air.ground_radius + h) * seen);
    let beyond = outward_columns(air, lowest, 0.0, top_distance(air.ground_radius, air.top, lowest, 0.0));
    return Lanes(before.low + beyond.low, before.high + beyond.high);
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
