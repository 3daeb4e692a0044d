//! What a texel of a layer's tile holds: two numbers of 8 bits, or of 16.
//! source   ours
//! symbols  least density that 0 stands for [1]
#define_import_path veduta::clouds::code

/// Numbers in [-1, 1] that stand for a density before its cut, from `least` to 1, and an optical depth. Between -1 and 1 the code of a depth runs as 2 depth / (2 + depth) - 1,
/// so that small ones are told apart by 0.008 and depths of 500 and more are one.
///
/// internal
fn tile_code(density: f32, depth: f32, least: f32) -> vec2<f32> {
    let code = vec2<f32>((density - least) / (1.0 - least), depth / (2.0 + depth));
    return clamp(2.0 * code - 1.0, vec2<f32>(-1.0), vec2<f32>(1.0, 0.992126));
}

/// Density and optical depth of a code, or of what lies between codes; of numbers of 16 bits, which are told by a `least` of 1, what they are.
///
/// internal
fn tile_value(code: vec2<f32>, least: f32) -> vec2<f32> {
    return select(vec2<f32>(mix(least, 1.0, 0.5 * code.x + 0.5), 2.0 * (1.0 + code.y) / (1.0 - code.y)), code, least == 1.0);
}
