//! Measures the time of every checker, for authors of rules. No result depends on it.

use std::fmt;
use std::time::Duration;

/// Times of the checkers of one run.
#[derive(Debug, Clone, Default)]
pub struct Timings {
    /// Each demanded checker, with the time from its start to its end. The first checker computes
    /// shared data, and this counts as its time.
    pub checkers: Vec<(String, Duration)>,
    /// Time of the whole check.
    pub whole: Duration,
}

impl Timings {
    /// Returns the sum of the times of all checkers.
    pub fn sum(&self) -> Duration {
        self.checkers.iter().map(|(_, took)| *took).sum()
    }
}

impl fmt::Display for Timings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut line = |took: Duration, what: &str| {
            let milliseconds = took.as_secs_f64() * 1e3;
            writeln!(f, "{milliseconds:10.3} ms  {what}")
        };
        let mut checkers: Vec<&(String, Duration)> = self.checkers.iter().collect();
        checkers.sort_by(|one, next| next.1.cmp(&one.1).then_with(|| one.0.cmp(&next.0)));
        for (id, took) in checkers {
            line(*took, id)?;
        }
        line(self.sum(), "all checkers")?;
        line(
            self.whole.saturating_sub(self.sum()),
            "models, preconditions, results",
        )?;
        line(self.whole, "altogether")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slowest_checker_comes_first_followed_by_sums() {
        let millis = Duration::from_millis;
        let checkers = [("quick", 1), ("slow", 30), ("idle", 0)];
        let timings = Timings {
            checkers: checkers
                .map(|(id, took)| (id.to_owned(), millis(took)))
                .into(),
            whole: millis(40),
        };
        let text = timings.to_string();
        let lines: Vec<Vec<&str>> = text
            .lines()
            .map(|line| line.split_whitespace().collect())
            .collect();
        let column = |at: usize| -> Vec<&str> { lines.iter().map(|line| line[at]).collect() };
        assert_eq!(
            column(2),
            ["slow", "quick", "idle", "all", "models,", "altogether"]
        );
        assert_eq!(
            column(0),
            ["30.000", "1.000", "0.000", "31.000", "9.000", "40.000"]
        );
    }
}
