//! Adversarial inputs for every public function and every effect, on the device, with the bits read back.

pub mod airs;
pub mod check;
pub mod effects;
pub mod energy;
pub mod report;
pub mod samples;
pub mod subject;
pub mod twins;

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use veduta::device::Gpu;
use veduta::reference::parallel::parallel_map;
use veduta_compose::Library;

use self::check::{Finding, Work};
use self::subject::Subject;
use self::twins::{ELSEWHERE, Entry};
use crate::error::CliError;

/// How much is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Evaluations of all functions together.
    pub evaluations: u64,
    /// Evaluations of one function at least.
    pub least: u64,
    /// Whether bounds that are too generous fail.
    pub tight: bool,
}

/// The rows of a batch of a function of weight 1.
const BATCH: f64 = 32768.0;

/// The subjects with their entries.
///
/// # Errors
/// Faults of headers; [`CliError::Missing`] for a function without an entry, and for an entry without a function.
pub fn pairs<'a>(
    subjects: &'a [Subject],
    entries: &'a [Entry],
) -> Result<Vec<(&'a Subject, &'a Entry)>, CliError> {
    let missing = |what, name: &str| CliError::Missing {
        what,
        name: name.to_owned(),
        hint: "every public function has one entry in the registry of cli/src/stress/twins.rs"
            .to_owned(),
    };
    if let Some(lost) = entries
        .iter()
        .find(|e| subjects.iter().all(|s| s.path != e.path))
    {
        return Err(missing("public function", lost.path));
    }
    subjects
        .iter()
        .map(|subject| {
            let mut found = entries.iter().filter(|e| e.path == subject.path);
            match (found.next(), found.next()) {
                (Some(entry), None) => Ok((subject, entry)),
                _ => Err(missing("the only twin of function", &subject.path)),
            }
        })
        .collect()
}

/// The functions that read textures, which no row of numbers can hold, each with the test that judges it.
///
/// # Errors
/// Faults of headers; [`CliError::Missing`] for a function that the table does not name, and for a row without a function.
pub fn elsewhere<'a>(
    library: &Library,
    table: &[(&'a str, &'a str)],
) -> Result<Vec<(String, &'a str)>, CliError> {
    let missing = |what, name: &str| {
        CliError::Missing {
        what,
        name: name.to_owned(),
        hint: "every public function that reads a texture has one row, with the test that judges it, in the table ELSEWHERE of cli/src/stress/twins.rs"
            .to_owned(),
    }
    };
    let textured = Subject::textured(library)?;
    if let Some((lost, _)) = table
        .iter()
        .find(|(path, _)| textured.iter().all(|t| t != path))
    {
        return Err(missing("public function with textures", lost));
    }
    textured
        .into_iter()
        .map(|path| {
            let mut found = table.iter().filter(|(known, _)| *known == path);
            match (found.next(), found.next()) {
                (Some((_, test)), None) => Ok((path, *test)),
                _ => Err(missing("the only test of function", &path)),
            }
        })
        .collect()
}

/// Shares evaluations out so that each function takes about the same time, none less than the least.
pub fn shares(weights: &[f64], plan: &Plan) -> Vec<u64> {
    let mut counts = vec![plan.least; weights.len()];
    let mut fixed = vec![false; weights.len()];
    loop {
        let taken: u64 = fixed.iter().filter(|f| **f).count() as u64 * plan.least;
        let free = || weights.iter().zip(&fixed).filter(|(_, f)| !**f);
        let whole: f64 = free().map(|(w, _)| 1.0 / w).sum();
        let left = plan.evaluations.saturating_sub(taken) as f64;
        let mut changed = false;
        for k in 0..weights.len() {
            if !fixed[k] {
                counts[k] = (left / weights[k] / whole).ceil() as u64;
                if counts[k] < plan.least {
                    counts[k] = plan.least;
                    fixed[k] = true;
                    changed = true;
                }
            }
        }
        if !changed {
            return counts;
        }
    }
}

/// Stresses the functions whose path holds `filter` with the entries of [`twins::registry`]; `progress` hears evaluations
/// done and all.
///
/// # Errors
/// Faults of composing, of the registry and of the device. What functions do wrong stands in the findings.
pub fn functions(
    gpu: &Gpu,
    library: &Library,
    entries: &[Entry],
    plan: &Plan,
    filter: &str,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Vec<Finding>, CliError> {
    elsewhere(library, ELSEWHERE)?;
    let subjects = Subject::all(library)?;
    let mut chosen = pairs(&subjects, entries)?;
    chosen.retain(|(subject, _)| subject.path.contains(filter));
    if chosen.is_empty() {
        return Err(CliError::Missing {
            what: "function",
            name: filter.to_owned(),
            hint: "a part of a name such as veduta::noise::value::value_noise_2d".to_owned(),
        });
    }
    let weights: Vec<f64> = chosen.iter().map(|(_, e)| e.weight).collect();
    let counts = shares(&weights, plan);
    let all: u64 = counts.iter().sum();
    let done = AtomicU64::new(0);
    // The most expensive first, so that the cores end together.
    let mut order: Vec<usize> = (0..chosen.len()).collect();
    order.sort_by(|a, b| weights[*b].total_cmp(&weights[*a]));
    let failed = Mutex::new(None);
    let stopped = AtomicUsize::new(0);
    let mut findings = parallel_map(order.len(), |i| {
        let k = order[i];
        if stopped.load(Ordering::Relaxed) > 0 {
            return None;
        }
        let (subject, entry) = chosen[k];
        let work = || -> Result<Finding, CliError> {
            let mut work = Work::new(gpu, library, subject, entry)?;
            while work.evaluations() < counts[k] {
                let left = counts[k] - work.evaluations();
                let batch = (BATCH / entry.weight).max(256.0) as u64;
                let count = batch.min(left).max(1);
                work.run(count as usize)?;
                progress(done.fetch_add(count, Ordering::Relaxed) + count, all);
            }
            Ok(work.finish(plan.tight))
        };
        match work() {
            Ok(finding) => Some(finding),
            Err(error) => {
                stopped.store(1, Ordering::Relaxed);
                if let Ok(mut failed) = failed.lock() {
                    failed.get_or_insert(error);
                }
                None
            }
        }
    });
    if let Ok(Some(error)) = failed.into_inner() {
        return Err(error);
    }
    findings.sort_by(|a, b| {
        let name = |f: &Option<Finding>| f.as_ref().map(|f| f.function.clone());
        name(a).cmp(&name(b))
    });
    Ok(findings.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evaluations_are_shared_out_by_cost() {
        let plan = Plan {
            evaluations: 1_000_000,
            least: 1000,
            tight: false,
        };
        let counts = shares(&[1.0, 10.0, 1e6], &plan);
        assert_eq!(counts[2], 1000);
        assert!(counts[0] > 9 * counts[1] && counts[0] < 11 * counts[1]);
        assert!(counts.iter().sum::<u64>() >= plan.evaluations);
    }
}
