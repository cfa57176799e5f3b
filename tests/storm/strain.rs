//! Measures how slow the machine is during the storm. A broker ends bundles that are silent for
//! four seconds or need six for a job. On an overloaded machine this also happens to correct
//! bundles. The judge must therefore know the slowness.

use std::time::{Duration, Instant};

use super::history::{Seen, What};

/// Processor time of one measurement. The test measures how long a thread waits to get it. It is
/// longer than the kernel's time slice, so the thread must wait for others.
const WORK: Duration = Duration::from_millis(5);

/// Pause between two measurements. They take one fiftieth of a processor.
pub const PAUSE: Duration = Duration::from_millis(250);

/// Slowdown from which the machine counts as slow, relative to a processor of its own. In a storm
/// with two processors of its own, work takes about four times as long.
const SLOW: f64 = 8.0;

/// Period before an event over which the slowdown is averaged. It covers the longest limit of a
/// storm's broker, and the time until the watchers see the effect.
const BEFORE: Duration = Duration::from_secs(10);

/// Maximum time between two consecutive clock reads. If more time passes, the thread was off the
/// processor.
const GLANCE: Duration = Duration::from_micros(50);

/// Works for [`WORK`], and returns the elapsed time.
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

/// Times that the watchers' work took during the storm.
#[derive(Debug)]
pub struct Strain(Vec<(Duration, Duration)>);

impl Strain {
    /// Collects the measurements from the history.
    pub fn new(history: &[Seen]) -> Strain {
        let worked = history.iter().filter_map(|seen| match seen.what {
            What::Worked { took } => Some((seen.at, took)),
            _ => None,
        });
        Strain(worked.collect())
    }

    /// Checks whether the machine was too slow at this time. If so, a broker's limits prove nothing
    /// about a bundle that was ended then.
    pub fn was_slow(&self, at: Duration) -> bool {
        self.slowness(at).is_none_or(|times| times >= SLOW)
    }

    /// Returns the slowdown in the slowest ten seconds, relative to a processor of its own.
    pub fn slowest(&self) -> f64 {
        let times = self.0.iter().filter_map(|(at, _)| self.slowness(*at));
        times.fold(0.0, f64::max)
    }

    /// Returns the average slowdown before this time, or `None` if no measurement ended.
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
fn death_is_excused_only_by_a_slow_machine() {
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
    // No measurement ended for ten seconds.
    assert!(strain(3).was_slow(Duration::from_secs(100)));
}
