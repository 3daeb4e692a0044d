//! What was found, as a table, as Markdown and as JSON.

use serde_json::json;

use super::check::{Fault, Finding};
use super::effects::Pictures;
use crate::bench::table;
use veduta_compose::header::ErrorKind;

/// Everything that a run has found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// One a function, by name.
    pub findings: Vec<Finding>,
    /// Functions that read textures, each with the test that judges it.
    pub elsewhere: Vec<(String, &'static str)>,
    /// Evaluations for integrals.
    pub integral_evaluations: u64,
    /// What is wrong with integrals.
    pub integral_faults: Vec<Fault>,
    /// The pictures, if they were drawn.
    pub pictures: Option<Pictures>,
}

fn kind(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::Abs => "abs",
        ErrorKind::Rel => "rel",
        ErrorKind::Ulp => "ulp",
    }
}

fn scientific(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else {
        format!("{value:.2e}")
    }
}

impl Report {
    /// All evaluations.
    pub fn evaluations(&self) -> u64 {
        self.findings.iter().map(|f| f.evaluations).sum::<u64>() + self.integral_evaluations
    }

    /// Everything that is wrong.
    pub fn faults(&self) -> impl Iterator<Item = &Fault> {
        let pictures = self.pictures.iter().flat_map(|p| &p.faults);
        let functions = self.findings.iter().flat_map(|f| &f.faults);
        functions.chain(&self.integral_faults).chain(pictures)
    }

    /// The table of the functions.
    pub fn table(&self) -> String {
        let mut rows = vec![
            [
                "function",
                "evaluations",
                "largest error",
                "bound",
                "share of bound",
                "mean error",
                "left out",
                "outside",
                "worst input",
            ]
            .map(str::to_owned)
            .to_vec(),
        ];
        for f in &self.findings {
            let bound = f.bound.as_ref();
            let share = bound.filter(|b| b.value > 0.0).map(|b| f.largest / b.value);
            let inside = (f.evaluations - f.outside).max(1) as f64;
            rows.push(vec![
                format!("`{}`", f.function),
                f.evaluations.to_string(),
                scientific(f.largest),
                bound.map_or("-".to_owned(), |b| {
                    format!("{:e} {}", b.value, kind(b.kind))
                }),
                share.map_or("-".to_owned(), |s| format!("{:.0} %", 100.0 * s)),
                scientific(f.mean),
                match f.left_out {
                    0 => "-".to_owned(),
                    n => format!("{:.1e}", n as f64 / inside),
                },
                match (f.outside_not_finite, f.outside) {
                    (0, 0) => "-".to_owned(),
                    (0, _) => "finite".to_owned(),
                    _ => "not finite".to_owned(),
                },
                match (&f.worst, f.largest > 0.0) {
                    (Some(worst), true) => worst.clone(),
                    _ => "-".to_owned(),
                },
            ]);
        }
        table(&rows)
    }

    /// What is wrong, a line each.
    pub fn fault_lines(&self) -> String {
        self.faults()
            .map(|f| format!("{}: {}: {}\n", f.subject, f.check.name(), f.what))
            .collect()
    }

    /// The document `docs/accuracy.md`.
    pub fn markdown(&self, machine: &str, command: &str) -> String {
        let mut text =
            format!("# Accuracy of the functions\n\nWritten by `{command}`.\n\n{machine}");
        text += &format!(
            "- {} functions, {} evaluations\n",
            self.findings.len(),
            self.evaluations()
        );
        if let Some(p) = &self.pictures {
            text += &format!(
                "- {} pictures at extreme places and settings: {} pixels, the brightest at {} of its bound; {} values refused\n",
                p.drawn,
                p.pixels,
                scientific(p.share),
                p.refused
            );
        }
        let faults = self.fault_lines();
        text += "\nErrors are the distances from the twins in f64 on the device, in the measure of the bound, which stands in the\nfunction's header. The mean is that of all components. `left out` is the share of results that are not determined: the\ntwin reaches them when the arguments move by units in the last place. `outside` says whether results are finite for\narguments outside of the domain, up to 1e30.\n\n";
        text += &self.table();
        let notes: Vec<String> = self
            .findings
            .iter()
            .filter(|f| !f.notes.is_empty())
            .map(|f| format!("- `{}`: {}", f.function, f.notes.join("; ")))
            .collect();
        if !notes.is_empty() {
            text += "\n## Arguments\n\nWhat the headers do not say: domains of members, arguments that belong together, parts of domains that are sampled,\nand where results are left out.\n\n";
            text += &notes.join("\n");
            text += "\n";
        }
        if !self.elsewhere.is_empty() {
            text += "\n## Judged elsewhere\n\nFunctions that read textures, and the tests of `tests/all` that hold them against their references.\n\n";
            for (path, test) in &self.elsewhere {
                let short = path.strip_prefix("veduta::").unwrap_or(path);
                text += &format!("- `{short}`: `{test}`\n");
            }
        }
        let outside: Vec<String> = self
            .findings
            .iter()
            .filter_map(|f| Some((f, f.outside_example.as_ref()?)))
            .map(|(f, example)| format!("- `{}`: {example}", f.function))
            .collect();
        if !outside.is_empty() {
            text += "\n## Outside of the domain\n\nOne result a function that is not finite.\n\n";
            text += &outside.join("\n");
            text += "\n";
        }
        if !faults.is_empty() {
            text += "\n## Faults\n\n```text\n";
            text += &faults;
            text += "```\n";
        }
        text
    }

    /// The same as JSON.
    pub fn json(&self) -> serde_json::Value {
        let fault =
            |f: &Fault| json!({ "subject": f.subject, "check": f.check.name(), "what": f.what });
        let functions: Vec<serde_json::Value> = self
            .findings
            .iter()
            .map(|f| {
                json!({
                    "function": f.function,
                    "evaluations": f.evaluations,
                    "outside": f.outside,
                    "left_out": f.left_out,
                    "largest_error": f.largest,
                    "mean_error": f.mean,
                    "bound": f.bound.as_ref().map(|b| b.value),
                    "measure": f.bound.as_ref().map(|b| kind(b.kind)),
                    "reference": f.bound.as_ref().map(|b| b.reference.clone()),
                    "worst_input": f.worst,
                    "outside_not_finite": f.outside_not_finite,
                    "outside_example": f.outside_example,
                    "outside_undefined": f.outside_undefined,
                    "notes": f.notes,
                    "seconds": f.seconds,
                })
            })
            .collect();
        let faults: Vec<serde_json::Value> = self.faults().map(fault).collect();
        json!({
            "evaluations": self.evaluations(),
            "functions": functions,
            "elsewhere": self.elsewhere.iter().map(|(function, test)| json!({ "function": function, "test": test })).collect::<Vec<_>>(),
            "pictures": self.pictures.as_ref().map(|p| json!({
                "drawn": p.drawn,
                "pixels": p.pixels,
                "refused": p.refused,
                "share_of_bound": p.share,
            })),
            "faults": faults,
        })
    }
}
