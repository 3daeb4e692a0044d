//! Numerical integration of vector functions, with errors: composite Gauss-Legendre, and adaptive Gauss-Kronrod.

use super::math::gauss_legendre;

/// A Gauss-Legendre rule on [-1, 1]; exact for polynomials of degree up to twice its order less one.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// Node and weight of each point, from 1 down to -1; the weights sum to 2.
    pub points: Vec<(f64, f64)>,
}

impl Rule {
    /// The rule with `order` >= 1 points; nodes and weights to about 1e-15, checked up to order 64.
    pub fn new(order: usize) -> Self {
        Self {
            points: gauss_legendre(order),
        }
    }

    /// Integral of `f` from `a` to `b`, each of its components on its own; negated when `b` < `a`.
    pub fn integrate<const N: usize>(
        &self,
        mut f: impl FnMut(f64) -> [f64; N],
        a: f64,
        b: f64,
    ) -> [f64; N] {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let mut sum = [0.0; N];
        for &(x, w) in &self.points {
            let y = f(middle + half * x);
            for k in 0..N {
                sum[k] += w * half * y[k];
            }
        }
        sum
    }

    /// Integral of `f` from `a` to `b` over `panels` >= 1 equal panels. The error falls with the power of twice the
    /// order in the panel's width when `f` is smooth.
    pub fn composite<const N: usize>(
        &self,
        mut f: impl FnMut(f64) -> [f64; N],
        a: f64,
        b: f64,
        panels: usize,
    ) -> [f64; N] {
        let edge = |i: usize| a + (b - a) * i as f64 / panels as f64;
        let mut sum = [0.0; N];
        for i in 0..panels {
            let part = self.integrate(&mut f, edge(i), edge(i + 1));
            for k in 0..N {
                sum[k] += part[k];
            }
        }
        sum
    }
}

/// Node and weight on [0, 1] number `i` of a Gauss-Legendre rule, from the lowest.
fn gauss_point(order: usize, i: i32) -> [f64; 2] {
    let (x, w) = gauss_legendre(order)[order - 1 - i.clamp(0, order as i32 - 1) as usize];
    [0.5 + 0.5 * x, 0.5 * w]
}

/// Node and weight number `i` on [0, 1] of the Gauss-Legendre rule with four points.
pub fn gauss_four(i: i32) -> [f64; 2] {
    gauss_point(4, i)
}

/// Node and weight number `i` on [0, 1] of the Gauss-Legendre rule with five points.
pub fn gauss_five(i: i32) -> [f64; 2] {
    gauss_point(5, i)
}

/// Node and weight number `i` of the midpoint rule with `count` points after the change of variable t = (x^2 (3 - 2 x))^2; the
/// last weight makes their sum 1.
pub fn squared_node(count: i32, i: i32) -> [f64; 2] {
    let n = f64::from(count.max(1));
    let x = (f64::from(i) + 0.5) / n;
    let step = x * x * (3.0 - 2.0 * x);
    let slope = 2.0 * step * 6.0 * x * (1.0 - x);
    let surplus = if i == count - 1 { 0.5 / (n * n) } else { 0.0 };
    [step * step, slope / n - surplus]
}

/// A point of the pair of rules with 7 and 15 points that share their nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KronrodPoint {
    /// Place in [0, 1); the rules are symmetric about 0.
    pub node: f64,
    /// Weight in Kronrod's rule of 15 points, exact up to degree 23.
    pub kronrod: f64,
    /// Weight in Gauss's rule of 7 points, exact up to degree 13; 0 where it has no node.
    pub gauss: f64,
}

const fn point(node: f64, kronrod: f64, gauss: f64) -> KronrodPoint {
    KronrodPoint {
        node,
        kronrod,
        gauss,
    }
}

/// The half of the rules with nodes at 0 or above, the middle last. Piessens et al., QUADPACK (1983), to double precision.
pub const KRONROD: [KronrodPoint; 8] = [
    point(0.991_455_371_120_812_6, 0.022_935_322_010_529_22, 0.0),
    point(
        0.949_107_912_342_758_5,
        0.063_092_092_629_978_55,
        0.129_484_966_168_869_7,
    ),
    point(0.864_864_423_359_769_1, 0.104_790_010_322_250_18, 0.0),
    point(
        0.741_531_185_599_394_4,
        0.140_653_259_715_525_92,
        0.279_705_391_489_276_64,
    ),
    point(0.586_087_235_467_691_1, 0.169_004_726_639_267_9, 0.0),
    point(
        0.405_845_151_377_397_2,
        0.190_350_578_064_785_4,
        0.381_830_050_505_118_9,
    ),
    point(0.207_784_955_007_898_47, 0.204_432_940_075_298_9, 0.0),
    point(0.0, 0.209_482_141_084_727_83, 0.417_959_183_673_469_4),
];

/// When an adaptive integration may stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Error over the integral's magnitude, in every component.
    pub relative: f64,
    /// Error that is always small enough, in the integral's unit.
    pub absolute: f64,
    /// Panels at most; reaching them leaves `converged` false.
    pub panels: usize,
}

impl Tolerance {
    /// A relative tolerance alone, with at most 1000 panels.
    pub fn relative(relative: f64) -> Self {
        Self {
            relative,
            absolute: 0.0,
            panels: 1000,
        }
    }
}

/// An integral with its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<const N: usize> {
    /// The integral.
    pub value: [f64; N],
    /// Estimated absolute error of each component, rounding included.
    pub error: [f64; N],
    /// Values of the integrand taken.
    pub evaluations: usize,
    /// Whether the tolerance was met.
    pub converged: bool,
}

/// A panel with the integral over it and the error of that.
struct Panel<const N: usize> {
    a: f64,
    b: f64,
    value: [f64; N],
    error: [f64; N],
    /// The part of the error that halving cannot lower.
    rounding: [f64; N],
}

/// Both rules on one panel. Their difference is the error of the lower one; the error of the higher one is taken as
/// QUADPACK does, from the difference measured against the integrand's variation, to the power 3/2.
fn kronrod_panel<const N: usize>(f: &mut impl FnMut(f64) -> [f64; N], a: f64, b: f64) -> Panel<N> {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let mut samples = [([0.0; N], 0.0, 0.0); 15];
    for (i, p) in KRONROD.iter().enumerate() {
        samples[i] = (f(middle - half * p.node), p.kronrod, p.gauss);
        if i < 7 {
            samples[14 - i] = (f(middle + half * p.node), p.kronrod, p.gauss);
        }
    }
    let mut panel = Panel {
        a,
        b,
        value: [0.0; N],
        error: [0.0; N],
        rounding: [0.0; N],
    };
    for k in 0..N {
        let (mut high, mut low, mut size) = (0.0, 0.0, 0.0);
        for (y, kronrod, gauss) in &samples {
            high += kronrod * y[k];
            low += gauss * y[k];
            size += kronrod * y[k].abs();
        }
        let mean = 0.5 * high;
        let variation: f64 = samples
            .iter()
            .map(|(y, w, _)| w * (y[k] - mean).abs())
            .sum();
        let difference = (high - low).abs();
        let mut error = difference;
        if variation > 0.0 {
            error = variation * (200.0 * difference / variation).powf(1.5).min(1.0);
        }
        let rounding = 50.0 * f64::EPSILON * size;
        panel.value[k] = high * half;
        panel.error[k] = error.max(rounding) * half;
        panel.rounding[k] = rounding * half;
    }
    panel
}

/// Integral of `f` over all `intervals` (a, b), a <= b, by halving the panel whose error is the largest part of what is
/// allowed, until every component meets the tolerance. Give the places where `f` jumps or bends as ends of intervals.
pub fn integrate_kronrod<const N: usize>(
    mut f: impl FnMut(f64) -> [f64; N],
    intervals: &[(f64, f64)],
    tolerance: Tolerance,
) -> Estimate<N> {
    let mut panels: Vec<Panel<N>> = intervals
        .iter()
        .filter(|(a, b)| b > a)
        .map(|&(a, b)| kronrod_panel(&mut f, a, b))
        .collect();
    let mut evaluations = 15 * panels.len();
    loop {
        let mut result = Estimate {
            value: [0.0; N],
            error: [0.0; N],
            evaluations,
            converged: true,
        };
        for panel in &panels {
            for k in 0..N {
                result.value[k] += panel.value[k];
                result.error[k] += panel.error[k];
            }
        }
        let allowed: [f64; N] = std::array::from_fn(|k| {
            (tolerance.relative * result.value[k].abs()).max(tolerance.absolute)
        });
        result.converged = (0..N).all(|k| result.error[k] <= allowed[k]);
        if result.converged || panels.len() >= tolerance.panels {
            return result;
        }
        let share = |panel: &Panel<N>| {
            (0..N)
                .filter(|&k| result.error[k] > allowed[k] && panel.error[k] > panel.rounding[k])
                .map(|k| panel.error[k] / allowed[k].max(f64::MIN_POSITIVE))
                .fold(0.0, f64::max)
        };
        let worst = (0..panels.len())
            .filter(|&i| {
                let p = &panels[i];
                let middle = 0.5 * (p.a + p.b);
                share(p) > 0.0
                    && p.b - p.a > 1e-14 * p.a.abs().max(p.b.abs())
                    && middle > p.a
                    && middle < p.b
            })
            .max_by(|&i, &j| share(&panels[i]).total_cmp(&share(&panels[j])));
        let Some(worst) = worst else {
            return result;
        };
        let (a, b) = (panels[worst].a, panels[worst].b);
        let middle = 0.5 * (a + b);
        panels[worst] = kronrod_panel(&mut f, a, middle);
        panels.push(kronrod_panel(&mut f, middle, b));
        evaluations += 30;
    }
}
