//! Checks that the list of rules in the bundle's README is complete. `QCBUS_BLESS=1` writes it.

use std::fmt::Write as _;

use qcbus_modular::BUNDLE;

const README: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
const BEGIN: &str = "| rule | level | what it demands |\n|---|---|---|\n";

fn table() -> String {
    let mut table = BEGIN.to_owned();
    for checker in BUNDLE.checkers() {
        let uid = checker.facts.uids.first().unwrap();
        let name = uid.rsplit(':').next().unwrap();
        let level = format!("{:?}", checker.facts.level).to_lowercase();
        writeln!(table, "| `{name}` | {level} | {} |", checker.description).unwrap();
    }
    table
}

#[test]
fn readme_lists_every_rule() {
    let text = std::fs::read_to_string(README).unwrap();
    let (before, after) = text.split_once(BEGIN).unwrap();
    let rest = after.find("\n\n").map_or("", |end| &after[end + 1..]);
    let wanted = format!("{before}{}{rest}", table());
    if std::env::var_os("QCBUS_BLESS").is_some() {
        std::fs::write(README, &wanted).unwrap();
        return;
    }
    assert!(
        text == wanted,
        "run with QCBUS_BLESS=1 and look at the difference:\n{wanted}"
    );
}
