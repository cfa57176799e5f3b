//! Tests of the shipped tables: they are valid, and the same after a round trip.

use crate::support::name_of;
use qcbus_schema::{SHIPPED, Schema};

#[test]
fn every_table_is_read_and_written_back_unchanged() {
    for shipped in &SHIPPED {
        let name = name_of(shipped);
        let schema = shipped
            .schema()
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(schema.to_notation(), shipped.notation, "{name}");
    }
}

#[test]
fn broken_table_is_refused_with_its_line() {
    let good = SHIPPED[0].notation;
    for (from, to, expected) in [
        ("qcbus-schema 1", "qcbus-schema 9", "line 1"),
        ("simple 0 =", "simple 7 =", "numbered in order"),
        ("state 0", "state 5", "numbered in order"),
        ("edition", "addition", "unknown statement"),
        ("child header c", "child header c9", "undefined"),
    ] {
        let error = Schema::from_notation(&good.replacen(from, to, 1)).expect_err(from);
        assert!(error.to_string().contains(expected), "{from}: {error}");
    }
}

#[test]
fn truncated_tables_never_panic() {
    let text = SHIPPED[7].notation;
    for cut in (0..text.len()).step_by(97) {
        if let Some(part) = text.get(..cut) {
            let _ = Schema::from_notation(part);
        }
    }
}
