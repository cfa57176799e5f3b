//! The page that shows where a bundle agrees with ASAM's own, and where not and why.

use std::fmt::Write;
use std::path::Path;

use super::{Comparison, Deviation, NOTHING_THERE, compare_asam_cases, compare_real_files, settle};
use crate::Bundle;

/// Inputs on which a checker differs from what is recorded, all for one reason.
#[derive(Debug, Clone, Copy)]
pub struct Deviations {
    /// The checker.
    pub checker: &'static str,
    /// Ends of the inputs' paths.
    pub inputs: &'static [&'static str],
    /// Why ours is right.
    pub reason: &'static str,
}

impl Deviations {
    /// The deviations, input by input.
    fn each(&self) -> impl Iterator<Item = Deviation> + use<> {
        let (checker, reason) = (self.checker, self.reason);
        self.inputs.iter().map(move |input| Deviation {
            input,
            checker,
            reason,
        })
    }
}

/// A bundle beside ASAM's.
#[derive(Clone, Copy)]
pub struct Parity {
    /// Ours.
    pub bundle: &'static Bundle,
    /// What the page says before its tables.
    pub introduction: &'static str,
    /// Whether a checker of theirs that was skipped agrees with one of ours that looked and found
    /// nothing: theirs are skipped where there is no map or no storyboard to look at.
    pub theirs_skip_nothing_to_see: bool,
    /// Where we differ on ASAM's own test files.
    pub on_cases: &'static [Deviations],
    /// What the page says before the table of other projects' files, with its heading.
    pub about_real_files: &'static str,
    /// Where we differ on files of other projects.
    pub on_real_files: &'static [Deviations],
}

impl Parity {
    /// Fails the running test when ours disagrees with what is recorded in `cases` and no deviation is
    /// declared, when a declared one does not occur, or when the page does not say so; writes the page
    /// with `QCBUS_BLESS` set. Without the cases it says so and passes.
    ///
    /// # Panics
    /// With all that differs.
    pub fn assert(&self, cases: &Path, page: &Path) {
        let on_cases = self.recorded(compare_asam_cases, cases, self.on_cases);
        let on_real_files = self.recorded(compare_real_files, cases, self.on_real_files);
        if let Some((on_cases, on_real_files)) = on_cases.zip(on_real_files) {
            agrees_or_says(page, &self.page(&on_cases, &on_real_files));
        }
    }

    /// The recorded results with ours, of which only declared ones differ; `None` when they are not at
    /// hand.
    #[expect(clippy::panic, reason = "it is an assertion for tests")]
    fn recorded(
        &self,
        compare: Compare,
        cases: &Path,
        deviations: &[Deviations],
    ) -> Option<Vec<Comparison>> {
        let comparisons = match compare(self.bundle, cases) {
            Ok(comparisons) => comparisons,
            Err(error) => panic!("{error}"),
        };
        let Some(mut comparisons) = comparisons else {
            crate::run::complain(&format!("skipped: {} is not there\n", cases.display()));
            return None;
        };
        for one in comparisons
            .iter_mut()
            .filter(|_| self.theirs_skip_nothing_to_see)
        {
            one.difference
                .take_if(|difference| difference == NOTHING_THERE);
        }
        let each: Vec<Deviation> = deviations.iter().flat_map(Deviations::each).collect();
        settle(self.bundle, &comparisons, &each);
        Some(comparisons)
    }

    fn page(&self, on_cases: &[Comparison], on_real_files: &[Comparison]) -> String {
        let mut page = self.introduction.to_owned();
        page.push_str(
            "\n## ASAM's own test files\n\n\
             A result agrees when status, number and levels of the issues are the same and the XPaths select\n\
             the same elements; ours may name further places.\n",
        );
        collection(&mut page, on_cases, self.on_cases);
        page.push_str(self.about_real_files);
        collection(&mut page, on_real_files, self.on_real_files);
        page
    }
}

type Compare = fn(&'static Bundle, &Path) -> Result<Option<Vec<Comparison>>, String>;

/// Fails the running test when the file does not say this; writes it with `QCBUS_BLESS` set.
///
/// # Panics
/// See above.
pub fn agrees_or_says(path: &Path, text: &str) {
    if std::env::var_os("QCBUS_BLESS").is_some() {
        let written = std::fs::write(path, text);
        assert!(written.is_ok(), "{}: {written:?}", path.display());
        return;
    }
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        written == text,
        "{} is not what the test finds; QCBUS_BLESS=1 writes it, review the difference",
        path.display()
    );
}

fn collection(page: &mut String, comparisons: &[Comparison], deviations: &[Deviations]) {
    page.push_str("\n| checker | results | agree | deviations |\n|---|---:|---:|---:|\n");
    let mut checkers: Vec<&str> = comparisons.iter().map(|one| one.checker.as_str()).collect();
    checkers.sort_unstable();
    checkers.dedup();
    for checker in &checkers {
        let of_checker = comparisons.iter().filter(|one| one.checker == *checker);
        let (all, differ) = of_checker.fold((0, 0), |(all, differ), one| {
            (all + 1, differ + u32::from(one.difference.is_some()))
        });
        _ = writeln!(
            page,
            "| `{checker}` | {all} | {} | {differ} |",
            all - differ
        );
    }
    let differ = comparisons.iter().filter(|one| one.difference.is_some());
    let differ = differ.count();
    _ = writeln!(
        page,
        "\n{} results, {differ} deviations:",
        comparisons.len()
    );
    for deviation in deviations {
        _ = writeln!(page, "\n`{}`: {}.\n", deviation.checker, deviation.reason);
        for input in deviation.inputs {
            let hit = comparisons.iter().find(|one| {
                one.checker == deviation.checker
                    && one.input.ends_with(input)
                    && one.difference.is_some()
            });
            if let Some((path, difference)) =
                hit.and_then(|one| Some((&one.input, one.difference.as_ref()?)))
            {
                _ = writeln!(page, "- `{path}`: {}", difference.trim_end_matches(" ()"));
            }
        }
    }
}
