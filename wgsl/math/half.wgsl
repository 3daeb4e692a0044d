//! Numbers of 16 bits, two to a word, without the capability that the builtins want.
//! source   IEEE 754 binary16
//! symbols  x a number [1]
#define_import_path veduta::math::half

/// The bits of a number from -65,000 to 65,000 as a 16-bit float, rounded; what is within 6e-5 of 0 may become 0.
///
/// internal
fn half_bits(x: f32) -> u32 {
    return ((bitcast<u32>(abs(x) * 1.92592994e-34) + 0x1000u) >> 13u) | select(0u, 0x8000u, x < 0.0);
}

/// The word of two such numbers, the first in its lower half.
///
/// internal
fn half_word(pair: vec2<f32>) -> u32 {
    return half_bits(pair.x) | (half_bits(pair.y) << 16u);
}

/// The numbers of such a word.
///
/// internal
fn word_halves(word: u32) -> vec2<f32> {
    let bits = vec2<u32>(word & 0xffffu, word >> 16u);
    let size = bitcast<vec2<f32>>((bits & vec2<u32>(0x7fffu)) << vec2<u32>(13u)) * 5.192297e33;
    return select(size, -size, bits >= vec2<u32>(0x8000u));
}
