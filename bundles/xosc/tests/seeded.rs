//! Real scenarios, broken as authors break them, and changed within what is allowed: the faults are found
//! where they are, and nothing is said against the rest. `tests/seeded/README.md` describes the lists.
//!
//! The scenarios of three projects are among the shared cases; those of the others are below `QCBUS_SCENARIOS`.
//! What is not at hand is skipped. `QCBUS_BLESS=1` writes `docs/evidence/seeded-scenarios.md` when all are;
//! `QCBUS_SEEDED=ID` tries the entries whose id contains it, and says what each leads to.

#![expect(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    reason = "a test may fail and tell what it tried"
)]

#[path = "seeded/engine.rs"]
mod engine;
#[path = "seeded/judge.rs"]
mod judge;
#[path = "seeded/page.rs"]
mod page;
#[path = "seeded/table.rs"]
mod table;
#[path = "seeded/trials.rs"]
mod trials;

use std::collections::BTreeMap;
use std::io::Write as _;

use judge::Trial;
use table::Entry;
use trials::{Trials, try_all};

const FAULTS: &str = include_str!("seeded/faults.txt");
const HARMLESS: &str = include_str!("seeded/harmless.txt");
const PAGE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../docs/evidence/seeded-scenarios.md"
);

/// Of those that are tried, in hundredths.
const MIN_FOUND: usize = 85;

#[test]
fn faults_are_found_and_harmless_variants_are_not_rejected() {
    let (faults, harmless) = (table::read(FAULTS).unwrap(), table::read(HARMLESS).unwrap());
    assert!(faults.iter().all(|entry| entry.level.is_some()));
    assert!(harmless.iter().all(|entry| entry.level.is_none()));
    let wanted = std::env::var("QCBUS_SEEDED").unwrap_or_default();
    let entries: Vec<&Entry> = faults.iter().chain(&harmless).collect();
    let entries: Vec<&Entry> = entries
        .into_iter()
        .filter(|entry| entry.id.contains(&wanted))
        .collect();
    let (faults, harmless, errors) = try_all(&entries).split();
    tell(&counts("faults", &faults, "found", |it| {
        it.found.is_enough()
    }));
    tell(&counts("harmless variants", &harmless, "rejected", |it| {
        it.is_alarm()
    }));
    assert!(errors.is_empty(), "cannot be tried:\n{}", errors.join("\n"));
    if faults.done.is_empty() && harmless.done.is_empty() {
        return tell("skipped: no scenario is at hand\n");
    }
    if !wanted.is_empty() {
        return told(&faults, &harmless);
    }
    let text = page::page(&faults, &harmless);
    println!("{text}");
    let whole = faults.skipped.is_empty() && harmless.skipped.is_empty();
    if whole && std::env::var_os("QCBUS_BLESS").is_some() {
        std::fs::write(PAGE, &text).unwrap();
    }
    let alarms = harmless.done.iter().filter(|it| it.is_alarm()).count();
    let (found, tried) = page::share(&faults);
    assert!(
        alarms == 0 && found * 100 >= tried * MIN_FOUND,
        "{found} of {tried} faults are found, {alarms} harmless variants are rejected"
    );
}

/// How many entries of which producer were tried, and how many of these are counted; what is not at hand
/// is not passed over in silence.
fn counts(
    sort: &str,
    trials: &Trials<'_>,
    what: &str,
    counted: impl Fn(&Trial<'_>) -> bool,
) -> String {
    // Tried, counted, skipped.
    let mut producers: BTreeMap<&str, [usize; 3]> = BTreeMap::new();
    for trial in &trials.done {
        let counts = producers.entry(&trial.entry.scenario.producer).or_default();
        counts[0] += 1;
        counts[1] += usize::from(counted(trial));
    }
    for entry in &trials.skipped {
        producers.entry(&entry.scenario.producer).or_default()[2] += 1;
    }
    let line = |(producer, [tried, counted, skipped]): (&str, [usize; 3])| {
        format!("{sort} of {producer}: {tried} tried, {counted} {what}, {skipped} skipped\n")
    };
    producers.into_iter().map(line).collect()
}

/// Everything about every entry.
fn told(faults: &Trials<'_>, harmless: &Trials<'_>) {
    for trial in faults.done.iter().chain(&harmless.done) {
        let (entry, found) = (trial.entry, trial.found);
        match entry.level {
            Some(level) => tell(&format!("{}: {level:?} found: {found:?}", entry.id)),
            None => tell(&format!("{}: harmless", entry.id)),
        }
        tell(&format!("\n    why: {}\n", entry.why));
        for (file, rows) in &trial.spots {
            tell(&format!(
                "    at: {} {rows:?}\n",
                qcbus_sdk::mutate::name(file)
            ));
        }
        for said in &trial.new {
            tell(&format!("    new: {said}\n"));
        }
    }
}

/// Not what the test prints: that is only shown when it fails.
fn tell(text: &str) {
    std::io::stderr().write_all(text.as_bytes()).unwrap();
}
