//! Tone maps; those without matrices work on each channel.

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

/// x (1 + x / white^2) / (1 + x) with x = exposure color, at most 1.
pub fn reinhard_extended(color: [f64; 3], exposure: f64, white: f64) -> [f64; 3] {
    color.map(|c| {
        let x = (c * exposure).max(0.0);
        if x >= white {
            return 1.0;
        }
        x * (1.0 + x / (white * white)) / (1.0 + x)
    })
}

/// A matrix, row by row, times a vector.
fn times(matrix: [[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| (0..3).map(|k| row[k] * v[k]).sum())
}

/// The inverse, by cofactors.
fn inverse(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let minor = |i: usize, j: usize| {
        let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * minor(0, j)).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| minor(j, i) / determinant))
}

fn exposed(color: [f64; 3], exposure: f64) -> [f64; 3] {
    color.map(|c| (c * exposure).max(0.0))
}

/// Hill's fit to the ACES reference rendering and output transforms.
pub fn aces_hill(color: [f64; 3], exposure: f64) -> [f64; 3] {
    let rendering = times(
        [
            [0.59719, 0.35458, 0.04823],
            [0.07600, 0.90834, 0.01566],
            [0.02840, 0.13383, 0.83777],
        ],
        exposed(color, exposure),
    );
    let bent = rendering.map(|v| {
        (v * v + 0.0245786 * v - 0.000090537) / (0.983729 * v * v + 0.4329510 * v + 0.238081)
    });
    times(
        [
            [1.60475, -0.53108, -0.07367],
            [-0.10208, 1.10813, -0.00605],
            [-0.00327, -0.07276, 1.07602],
        ],
        bent,
    )
    .map(|v| v.clamp(0.0, 1.0))
}

/// Narkowicz's fit to the ACES reference rendering and output transforms.
pub fn aces_narkowicz(color: [f64; 3], exposure: f64) -> [f64; 3] {
    exposed(color, exposure).map(|x| {
        let y = (2.51 * x * x + 0.03 * x) / (2.43 * x * x + 0.59 * x + 0.14);
        y.min(1.0)
    })
}

/// AgX's sigmoid through (0, 0), (20/33, 1/2) and (1, 1), of slope 2 in the middle.
pub fn agx_sigmoid(x: f64) -> f64 {
    let middle = 10.0 / 16.5;
    // Toe and shoulder: power, and how far the end is from the middle.
    let (power, end) = if x < middle {
        (3.0, middle)
    } else {
        (3.25, 1.0 - middle)
    };
    let (slope, rise) = (2.0, 0.5);
    // The scale of the bend that brings the curve to the end: rise / scale is the bent slope end / scale.
    let scale = ((rise / (slope * end)).powf(-power) - 1.0).powf(-1.0 / power) * slope * end;
    let straight: f64 = slope * (x - middle) / scale;
    let bent = straight / (1.0 + straight.abs().powf(power)).powf(1.0 / power);
    0.5 + scale * bent
}

/// AgX's base look, as the light of a display with exponent 2.2.
pub fn agx(color: [f64; 3], exposure: f64) -> [f64; 3] {
    let draw = [
        [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
        [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
        [0.0423756549057051, 0.0784336, 0.879142973793104],
    ];
    let code = times(draw, exposed(color, exposure)).map(|v| {
        let stops = (v / 0.18).max(1e-300).log2();
        agx_sigmoid(((stops + 10.0) / 16.5).clamp(0.0, 1.0))
    });
    times(inverse(draw), code).map(|v| v.clamp(0.0, 1.0).powf(2.2))
}

/// Khronos' PBR neutral tone map.
pub fn neutral(color: [f64; 3], exposure: f64) -> [f64; 3] {
    let x = exposed(color, exposure);
    let least = x[0].min(x[1]).min(x[2]);
    let offset = if least < 0.08 {
        least - 6.25 * least * least
    } else {
        0.04
    };
    let base = x.map(|c| c - offset);
    let peak = base[0].max(base[1]).max(base[2]);
    let start = 0.8 - 0.04;
    if peak < start {
        return base;
    }
    let room = 1.0 - start;
    let compressed = 1.0 - room * room / (peak + room - start);
    let white = 1.0 - 1.0 / (0.15 * (peak - compressed) + 1.0);
    base.map(|c| c * compressed / peak * (1.0 - white) + compressed * white)
}
