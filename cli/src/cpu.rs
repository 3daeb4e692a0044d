//! How much processor time this process has used.

use std::collections::BTreeMap;

/// Processor time of all threads at one moment.
#[derive(Debug, Clone)]
pub struct CpuTime {
    /// User and system time in units of 10 ms, ended threads included.
    ticks: u64,
    /// Nanoseconds of each living thread.
    threads: BTreeMap<u32, u64>,
}

/// Ticks a second in `/proc`: 100 on every Linux that Rust's standard library supports.
const TICKS_A_SECOND: f64 = 100.0;

impl CpuTime {
    /// The time used so far; `None` where there is no `/proc/self/stat`.
    pub fn now() -> Option<CpuTime> {
        let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
        // The process's name stands in parentheses and may hold blanks.
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        let field = |i: usize| fields.get(i)?.parse::<u64>().ok();
        let ticks = field(11)? + field(12)?;
        let mut threads = BTreeMap::new();
        for entry in std::fs::read_dir("/proc/self/task")
            .into_iter()
            .flatten()
            .flatten()
        {
            let name = entry.file_name();
            let Some(id) = name.to_str().and_then(|n| n.parse().ok()) else {
                continue;
            };
            // A thread may end while we look; kernels may lack the file.
            let Ok(text) = std::fs::read_to_string(entry.path().join("schedstat")) else {
                continue;
            };
            if let Some(ns) = text.split_whitespace().next().and_then(|n| n.parse().ok()) {
                threads.insert(id, ns);
            }
        }
        Some(CpuTime { ticks, threads })
    }

    /// Milliseconds used since `earlier`.
    ///
    /// Taken from the scheduler's nanoseconds, unless threads that have ended hide there: then from the ticks of 10 ms.
    pub fn since(&self, earlier: &CpuTime) -> f64 {
        let coarse = self.ticks.saturating_sub(earlier.ticks) as f64 * 1e3 / TICKS_A_SECOND;
        let fine: u64 = self
            .threads
            .iter()
            .map(|(id, ns)| ns.saturating_sub(earlier.threads.get(id).copied().unwrap_or(0)))
            .sum();
        let fine = fine as f64 / 1e6;
        if self.threads.is_empty() || coarse > fine + 50.0 {
            coarse
        } else {
            fine
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn work_is_seen() {
        let start = CpuTime::now().unwrap();
        let mut x = 1_u64;
        while CpuTime::now().unwrap().since(&start) < 30.0 {
            for _ in 0..100_000 {
                x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            }
            std::hint::black_box(x);
        }
        let used = CpuTime::now().unwrap().since(&start);
        assert!((30.0..10_000.0).contains(&used), "{used}");
    }
}
