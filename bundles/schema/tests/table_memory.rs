//! Test of the memory of the shipped tables. It is alone in its process, so nothing else allocates.

#![expect(
    clippy::expect_used,
    reason = "a test panics if its data is not as expected"
)]

use qcbus_schema::SHIPPED;

/// Returns the anonymous memory of this process in kilobytes.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has this file");
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("RssAnon:"));
    let number = line.and_then(|line| line.trim().strip_suffix(" kB"));
    number
        .and_then(|number| number.parse().ok())
        .expect("a number of kilobytes")
}

#[test]
fn all_tables_together_stay_below_ten_megabytes() {
    let before = memory();
    for shipped in &SHIPPED {
        assert!(shipped.schema().is_ok(), "{:?}", shipped.version);
    }
    let grown = memory() - before;
    assert!(grown > 100, "the measured size is too small: {grown} kB");
    assert!(grown < 10_000, "{grown} kB");
}
