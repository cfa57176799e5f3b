//! Damages files for tests in every way that authors and tools do. No damaged file may make a rule
//! panic. `QCBUS_FUZZ_ROUNDS` sets the number of mutations of examples (1,000), `QCBUS_FUZZ_FILES`
//! that of other files (200). `QCBUS_FUZZ_PLACES` sets at how many places each file is cut (2).
//! `QCBUS_FUZZ_SEED` sets another seed.
//!
//! A file that is cut is no longer well-formed XML, and few rules check it. So each file is cut a
//! second time, and all open elements are closed.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "it is an assertion for tests"
)]

use std::path::{Path, PathBuf};

use qcbus_fuzzing::Random;

use qcbus_sdk::{Bundle, Issue, Listener, Loaded, Outcome, Plan, Status, check};

use crate::leaves_open;
use crate::pages::{Template, evidence};

/// A bundle under test.
#[derive(Clone, Copy)]
pub struct Robust {
    /// The bundle.
    pub bundle: &'static Bundle,
    /// Templates for the examples of its pages.
    pub templates: &'static [Template],
    /// Extension of the files that it checks, without the dot.
    pub extension: &'static str,
    /// Values that replace others: [`NUMBERS`] and further values that are likely to cause faults.
    pub hostile: &'static [&'static str],
}

/// Collects checkers that did not complete, for example because of a caught panic.
#[derive(Default)]
struct Broken(Vec<(usize, String)>);

impl Listener for Broken {
    fn ended(&mut self, checker: usize, _: Vec<Issue>, outcome: Outcome) {
        if outcome.ending.status() == Status::Error {
            self.0.push((checker, outcome.ending.reason().to_owned()));
        }
    }
}

impl Robust {
    /// Cuts every example of the pages at some places.
    ///
    /// # Panics
    /// If a checker does not complete. The message names the first such checker and the file.
    pub fn assert_truncated_examples(&self) {
        let plan = Plan::by_default(self.bundle);
        let places = places();
        for shown in evidence::documents(self.bundle, self.templates) {
            self.assert_truncations(&plan, shown.text.as_bytes(), places, shown.rule);
        }
    }

    /// Mutates the examples of the pages.
    ///
    /// # Panics
    /// If a checker does not complete. The message names the first such checker and the file.
    pub fn assert_mutated_examples(&self) {
        let plan = Plan::by_default(self.bundle);
        let documents = evidence::documents(self.bundle, self.templates);
        let mut dice = dice();
        for round in 0..setting("QCBUS_FUZZ_ROUNDS", 1_000) {
            let shown = &documents[round % documents.len()];
            let mut text = shown.text.clone().into_bytes();
            self.mutate(&mut text, &mut dice);
            self.assert_unbroken(&plan, &text, shown.rule);
        }
    }

    /// Mutates the files of a set, such as a modular scenario with its libraries, and checks the
    /// first file. `twists` are pairs of a text and its replacement. They produce faults that only
    /// a set of files can have.
    ///
    /// # Panics
    /// If a checker does not complete. The message names the first such checker and the files.
    pub fn assert_mutated_set(&self, files: &[(&str, &str)], twists: &[(&str, &str)]) {
        let plan = Plan::by_default(self.bundle);
        let folder = tempfile::tempdir().unwrap();
        let mut dice = dice();
        // A round costs ten times as much as one with a single file in memory.
        for _ in 0..setting("QCBUS_FUZZ_ROUNDS", 1_000) / 10 {
            let mut mutated: Vec<Vec<u8>> = Vec::new();
            let victim = dice.below(files.len());
            for (index, (_, text)) in files.iter().enumerate() {
                let mut text = (*text).to_owned();
                for (what, other) in twists {
                    if dice.below(8) == 0 {
                        text = text.replacen(what, other, 1 + dice.below(3));
                    }
                }
                let mut bytes = text.into_bytes();
                if index == victim && dice.below(2) == 0 {
                    self.mutate(&mut bytes, &mut dice);
                }
                mutated.push(bytes);
            }
            for ((name, _), bytes) in files.iter().zip(&mutated) {
                std::fs::write(folder.path().join(name), bytes).unwrap();
            }
            let first = folder.path().join(files[0].0);
            let loaded = Loaded::from_path(&first, folder.path()).unwrap();
            let mut broken = Broken::default();
            check(&plan, &loaded.subject(self.bundle).unwrap(), &mut broken);
            if let Some((checker, reason)) = broken.0.first() {
                let texts: Vec<_> = mutated
                    .iter()
                    .map(|it| String::from_utf8_lossy(it))
                    .collect();
                let id = &plan.checkers()[*checker].id;
                panic!("{id}: {reason}\n{}", texts.join("\n----\n"));
            }
        }
    }

    /// Checks whole files, cut files and mutated files below a directory. Checks none if the
    /// directory does not exist.
    ///
    /// # Panics
    /// If a checker does not complete. The message names the first such checker and the file.
    pub fn assert_files_below(&self, directory: &Path) {
        let mut files = Vec::new();
        gather(directory, self.extension, &mut files);
        files.sort();
        let plan = Plan::by_default(self.bundle);
        let places = places();
        crate::note(&format!(
            "{} files, each cut at {places} places\n",
            files.len()
        ));
        for file in &files {
            let bytes = std::fs::read(file).unwrap();
            let what = file.display().to_string();
            self.assert_unbroken(&plan, &bytes, &what);
            self.assert_truncations(&plan, &bytes, places, &what);
        }
        let mut dice = dice();
        for round in 0..setting("QCBUS_FUZZ_FILES", 200).min(files.len() * 1_000_000) {
            let file = &files[round % files.len()];
            let mut text = std::fs::read(file).unwrap();
            self.mutate(&mut text, &mut dice);
            self.assert_unbroken(&plan, &text, &format!("{}, round {round}", file.display()));
        }
    }

    /// Asserts that every checker of the plan completes on a file.
    ///
    /// # Panics
    /// If a checker does not complete. The message names the first such checker and the file.
    pub fn assert_unbroken(&self, plan: &Plan, bytes: &[u8], what: &str) {
        let name = format!("fuzz.{}", self.extension);
        let loaded = Loaded::from_bytes(Path::new(&name), bytes.to_vec()).unwrap();
        let Ok(subject) = loaded.subject(self.bundle) else {
            return;
        };
        let mut broken = Broken::default();
        check(plan, &subject, &mut broken);
        let mut broken = broken.0.iter();
        if let Some((checker, reason)) = broken.find(|(_, reason)| !leaves_open(reason)) {
            panic!(
                "{}: {reason}\non {what}:\n{}",
                plan.checkers()[*checker].id,
                String::from_utf8_lossy(bytes)
            );
        }
    }

    fn assert_truncations(&self, plan: &Plan, bytes: &[u8], places: usize, what: &str) {
        for place in 1..=places {
            let end = bytes.len() * place / (places + 1);
            self.assert_unbroken(plan, &bytes[..end], what);
            self.assert_unbroken(plan, &mended(&bytes[..end]), what);
        }
    }

    fn mutate(&self, text: &mut Vec<u8>, dice: &mut Random) {
        for _ in 0..=dice.below(3) {
            mutate(text, dice, self.hostile);
        }
    }
}

/// Numbers that break arithmetic, and texts that are not numbers.
pub const NUMBERS: &[&str] = &[
    "0",
    "-0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "NaN",
    "INF",
    "-INF",
    "",
    " ",
    "x",
    "99999999999999999999",
    "-9223372036854775808",
    "0.0000001",
    "1e5",
];

/// Returns the elements of a cut file, without the incomplete last tag and with all elements
/// closed.
fn mended(cut: &[u8]) -> Vec<u8> {
    let mut open: Vec<&[u8]> = Vec::new();
    let (mut at, mut whole) = (0, 0);
    while let Some(start) = find(cut, at, b"<") {
        let comment = cut[start..].starts_with(b"<!--");
        let Some(end) = find(cut, start, if comment { b"-->" } else { b">" }) else {
            break;
        };
        at = end + if comment { 3 } else { 1 };
        whole = at;
        let tag = &cut[start + 1..end];
        match tag.first() {
            Some(b'/') => _ = open.pop(),
            Some(b'?' | b'!') | None => {}
            Some(_) if tag.ends_with(b"/") => {}
            Some(_) => open.extend(tag.split(u8::is_ascii_whitespace).next()),
        }
    }
    let mut text = cut[..whole].to_vec();
    for name in open.iter().rev() {
        text.extend([b"</", *name, b">"].concat());
    }
    text
}

fn find(text: &[u8], from: usize, what: &[u8]) -> Option<usize> {
    let rest = text.get(from..)?;
    let place = rest.windows(what.len()).position(|here| here == what)?;
    Some(from + place)
}

/// Applies one random edit of the kinds that authoring tools and editors produce.
fn mutate(text: &mut Vec<u8>, dice: &mut Random, hostile: &[&str]) {
    let values: Vec<(usize, usize)> = attribute_values(text);
    let at = dice.below(text.len());
    match dice.below(6) {
        0 | 1 if !values.is_empty() => {
            let (start, end) = values[dice.below(values.len())];
            let hostile = hostile[dice.below(hostile.len())];
            text.splice(start..end, hostile.bytes());
        }
        2 if values.len() > 1 => {
            let (from, to) = (
                values[dice.below(values.len())],
                values[dice.below(values.len())],
            );
            let value = text[from.0..from.1].to_vec();
            text.splice(to.0..to.1, value);
        }
        3 | 4 => {
            let elements = empty_elements(text);
            if elements.is_empty() {
                return;
            }
            let (start, end) = elements[dice.below(elements.len())];
            let element = text[start..end].to_vec();
            if dice.below(2) == 0 {
                text.drain(start..end);
            } else {
                let (place, _) = elements[dice.below(elements.len())];
                text.splice(place..place, element);
            }
        }
        _ => text[at] = b" <>\"=/a9&-"[dice.below(10)],
    }
}

fn attribute_values(text: &[u8]) -> Vec<(usize, usize)> {
    let mut values = Vec::new();
    let mut at = 0;
    while let Some(start) = text[at..].windows(2).position(|pair| pair == b"=\"") {
        let start = at + start + 2;
        let Some(len) = text[start..].iter().position(|byte| *byte == b'"') else {
            break;
        };
        values.push((start, start + len));
        at = start + len + 1;
    }
    values
}

fn empty_elements(text: &[u8]) -> Vec<(usize, usize)> {
    let mut elements = Vec::new();
    let mut open = None;
    for (at, byte) in text.iter().enumerate() {
        match byte {
            b'<' => open = Some(at),
            b'>' if at > 0 && text[at - 1] == b'/' => {
                elements.extend(open.take().map(|start| (start, at + 1)));
            }
            _ => {}
        }
    }
    elements
}

fn gather(directory: &Path, extension: &str, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            gather(&path, extension, found);
        } else if path.extension().is_some_and(|it| it == extension) {
            found.push(path);
        }
    }
}

fn dice() -> Random {
    Random(setting("QCBUS_FUZZ_SEED", 0x9E37_79B9) as u64)
}

/// Returns at how many places a file is cut.
pub fn places() -> usize {
    setting("QCBUS_FUZZ_PLACES", 2)
}

fn setting(name: &str, default: usize) -> usize {
    let set = std::env::var(name).ok().and_then(|text| text.parse().ok());
    set.unwrap_or(default)
}
