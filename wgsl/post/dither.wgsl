//! Ordered dithering: hides the steps of a coarse output format without changing the mean.
//! source   Bayer1973; Roberts2018 The unreasonable effectiveness of quasirandom sequences
//! symbols  pixel integer coordinates · levels number of steps between 0 and 1 (255 for 8 bits) [1]
#define_import_path veduta::post::dither

/// Threshold of a pixel in Bayer's 8 x 8 matrix: each of (k + 0.5) / 64 once in every 8 x 8 block.
///
/// domain  pixel in [0, 16384] 1 lin
/// range   [0.0078125, 0.9921875] 1
/// error   0 abs of reference::post::bayer_8x8
/// source  Bayer1973; bits of x xor y and y interleaved in reverse
fn bayer_8x8(pixel: vec2<u32>) -> f32 {
    let a = pixel.x ^ pixel.y;
    let b = pixel.y;
    let rank = ((a & 1u) << 5u) | ((b & 1u) << 4u) | ((a & 2u) << 2u) | ((b & 2u) << 1u) | ((a & 4u) >> 1u) | ((b & 4u) >> 2u);
    return (f32(rank) + 0.5) / 64.0;
}

/// A number of a pixel that differs much from those of its neighbours and is even over any patch: with it what would be bands is noise without coarse grain.
///
/// domain  pixel in [0, 16384] 1 lin
/// range   [0, 1] 1
/// error   0 abs of reference::post::blue_mask
/// source  Roberts2018 (multiples of the inverse powers of the plastic number), folded so that it has no jump
fn blue_mask(pixel: vec2<u32>) -> f32 {
    let turns = pixel.x * 3242174889u + pixel.y * 2447445414u;
    let folded = select(turns, ~turns, turns >= 0x80000000u);
    return f32(folded >> 7u) / 16777216.0;
}

/// A signal shifted by less than half an output step, by the pixel's threshold; the output's rounding then dithers it.
///
/// domain  encoded in [0, 1] 1 lin
/// domain  pixel in [0, 16384] 1 lin
/// domain  levels in [1, 65535] 1 log
/// range   [-0.5, 1.5] 1
/// error   2e-7 abs of reference::post::dither
/// source  Bayer1973
fn dither(encoded: vec3<f32>, pixel: vec2<u32>, levels: f32) -> vec3<f32> {
    return encoded + (bayer_8x8(pixel) - 0.5) / max(levels, 1.0);
}
