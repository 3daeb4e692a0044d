//! Times of subjects that are drawn in turns, and their ratios.
//!
//! On a machine that others use, the time of one draw means little: it wanders by tens of per cent from minute to minute.
//! The ratio of two draws of one round wanders less, and the median of many rounds less still; how much less, the rounds
//! say themselves.

use veduta::{View, wgpu};

use crate::error::CliError;
use crate::render::{Renderer, Tiling, median};

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Clock {
    /// Timestamps of the device.
    Gpu,
    /// Processor time of the process, the driver's threads included: what a software device needs.
    Cpu,
    /// Time on the clock.
    Wall,
}

impl Clock {
    /// The clock that suits a device: processor time for one in software, else its timestamps, else the clock on the wall.
    pub fn of(info: &wgpu::AdapterInfo, features: wgpu::Features) -> Clock {
        if info.device_type == wgpu::DeviceType::Cpu && crate::cpu::CpuTime::now().is_some() {
            Clock::Cpu
        } else if features.contains(wgpu::Features::TIMESTAMP_QUERY) {
            Clock::Gpu
        } else {
            Clock::Wall
        }
    }

    /// What the times are, in words.
    pub fn describe(self) -> &'static str {
        match self {
            Clock::Gpu => "device timestamps",
            Clock::Cpu => "process CPU time",
            Clock::Wall => "wall time",
        }
    }
}

/// One thing that is drawn in turns with others.
#[derive(Debug)]
pub struct Subject {
    /// The pipeline and its picture.
    pub renderer: Renderer,
    /// What it looks at.
    pub view: View,
}

impl Subject {
    /// Draws once; milliseconds by the clock.
    ///
    /// # Errors
    /// Faults of the device; [`CliError::Argument`] for a clock that does not run here.
    pub fn draw(&mut self, clock: Clock) -> Result<f64, CliError> {
        self.renderer.use_timestamps(clock == Clock::Gpu)?;
        let cost = self
            .renderer
            .draw(&self.view, Tiling::Adaptive, &mut |_| {})?;
        let ms = match clock {
            Clock::Gpu => cost.gpu_ms,
            Clock::Cpu => cost.cpu_ms,
            Clock::Wall => Some(cost.wall.as_secs_f64() * 1e3),
        };
        ms.ok_or_else(|| {
            CliError::argument(
                "--clock",
                format!("{clock:?}"),
                "one that runs on this system",
            )
        })
    }
}

/// How many rounds there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rounds {
    /// At least so many, 1 or more.
    pub least: usize,
    /// More, up to this, while a ratio is not conclusive.
    pub most: usize,
}

/// Times of subjects, each with its bases drawn right beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Turns {
    /// `[subject][round]` milliseconds.
    pub times: Vec<Vec<f64>>,
    bases: Vec<usize>,
    /// `[base][subject][round]` milliseconds of the base beside the subject.
    beside: Vec<Vec<Vec<f64>>>,
}

impl Turns {
    /// The ratio of a subject's times to those of a base beside it; 1 to itself, NaN to what was no base.
    pub fn ratio(&self, subject: usize, base: usize) -> Ratio {
        if subject == base {
            return Ratio {
                median: 1.0,
                uncertainty: 0.0,
            };
        }
        match (
            self.bases.iter().position(|b| *b == base),
            self.times.get(subject),
        ) {
            (Some(k), Some(times)) => Ratio::of(times, &self.beside[k][subject]),
            _ => Ratio::of(&[], &[]),
        }
    }

    fn settled(&self) -> bool {
        (0..self.times.len())
            .all(|k| (self.bases.iter()).all(|base| self.ratio(k, *base).conclusive()))
    }
}

/// Draws every subject, after one warm-up draw each, with each of the subjects `bases` right beside it: in the rounds in turns before and after it, so that
/// a drift cancels, and what slows the machine for seconds slows both. Rounds follow until all ratios were conclusive after
/// two rounds in succession, or there are as many as `rounds` allows.
///
/// # Errors
/// Faults of the device.
pub fn beside_bases(
    subjects: &mut [Subject],
    bases: &[usize],
    clock: Clock,
    rounds: Rounds,
    progress: &mut dyn FnMut(),
) -> Result<Turns, CliError> {
    let count = subjects.len();
    let mut turns = Turns {
        times: vec![Vec::new(); count],
        bases: bases.to_vec(),
        beside: vec![vec![Vec::new(); count]; bases.len()],
    };
    for subject in subjects.iter_mut() {
        subject.renderer.warm_up(&subject.view)?;
    }
    let mut settled_before = false;
    for round in 0..rounds.most.max(rounds.least).max(1) {
        let even = round % 2 == 0;
        for turn in 0..count {
            let k = if even { turn } else { count - 1 - turn };
            if !even {
                turns.times[k].push(subjects[k].draw(clock)?);
            }
            for (b, base) in bases.iter().enumerate() {
                if *base != k {
                    turns.beside[b][k].push(subjects[*base].draw(clock)?);
                }
            }
            if even {
                turns.times[k].push(subjects[k].draw(clock)?);
            }
            progress();
        }
        let settled = turns.settled();
        if round + 1 >= rounds.least.max(1) && settled && settled_before {
            break;
        }
        settled_before = settled;
    }
    Ok(turns)
}

/// The middle of values and how far they scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Middle {
    /// The median.
    pub median: f64,
    /// Quartiles.
    pub quartiles: (f64, f64),
}

impl Middle {
    /// Of at least one value; 0 of none.
    pub fn of(values: &[f64]) -> Middle {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * (sorted.len().max(1) - 1) as f64;
            let (low, part) = (place.floor() as usize, place.fract());
            let value = |i: usize| sorted.get(i).copied().unwrap_or(0.0);
            value(low) + part * (value((low + 1).min(sorted.len().max(1) - 1)) - value(low))
        };
        Middle {
            median: median(values.to_vec()).unwrap_or(0.0),
            quartiles: (at(0.25), at(0.75)),
        }
    }
}

/// The ratio of the times of two subjects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// The median of the rounds' ratios.
    pub median: f64,
    /// One standard error of that median, relative to it, from the scatter of the rounds: robust, as of a normal
    /// distribution with the same median deviation. Infinite for fewer than three rounds.
    pub uncertainty: f64,
}

/// Above this relative uncertainty a ratio says nothing: two runs differ by the root of two of it, and three times that is
/// the 10 % that they may differ by.
pub const CONCLUSIVE: f64 = 0.0235;

impl Ratio {
    /// Round by round `times` over `base`.
    pub fn of(times: &[f64], base: &[f64]) -> Ratio {
        let ratios: Vec<f64> = times.iter().zip(base).map(|(t, b)| t / b).collect();
        let Some(middle) = median(ratios.clone()) else {
            return Ratio {
                median: f64::NAN,
                uncertainty: f64::INFINITY,
            };
        };
        let deviations: Vec<f64> = ratios.iter().map(|r| (r - middle).abs()).collect();
        let deviation = 1.4826 * median(deviations).unwrap_or(0.0);
        // The median's standard error is sqrt(pi / 2) times the mean's.
        let error = 1.2533 * deviation / (ratios.len() as f64).sqrt();
        Ratio {
            median: middle,
            uncertainty: if ratios.len() < 3 {
                f64::INFINITY
            } else {
                error / middle
            },
        }
    }

    /// Whether two runs can be expected to agree within 10 %.
    pub fn conclusive(self) -> bool {
        self.uncertainty <= CONCLUSIVE
    }
}

impl std::fmt::Display for Ratio {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = if self.median < 0.1 { 4 } else { 3 };
        if self.conclusive() {
            write!(f, "{:.digits$}", self.median)
        } else {
            write!(f, "({:.digits$}?)", self.median)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_cancel_what_slows_a_whole_round() {
        let load = [1.0, 1.9, 1.2, 0.8, 3.0];
        let base: Vec<f64> = load.iter().map(|l| 10.0 * l).collect();
        let half: Vec<f64> = load.iter().map(|l| 5.0 * l).collect();
        let ratio = Ratio::of(&half, &base);
        assert!((ratio.median - 0.5).abs() < 1e-12 && ratio.conclusive());
        assert_eq!(ratio.to_string(), "0.500");
    }

    #[test]
    fn ratios_are_to_the_base_beside() {
        let slow = |factor: f64| vec![10.0 * factor, 20.0 * factor, 30.0 * factor];
        let turns = Turns {
            times: vec![slow(1.0), slow(2.0), slow(3.0)],
            bases: vec![0, 1],
            beside: vec![
                vec![vec![], slow(1.0), slow(1.5)],
                vec![slow(2.0), vec![], slow(2.0)],
            ],
        };
        let near = |subject, base, expected: f64| {
            let found = turns.ratio(subject, base).median;
            assert!(
                (found - expected).abs() < 1e-12,
                "{subject} to {base}: {found}"
            );
        };
        near(1, 0, 2.0);
        // Whatever the base took elsewhere: here it was half as slow again.
        near(2, 0, 2.0);
        near(2, 1, 1.5);
        near(0, 1, 0.5);
        near(1, 1, 1.0);
        assert!(turns.ratio(0, 2).median.is_nan() && turns.ratio(3, 0).median.is_nan());
        assert!(turns.settled());
    }

    #[test]
    fn a_wide_spread_is_no_conclusion() {
        let base = [10.0; 5];
        let wild = [5.0, 9.0, 7.0, 12.0, 3.0];
        let ratio = Ratio::of(&wild, &base);
        assert!(!ratio.conclusive() && ratio.to_string().contains('?'));
        // Two rounds are none, however equal.
        assert!(!Ratio::of(&[1.0, 1.0], &[1.0, 1.0]).conclusive());
        assert!(Ratio::of(&[], &[]).median.is_nan());
    }

    #[test]
    fn more_rounds_make_it_surer() {
        // Scatter of 5 %: enough with many rounds, not with four.
        let noisy = |n: usize| -> Vec<f64> {
            (0..n)
                .map(|i| 1.0 + 0.05 * ((i * 7919 % 13) as f64 / 6.0 - 1.0))
                .collect()
        };
        let [few, many] = [4, 40].map(|n| Ratio::of(&noisy(n), &vec![1.0; n]).uncertainty);
        assert!(many < 0.6 * few && many < CONCLUSIVE, "{few} {many}");
    }

    #[test]
    fn quartiles_lie_between() {
        let middle = Middle::of(&[4.0, 1.0, 3.0, 2.0, 5.0]);
        assert_eq!((middle.median, middle.quartiles), (3.0, (2.0, 4.0)));
        assert_eq!(Middle::of(&[7.0]).quartiles, (7.0, 7.0));
        assert_eq!(Middle::of(&[]).median, 0.0);
    }
}
