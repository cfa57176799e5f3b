//! Waits for conditions. Nothing here measures speed: the limit is longer than any step takes on
//! the slowest machine. Only a hang reaches it.

use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// Time limit of a wait, longer than any step takes. `QCBUS_TEST_PATIENCE` sets another number of
/// seconds, for example a shorter limit while writing a test.
pub static LONG: LazyLock<Duration> = LazyLock::new(|| {
    let seconds = std::env::var("QCBUS_TEST_PATIENCE")
        .ok()
        .and_then(|text| text.parse().ok());
    Duration::from_secs(seconds.unwrap_or(180))
});

/// Interval between two checks of a condition.
const LOOK: Duration = Duration::from_millis(10);

/// Waits until `look` returns a value.
///
/// # Panics
/// Panics if `look` never returns a value. The message contains `what` and the text of `explain`.
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
            "watchdog timeout: {what}: this did not happen\n{}",
            explain()
        );
        pause(LOOK);
    }
}

/// Waits until `look` returns a value.
pub fn until<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    until_or(what, look, String::new)
}

/// Waits until a condition holds.
pub fn until_so(what: &str, mut look: impl FnMut() -> bool) {
    until(what, || look().then_some(()));
}

/// Sleeps for some time. Only tests that cause random failures use it, never tests that wait for a
/// result.
pub fn pause(time: Duration) {
    std::thread::sleep(time);
}
