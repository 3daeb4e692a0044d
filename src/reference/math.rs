//! Small vectors, careful elementary functions and quadrature.

/// Dot product.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Sum.
pub fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Product with a number.
pub fn scale(a: [f64; 3], s: f64) -> [f64; 3] {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// Length.
pub fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// Unit vector; the zero vector stays.
pub fn normalize(a: [f64; 3]) -> [f64; 3] {
    let l = length(a);
    if l > 0.0 { scale(a, 1.0 / l) } else { a }
}

/// Linear interpolation, per component.
pub fn mix(a: [f64; 3], b: [f64; 3], s: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * s)
}

/// Cubic step from 0 at `edge0` to 1 at `edge1`.
pub fn smoothstep(edge0: f64, edge1: f64, x: f64) -> f64 {
    let s = ((x - edge0) / (edge1 - edge0)).clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}

/// (1 - exp(-x)) / x, with the limit 1 at 0.
pub fn one_minus_exp_over_x(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x }
}

/// 1 - exp(-x).
pub fn one_minus_exp(x: f64) -> f64 {
    -(-x).exp_m1()
}

/// Nodes and weights of the Gauss-Legendre rule with `n` points on [-1, 1], by Newton's method on the Legendre polynomial.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            let mut found = false;
            for _ in 0..100 {
                let (mut p0, mut p1) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
                }
                slope = n as f64 * (x * p1 - p0) / (x * x - 1.0);
                // The weight wants the slope at the root itself.
                if found {
                    break;
                }
                let step = p1 / slope;
                x -= step;
                found = step.abs() < 1e-15;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Lagrange's weights of values at 0, 1, 2 and 3 for the place `x`; of the two nearest where there are `few`.
pub fn cubic_weights(x: f64, few: bool) -> [f64; 4] {
    std::array::from_fn(|k| {
        let own = k as f64;
        if few {
            return (1.0 - (x - own).abs()).max(0.0);
        }
        (0..4)
            .filter(|j| *j != k)
            .map(|j| (x - j as f64) / (own - j as f64))
            .product()
    })
}
