//! How slow the machine is while it storms. A broker ends bundles that say nothing for four seconds, or
//! need six for a job. Where many times more is to be done than the processors can do, that happens
//! to bundles that do nothing wrong, so the judge must know how slow it was.

use std::time::{Duration, Instant};

use super::history::{Seen, What};

/// What is measured is how long a thread waits to get so much of a processor: longer than the
/// slice that the kernel gives it at once, so that it has to wait its turn.
const WORK: Duration = Duration::from_millis(5);

/// Between two measurements: they take one part in fifty of a processor.
pub const PAUSE: Duration = Duration::from_millis(250);

/// Work takes this many times longer than on a processor of its own: in a storm that has two processors
/// for itself it takes about four times as long.
const SLOW: f64 = 8.0;

/// Over so long a time before something: the longest limit of a storm's broker, and the time until the
/// watchers see what came of it.
const BEFORE: Duration = Duration::from_secs(10);

/// Whoever looks at the clock again and again and finds that more time has passed was off the processor.
const GLANCE: Duration = Duration::from_micros(50);

/// Works for [`WORK`], and returns how long that took.
pub fn measure() -> Duration {
    let begin = Instant::now();
    let (mut last, mut worked) = (begin, Duration::ZERO);
    while worked < WORK {
        let now = Instant::now();
        worked += (now - last).min(GLANCE);
        last = now;
    }
    last - begin
}

/// What the watchers' work took while it stormed.
#[derive(Debug)]
pub struct Strain(Vec<(Duration, Duration)>);

impl Strain {
    /// As it was seen.
    pub fn new(history: &[Seen]) -> Strain {
        let worked = history.iter().filter_map(|seen| match seen.what {
            What::Worked { took } => Some((seen.at, took)),
            _ => None,
        });
        Strain(worked.collect())
    }

    /// Whether the machine was too slow for the broker's limits to say anything about a bundle that
    /// was seen to be ended at this time.
    pub fn was_slow(&self, at: Duration) -> bool {
        self.slowness(at).is_none_or(|times| times >= SLOW)
    }

    /// How many times longer work took in the slowest ten seconds than on a processor of its own.
    pub fn slowest(&self) -> f64 {
        let times = self.0.iter().filter_map(|(at, _)| self.slowness(*at));
        times.fold(0.0, f64::max)
    }

    /// On average before this time; `None` when nothing came to its end.
    fn slowness(&self, at: Duration) -> Option<f64> {
        let near = self
            .0
            .iter()
            .filter(|(end, _)| *end <= at && *end + BEFORE >= at);
        let (count, sum) = near.fold((0, Duration::ZERO), |(count, sum), (_, took)| {
            (count + 1, sum + *took)
        });
        (count > 0).then(|| sum.as_secs_f64() / (WORK * count).as_secs_f64())
    }
}

#[test]
fn death_is_excused_by_a_slow_machine_and_by_no_other() {
    let strain = |times: u32| {
        let worked = |second| (Duration::from_secs(second), WORK * times);
        Strain((0..60).map(worked).collect())
    };
    let at = Duration::from_secs(30);
    assert!(!strain(3).was_slow(at));
    assert!(strain(20).was_slow(at));
    let mut only_before = strain(3);
    for (_, took) in &mut only_before.0[..15] {
        *took = WORK * 50;
    }
    assert!(!only_before.was_slow(at));
    assert!(only_before.was_slow(Duration::from_secs(15)));
    // Nothing came to its end for ten seconds.
    assert!(strain(3).was_slow(Duration::from_secs(100)));
}
