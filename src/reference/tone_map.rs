//! Tone maps, per channel.

/// 1 - exp(-exposure color).
pub fn exponential(color: [f64; 3], exposure: f64) -> [f64; 3] {
    color.map(|c| super::math::one_minus_exp((c * exposure).max(0.0)))
}

/// x / (1 + x) with x = exposure color.
pub fn reinhard(color: [f64; 3], exposure: f64) -> [f64; 3] {
    color.map(|c| {
        let x = (c * exposure).max(0.0);
        x / (1.0 + x)
    })
}
