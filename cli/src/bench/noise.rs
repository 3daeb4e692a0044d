//! Throughput of the noises, against hand-tuned kernels of the same noises.

use serde_json::json;
use veduta::eval::{Evaluator, Spec};

use super::baseline::{AIM_SPEED, Gauge, Speed, rate};
use super::timing::Middle;
use super::{Bench, table};
use crate::error::CliError;

/// A noise, and what a hand-tuned kernel of it reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// The function that is imported.
    pub import: &'static str,
    /// A call of it, with the whole numbers `c` and `k` and a fraction `f`.
    pub call: &'static str,
    /// Millions of evaluations a second of processor time by hand, at the speed [`AIM_SPEED`]; where one was written.
    pub by_hand: Option<f64>,
}

const fn noise(import: &'static str, call: &'static str, by_hand: Option<f64>) -> Noise {
    Noise {
        import,
        call,
        by_hand,
    }
}

/// What is measured. Each is called with another cell every time, and all octaves of the clouds' field count as one.
pub const NOISES: [Noise; 8] = [
    noise(
        "veduta::noise::value::value_noise_2d",
        "value_noise_2d(vec2<i32>(c, k), vec2<f32>(f, 1.0 - f), 7u)",
        Some(507.0),
    ),
    noise(
        "veduta::noise::value::value_noise_3d",
        "value_noise_3d(vec3<i32>(c, c + 5, k), vec3<f32>(f, 1.0 - f, 0.3), 7u)",
        Some(305.0),
    ),
    noise(
        "veduta::noise::gradient::gradient_noise_2d",
        "gradient_noise_2d(vec2<i32>(c, k), vec2<f32>(f, 1.0 - f), 7u)",
        Some(156.0),
    ),
    noise(
        "veduta::noise::gradient::gradient_noise_3d",
        "gradient_noise_3d(vec3<i32>(c, c + 5, k), vec3<f32>(f, 1.0 - f, 0.3), 7u)",
        Some(185.0),
    ),
    noise(
        "veduta::noise::gradient::gradient_noise_2d_slope",
        "gradient_noise_2d_slope(vec2<i32>(c, k), vec2<f32>(f, 1.0 - f), 7u).y",
        Some(143.0),
    ),
    noise(
        "veduta::noise::simplex::simplex_noise_2d",
        "simplex_noise_2d(vec2<i32>(c, k), vec2<f32>(f, 1.0 - f), 7u)",
        Some(174.0),
    ),
    noise(
        "veduta::noise::simplex::simplex_noise_3d",
        "simplex_noise_3d(vec3<i32>(c, c + 5, k), vec3<f32>(f, 1.0 - f, 0.3), 7u)",
        Some(214.0),
    ),
    noise(
        "veduta::fractal::fbm::fbm_value_3d_torus_six",
        "fbm_value_3d_torus_six(vec3<u32>(bitcast<u32>(c)) * vec3<u32>(7919u, 79190001u, 79190000u), 2u, 0.5, 7u)",
        Some(57.5),
    ),
];

const CALLS: u32 = 2000;

/// One round.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// The machine's speed at that moment.
    pub speed: Speed,
    /// Millions of evaluations a second, as in [`NOISES`].
    pub rates: Vec<f64>,
}

/// Measures all noises once a round.
///
/// # Errors
/// Faults of the device.
pub fn run(
    bench: &Bench,
    rounds: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Round>, CliError> {
    let library = bench
        .job("thesis", "thesis", "V01", &[])?
        .catalog
        .library()?;
    let gauge = Gauge::new(&bench.gpu, &library)?;
    let kernels = NOISES
        .iter()
        .map(|noise| {
            let prelude = format!(
                "fn repeat(i: i32) -> f32 {{\n    var sum = 0.0;\n    for (var k = 0; k < {CALLS}; k++) {{\n        \
                 let c = i * 7919 + k * 13;\n        let f = f32((c * 7) & 1023) * 0.0009765625;\n        sum += {};\n    \
                 }}\n    return sum;\n}}\n",
                noise.call
            );
            Ok(Evaluator::new(
                &bench.gpu,
                &library,
                &Spec {
                    imports: &[noise.import],
                    prelude: &prelude,
                    prelude_file: "",
                    expression: "repeat(in.i[0])",
                    columns: 1, features: &[], },
            )?)
        })
        .collect::<Result<Vec<_>, CliError>>()?;
    let mut done = Vec::new();
    for k in 0..rounds.max(1) {
        progress(&format!("round {} of {}", k + 1, rounds.max(1)));
        let speed = gauge.speed()?;
        let rates = kernels
            .iter()
            .map(|kernel| rate(kernel, f64::from(CALLS)))
            .collect::<Result<_, _>>()?;
        done.push(Round { speed, rates });
    }
    Ok(done)
}

/// Medians of the rate, of the rate at the aim's speed by the four chains, and of its share of the rate by hand.
pub fn medians(rounds: &[Round], noise: usize) -> [f64; 3] {
    let of = |f: &dyn Fn(&Round, f64) -> f64| {
        let values: Vec<f64> = rounds
            .iter()
            .filter_map(|r| Some(f(r, *r.rates.get(noise)?)))
            .collect();
        Middle::of(&values).median
    };
    let scaled = of(&|r, rate| rate * AIM_SPEED.side_by_side / r.speed.side_by_side);
    let by_hand = NOISES.get(noise).and_then(|n| n.by_hand);
    [
        of(&|_, rate| rate),
        scaled,
        by_hand.map_or(f64::NAN, |h| scaled / h),
    ]
}

/// The rounds as a document.
pub fn markdown(bench: &Bench, rounds: &[Round], command: &str) -> String {
    let mut rows = vec![
        [
            "noise",
            "measured [M/s]",
            "at the aim's speed [M/s]",
            "by hand [M/s]",
            "share",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for (k, noise) in NOISES.iter().enumerate() {
        let [measured, scaled, share] = medians(rounds, k);
        rows.push(vec![
            format!("`{}`", noise.import.trim_start_matches("veduta::")),
            format!("{measured:.0}"),
            format!("{scaled:.0}"),
            noise.by_hand.map_or("-".to_owned(), |h| format!("{h:.0}")),
            format!("{:.0} %", 100.0 * share),
        ]);
    }
    let speeds: Vec<f64> = rounds.iter().map(|r| r.speed.side_by_side).collect();
    format!(
        "# Throughput of the noises\n\nWritten by `{command}`.\n\n{}\n\
         Millions of evaluations a second of processor time, medians of {} rounds. Kernels tuned by hand were measured on a machine\n\
         that makes {:.0} million PCG hashes a second in four chains side by side; this one made {:.0} in the middle, and every\n\
         round is scaled by its own. All are judged with the hashes and the carrying of fractions that the library has; those by\n\
         hand hash with less.\n\n{}",
        bench.machine(),
        rounds.len(),
        AIM_SPEED.side_by_side,
        Middle::of(&speeds).median,
        table(&rows),
    )
}

/// The same as JSON.
pub fn to_json(bench: &Bench, rounds: &[Round], command: &str) -> serde_json::Value {
    let list: Vec<serde_json::Value> = NOISES
        .iter()
        .enumerate()
        .map(|(k, noise)| {
            let [measured, scaled, share] = medians(rounds, k);
            json!({ "noise": noise.import, "measured": measured, "scaled": scaled, "by_hand": noise.by_hand, "share": share })
        })
        .collect();
    let mut document = bench.head(command);
    document["noises"] = list.into();
    document
}
