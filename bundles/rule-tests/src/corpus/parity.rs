//! The page that shows where a bundle agrees with that of ASAM, and where and why it differs.

use std::fmt::Write;
use std::path::Path;

use super::{Comparison, Deviation, NOTHING_THERE, compare_asam_cases, compare_real_files, settle};
use qcbus_sdk::Bundle;

/// Inputs on which a checker differs from the record, all for the same reason.
#[derive(Debug, Clone, Copy)]
pub struct Deviations {
    /// The checker.
    pub checker: &'static str,
    /// Ends of the inputs' paths.
    pub inputs: &'static [&'static str],
    /// Reason why our result is correct.
    pub reason: &'static str,
}

impl Deviations {
    /// Returns one deviation for each input.
    fn each(&self) -> impl Iterator<Item = Deviation> + use<> {
        let (checker, reason) = (self.checker, self.reason);
        self.inputs.iter().map(move |input| Deviation {
            input,
            checker,
            reason,
        })
    }
}

/// Comparison of a bundle with that of ASAM.
#[derive(Clone, Copy)]
pub struct Parity {
    /// Our bundle.
    pub bundle: &'static Bundle,
    /// Text of the page before its tables.
    pub introduction: &'static str,
    /// Whether a skipped recorded checker agrees with one that ran and found nothing. ASAM's
    /// checkers are skipped if there is no map or no storyboard.
    pub theirs_skip_nothing_to_see: bool,
    /// Deviations on ASAM's own test files.
    pub on_cases: &'static [Deviations],
    /// Text of the page before the table of other projects' files, with its heading.
    pub about_real_files: &'static str,
    /// Deviations on files of other projects.
    pub on_real_files: &'static [Deviations],
}

impl Parity {
    /// Fails the running test for an undeclared difference from the record in `cases`. It also
    /// fails for a declared deviation that does not occur, and for an outdated page. Writes the
    /// page if `QCBUS_BLESS` is set. Without the cases it prints a message and passes.
    ///
    /// # Panics
    /// Panics with all differences.
    pub fn assert(&self, cases: &Path, page: &Path) {
        let on_cases = self.recorded(compare_asam_cases, cases, self.on_cases);
        let on_real_files = self.recorded(compare_real_files, cases, self.on_real_files);
        if let Some((on_cases, on_real_files)) = on_cases.zip(on_real_files) {
            agrees_or_says(page, &self.page(&on_cases, &on_real_files));
        }
    }

    /// Returns the comparisons with the record, in which only declared ones differ. Returns `None`
    /// if the record is missing.
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
            crate::note(&format!("skipped: {} is missing\n", cases.display()));
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
            "\n## ASAM's own test files\n\nA result agrees when status, number and levels of the issues are the \
             same and the XPaths select the\nsame elements; our results may name further places.\n",
        );
        collection(&mut page, on_cases, self.on_cases);
        page.push_str(self.about_real_files);
        collection(&mut page, on_real_files, self.on_real_files);
        page
    }
}

type Compare = fn(&'static Bundle, &Path) -> Result<Option<Vec<Comparison>>, String>;

/// Fails the running test if the file does not contain this text. Writes the file if `QCBUS_BLESS`
/// is set.
///
/// # Panics
/// Panics if the text differs or the file cannot be written.
pub fn agrees_or_says(path: &Path, text: &str) {
    if std::env::var_os("QCBUS_BLESS").is_some() {
        let written = std::fs::write(path, text);
        assert!(written.is_ok(), "{}: {written:?}", path.display());
        return;
    }
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        written == text,
        "{} differs from the result of the test; QCBUS_BLESS=1 writes it, review the difference",
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
