//! Output encoding.

/// sRGB signal of a linear light (IEC 61966-2-1), per channel.
pub fn encode_srgb(linear: [f64; 3]) -> [f64; 3] {
    linear.map(|c| {
        let c = c.max(0.0);
        if c <= 0.0031308 {
            12.92 * c
        } else {
            1.055 * c.powf(1.0 / 2.4) - 0.055
        }
    })
}

/// Linear light of an sRGB signal (IEC 61966-2-1), per channel.
pub fn decode_srgb(encoded: [f64; 3]) -> [f64; 3] {
    encoded.map(|c| {
        let c = c.max(0.0);
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    })
}

/// Threshold of a pixel in Bayer's 8 x 8 matrix, built by his recursion M(2n) = [4M, 4M + 2; 4M + 3, 4M + 1].
pub fn bayer_8x8(pixel: [u32; 2]) -> f64 {
    fn rank(x: u32, y: u32, size: u32) -> u32 {
        if size == 1 {
            return 0;
        }
        let half = size / 2;
        let quadrant = [[0, 2], [3, 1]][(y / half % 2) as usize][(x / half % 2) as usize];
        4 * rank(x % half, y % half, half) + quadrant
    }
    (f64::from(rank(pixel[0] % 8, pixel[1] % 8, 8)) + 0.5) / 64.0
}

/// Multiples of 1 / p and 1 / p^2, with the plastic number p, without their whole part, folded at a half; rounded down to 24 bits.
pub fn blue_mask(pixel: [u32; 2]) -> f64 {
    let steps = [0.754_877_666_246_692_7_f64, 0.569_840_290_998_053_3];
    let turns = |k: usize| u64::from(pixel[k]) * (steps[k] * 2_f64.powi(32)).round() as u64;
    let share = ((turns(0) + turns(1)) % (1 << 32)) as f64;
    let top = 2_f64.powi(32);
    let folded = if share >= 0.5 * top {
        top - 1.0 - share
    } else {
        share
    };
    (folded / 128.0).floor() / 2_f64.powi(24)
}

/// A signal shifted by less than half an output step.
pub fn dither(encoded: [f64; 3], pixel: [u32; 2], levels: f64) -> [f64; 3] {
    encoded.map(|c| c + (bayer_8x8(pixel) - 0.5) / levels)
}

/// The value of a pixel that nothing shines through, for a target of encoded colour (0), linear colour (1) or radiance (2).
pub fn displayed(output: i32, radiance: [f64; 3], exposure: f64, pixel: [u32; 2]) -> [f64; 4] {
    let signal = dither(
        encode_srgb(super::tone_map::exponential(radiance, exposure)),
        pixel,
        255.0,
    );
    let [r, g, b] = match output {
        2 => radiance,
        1 => decode_srgb(signal),
        _ => signal,
    };
    [r, g, b, 1.0]
}

/// Weights of four neighbours in a row for a place `x` between the second and the third, by Keys's kernel with a = -1/2.
pub fn catmull_rom(x: f64) -> [f64; 4] {
    [x + 1.0, x, 1.0 - x, 2.0 - x].map(|d| {
        if d < 1.0 {
            (1.5 * d - 2.5) * d * d + 1.0
        } else if d < 2.0 {
            ((-0.5 * d + 2.5) * d - 4.0) * d + 2.0
        } else {
            0.0
        }
    })
}

/// How much a sample counts for a pixel whose middle is `x` pixels away.
pub fn pixel_share(x: f64) -> f64 {
    ((0.6 - x.abs()) / 0.2).clamp(0.0, 1.0)
}

/// Factor that brings a difference into a box of `bound` standard deviations a side.
pub fn box_share(difference: [f64; 3], deviation: [f64; 3], bound: f64) -> f64 {
    let most = (0..3)
        .map(|k| difference[k].abs() / (bound * deviation[k] + 1e-6))
        .fold(1.0, f64::max);
    1.0 / most
}
