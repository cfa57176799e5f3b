//! Real files, broken as authors and tools break them, and changed within what is allowed: the faults are found
//! where they are, and nothing is said against the rest. `bundles/xosc/tests/seeded/README.md` describes the lists.
//!
//! Some of the files are among the shared cases, the others lie below a directory that a variable of the
//! environment names. What is not at hand is skipped. `QCBUS_BLESS=1` writes the study's page when all are;
//! `QCBUS_SEEDED=ID` tries the entries whose id contains it, and says what each leads to.

#![expect(
    clippy::indexing_slicing,
    reason = "a test may fail and tell what it tried"
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

use crate::Bundle;

/// What is tried.
pub struct Study<'s> {
    /// Who must find the faults.
    pub bundle: &'static Bundle,
    /// What is broken: `scenarios`, `maps`.
    pub what: &'static str,
    /// The attribute that `#` means in selectors.
    pub key: &'static str,
    /// The lists `faults.txt` and `harmless.txt`.
    pub faults: &'s str,
    /// Likewise.
    pub harmless: &'s str,
    /// The test and the directory of the lists, for the page.
    pub place: &'static str,
    /// Directory of the shared cases.
    pub shared: &'s Path,
    /// The variable that names the directory of the other files.
    pub fetched: &'static str,
    /// Where the tables are written.
    pub page: &'s Path,
    /// How many of those that are tried must be found at the due level, in hundredths.
    pub least: usize,
}

impl Study<'_> {
    /// Tries all.
    ///
    /// # Panics
    /// When too few faults are found, a harmless variant is rejected, or an entry cannot be tried.
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
        tell(&counts("faults", &faults, "found", |it| {
            it.found.is_enough()
        }));
        tell(&counts("harmless variants", &harmless, "rejected", |it| {
            it.is_alarm()
        }));
        assert!(errors.is_empty(), "cannot be tried:\n{}", errors.join("\n"));
        if faults.done.is_empty() && harmless.done.is_empty() {
            return tell(&format!("skipped: none of the {} is at hand\n", self.what));
        }
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
            tell(&format!("    at: {} {rows:?}\n", super::name(file)));
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
