//! Comparing a module function on the device with its f64 twin on many random points.

use crate::common::{Random, evaluator};

/// The true values of one row.
#[derive(Clone, Copy, Default)]
pub struct Truth {
    /// The twin's components.
    pub value: [f64; 4],
    /// The largest error allowed of each component.
    pub bar: [f64; 4],
    /// The row lies so near to a kink that its gradient is not determined; only component 0 is compared.
    pub kink: bool,
}

/// What a comparison found.
#[derive(Clone, Copy, Default, Debug)]
pub struct Summary {
    /// Rows compared.
    pub rows: usize,
    /// Rows at a kink.
    pub kinks: usize,
    /// Components that are NaN or infinite.
    pub not_finite: usize,
    /// The largest error of component 0.
    pub value_error: f64,
    /// The largest error of the other components.
    pub slope_error: f64,
    /// The largest error of component 0 as a share of its bar.
    pub value_share: f64,
    /// The largest error of the other components as a share of their bar.
    pub slope_share: f64,
    /// The smallest value of component 0 on the device.
    pub low: f64,
    /// The largest value of component 0 on the device.
    pub high: f64,
}

impl Summary {
    fn merge(self, other: Summary) -> Summary {
        Summary {
            rows: self.rows + other.rows,
            kinks: self.kinks + other.kinks,
            not_finite: self.not_finite + other.not_finite,
            value_error: self.value_error.max(other.value_error),
            slope_error: self.slope_error.max(other.slope_error),
            value_share: self.value_share.max(other.value_share),
            slope_share: self.slope_share.max(other.slope_share),
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn of_rows(
        rows: &[u32],
        columns: usize,
        results: &[u32],
        width: usize,
        twin: &(impl Fn(&[u32]) -> Truth + Sync),
    ) -> Summary {
        let mut s = Summary {
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            ..Default::default()
        };
        for (row, result) in rows.chunks_exact(columns).zip(results.chunks_exact(width)) {
            let truth = twin(row);
            s.rows += 1;
            s.kinks += usize::from(truth.kink);
            for (k, &bits) in result.iter().enumerate() {
                let value = f64::from(f32::from_bits(bits));
                if !value.is_finite() {
                    s.not_finite += 1;
                    continue;
                }
                let error = (value - truth.value[k]).abs();
                if k == 0 {
                    s.value_error = s.value_error.max(error);
                    s.value_share = s.value_share.max(error / truth.bar[0]);
                    s.low = s.low.min(value);
                    s.high = s.high.max(value);
                } else if !truth.kink {
                    s.slope_error = s.slope_error.max(error);
                    s.slope_share = s.slope_share.max(error / truth.bar[k]);
                }
            }
        }
        s
    }
}

/// Rows in one pass over the device.
const PASS: usize = 1 << 20;

/// The points that a function is compared on.
pub const POINTS: usize = 10_000_000;

/// The expected cost of a twin decides nothing here: every pass runs on the device, then on the processor's threads.
pub fn compare(
    function: &str,
    arguments: &str,
    columns: usize,
    points: usize,
    fill: impl Fn(&mut Random, &mut [u32]) + Sync,
    twin: impl Fn(&[u32]) -> Truth + Sync,
) -> Summary {
    let name = function.rsplit("::").next().unwrap();
    let device = evaluator(&[function], "", &format!("{name}({arguments})"), columns);
    let width = device.width();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut total = Summary {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
        ..Default::default()
    };
    let mut random = Random(function.bytes().map(u64::from).sum());
    let mut left = points;
    while left > 0 {
        let count = left.min(PASS);
        left -= count;
        let mut rows = vec![0_u32; count * columns];
        for row in rows.chunks_exact_mut(columns) {
            fill(&mut random, row);
        }
        let results = device.run_bits(&rows).unwrap();
        let part = count.div_ceil(threads);
        let found: Vec<Summary> = std::thread::scope(|scope| {
            let workers: Vec<_> = rows
                .chunks(part * columns)
                .zip(results.chunks(part * width))
                .map(|(rows, results)| {
                    let twin = &twin;
                    scope.spawn(move || Summary::of_rows(rows, columns, results, width, twin))
                })
                .collect();
            workers.into_iter().map(|w| w.join().unwrap()).collect()
        });
        total = found.into_iter().fold(total, Summary::merge);
    }
    total
}

/// The number in the `error` line of a function's header.
pub fn header_error(function: &str) -> f64 {
    let mut parts: Vec<&str> = function.split("::").collect();
    let name = parts.pop().unwrap();
    let file = format!(
        "{}/wgsl/{}.wgsl",
        env!("CARGO_MANIFEST_DIR"),
        parts[1..].join("/")
    );
    let text = std::fs::read_to_string(&file).unwrap();
    let at = text
        .find(&format!("\nfn {name}("))
        .unwrap_or_else(|| panic!("{file} has no function {name}"));
    let line = text[..at]
        .lines()
        .rev()
        .take_while(|line| line.starts_with("///"))
        .find(|line| line.starts_with("/// error "))
        .unwrap_or_else(|| panic!("{name} states no error"));
    line.split_whitespace().nth(2).unwrap().parse().unwrap()
}

/// [`compare`], printed, and held against the bars, the header and the need that every result is finite.
pub fn check(
    function: &str,
    arguments: &str,
    columns: usize,
    points: usize,
    fill: impl Fn(&mut Random, &mut [u32]) + Sync,
    twin: impl Fn(&[u32]) -> Truth + Sync,
) -> Summary {
    let start = std::time::Instant::now();
    let s = compare(function, arguments, columns, points, fill, twin);
    let stated = header_error(function);
    println!(
        "{function}: {} points, error {:.2e} ({:.0} % of the bar), of the gradient {:.2e} ({:.0} %), header {stated:.1e}; \
         {} at kinks; values {:.6} to {:.6}; {:.1} s",
        s.rows,
        s.value_error,
        100.0 * s.value_share,
        s.slope_error,
        100.0 * s.slope_share,
        s.kinks,
        s.low,
        s.high,
        start.elapsed().as_secs_f64()
    );
    assert_eq!(s.rows, points, "{function}");
    assert_eq!(s.not_finite, 0, "{function}: results that are no numbers");
    assert!(s.value_share <= 1.0, "{function}: {s:?}");
    assert!(s.slope_share <= 1.0, "{function}: {s:?}");
    assert!(
        s.value_error.max(s.slope_error) <= stated,
        "{function}: the header states {stated}, found {s:?}"
    );
    s
}

/// A lattice coordinate: near the origin, near 1e8 on either side, or anywhere.
pub fn random_cell(random: &mut Random) -> u32 {
    let bits = random.bits();
    let near = (bits % 2001) as i32 - 1000;
    let cell = match bits >> 61 {
        0..=2 => near,
        3 | 4 => 100_000_000 + near,
        5 | 6 => -100_000_000 + near,
        _ => (bits >> 20) as i32,
    };
    cell.cast_unsigned()
}

/// A fraction in [0, 1]: 24 random bits, now and then an end, a tiny number or the last one before 1.
pub fn random_frac(random: &mut Random) -> u32 {
    let bits = random.bits();
    let frac = if bits >> 58 == 0 {
        [
            0.0,
            1.0,
            1.0 - f32::EPSILON / 2.0,
            0.5,
            1e-9,
            1e-30,
            f32::MIN_POSITIVE,
            1e-4,
        ][(bits & 7) as usize]
    } else {
        (bits >> 8 & 0xff_ffff) as f32 / (1 << 24) as f32
    };
    frac.to_bits()
}

/// Columns of a row read back: cell, fraction and the rest.
pub fn cell<const N: usize>(row: &[u32]) -> [i32; N] {
    std::array::from_fn(|k| row[k].cast_signed())
}

/// Columns as numbers.
pub fn float(bits: u32) -> f64 {
    f64::from(f32::from_bits(bits))
}

/// Columns as a vector of numbers.
pub fn floats<const N: usize>(row: &[u32]) -> [f64; N] {
    std::array::from_fn(|k| float(row[k]))
}
