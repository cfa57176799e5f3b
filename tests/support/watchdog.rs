//! Waiting for something to be so. Nothing here measures speed: the limit is longer than anything
//! takes on the slowest machine, and only a hang gets there.

use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// Longer than anything takes. Whoever writes a test may be less patient: `QCBUS_TEST_PATIENCE`
/// is a number of seconds.
pub static LONG: LazyLock<Duration> = LazyLock::new(|| {
    let seconds = std::env::var("QCBUS_TEST_PATIENCE")
        .ok()
        .and_then(|text| text.parse().ok());
    Duration::from_secs(seconds.unwrap_or(180))
});

/// How often the world is looked at.
const LOOK: Duration = Duration::from_millis(10);

/// Waits until `look` gives something.
///
/// # Panics
/// When it never does, with what was waited for and what `explain` says.
pub fn until_or<T>(
    what: &str,
    mut look: impl FnMut() -> Option<T>,
    explain: impl FnOnce() -> String,
) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(
            start.elapsed() < *LONG,
            "the watchdog: {what}: this never happened\n{}",
            explain()
        );
        pause(LOOK);
    }
}

/// Waits until `look` gives something.
pub fn until<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    until_or(what, look, String::new)
}

/// Waits until something is so.
pub fn until_so(what: &str, mut look: impl FnMut() -> bool) {
    until(what, || look().then_some(()));
}

/// Lets time pass: for whoever makes trouble at random, never for whoever waits for an outcome.
pub fn pause(time: Duration) {
    std::thread::sleep(time);
}
