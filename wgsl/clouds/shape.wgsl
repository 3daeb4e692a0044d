//! A layer of clouds with forms: weather over the land, kinds with profiles over the height, heaps of billows, frayed by finer ones. It repeats as the layer does.
//! source   Schneider2015 (weather, profiles, a base of gradient noise and billows, erosion by finer billows); formulas: ours
//! symbols  relative position relative to the eye [m] · altitude [m] · turn place on the torus, 2^32 a turn · kind 0 stratus, 1/2 cumulus, 1 cumulonimbus
#define_import_path veduta::clouds::shape

#import veduta::noise::worley::{cell_point_3d}
#import veduta::noise::gradient::{gradient_noise_2d_periodic, gradient_noise_3d_periodic}
#import veduta::noise::lattice::{turn_3d, octave_seed}
#import veduta::clouds::field::{CloudLayer}

/// What forms the clouds of a layer.
struct CloudShape {
    /// Kind of the clouds where the weather leaves it, in [0, 1].
    kind: f32,
    /// What the weather adds to the kind at most, about.
    kind_spread: f32,
    /// What the weather adds to the coverage at most, about.
    coverage_spread: f32,
    /// How far finer billows fray the edges, in [0, 1].
    detail: f32,
    /// Density over what the noise exceeds its threshold by, in [1, 32].
    sharpness: f32,
    /// The weather has 2 to this power cells over the period, in [1, 12].
    weather_doublings: u32,
}

/// Squared distance from a position in a cell to the point of the cell at an offset of 0 or 1 from the lowest; points keep to the middle half of cells.
///
/// internal
fn billow_distance(low: vec3<u32>, frac: vec3<f32>, offset: vec3<u32>, mask: u32, seed: u32) -> f32 {
    let point = cell_point_3d(bitcast<vec3<i32>>((low + offset) & vec3<u32>(mask)), seed);
    let d = frac - vec3<f32>(offset) - (0.25 + 0.5 * point);
    return dot(d, d);
}

/// Billows on a torus of 2^bits cells: 1 at scattered points, one a cell, falling evenly to 0 at three quarters of a cell from them.
///
/// domain  turn in [0, 4294967295] turn/2^32 lin
/// domain  bits in [1, 16] 1 lin
/// domain  seed in [0, 4294967295] 1 lin
/// range   [0, 1] 1
/// error   2e-6 abs of reference::clouds::billows
/// source  Worley1996 F1 of points in the middle half of cells, which eight cells hold
fn billows(turn: vec3<u32>, bits: u32, seed: u32) -> f32 {
    let cell = turn >> vec3<u32>(32u - bits);
    let frac = vec3<f32>((turn << vec3<u32>(bits)) >> vec3<u32>(8u)) * 5.9604645e-8;
    let far = frac >= vec3<f32>(0.5);
    // The lowest of the eight cells about the position, and where that lies from it.
    let low = cell - select(vec3<u32>(1u), vec3<u32>(0u), far);
    let p = frac + select(vec3<f32>(1.0), vec3<f32>(0.0), far);
    let mask = (1u << bits) - 1u;
    let a = min(billow_distance(low, p, vec3<u32>(0u, 0u, 0u), mask, seed), billow_distance(low, p, vec3<u32>(1u, 0u, 0u), mask, seed));
    let b = min(billow_distance(low, p, vec3<u32>(0u, 1u, 0u), mask, seed), billow_distance(low, p, vec3<u32>(1u, 1u, 0u), mask, seed));
    let c = min(billow_distance(low, p, vec3<u32>(0u, 0u, 1u), mask, seed), billow_distance(low, p, vec3<u32>(1u, 0u, 1u), mask, seed));
    let d = min(billow_distance(low, p, vec3<u32>(0u, 1u, 1u), mask, seed), billow_distance(low, p, vec3<u32>(1u, 1u, 1u), mask, seed));
    return 1.0 - min(sqrt(min(min(a, b), min(c, d))) * 1.3333334, 1.0);
}

/// Gradient noise over the land on a torus.
///
/// internal
fn torus_gradient_2d(turn: vec2<u32>, bits: u32, seed: u32) -> f32 {
    let cell = bitcast<vec2<i32>>(turn >> vec2<u32>(32u - bits));
    let frac = vec2<f32>((turn << vec2<u32>(bits)) >> vec2<u32>(8u)) * 5.9604645e-8;
    return gradient_noise_2d_periodic(cell, frac, vec2<i32>(i32(1u << bits)), seed);
}

/// Gradient noise on a torus.
///
/// internal
fn torus_gradient_3d(turn: vec3<u32>, bits: u32, seed: u32) -> f32 {
    let cell = bitcast<vec3<i32>>(turn >> vec3<u32>(32u - bits));
    let frac = vec3<f32>((turn << vec3<u32>(bits)) >> vec3<u32>(8u)) * 5.9604645e-8;
    return gradient_noise_3d_periodic(cell, frac, vec3<i32>(i32(1u << bits)), seed);
}

/// The smooth step from 0 at 0 to 1 at 1.
///
/// internal
fn smooth_rise(x: f32) -> f32 {
    let t = clamp(x, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

/// How much cloud a kind has at a share `height` of the layer: stratus lies low and flat, cumulus is domed, cumulonimbus fills the layer.
///
/// domain  kind in [0, 1] 1 lin
/// domain  height in [0, 1] 1 lin
/// range   [0, 1] 1
/// error   3e-6 abs of reference::clouds::kind_profile
/// source  Schneider2015; formula: ours
fn kind_profile(kind: f32, height: f32) -> f32 {
    let wane = 0.08 + kind * (0.34 + 0.3 * kind);
    let end = 0.22 + kind * (0.8 - 0.02 * kind);
    return smooth_rise(height / (0.05 + 0.05 * kind)) * (1.0 - smooth_rise((height - wane) / (end - wane)));
}

/// Density before its cut of a layer with forms at a place on its torus, where coverage and kind are these.
///
/// internal
fn formed_density(layer: CloudLayer, shape: CloudShape, turn: vec3<u32>, altitude: f32, cover: f32, kind: f32) -> f32 {
    let bits = layer.period_doublings;
    let height = clamp((altitude - layer.bottom) / max(layer.thickness, 1e-3), 0.0, 1.0);
    let heap = 0.6 * billows(turn, bits, octave_seed(layer.seed, 1)) + 0.28 * billows(turn, bits + 1u, octave_seed(layer.seed, 2))
        + 0.12 * billows(turn, bits + 2u, octave_seed(layer.seed, 3));
    let swell = torus_gradient_3d(turn, bits, octave_seed(layer.seed, 4)) + 0.5 * torus_gradient_3d(turn, bits + 1u, octave_seed(layer.seed, 5));
    let base = mix(clamp(0.175 + 0.21 * swell + 0.8125 * heap, 0.0, 1.0), 1.0, layer.uniformity);
    let whole = shape.sharpness * (base + cover * kind_profile(kind, height) - 1.0);
    let fine = 0.65 * billows(turn, bits + 3u, octave_seed(layer.seed, 6)) + 0.35 * billows(turn, bits + 4u, octave_seed(layer.seed, 7));
    // Wisps below, heads above.
    let frayed = mix(fine, 1.0 - fine, clamp(8.0 * height, 0.0, 1.0));
    return whole - 0.35 * shape.detail * shape.sharpness * frayed * (1.0 - clamp(whole, 0.0, 1.0));
}

/// Coverage and kind of a map that lies over the torus, linear between the middles of its texels.
///
/// domain  turn in [0, 4294967295] turn/2^32 lin
/// range   [0, 1] 1
/// error   2e-5 abs of reference::clouds::map_weather
/// source  bilinear, with 16 bits of a texel
fn map_weather(map: texture_2d<f32>, turn: vec2<u32>) -> vec2<f32> {
    let size = textureDimensions(map);
    // In texels, 16 bits behind the point; a map farther on, so that half a texel less is above 0.
    let wide = (turn >> vec2<u32>(16u)) * size + (((turn & vec2<u32>(65535u)) * size) >> vec2<u32>(16u));
    let at = wide + (size << vec2<u32>(16u)) - 32768u;
    let cell = at >> vec2<u32>(16u);
    let low = select(cell, cell - size, cell >= size);
    let next = select(low + 1u, vec2<u32>(0u), low + 1u == size);
    let part = vec2<f32>(at & vec2<u32>(65535u)) * 1.5258789e-5;
    let north = mix(textureLoad(map, low, 0).xy, textureLoad(map, vec2<u32>(next.x, low.y), 0).xy, part.x);
    let south = mix(textureLoad(map, vec2<u32>(low.x, next.y), 0).xy, textureLoad(map, next, 0).xy, part.x);
    return clamp(mix(north, south, part.y), vec2<f32>(0.0), vec2<f32>(1.0));
}

/// As `shaped_density`, where a map tells the weather: its coverage times that of the layer, its kind times that of the shape. It lies `repeats` times along the period.
///
/// domain  repeats in [1, 4096] 1 lin
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [4000, 5500] m lin
/// range   [-1e2, 3.3e1] 1
/// error   2e-3 abs of reference::clouds::mapped_density
/// outside undefined
/// source  Schneider2015; formulas: ours
fn mapped_density(map: texture_2d<f32>, layer: CloudLayer, shape: CloudShape, repeats: u32, relative: vec3<f32>, altitude: f32) -> f32 {
    let turn = layer.turn + turn_3d(vec3<f32>(relative.x, altitude, relative.z) * layer.turns_per_metre);
    let weather = map_weather(map, turn.xz * repeats);
    return formed_density(layer, shape, turn, altitude, layer.coverage * weather.x, shape.kind * weather.y);
}

/// Density before its cut of a layer with forms, as `uncut_density` gives that of value noise; not cut at the layer's spheres either.
///
/// domain  relative in [-1e5, 1e5] m lin
/// domain  altitude in [4000, 5500] m lin
/// range   [-1e2, 3.3e1] 1
/// error   2e-3 abs of reference::clouds::shaped_density
/// outside undefined
/// source  Schneider2015; formulas: ours
fn shaped_density(layer: CloudLayer, shape: CloudShape, relative: vec3<f32>, altitude: f32) -> f32 {
    let turn = layer.turn + turn_3d(vec3<f32>(relative.x, altitude, relative.z) * layer.turns_per_metre);
    let wide = shape.weather_doublings;
    let fronts = torus_gradient_2d(turn.xz, wide, octave_seed(layer.seed, 8)) + 0.5 * torus_gradient_2d(turn.xz, wide + 1u, octave_seed(layer.seed, 9));
    let cover = clamp(layer.coverage + shape.coverage_spread * fronts, 0.0, 1.0);
    let kind = clamp(shape.kind + shape.kind_spread * torus_gradient_2d(turn.xz, wide, octave_seed(layer.seed, 10)), 0.0, 1.0);
    return formed_density(layer, shape, turn, altitude, cover, kind);
}
