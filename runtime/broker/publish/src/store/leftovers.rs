//! Results of this program that the journal does not contain.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_disk::foreign;
use qcbus_messages::path_text::from_text;
use serde::Deserialize;

use crate::result_paths::{verdict_beside, with_suffix};
use crate::verdict_file::FORMAT;

/// A result and its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Leftover {
    pub(super) path: Arc<Path>,
    pub(super) xqar: PathBuf,
}

/// Returns all results below `out` that certainly come from qcbus and are not in `owned`.
pub(super) fn leftovers(out: &Path, owned: &HashSet<PathBuf>) -> Vec<Leftover> {
    let mut places = HashSet::new();
    walk(out, &mut |path| {
        let result = path.extension().is_some_and(|it| it == "xqar");
        let stem = path.to_str().and_then(|it| it.strip_suffix(VERDICT));
        let xqar = match stem {
            Some(stem) => with_suffix(Path::new(stem), ".xqar"),
            None if result => path,
            None => return,
        };
        if !owned.contains(&xqar) {
            places.insert(xqar);
        }
    });
    let mut places: Vec<PathBuf> = places.into_iter().collect();
    places.sort();
    let ours = |xqar: PathBuf| {
        let path = named_by_verdict(&xqar).or_else(|| named_by_result(&xqar))?;
        Some(Leftover {
            path: path.as_path().into(),
            xqar,
        })
    };
    places.into_iter().filter_map(ours).collect()
}

const VERDICT: &str = ".verdict.json";

/// Visits every file below a directory of results. Skips other brokers' directories, which have a state.
pub(super) fn walk(out: &Path, found: &mut dyn FnMut(PathBuf)) {
    let mut open = vec![out.to_path_buf()];
    while let Some(next) = open.pop() {
        if next != *out && next.join(STATE).exists() {
            continue;
        }
        // An unreadable directory contains no result that could be removed.
        let Ok(entries) = std::fs::read_dir(&next) else {
            continue;
        };
        for entry in entries.flatten() {
            match entry.file_type() {
                Ok(kind) if kind.is_dir() && entry.file_name() != STATE => open.push(entry.path()),
                Ok(kind) if kind.is_file() => found(entry.path()),
                _ => {}
            }
        }
    }
}

const STATE: &str = ".qcbus";

/// The part of a verdict file that names its file and result.
#[derive(Deserialize)]
struct About {
    format: u32,
    input_file: String,
    result: String,
}

/// Returns the file that the verdict file next to a result names, if qcbus wrote it.
fn named_by_verdict(xqar: &Path) -> Option<PathBuf> {
    let text = foreign::read(&verdict_beside(xqar)?, MOST_OF_A_VERDICT).ok()?;
    let about: About = serde_json::from_slice(&text).ok()?;
    (about.format == FORMAT && from_text(&about.result) == xqar)
        .then(|| from_text(&about.input_file))
}

/// Returns the file of a result, if qcbus wrote the result: its name must be that of the file.
pub(super) fn named_by_result(xqar: &Path) -> Option<PathBuf> {
    let input = input_of(xqar)?;
    let expected = with_suffix(Path::new(input.file_name()?), ".xqar");
    (input.is_absolute() && Some(expected.as_os_str()) == xqar.file_name()).then_some(input)
}

/// Returns the first `InputFile` of a result. It is near the beginning, so the rest is not read.
pub(super) fn input_of(xqar: &Path) -> Option<PathBuf> {
    let mut head = Vec::new();
    let (mut file, _) = foreign::open(xqar).ok()?;
    foreign::read_on(xqar, &mut file, HEAD, &mut head).ok()?;
    qcbus_formats::xqar::input_file(&head).map(|it| from_text(&it))
}

/// Maximum size of a verdict file in bytes. Its only long part is the list of the verdict's dependencies.
const MOST_OF_A_VERDICT: u64 = 64 << 20;

/// Number of bytes that contain the beginning of a result.
const HEAD: u64 = 16 << 10;
