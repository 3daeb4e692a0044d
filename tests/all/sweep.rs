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
#[derive(Clone, Copy, Debug)]
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

    const NONE: Summary = Summary {
        rows: 0,
        kinks: 0,
        not_finite: 0,
        value_error: 0.0,
        slope_error: 0.0,
        value_share: 0.0,
        slope_share: 0.0,
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };

    fn add(&mut self, result: &[u32], truth: &Truth) {
        self.rows += 1;
        self.kinks += usize::from(truth.kink);
        for (k, &bits) in result.iter().enumerate() {
            let value = f64::from(f32::from_bits(bits));
            if !value.is_finite() {
                self.not_finite += 1;
                continue;
            }
            let error = (value - truth.value[k]).abs();
            if k == 0 {
                self.value_error = self.value_error.max(error);
                self.value_share = self.value_share.max(error / truth.bar[0]);
                self.low = self.low.min(value);
                self.high = self.high.max(value);
            } else if !truth.kink {
                self.slope_error = self.slope_error.max(error);
                self.slope_share = self.slope_share.max(error / truth.bar[k]);
            }
        }
    }
}

/// Rows in one pass over the device.
const PASS: usize = 1 << 20;

/// The points that a function is compared on.
pub const POINTS: usize = 10_000_000;

/// Compares functions of the same arguments with one twin, which gives the components of the widest one. The rows run on
/// the device in passes, the twin on all processors.
pub fn compare(
    functions: &[String],
    arguments: &str,
    columns: usize,
    points: usize,
    fill: impl Fn(&mut Random, &mut [u32]) + Sync,
    twin: impl Fn(&[u32]) -> Truth + Sync,
) -> Vec<Summary> {
    let devices: Vec<_> = functions
        .iter()
        .map(|function| {
            let name = function.rsplit("::").next().unwrap();
            evaluator(&[function], "", &format!("{name}({arguments})"), columns)
        })
        .collect();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut totals = vec![Summary::NONE; functions.len()];
    let mut random = Random(functions[0].bytes().map(u64::from).sum());
    let mut left = points;
    while left > 0 {
        let count = left.min(PASS);
        left -= count;
        let mut rows = vec![0_u32; count * columns];
        for row in rows.chunks_exact_mut(columns) {
            fill(&mut random, row);
        }
        let results: Vec<Vec<u32>> = devices
            .iter()
            .map(|device| device.run_bits(&rows).unwrap())
            .collect();
        let part = count.div_ceil(threads);
        let found: Vec<Vec<Summary>> = std::thread::scope(|scope| {
            let workers: Vec<_> = rows
                .chunks(part * columns)
                .enumerate()
                .map(|(worker, rows)| {
                    let (twin, results, devices) = (&twin, &results, &devices);
                    scope.spawn(move || {
                        let mut sums = vec![Summary::NONE; devices.len()];
                        for (k, row) in rows.chunks_exact(columns).enumerate() {
                            let truth = twin(row);
                            let at = worker * part + k;
                            for ((sum, result), device) in sums.iter_mut().zip(results).zip(devices)
                            {
                                let width = device.width();
                                sum.add(&result[at * width..][..width], &truth);
                            }
                        }
                        sums
                    })
                })
                .collect();
            workers.into_iter().map(|w| w.join().unwrap()).collect()
        });
        for sums in found {
            for (total, sum) in totals.iter_mut().zip(sums) {
                *total = total.merge(sum);
            }
        }
    }
    totals
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
pub fn check_all(
    functions: &[String],
    arguments: &str,
    columns: usize,
    points: usize,
    fill: impl Fn(&mut Random, &mut [u32]) + Sync,
    twin: impl Fn(&[u32]) -> Truth + Sync,
) -> Vec<Summary> {
    let start = std::time::Instant::now();
    let found = compare(functions, arguments, columns, points, fill, twin);
    let seconds = start.elapsed().as_secs_f64();
    let mut faults = Vec::new();
    for (function, s) in functions.iter().zip(&found) {
        let stated = header_error(function);
        println!(
            "{function}: {} points, error {:.2e} ({:.0} % of the bar), of the gradient {:.2e} ({:.0} %), header {stated:e}; \
             {} at kinks; values {:.6} to {:.6}; {seconds:.1} s",
            s.rows,
            s.value_error,
            100.0 * s.value_share,
            s.slope_error,
            100.0 * s.slope_share,
            s.kinks,
            s.low,
            s.high,
        );
        let fine = s.rows == points
            && s.not_finite == 0
            && s.value_share <= 1.0
            && s.slope_share <= 1.0
            && s.value_error.max(s.slope_error) <= stated;
        if !fine {
            faults.push(format!("{function}, header {stated:e}: {s:?}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    found
}

/// [`check_all`] of one function.
pub fn check(
    function: &str,
    arguments: &str,
    columns: usize,
    points: usize,
    fill: impl Fn(&mut Random, &mut [u32]) + Sync,
    twin: impl Fn(&[u32]) -> Truth + Sync,
) -> Summary {
    check_all(
        &[function.to_owned()],
        arguments,
        columns,
        points,
        fill,
        twin,
    )[0]
}

/// That the headers' errors are at most eight times what was found.
pub fn assert_tight(functions: &[String], found: &[Summary]) {
    for (function, s) in functions.iter().zip(found) {
        let stated = header_error(function);
        let worst = s.value_error.max(s.slope_error);
        assert!(
            stated <= 8.0 * worst,
            "{function}: header {stated:e}, found {worst:e}"
        );
    }
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
