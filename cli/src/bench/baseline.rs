//! What a frame of the frozen baseline costs, and how fast the machine is at that moment.
//!
//! A shared machine changes its speed from hour to hour, and no load need show it. So every round also times two loops of
//! PCG hashes: one chain, which waits for each multiplication, and four chains side by side, which keep the units busy.
//! Their rates are known of the machine on which the baseline's aim was set.

use std::time::Instant;

use veduta::device::Gpu;
use veduta::eval::{Evaluator, Spec};
use veduta_compose::Library;

use super::timing::{Middle, Ratio, Subject};
use super::{Bench, table};
use crate::cpu::CpuTime;
use crate::error::CliError;

/// What the aim was measured with: millions of hashes a second of processor time.
pub const AIM_SPEED: Speed = Speed {
    chain: 960.0,
    side_by_side: 3500.0,
};

/// The aim for one frame of the baseline in milliseconds, give or take [`AIM_TOLERANCE`].
pub const AIM: f64 = 550.0;

/// The share of [`AIM`] that a frame may miss it by.
pub const AIM_TOLERANCE: f64 = 0.2;

const HASHES: u32 = 512;

const LOOPS: &str = "
fn chain(seed: u32) -> u32 {
    var a = seed;
    for (var j = 0; j < 128; j++) {
        a = pcg(pcg(pcg(pcg(a))));
    }
    return a;
}
fn side_by_side(seed: u32) -> u32 {
    var a = vec4<u32>(seed, seed + 77u, seed + 177u, seed + 277u);
    for (var j = 0; j < 64; j++) {
        a = vec4<u32>(pcg(a.x), pcg(a.y), pcg(a.z), pcg(a.w));
        a = vec4<u32>(pcg(a.x), pcg(a.y), pcg(a.z), pcg(a.w));
    }
    return a.x ^ a.y ^ a.z ^ a.w;
}
fn repeat_chain(seed: u32) -> u32 {
    var sum = 0u;
    for (var k = 0u; k < 16u; k++) {
        sum += chain(seed + k);
    }
    return sum;
}
fn repeat_side_by_side(seed: u32) -> u32 {
    var sum = 0u;
    for (var k = 0u; k < 16u; k++) {
        sum += side_by_side(seed + k);
    }
    return sum;
}
";

/// How fast a device hashes: millions of PCG hashes a second, of processor time where the system tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Speed {
    /// One chain.
    pub chain: f64,
    /// Four chains side by side.
    pub side_by_side: f64,
}

/// The loops, compiled.
#[derive(Debug)]
pub struct Gauge {
    chain: Evaluator,
    side_by_side: Evaluator,
}

impl Gauge {
    /// Compiles the loops.
    ///
    /// # Errors
    /// Faults of the device.
    pub fn new(gpu: &Gpu, library: &Library) -> Result<Gauge, CliError> {
        let compile = |expression: &str| {
            Evaluator::new(
                gpu,
                library,
                &Spec {
                    imports: &["veduta::hash::pcg::pcg"],
                    prelude: LOOPS,
                    prelude_file: "",
                    expression,
                    columns: 1,
                    features: &[],
                },
            )
        };
        Ok(Gauge {
            chain: compile("repeat_chain(in.u[0])")?,
            side_by_side: compile("repeat_side_by_side(in.u[0])")?,
        })
    }

    /// The rates of this moment.
    ///
    /// # Errors
    /// Faults of the device.
    pub fn speed(&self) -> Result<Speed, CliError> {
        let hashes = 16.0 * f64::from(HASHES);
        Ok(Speed {
            chain: rate(&self.chain, hashes)?,
            side_by_side: rate(&self.side_by_side, hashes)?,
        })
    }
}

/// Millions of evaluations a second of an expression whose rows take `evaluations` each: of processor time where the
/// system tells it. From the times of a short and of a long run, so that what a run costs by itself cancels.
///
/// # Errors
/// Faults of the device.
pub fn rate(expression: &Evaluator, evaluations: f64) -> Result<f64, CliError> {
    let time = |rows: u32| -> Result<f64, CliError> {
        let rows: Vec<u32> = (0..rows).collect();
        let (cpu, wall) = (CpuTime::now(), Instant::now());
        expression.run_bits(&rows)?;
        Ok(match (cpu, CpuTime::now()) {
            (Some(before), Some(after)) => after.since(&before),
            _ => wall.elapsed().as_secs_f64() * 1e3,
        })
    };
    // About 2^28 evaluations, and no single submission that runs long on a slow device.
    let many = ((2.0_f64.powi(28) / evaluations) as u32).clamp(1 << 10, 1 << 16);
    let few = many >> 7;
    time(few)?;
    let spent = time(many)? - time(few)?;
    Ok(f64::from(many - few) * evaluations / spent.max(1e-3) / 1e3)
}

/// A round: the machine's speed, and a frame of each subject in milliseconds.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// The speed of this moment.
    pub speed: Speed,
    /// The preset `thesis`, the whole scene.
    pub thesis: f64,
    /// The preset `thesis_skip`, the whole scene.
    pub skip: f64,
    /// The preset `thesis` without clouds.
    pub clear: f64,
}

impl Round {
    /// What the frame would have cost at the speed of the aim in milliseconds, by the chain and by the four chains.
    pub fn at_the_speed_of_the_aim(&self) -> (f64, f64) {
        (
            self.thesis * self.speed.chain / AIM_SPEED.chain,
            self.thesis * self.speed.side_by_side / AIM_SPEED.side_by_side,
        )
    }
}

/// Draws view V01 with both presets of the baseline and without clouds, in turns.
///
/// # Errors
/// Faults of the device.
pub fn run(
    bench: &Bench,
    rounds: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Round>, CliError> {
    let thesis = bench.job("thesis", "thesis", "V01", &[])?;
    let gauge = Gauge::new(&bench.gpu, &thesis.catalog.library()?)?;
    let mut subjects: [Subject; 3] = [
        bench.subject(&thesis, 0.0)?,
        bench.subject(&bench.job("thesis", "thesis_skip", "V01", &[])?, 0.0)?,
        bench.subject(&bench.job("clear", "thesis", "V01", &[])?, 0.0)?,
    ];
    for subject in &mut subjects {
        subject.renderer.warm_up(&subject.view)?;
    }
    let mut done = Vec::new();
    for k in 0..rounds.max(1) {
        progress(&format!("round {} of {}", k + 1, rounds.max(1)));
        let speed = gauge.speed()?;
        let [thesis, skip, clear] = &mut subjects;
        done.push(Round {
            speed,
            thesis: thesis.draw(bench.clock)?,
            skip: skip.draw(bench.clock)?,
            clear: clear.draw(bench.clock)?,
        });
    }
    Ok(done)
}

/// The rounds as a document.
pub fn markdown(bench: &Bench, rounds: &[Round], command: &str) -> String {
    let column = |f: &dyn Fn(&Round) -> f64| -> Vec<f64> { rounds.iter().map(f).collect() };
    let columns: [(&str, Vec<f64>); 7] = [
        ("PCG, one chain [M/s]", column(&|r| r.speed.chain)),
        ("PCG, four chains [M/s]", column(&|r| r.speed.side_by_side)),
        ("`thesis` [ms]", column(&|r| r.thesis)),
        ("`thesis_skip` [ms]", column(&|r| r.skip)),
        ("clear scene, `thesis` [ms]", column(&|r| r.clear)),
        (
            "`thesis` at the aim's speed by one chain [ms]",
            column(&|r| r.at_the_speed_of_the_aim().0),
        ),
        (
            "the same by four chains [ms]",
            column(&|r| r.at_the_speed_of_the_aim().1),
        ),
    ];
    let mut rows = vec![vec![
        "what".to_owned(),
        "median".to_owned(),
        "quartiles".to_owned(),
        "rounds".to_owned(),
    ]];
    for (name, values) in &columns {
        let middle = Middle::of(values);
        let each: Vec<String> = values.iter().map(|v| format!("{v:.0}")).collect();
        rows.push(vec![
            (*name).to_owned(),
            format!("{:.0}", middle.median),
            format!("{:.0} to {:.0}", middle.quartiles.0, middle.quartiles.1),
            each.join(", "),
        ]);
    }
    let over = |f: &dyn Fn(&Round) -> f64| Ratio::of(&column(&|r| r.thesis), &column(f));
    format!(
        "# What a frame of the baseline costs\n\nWritten by `{command}`.\n\n{}\n\
         One frame of view V01 a round, in turns. The aim is {AIM:.0} ms, give or take {:.0} %, on a machine that makes {:.0} million PCG \
         hashes\na second in one chain and {:.0} million in four chains side by side; the last two rows divide by how much\n\
         slower this machine was in the same round.\n\n{}\n\
         `thesis` over `thesis_skip` {}, over the clear scene {}.\n",
        bench.machine(),
        100.0 * AIM_TOLERANCE,
        AIM_SPEED.chain,
        AIM_SPEED.side_by_side,
        table(&rows),
        over(&|r| r.skip),
        over(&|r| r.clear),
    )
}
