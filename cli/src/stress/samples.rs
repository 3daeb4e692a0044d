//! Arguments: random ones of the domains, adversarial ones of the domains, and ones outside of them.

use veduta::reference::monte_carlo::splitmix64;
use veduta_compose::header::{Bound, Interval, Spacing};

use super::subject::{Scalar, Subject};
use super::twins::Entry;
use crate::error::CliError;

/// A small generator of random bits (splitmix64).
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        splitmix64(&mut self.0)
    }

    /// The next number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The next index below `count`, which is at least 1.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count.max(1) as u64) as usize
    }
}

/// The values that one number may have.
#[derive(Debug, Clone)]
struct Column {
    scalar: Scalar,
    lo: Bound,
    hi: Bound,
    lo_open: bool,
    hi_open: bool,
    spacing: Spacing,
    branches: Vec<f64>,
    /// Adversarial values within the domain; empty where the domain depends on other arguments.
    special: Vec<u32>,
    /// Values outside of the domain.
    outside: Vec<u32>,
}

/// The columns of a function's rows.
#[derive(Debug, Clone)]
pub struct Samples {
    columns: Vec<Column>,
    names: Vec<String>,
    /// The number of all combinations of adversarial values, if they are few.
    combinations: Option<usize>,
}

/// All combinations are tried when they are not more than these.
const FEW: usize = 4096;

/// The limit of a domain that has none.
const LARGE: f64 = 1e30;

impl Column {
    fn ends(&self, lo: f64, hi: f64) -> (f64, f64) {
        let (mut lo, mut hi) = (lo.max(-LARGE), hi.min(LARGE));
        if self.scalar == Scalar::F32 {
            // The numbers of a header are meant as those of the function: f32.
            (lo, hi) = (f64::from(lo as f32), f64::from(hi as f32));
            if self.lo_open {
                lo = f64::from((lo as f32).next_up());
            }
            if self.hi_open {
                hi = f64::from((hi as f32).next_down());
            }
        } else {
            lo += f64::from(u8::from(self.lo_open && lo.fract() == 0.0));
            hi -= f64::from(u8::from(self.hi_open && hi.fract() == 0.0));
            (lo, hi) = (lo.ceil(), hi.floor());
        }
        (lo, hi)
    }

    fn constant(&self) -> Option<(f64, f64)> {
        let value = |bound: &Bound| bound.value(|_| None);
        Some(self.ends(value(&self.lo)?, value(&self.hi)?))
    }

    /// The bits of a value of the domain.
    fn bits(&self, value: f64, lo: f64, hi: f64) -> u32 {
        let value = value.clamp(lo, hi);
        match self.scalar {
            Scalar::F32 => (value as f32).clamp(lo as f32, hi as f32).to_bits(),
            Scalar::I32 => (value.floor() as i32).cast_unsigned(),
            Scalar::U32 | Scalar::Bool => value.floor() as u32,
        }
    }

    fn random(&self, random: &mut Random, lo: f64, hi: f64) -> u32 {
        let u = random.unit();
        if self.scalar == Scalar::F32 {
            let value = match self.spacing {
                Spacing::Lin => lo + (hi - lo) * u,
                Spacing::Log => (lo.ln() + (hi / lo).ln() * u).exp(),
            };
            return self.bits(value, lo, hi);
        }
        // Half of the integers of wide domains are spread by their size.
        let wide = hi - lo > 1e6 && random.bits().is_multiple_of(2);
        let value = if self.spacing == Spacing::Log {
            (lo.ln() + ((hi + 1.0) / lo).ln() * u).exp()
        } else if wide {
            let size = (u * 32.0).exp2() - 1.0;
            if lo < 0.0 && random.bits().is_multiple_of(2) {
                -size
            } else {
                lo.max(0.0) + size
            }
        } else {
            lo + (hi - lo + 1.0) * u
        };
        self.bits(value, lo, hi)
    }

    /// Numbers about which things go wrong.
    fn candidates(&self, lo: f64, hi: f64) -> Vec<u32> {
        if self.scalar != Scalar::F32 {
            let mut found = vec![lo, lo + 1.0, lo + 2.0, hi - 2.0, hi - 1.0, hi];
            found.extend([-2.0, -1.0, 0.0, 1.0, 2.0, 3.0]);
            for power in [7, 8, 15, 16, 22, 23, 24, 30, 31] {
                let p = f64::from(1_u32 << power);
                found.extend([-p - 1.0, -p, 1.0 - p, p - 1.0, p, p + 1.0]);
            }
            found.extend(self.branches.iter().flat_map(|b| [b - 1.0, *b, b + 1.0]));
            return found
                .into_iter()
                .filter_map(|v| match self.scalar {
                    Scalar::I32 => {
                        let whole = (-2_147_483_648.0..=2_147_483_647.0)
                            .contains(&v)
                            .then_some(v)?;
                        Some((whole as i32).cast_unsigned())
                    }
                    _ => (0.0..=4_294_967_295.0).contains(&v).then_some(v as u32),
                })
                .collect();
        }
        let mut about = vec![lo as f32, hi as f32, 0.5, 1.0, 2.0, 3.0];
        about.extend(self.branches.iter().map(|b| *b as f32));
        let mut found = vec![0.0_f32, f32::from_bits(1), f32::MIN_POSITIVE.next_down()];
        found.push(f32::MIN_POSITIVE);
        found.extend((-30..=30).map(|k| 10_f64.powi(k) as f32));
        found.extend([1.0 - f32::EPSILON / 2.0, 1e-45, 0.25, 0.75]);
        for x in about {
            found.extend([x.next_down(), x, x.next_up()]);
        }
        found.extend([(2.0 * hi) as f32, (0.5 * (lo + hi)) as f32]);
        let negative: Vec<f32> = found.iter().map(|x| -x).collect();
        found.extend(negative);
        found.iter().map(|x| x.to_bits()).collect()
    }

    fn fill(&mut self) {
        let Some((lo, hi)) = self.constant() else {
            return;
        };
        let mut all = self.candidates(lo, hi);
        all.sort_unstable();
        all.dedup();
        let scalar = self.scalar;
        let within = |bits: &u32| (lo..=hi).contains(&scalar.value(*bits));
        self.special = all.iter().copied().filter(within).collect();
        self.outside = all.into_iter().filter(|bits| !within(bits)).collect();
        if self.scalar != Scalar::F32 {
            // Counts above their domain only make loops long.
            self.outside.retain(|bits| scalar.value(*bits) < lo);
        }
    }
}

/// What a row is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Spread over the domains.
    Random,
    /// Ends, powers of ten, branches and their neighbours, within the domains.
    Adversarial,
    /// At least one argument outside of its domain.
    Outside,
    /// One of a row of rows in which one argument grows.
    Sweep,
}

/// How many rows a sweep has.
pub const SWEEP: usize = 16;

impl Samples {
    /// The columns of a function, from its header and from its entry.
    ///
    /// # Errors
    /// [`CliError::Argument`] for a number without a domain.
    pub fn new(subject: &Subject, entry: &Entry) -> Result<Samples, CliError> {
        let mut columns = Vec::new();
        for leaf in &subject.inputs {
            let header = subject.function.header.domain(&leaf.name);
            let own = entry.domains.iter().find(|d| d.name == leaf.name);
            let (interval, spacing) = match (own, header) {
                (Some(own), _) => (own.interval.clone(), own.spacing),
                (None, Some(header)) => (header.interval.clone(), header.spacing),
                (None, None) => {
                    let hi = match leaf.scalar {
                        Scalar::U32 if leaf.choices.is_some() => {
                            f64::from(leaf.choices.unwrap_or(1) - 1)
                        }
                        Scalar::U32 => f64::from(u32::MAX),
                        Scalar::Bool => 1.0,
                        _ => {
                            return Err(CliError::argument(
                                &subject.path,
                                leaf.show(),
                                "a parameter with a domain in the header or in the registry",
                            ));
                        }
                    };
                    let interval = Interval {
                        lo: Bound::Number(0.0),
                        hi: Bound::Number(hi),
                        lo_open: false,
                        hi_open: false,
                        unit: "1".to_owned(),
                    };
                    (interval, Spacing::Lin)
                }
            };
            let mut column = Column {
                scalar: leaf.scalar,
                lo: interval.lo,
                hi: interval.hi,
                lo_open: interval.lo_open,
                hi_open: interval.hi_open,
                spacing,
                branches: entry
                    .branches
                    .iter()
                    .filter(|(name, _)| *name == leaf.name)
                    .flat_map(|(_, at)| at.iter().copied())
                    .collect(),
                special: Vec::new(),
                outside: Vec::new(),
            };
            column.fill();
            columns.push(column);
        }
        let combinations = columns
            .iter()
            .try_fold(1_usize, |n, c| n.checked_mul(c.special.len().max(1)))
            .filter(|n| *n <= FEW);
        Ok(Samples {
            names: subject.inputs.iter().map(|l| l.name.clone()).collect(),
            columns,
            combinations,
        })
    }

    /// The ends of a column's domain, given the columns before it.
    fn ends(&self, k: usize, row: &[u32]) -> (f64, f64) {
        let column = &self.columns[k];
        let lookup = |name: &str| {
            let at = self.names[..k].iter().position(|n| n == name)?;
            Some(self.columns[at].scalar.value(row[at]))
        };
        let value = |bound: &Bound, or: f64| bound.value(lookup).unwrap_or(or);
        column.ends(value(&column.lo, -LARGE), value(&column.hi, LARGE))
    }

    fn within(&self, random: &mut Random, row: &mut [u32], share_special: f64) {
        for k in 0..self.columns.len() {
            let column = &self.columns[k];
            row[k] = if !column.special.is_empty() && random.unit() < share_special {
                column.special[random.below(column.special.len())]
            } else {
                let (lo, hi) = self.ends(k, row);
                column.random(random, lo, hi)
            };
        }
    }

    /// A row on one of the ends of every second argument's domain: sums and products are largest there.
    fn on_ends(&self, random: &mut Random, row: &mut [u32]) {
        let mut at_end = false;
        for k in 0..self.columns.len() {
            let argument = |k: usize| self.names[k].split('.').next();
            if k == 0 || argument(k) != argument(k - 1) {
                at_end = random.bits().is_multiple_of(2);
            }
            let (lo, hi) = self.ends(k, row);
            row[k] = if at_end {
                let end = if random.bits().is_multiple_of(2) {
                    lo
                } else {
                    hi
                };
                self.columns[k].bits(end, lo, hi)
            } else {
                self.columns[k].random(random, lo, hi)
            };
        }
    }

    /// Writes the `index`-th row of a kind.
    pub fn row(&self, random: &mut Random, kind: Kind, index: u64, row: &mut [u32]) {
        match (kind, self.combinations) {
            (Kind::Adversarial, Some(count)) if index < count as u64 => {
                let mut rest = index as usize;
                for k in 0..self.columns.len() {
                    let special = &self.columns[k].special;
                    if special.is_empty() {
                        let (lo, hi) = self.ends(k, row);
                        row[k] = self.columns[k].random(random, lo, hi);
                    } else {
                        row[k] = special[rest % special.len()];
                        rest /= special.len();
                    }
                }
            }
            // A third of them lies on the ends of some arguments' domains, and anywhere in the others'.
            (Kind::Adversarial, _) if random.below(3) == 0 => self.on_ends(random, row),
            (Kind::Adversarial, _) => {
                let share = [0.2, 0.5, 0.9][random.below(3)];
                self.within(random, row, share);
            }
            (Kind::Outside, _) => {
                let share = [0.0, 0.3, 0.6][random.below(3)];
                self.within(random, row, share);
                let open: Vec<usize> = (0..self.columns.len())
                    .filter(|k| !self.columns[*k].outside.is_empty())
                    .collect();
                if open.is_empty() {
                    return;
                }
                let several = random.unit() < 0.3;
                let one = open[random.below(open.len())];
                for k in open {
                    if k == one || (several && random.bits().is_multiple_of(2)) {
                        let outside = &self.columns[k].outside;
                        row[k] = outside[random.below(outside.len())];
                    }
                }
            }
            (Kind::Random | Kind::Sweep, _) => self.within(random, row, 0.0),
        }
    }

    /// Whether any column has values outside of its domain.
    pub fn has_outside(&self) -> bool {
        self.columns.iter().any(|c| !c.outside.is_empty())
    }

    /// The columns of a parameter.
    pub fn columns_of(&self, name: &str) -> Vec<usize> {
        (0..self.names.len())
            .filter(|k| self.names[*k] == name)
            .collect()
    }

    /// Makes a sweep of one row: the argument in `column` grows, everything else stays.
    pub fn sweep(&self, random: &mut Random, column: usize, rows: &mut [u32], width: usize) {
        let base: Vec<u32> = rows[..width].to_vec();
        let (lo, hi) = self.ends(column, &base);
        let which = &self.columns[column];
        let mut values = Vec::new();
        while values.len() < SWEEP {
            let bits = if !which.special.is_empty() && random.unit() < 0.4 {
                which.special[random.below(which.special.len())]
            } else {
                which.random(random, lo, hi)
            };
            values.push(bits);
            if which.scalar == Scalar::F32 && random.unit() < 0.3 {
                let next = f32::from_bits(bits).next_up();
                values.push(which.bits(f64::from(next), lo, hi));
            }
        }
        values.truncate(SWEEP);
        values.sort_by(|a, b| which.scalar.value(*a).total_cmp(&which.scalar.value(*b)));
        for (row, value) in rows.chunks_exact_mut(width).zip(values) {
            row.copy_from_slice(&base);
            row[column] = value;
        }
    }
}
