//! Integrals that must be 1 whatever the arguments are: phase functions over the sphere, the sun's disc over the sky.

use std::f64::consts::PI;

use veduta::device::Gpu;
use veduta::eval::{Evaluator, Spec};
use veduta_compose::Library;

use super::check::{Check, Fault};
use crate::error::CliError;

/// A function of a cosine and further arguments whose integral over the sphere is 1.
struct Integral {
    module: &'static str,
    call: &'static str,
    /// Sets of further arguments.
    sets: Vec<Vec<f32>>,
    /// How far the integral may be off.
    slack: f64,
}

/// The asymmetries from end to end.
const G: [f32; 11] = [
    -0.999, -0.99, -0.9, -0.5, -1e-30, 0.0, 1e-7, 0.5, 0.9, 0.99, 0.999,
];

fn integrals() -> Vec<Integral> {
    let phase = "veduta::lighting::phase";
    let one = |list: &[f32]| list.iter().map(|g| vec![*g]).collect::<Vec<_>>();
    let mut lobes = Vec::new();
    for forward in [0.0, 0.5, 0.99] {
        for backward in [0.0, -0.5, -0.99] {
            lobes.extend([0.0, 0.3, 1.0].map(|share| vec![forward, backward, share]));
        }
    }
    let mut draine = Vec::new();
    for g in G {
        draine.extend([0.0, 1.0, 100.0].map(|alpha| vec![g, alpha]));
    }
    vec![
        Integral {
            module: phase,
            call: "phase_isotropic()",
            sets: vec![vec![]],
            slack: 1e-5,
        },
        Integral {
            module: phase,
            call: "phase_rayleigh(in.f[0])",
            sets: vec![vec![]],
            slack: 1e-5,
        },
        Integral {
            module: phase,
            call: "phase_henyey_greenstein(in.f[0], in.f[1])",
            sets: one(&G),
            slack: 2e-3,
        },
        Integral {
            module: phase,
            call: "phase_double_henyey_greenstein(in.f[0], in.f[1], in.f[2], in.f[3])",
            sets: lobes,
            slack: 2e-3,
        },
        Integral {
            module: phase,
            call: "phase_schlick(in.f[0], in.f[1])",
            sets: one(&[-0.9, -0.5, 0.0, 0.5, 0.9]),
            slack: 2e-3,
        },
        Integral {
            module: phase,
            call: "phase_cornette_shanks(in.f[0], in.f[1])",
            sets: one(&G),
            slack: 2e-3,
        },
        Integral {
            module: phase,
            call: "phase_draine(in.f[0], in.f[1], in.f[2])",
            sets: draine,
            slack: 2e-3,
        },
        Integral {
            module: phase,
            call: "phase_henyey_greenstein_draine(in.f[0], in.f[1])",
            sets: one(&[5e-6, 1e-5, 2e-5, 5e-5]),
            slack: 2e-3,
        },
        Integral {
            module: "veduta::atmosphere::sun_disc",
            call: "sun_disc(vec3f(sqrt(max((1.0 - in.f[0]) * (1.0 + in.f[0]), 0.0)), in.f[0], 0.0), vec3f(0.0, 1.0, 0.0), in.f[1], in.f[2])",
            sets: vec![
                vec![0.01, 0.0],
                vec![0.01, 0.01],
                vec![0.1, 0.001],
                vec![0.1, 0.1],
                vec![0.05, 0.1],
            ],
            slack: 1e-2,
        },
    ]
}

/// Cosines, exact in f32, dense about both ends.
fn nodes() -> Vec<f32> {
    const HALF: i32 = 20_000;
    let mut found: Vec<f32> = (0..=HALF)
        .flat_map(|k| {
            // Distances from the end, from 1e-8 to 1.
            let gap = 1e-8_f64.powf(1.0 - f64::from(k) / f64::from(HALF));
            [(1.0 - gap) as f32, (gap - 1.0) as f32]
        })
        .collect();
    found.extend([-1.0, 1.0]);
    found.sort_by(f32::total_cmp);
    found.dedup();
    found
}

/// Checks the integrals of the functions whose path holds `filter`; the number of evaluations, and what is wrong.
///
/// # Errors
/// Faults of composing and of the device.
pub fn check(gpu: &Gpu, library: &Library, filter: &str) -> Result<(u64, Vec<Fault>), CliError> {
    let nodes = nodes();
    let (mut evaluations, mut faults) = (0, Vec::new());
    for integral in integrals() {
        let name = integral.call.split('(').next().unwrap_or("");
        let path = format!("{}::{name}", integral.module);
        if !path.contains(filter) {
            continue;
        }
        let columns = 1 + integral.sets[0].len();
        let imports = [path.as_str()];
        let device = Evaluator::new(
            gpu,
            library,
            &Spec {
                imports: &imports,
                expression: integral.call,
                columns,
                ..Spec::default()
            },
        )?;
        for set in &integral.sets {
            let rows: Vec<u32> = nodes
                .iter()
                .flat_map(|mu| std::iter::once(mu).chain(set).map(|v| v.to_bits()))
                .collect();
            let values = device.run(&rows)?;
            evaluations += values.len() as u64;
            // The trapezoid rule on the nodes as the device has them.
            let whole: f64 = nodes
                .windows(2)
                .zip(values.windows(2))
                .map(|(mu, v)| PI * (f64::from(mu[1]) - f64::from(mu[0])) * (v[0] + v[1]))
                .sum();
            if (whole - 1.0)
                .abs()
                .partial_cmp(&integral.slack)
                .is_none_or(|o| o.is_gt())
            {
                faults.push(Fault {
                    subject: path.trim_start_matches("veduta::").to_owned(),
                    check: Check::Energy,
                    what: format!("the integral over the sphere is {whole}, for {set:?}"),
                });
            }
        }
    }
    Ok((evaluations, faults))
}
