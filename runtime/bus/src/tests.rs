//! Tests of the broker's end of the bus with peers that do not use this crate's [`Peer`](crate::Peer).

#[expect(dead_code, reason = "the integration tests use all of them")]
#[path = "../tests/bus/support.rs"]
mod support;

mod fuzz;
mod hostile;
mod rogue;

/// Waits until a lock that was just dropped is free. A test in another thread that starts a process
/// passes the locked descriptor to it until its `exec`.
pub(crate) fn unlocked(what: &str, is_free: impl Fn() -> bool) {
    let begin = std::time::Instant::now();
    while !is_free() {
        let waited = begin.elapsed();
        assert!(waited.as_secs() < 120, "after {waited:?}: {what}");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}
