//! Study with real files. Some are broken as authors and tools break them; others are changed in
//! allowed ways. The faults must be found at their places, and the rest must have no findings.
//! `bundles/xosc/tests/rules/seeded/README.md` describes the lists.
//!
//! Some of the files are among the shared cases. The others are below a directory named by an
//! environment variable. Missing files are skipped. `QCBUS_BLESS=1` writes the study's page if all
//! files exist. `QCBUS_SEEDED=ID` tries the entries with this text in their id, and prints their
//! results.

#![expect(
    clippy::indexing_slicing,
    reason = "a test may panic and report what it tried"
)]

mod judge;
mod page;
mod table;
#[cfg(test)]
mod tests;
mod trials;

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use judge::Trial;
use table::Entry;
use trials::Trials;

use qcbus_sdk::Bundle;

/// Input and requirements of a study.
pub struct Study<'s> {
    /// Bundle that must find the faults.
    pub bundle: &'static Bundle,
    /// Kind of files that are broken: `scenarios`, `maps`.
    pub what: &'static str,
    /// The attribute that `#` means in selectors.
    pub key: &'static str,
    /// Text of the list `faults.txt`.
    pub faults: &'s str,
    /// Text of the list `harmless.txt`.
    pub harmless: &'s str,
    /// Path of the test and of its lists, for the page.
    pub place: &'static str,
    /// Directory of the shared cases.
    pub shared: &'s Path,
    /// Environment variable that names the directory of the other files.
    pub fetched: &'static str,
    /// Path of the page with the tables.
    pub page: &'s Path,
    /// Minimum percentage of the tried faults that must be found at the required level.
    pub least: usize,
}

impl Study<'_> {
    /// Tries all entries.
    ///
    /// # Panics
    /// Panics if too few faults are found, a harmless variant is rejected, or an entry cannot be
    /// tried.
    pub fn run(&self) {
        let faults = table::read(self.faults, self.key).unwrap();
        let harmless = table::read(self.harmless, self.key).unwrap();
        assert!(faults.iter().all(|entry| entry.level.is_some()));
        assert!(harmless.iter().all(|entry| entry.level.is_none()));
        let wanted = std::env::var("QCBUS_SEEDED").unwrap_or_default();
        let entries: Vec<&Entry> = faults
            .iter()
            .chain(&harmless)
            .filter(|entry| entry.id.contains(&wanted))
            .collect();
        let (faults, harmless, errors) = self.try_all(&entries).split();
        if errors.is_empty() && faults.done.is_empty() && harmless.done.is_empty() {
            return tell(&format!(
                "skipped: none of the {} is available\n",
                self.what
            ));
        }
        tell(&counts("faults", &faults, "found", |it| {
            it.found.is_enough()
        }));
        tell(&counts("harmless variants", &harmless, "rejected", |it| {
            it.is_alarm()
        }));
        assert!(errors.is_empty(), "cannot be tried:\n{}", errors.join("\n"));
        if !wanted.is_empty() {
            return told(&faults, &harmless);
        }
        self.conclude(&faults, &harmless);
    }

    fn conclude(&self, faults: &Trials<'_>, harmless: &Trials<'_>) {
        let text = page::page(self, faults, harmless);
        tell(&text);
        let whole = faults.skipped.is_empty() && harmless.skipped.is_empty();
        if whole && std::env::var_os("QCBUS_BLESS").is_some() {
            std::fs::write(self.page, &text).unwrap();
        }
        let alarms = harmless.done.iter().filter(|it| it.is_alarm()).count();
        let (found, tried) = page::share(faults);
        assert!(
            alarms == 0 && found * 100 >= tried * self.least,
            "{found} of {tried} faults are found, {alarms} harmless variants are rejected"
        );
    }
}

/// Returns the number of tried, counted and skipped entries of each producer. Files that are
/// missing are skipped.
fn counts(
    sort: &str,
    trials: &Trials<'_>,
    what: &str,
    counted: impl Fn(&Trial<'_>) -> bool,
) -> String {
    // The numbers of tried, counted and skipped entries.
    let mut producers: BTreeMap<&str, [usize; 3]> = BTreeMap::new();
    for trial in &trials.done {
        let counts = producers.entry(&trial.entry.original.producer).or_default();
        counts[0] += 1;
        counts[1] += usize::from(counted(trial));
    }
    for entry in &trials.skipped {
        producers.entry(&entry.original.producer).or_default()[2] += 1;
    }
    let line = |(producer, [tried, counted, skipped]): (&str, [usize; 3])| {
        format!("{sort} of {producer}: {tried} tried, {counted} {what}, {skipped} skipped\n")
    };
    producers.into_iter().map(line).collect()
}

/// Prints all details of every entry.
fn told(faults: &Trials<'_>, harmless: &Trials<'_>) {
    for trial in faults.done.iter().chain(&harmless.done) {
        let (entry, found) = (trial.entry, trial.found);
        match entry.level {
            Some(level) => tell(&format!("{}: {level:?} found: {found:?}", entry.id)),
            None => tell(&format!("{}: harmless", entry.id)),
        }
        tell(&format!("\n    why: {}\n", entry.why));
        for (file, rows) in &trial.spots {
            tell(&format!("    at: {} {rows:?}\n", super::name(file)));
        }
        for said in &trial.new {
            tell(&format!("    new: {said}\n"));
        }
    }
}

/// Writes to stderr directly, because the captured output of a test is only shown if it fails.
fn tell(text: &str) {
    std::io::stderr().write_all(text.as_bytes()).unwrap();
}
