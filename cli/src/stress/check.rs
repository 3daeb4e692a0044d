//! One function: rows drawn, run on the device, and held against its header and its twin.

use std::hash::{DefaultHasher, Hash, Hasher};

use veduta::device::Gpu;
use veduta_compose::Library;
use veduta_compose::header::{Bound, ErrorBound, ErrorKind, Interval};

use super::samples::{Kind, Random, SWEEP, Samples};
use super::subject::{Device, Scalar, Subject};
use super::twins::{Entry, Prepare, Values};
use crate::error::CliError;

/// What can be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Check {
    /// A result within the domain is infinite or NaN.
    Finite,
    /// A result outside of the domain is infinite or NaN, and the header does not say `outside undefined`.
    Outside,
    /// A result leaves the header's range.
    Range,
    /// A result is further from the twin's than the header's bound.
    Error,
    /// A result falls where the header promises that it grows, or the other way round.
    Monotone,
    /// A quantity of energy lies above its bound.
    Energy,
    /// Too many rows have no determined result.
    Undetermined,
    /// The header's bound is more than eight times the largest error.
    Generous,
}

impl Check {
    /// One word for it.
    pub fn name(self) -> &'static str {
        match self {
            Check::Finite => "finite",
            Check::Outside => "outside",
            Check::Range => "range",
            Check::Error => "error",
            Check::Monotone => "monotone",
            Check::Energy => "energy",
            Check::Undetermined => "undetermined",
            Check::Generous => "generous",
        }
    }
}

/// Something wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// The function or the case.
    pub subject: String,
    /// The check.
    pub check: Check,
    /// Values and the arguments.
    pub what: String,
}

/// What one function was found to do.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The function without `veduta::`.
    pub function: String,
    /// The header's bound.
    pub bound: Option<ErrorBound>,
    /// All evaluations, those outside of the domain included.
    pub evaluations: u64,
    /// Evaluations outside of the domain.
    pub outside: u64,
    /// Evaluations within the domain whose result is not determined.
    pub left_out: u64,
    /// The largest error, in the bound's measure.
    pub largest: f64,
    /// Where it is.
    pub worst: Option<String>,
    /// The mean error of all components.
    pub mean: f64,
    /// Results outside of the domain that are infinite or NaN.
    pub outside_not_finite: u64,
    /// One of them.
    pub outside_example: Option<String>,
    /// Whether the header says `outside undefined`.
    pub outside_undefined: bool,
    /// What arguments are made of, and where rows are left out.
    pub notes: Vec<String>,
    /// What is wrong; at most three of a kind.
    pub faults: Vec<Fault>,
    /// Seconds that it took, on one thread.
    pub seconds: f64,
}

/// Sets of arguments near a jump that are tried at most, beside those in which one is moved.
const TURNS: usize = 4000;

/// The most faults of a kind that are kept.
const MOST_FAULTS: usize = 3;

/// The largest share of rows spread over the domain whose result may be left out.
const MOST_LEFT_OUT: f64 = 0.02;

/// How often a bound may be the largest error in a long run.
pub const GENEROUS: f64 = 8.0;

/// A function ready for rows.
#[derive(Debug)]
pub struct Work<'a> {
    subject: &'a Subject,
    entry: &'a Entry,
    samples: Samples,
    device: Device,
    /// Columns of each preparation.
    prepared: Vec<Vec<usize>>,
    /// Whether range and error hold for an output.
    judged: Vec<bool>,
    /// Whether the range holds for an output.
    ranged: Vec<bool>,
    /// The columns that sweeps go through.
    swept: Vec<usize>,
    seed: u64,
    batches: u64,
    adversarial: u64,
    sum: f64,
    components: u64,
    /// Rows spread over the domain, and those of them that were left out.
    spread: u64,
    spread_left_out: u64,
    found: Finding,
}

/// The distance in the measure of the bound.
pub fn distance(kind: ErrorKind, device: f64, truth: f64) -> f64 {
    let difference = (device - truth).abs();
    // Below the smallest normal f32, devices may flush to 0.
    let size = truth.abs().max(f64::from(f32::MIN_POSITIVE));
    match kind {
        _ if difference == 0.0 => 0.0,
        ErrorKind::Abs => difference,
        ErrorKind::Rel => difference / size,
        ErrorKind::Ulp => difference / (size.log2().floor() - 23.0).exp2(),
    }
}

/// How far two neighbours may go the wrong way: the error, or one unit in the last place.
fn slack(error: Option<&ErrorBound>, value: f64) -> f64 {
    let size = value.abs().max(f64::from(f32::MIN_POSITIVE));
    let ulp = (size.log2().floor() - 23.0).exp2();
    let bound = error.map_or(0.0, |e| match e.kind {
        ErrorKind::Abs => e.value,
        ErrorKind::Rel => e.value * size,
        ErrorKind::Ulp => e.value * ulp,
    });
    bound.max(ulp)
}

/// The ends of a range, given a row.
fn ends(subject: &Subject, range: &Interval, row: &[u32]) -> (f64, f64) {
    let lookup = |name: &str| {
        let at = subject.inputs.iter().position(|l| l.name == name)?;
        Some(subject.inputs[at].scalar.value(row[at]))
    };
    let value = |bound: &Bound, or: f64| bound.value(lookup).unwrap_or(or);
    (
        value(&range.lo, f64::NEG_INFINITY),
        value(&range.hi, f64::INFINITY),
    )
}

/// Whether a result lies in the range. The ends are meant as f32.
fn within(subject: &Subject, range: &Interval, row: &[u32], value: f64, scalar: Scalar) -> bool {
    let (mut lo, mut hi) = ends(subject, range, row);
    if scalar == Scalar::F32 {
        (lo, hi) = (lo.min(f64::from(lo as f32)), hi.max(f64::from(hi as f32)));
    }
    let above = if range.lo_open {
        value > lo
    } else {
        value >= lo
    };
    let below = if range.hi_open {
        value < hi
    } else {
        value <= hi
    };
    above && below
}

impl<'a> Work<'a> {
    /// Compiles the function.
    ///
    /// # Errors
    /// Faults of composing and of the device; arguments without a domain; a twin that reads other columns.
    pub fn new(
        gpu: &Gpu,
        library: &Library,
        subject: &'a Subject,
        entry: &'a Entry,
    ) -> Result<Work<'a>, CliError> {
        let header = &subject.function.header;
        let stated = header.error.as_ref().map(|e| e.reference.as_str());
        if stated != Some(entry.reference) {
            return Err(CliError::argument(
                subject.short(),
                stated.unwrap_or("nothing"),
                format!("the registry's reference, {}", entry.reference),
            ));
        }
        if entry.columns != subject.inputs.len() {
            return Err(CliError::argument(
                subject.short(),
                format!("{} numbers", subject.inputs.len()),
                format!("those of its twin, {}", entry.columns),
            ));
        }
        let samples = Samples::new(subject, entry)?;
        let prepared = entry
            .prepare
            .iter()
            .map(|p| match p {
                Prepare::Unit(name) | Prepare::Whole(name) => samples.columns_of(name),
                Prepare::Horizon(name) => ["altitude", "ground_radius", "horizon"]
                    .iter()
                    .flat_map(|member| samples.columns_of(&format!("{name}.{member}")))
                    .collect(),
                Prepare::Ascending(names) => names
                    .iter()
                    .flat_map(|name| samples.columns_of(name))
                    .collect(),
            })
            .collect();
        let judged: Vec<bool> = subject
            .outputs
            .iter()
            .map(|leaf| {
                entry
                    .judged
                    .is_none_or(|list| list.contains(&leaf.name.as_str()))
            })
            .collect();
        // The range of a place on a lattice is that of its fraction.
        let ranged = subject
            .outputs
            .iter()
            .zip(&judged)
            .map(|(leaf, judged)| *judged && leaf.name != "cell")
            .collect();
        let swept = header
            .monotone
            .iter()
            .flat_map(|name| samples.columns_of(name))
            .collect();
        let mut hasher = DefaultHasher::new();
        subject.path.hash(&mut hasher);
        let mut notes: Vec<String> = entry.prepare.iter().map(Prepare::describe).collect();
        notes.extend(entry.domains.iter().map(|d| {
            let Interval { lo, hi, .. } = &d.interval;
            format!("{} in [{lo}, {hi}]", d.name)
        }));
        if let Some((at, _)) = entry.jumps {
            notes.push(format!("not determined at {at}"));
        }
        Ok(Work {
            device: subject.compile(gpu, library)?,
            samples,
            prepared,
            judged,
            ranged,
            swept,
            seed: hasher.finish(),
            batches: 0,
            adversarial: 0,
            sum: 0.0,
            components: 0,
            spread: 0,
            spread_left_out: 0,
            found: Finding {
                function: subject.short().to_owned(),
                bound: header.error.clone(),
                evaluations: 0,
                outside: 0,
                left_out: 0,
                largest: 0.0,
                worst: None,
                mean: 0.0,
                outside_not_finite: 0,
                outside_example: None,
                outside_undefined: header.outside_undefined,
                notes,
                faults: Vec::new(),
                seconds: 0.0,
            },
            subject,
            entry,
        })
    }

    fn fault(&mut self, check: Check, what: impl FnOnce() -> String) {
        let same = self.found.faults.iter().filter(|f| f.check == check);
        if same.count() < MOST_FAULTS {
            self.found.faults.push(Fault {
                subject: self.found.function.clone(),
                check,
                what: what(),
            });
        }
    }

    fn prepare(&self, row: &mut [u32]) {
        for (prepare, columns) in self.entry.prepare.iter().zip(&self.prepared) {
            let mut values: Vec<f64> = columns
                .iter()
                .map(|k| f64::from(f32::from_bits(row[*k])))
                .collect();
            match prepare {
                Prepare::Unit(_) => {
                    let length = values.iter().map(|v| v * v).sum::<f64>().sqrt();
                    if length > 1e-30 {
                        values.iter_mut().for_each(|v| *v /= length);
                    } else {
                        values.fill(0.0);
                        if let Some(up) = values.get_mut(1) {
                            *up = 1.0;
                        }
                    }
                }
                Prepare::Whole(_) => values.iter_mut().for_each(|v| *v = v.round()),
                Prepare::Horizon(_) => {
                    if let [altitude, radius, horizon] = &mut values[..] {
                        let r = *radius + *altitude;
                        let cosine = (*altitude * (2.0 * *radius + *altitude)).sqrt() / r;
                        // tan(z / 2) = (1 - cos z) / sin z
                        *horizon = (1.0 + cosine) * r / *radius;
                    }
                }
                Prepare::Ascending(_) => values.sort_by(f64::total_cmp),
            }
            for (k, value) in columns.iter().zip(values) {
                row[*k] = (value as f32).to_bits();
            }
        }
    }

    /// The rows of a batch and what each is for.
    fn rows(&mut self, count: usize) -> (Vec<u32>, Vec<Kind>) {
        let width = self.subject.columns();
        let mut random = Random(self.seed ^ self.batches.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        self.batches += 1;
        let mut rows = vec![0; count * width];
        let mut kinds = Vec::with_capacity(count);
        while kinds.len() < count {
            let at = kinds.len();
            let kind = match random.below(16) {
                0..=6 => Kind::Random,
                7..=12 => Kind::Adversarial,
                13 | 14 if self.samples.has_outside() => Kind::Outside,
                15 if !self.swept.is_empty() && at + SWEEP <= count && at.is_multiple_of(SWEEP) => {
                    Kind::Sweep
                }
                _ => Kind::Random,
            };
            // Blocks of one kind, so that sweeps lie together.
            let block = SWEEP.min(count - at);
            let rows = &mut rows[at * width..(at + block) * width];
            for row in rows.chunks_exact_mut(width) {
                if self.subject.inputs.is_empty() {
                    continue;
                }
                self.samples.row(&mut random, kind, self.adversarial, row);
                self.adversarial += u64::from(kind == Kind::Adversarial);
                if kind != Kind::Outside {
                    self.prepare(row);
                }
            }
            if kind == Kind::Sweep {
                let column = self.swept[random.below(self.swept.len())];
                self.samples.sweep(&mut random, column, rows, width);
            }
            kinds.extend(std::iter::repeat_n(kind, block));
        }
        (rows, kinds)
    }

    /// Draws, runs and checks `count` rows.
    ///
    /// # Errors
    /// Faults of the device.
    pub fn run(&mut self, count: usize) -> Result<(), CliError> {
        let start = std::time::Instant::now();
        let (rows, kinds) = self.rows(count);
        let results = self.device.run(&rows)?;
        let columns = self.subject.columns();
        let width = self.subject.outputs.len();
        for (at, ((row, bits), kind)) in rows
            .chunks_exact(columns)
            .zip(results.chunks_exact(width))
            .zip(&kinds)
            .enumerate()
        {
            self.judge(row, bits, *kind);
            if *kind == Kind::Sweep && at % SWEEP == 0 {
                let rows = &rows[at * columns..(at + SWEEP) * columns];
                self.judge_sweep(rows, &results[at * width..(at + SWEEP) * width]);
            }
        }
        self.found.seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    fn judge(&mut self, row: &[u32], bits: &[u32], kind: Kind) {
        let subject = self.subject;
        let mut device = [0.0; super::twins::MOST];
        let device = &mut device[..bits.len()];
        for ((to, leaf), bits) in device.iter_mut().zip(&subject.outputs).zip(bits) {
            *to = leaf.scalar.value(*bits);
        }
        self.found.evaluations += 1;
        if let Some(bad) = device.iter().find(|v| !v.is_finite()).copied() {
            if kind == Kind::Outside {
                self.found.outside += 1;
                self.found.outside_not_finite += 1;
                let example = || format!("{bad} at {}", subject.show(row));
                if self.found.outside_example.is_none() {
                    self.found.outside_example = Some(example());
                }
                if !self.found.outside_undefined {
                    self.fault(Check::Outside, example);
                }
            } else {
                self.fault(Check::Finite, || format!("{bad} at {}", subject.show(row)));
            }
            return;
        }
        if kind == Kind::Outside {
            self.found.outside += 1;
            return;
        }
        if let Some(range) = &subject.function.header.range {
            for (k, value) in device.iter().copied().enumerate() {
                let scalar = subject.outputs[k].scalar;
                if self.ranged[k] && !within(subject, range, row, value, scalar) {
                    self.fault(Check::Range, || {
                        format!(
                            "{value:?} is not in [{}, {}] at {}",
                            range.lo,
                            range.hi,
                            subject.show(row)
                        )
                    });
                }
            }
        }
        if let Some(energy) = self.entry.energy {
            let (value, bound) = energy(row, device);
            // A NaN is above every bound.
            if value.partial_cmp(&bound).is_none_or(|o| o.is_gt()) {
                self.fault(Check::Energy, || {
                    format!("{value:e} above {bound:e} at {}", subject.show(row))
                });
            }
        }
        let Some(error) = &subject.function.header.error else {
            return;
        };
        self.spread += u64::from(kind == Kind::Random);
        let truth = self.entry.call(row);
        if let Some(align) = self.entry.align {
            align(device, truth.get());
        }
        let (worst, sum, judged) = self.errors(error, device, &truth);
        // A reference that is no number judges nothing: an error.
        let worst = if worst.is_nan() { f64::INFINITY } else { worst };
        if worst > error.value && self.undetermined(error, row, device) {
            self.found.left_out += 1;
            self.spread_left_out += u64::from(kind == Kind::Random);
            return;
        }
        self.sum += sum;
        self.components += judged;
        if worst > self.found.largest {
            self.found.largest = worst;
            self.found.worst = Some(subject.show(row));
        }
        if worst > error.value {
            let (value, expected) = (device.to_vec(), truth.get().to_vec());
            self.fault(Check::Error, || {
                format!(
                    "{worst:e} instead of {:e}: {value:?}, not {expected:?}, at {}",
                    error.value,
                    subject.show(row)
                )
            });
        }
    }

    /// The largest error, the sum and the number of the components.
    fn errors(&self, error: &ErrorBound, device: &[f64], truth: &Values) -> (f64, f64, u64) {
        let (mut worst, mut sum, mut count) = (0.0_f64, 0.0, 0);
        for ((d, t), judged) in device.iter().zip(truth.get()).zip(&self.judged) {
            if *judged {
                let e = distance(error.kind, *d, *t);
                worst = if e.is_nan() { e } else { worst.max(e) };
                sum += e;
                count += 1;
            }
        }
        (worst, sum, count)
    }

    /// Whether the twin itself reaches the device's result when the arguments move by a few units in the last place.
    fn undetermined(&self, error: &ErrorBound, row: &[u32], device: &[f64]) -> bool {
        let Some((_, share)) = self.entry.jumps else {
            return false;
        };
        let mut hull = [(f64::INFINITY, f64::NEG_INFINITY); super::twins::MOST];
        let floats: Vec<usize> = (0..self.subject.inputs.len())
            .filter(|k| self.subject.inputs[*k].scalar == Scalar::F32)
            .collect();
        let mut random = Random(self.seed);
        let mut moved = row.to_vec();
        // Widens the hull by the twin of other arguments; true when the device's result lies within.
        let mut include = |moved: &[u32]| {
            for (end, v) in hull.iter_mut().zip(self.entry.call(moved).get()) {
                *end = (end.0.min(*v), end.1.max(*v));
            }
            device
                .iter()
                .zip(&hull)
                .zip(&self.judged)
                .all(|((d, (lo, hi)), judged)| {
                    !judged || distance(error.kind, *d, d.clamp(*lo, *hi)) <= error.value
                })
        };
        include(row);
        for turn in 0..(4 * floats.len() + TURNS) {
            moved.copy_from_slice(row);
            let shift = |x: f32, by: f64| (f64::from(x) + by * f64::from(x).abs().max(1.0)) as f32;
            if turn < 4 * floats.len() {
                let k = floats[turn / 4];
                let x = f32::from_bits(row[k]);
                let x = match turn % 4 {
                    0 => x.next_up(),
                    1 => x.next_down(),
                    2 => shift(x, share),
                    _ => shift(x, -share),
                };
                moved[k] = x.to_bits();
            } else {
                for k in &floats {
                    // Of all sizes up to the share: close to a jump, large ones hide it.
                    let size = share * 10_f64.powf(-8.0 * random.unit());
                    let by = if random.bits() & 1 == 0 { size } else { -size };
                    moved[*k] = shift(f32::from_bits(row[*k]), by).to_bits();
                }
            }
            if include(&moved) {
                return true;
            }
        }
        false
    }

    fn judge_sweep(&mut self, rows: &[u32], bits: &[u32]) {
        let subject = self.subject;
        let (columns, width) = (subject.columns(), subject.outputs.len());
        let error = subject.function.header.error.as_ref();
        for k in 0..width {
            let scalar = subject.outputs[k].scalar;
            let values: Vec<f64> = bits
                .chunks_exact(width)
                .map(|r| scalar.value(r[k]))
                .collect();
            if !self.judged[k] || values.iter().any(|v| !v.is_finite()) {
                continue;
            }
            let rising = values[SWEEP - 1] >= values[0];
            for (i, pair) in values.windows(2).enumerate() {
                let back = if rising {
                    pair[0] - pair[1]
                } else {
                    pair[1] - pair[0]
                };
                if back > slack(error, pair[0]) {
                    let row = &rows[i * columns..(i + 1) * columns];
                    let next = &rows[(i + 1) * columns..(i + 2) * columns];
                    let changed: Vec<String> = subject
                        .inputs
                        .iter()
                        .zip(row.iter().zip(next))
                        .filter(|(_, (a, b))| a != b)
                        .map(|(l, (_, b))| format!("{} = {}", l.show(), l.scalar.show(*b)))
                        .collect();
                    self.fault(Check::Monotone, || {
                        format!(
                            "{:?} then {:?} in a sweep that {}, at {} and then {}",
                            pair[0],
                            pair[1],
                            if rising { "rises" } else { "falls" },
                            subject.show(row),
                            changed.join(", ")
                        )
                    });
                }
            }
        }
    }

    /// How far the run has come.
    pub fn evaluations(&self) -> u64 {
        self.found.evaluations
    }

    /// The finding; `long` asks for bounds that are not too generous.
    pub fn finish(mut self, long: bool) -> Finding {
        self.found.mean = self.sum / self.components.max(1) as f64;
        let share = self.spread_left_out as f64 / self.spread.max(1) as f64;
        if share > MOST_LEFT_OUT {
            self.fault(Check::Undetermined, || {
                format!(
                    "{:.1} % of the results of random arguments are not determined",
                    100.0 * share
                )
            });
        }
        let largest = self.found.largest;
        if let (true, Some(bound)) = (long, &self.found.bound)
            && bound.value > GENEROUS * largest
        {
            let value = bound.value;
            self.fault(Check::Generous, || {
                format!("the bound {value:e} is more than {GENEROUS} times the largest error, {largest:e}")
            });
        }
        self.found
    }
}
