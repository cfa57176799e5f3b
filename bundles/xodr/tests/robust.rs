//! No file, however broken, makes a rule panic: truncations and seeded random mutations of every
//! example of the pages, and of real maps where they are at hand. `QCBUS_FUZZ_ROUNDS` sets the
//! number of mutations of examples (3,000), `QCBUS_FUZZ_MAPS` that of real maps (200),
//! `QCBUS_FUZZ_PLACES` at how many places those are cut (2), `QCBUS_FUZZ_SEED` another beginning.
//!
//! A file that is cut is no XML any more, and few rules look at it. So each is cut a second time, and
//! what is open is closed.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "in a test both are findings"
)]

use fastrand::Rng;
use std::path::{Path, PathBuf};

use qcbus_sdk::pages::evidence;
use qcbus_sdk::{Listener, Loaded, Outcome, Plan, check};
use qcbus_xodr::BUNDLE;

/// Notes checkers that did not come to their end: a caught panic is one.
#[derive(Default)]
struct Broken(Vec<(usize, String)>);

impl Listener for Broken {
    fn ended(&mut self, checker: usize, _: Vec<qcbus_sdk::Issue>, outcome: Outcome) {
        if outcome.ending.status() == qcbus_sdk::Status::Error {
            self.0.push((checker, outcome.ending.reason().to_owned()));
        }
    }
}

fn assert_unbroken(plan: &Plan, bytes: &[u8], what: &str) {
    let loaded = Loaded::from_bytes(Path::new("fuzz.xodr"), bytes.to_vec()).unwrap();
    let Ok(subject) = loaded.subject(&BUNDLE) else {
        return;
    };
    let mut broken = Broken::default();
    check(plan, &subject, &mut broken);
    if let Some((checker, reason)) = broken.0.first() {
        panic!(
            "{}: {reason}\non {what}:\n{}",
            plan.checkers()[*checker].id,
            String::from_utf8_lossy(bytes)
        );
    }
}

fn truncations(plan: &Plan, bytes: &[u8], places: usize, what: &str) {
    for place in 1..=places {
        let end = bytes.len() * place / (places + 1);
        assert_unbroken(plan, &bytes[..end], what);
        assert_unbroken(plan, &mended(&bytes[..end]), what);
    }
}

/// The elements of a file that was cut, without the last piece of a tag, and with all of them closed.
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

/// Numbers at which arithmetic goes wrong, and things that are no numbers.
const HOSTILE: [&str; 16] = [
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

/// One random edit of the kinds that authoring tools and editors produce.
fn mutate(text: &mut Vec<u8>, dice: &mut Rng) {
    let values: Vec<(usize, usize)> = attribute_values(text);
    let at = dice.usize(..text.len().max(1));
    match dice.usize(..6) {
        0 | 1 if !values.is_empty() => {
            let (start, end) = values[dice.usize(..values.len())];
            let hostile = HOSTILE[dice.usize(..HOSTILE.len())];
            text.splice(start..end, hostile.bytes());
        }
        2 if values.len() > 1 => {
            let (from, to) = (
                values[dice.usize(..values.len())],
                values[dice.usize(..values.len())],
            );
            let value = text[from.0..from.1].to_vec();
            text.splice(to.0..to.1, value);
        }
        3 | 4 => {
            let elements = empty_elements(text);
            if elements.is_empty() {
                return;
            }
            let (start, end) = elements[dice.usize(..elements.len())];
            let element = text[start..end].to_vec();
            if dice.usize(..2) == 0 {
                text.drain(start..end);
            } else {
                let (place, _) = elements[dice.usize(..elements.len())];
                text.splice(place..place, element);
            }
        }
        _ => text[at] = b" <>\"=/a9&-"[dice.usize(..10)],
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

fn setting(name: &str, default: usize) -> usize {
    std::env::var(name)
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(default)
}

#[test]
fn truncated_examples_break_no_rule() {
    let plan = Plan::by_default(&BUNDLE);
    for shown in evidence::documents(&BUNDLE) {
        truncations(&plan, shown.text.as_bytes(), 10, shown.rule);
    }
}

/// Each of these lengths in turn, for all roads, geometries, sections and repeats of an example.
#[test]
fn lengths_that_cannot_be_break_no_rule() {
    let plan = Plan::by_default(&BUNDLE);
    for shown in evidence::documents(&BUNDLE) {
        for length in ["-1", "0", "-9223372036854775808"] {
            let mut parts = shown.text.split(" length=\"");
            let mut text = parts.next().unwrap_or_default().to_owned();
            for part in parts {
                let rest = part.split_once('"').map_or(part, |(_, rest)| rest);
                text.push_str(&format!(" length=\"{length}\"{rest}"));
            }
            assert_unbroken(&plan, text.as_bytes(), shown.rule);
        }
    }
}

#[test]
fn mutated_examples_break_no_rule() {
    let plan = Plan::by_default(&BUNDLE);
    let documents = evidence::documents(&BUNDLE);
    let rounds = setting("QCBUS_FUZZ_ROUNDS", 3_000);
    let mut dice = Rng::with_seed(setting("QCBUS_FUZZ_SEED", 0x9E37_79B9) as u64);
    for round in 0..rounds {
        let shown = &documents[round % documents.len()];
        let mut text = shown.text.clone().into_bytes();
        for _ in 0..=dice.usize(..3) {
            mutate(&mut text, &mut dice);
        }
        assert_unbroken(&plan, &text, shown.rule);
    }
}

fn xodr_files(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            xodr_files(&path, found);
        } else if path.extension().is_some_and(|it| it == "xodr") {
            found.push(path);
        }
    }
}

fn real_maps() -> Vec<PathBuf> {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases");
    let mut files = Vec::new();
    xodr_files(&cases, &mut files);
    files.sort();
    files
}

#[test]
fn real_maps_whole_and_truncated_break_no_rule() {
    let files = real_maps();
    let plan = Plan::by_default(&BUNDLE);
    let places = setting("QCBUS_FUZZ_PLACES", 2);
    println!("{} files, each cut at {places} places", files.len());
    for file in files {
        let bytes = std::fs::read(&file).unwrap();
        let what = file.display().to_string();
        assert_unbroken(&plan, &bytes, &what);
        truncations(&plan, &bytes, places, &what);
    }
}

#[test]
fn mutated_real_maps_break_no_rule() {
    let files = real_maps();
    let plan = Plan::by_default(&BUNDLE);
    let rounds = setting("QCBUS_FUZZ_MAPS", 200).min(files.len() * 1_000_000);
    println!("{rounds} mutations of {} files", files.len());
    let mut dice = Rng::with_seed(setting("QCBUS_FUZZ_SEED", 0x9E37_79B9) as u64);
    for round in 0..rounds {
        let file = &files[round % files.len()];
        let mut text = std::fs::read(file).unwrap();
        for _ in 0..=dice.usize(..3) {
            mutate(&mut text, &mut dice);
        }
        assert_unbroken(&plan, &text, &format!("{}, round {round}", file.display()));
    }
}
