//! Counts and prints the actions of the driver.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Instant;

/// Actions by kind, and their log in order.
#[derive(Debug, Clone)]
pub struct Tally {
    counts: BTreeMap<&'static str, u64>,
    lines: Vec<String>,
    start: Instant,
}

/// Number of actions printed after a failure.
const TOLD: usize = 120;

impl Tally {
    /// Creates an empty tally.
    pub fn new() -> Tally {
        Tally {
            counts: BTreeMap::new(),
            lines: Vec::new(),
            start: Instant::now(),
        }
    }

    /// Counts an action, and logs it with its time.
    pub fn note(&mut self, kind: &'static str, what: &str) {
        *self.counts.entry(kind).or_default() += 1;
        let line = format!("{:9.3} {kind} {what}", self.start.elapsed().as_secs_f64());
        if kind.starts_with("kill") {
            crate::report(&line);
        }
        self.lines.push(line);
    }

    /// Returns the number of killed processes.
    pub fn kills(&self) -> u64 {
        let kills = self
            .counts
            .iter()
            .filter(|(kind, _)| kind.starts_with("kill"));
        kills.map(|(_, count)| count).sum()
    }

    /// Returns the last actions.
    pub fn last_lines(&self) -> String {
        self.lines[self.lines.len().saturating_sub(TOLD)..].join("\n")
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = self
            .counts
            .iter()
            .map(|(kind, count)| format!("{kind} {count}"));
        f.write_str(&counts.collect::<Vec<_>>().join(", "))
    }
}
