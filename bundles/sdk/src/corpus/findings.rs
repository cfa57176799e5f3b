//! Everything that a bundle finds in files, one line each, for those who judge whether it is right.

use std::path::{Path, PathBuf};

use qcbus_document::FileKind;
use qcbus_formats::xqar::Location;

use crate::run::examine;
use crate::{Bundle, Loaded, Plan};

/// Prints every finding on the files that are named, and on those below directories: file, checker,
/// level, row, text. `[--checker PART] PATH…`
///
/// # Errors
/// What could not be read.
#[expect(clippy::print_stdout, reason = "a tool for the terminal")]
pub fn print_findings(
    bundle: &'static Bundle,
    arguments: impl Iterator<Item = String>,
) -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = arguments.peekable();
    let part = match arguments.next_if(|argument| argument == "--checker") {
        Some(_) => arguments.next().unwrap_or_default(),
        None => String::new(),
    };
    let plan = Plan::new(bundle, |checker| checker.id.contains(&part), |_, _| None);
    let mut files = Vec::new();
    for argument in arguments {
        gather(bundle, Path::new(&argument), &mut files);
    }
    for path in files {
        let loaded = Loaded::from_path(&path, path.parent().unwrap_or(&path))?;
        for checker in examine(&plan, &loaded)?.checkers {
            for issue in checker.issues {
                let places = issue.locations.first().map(|first| first.places.as_slice());
                let row = places
                    .unwrap_or_default()
                    .iter()
                    .find_map(|place| match place {
                        Location::File { row, .. } => Some(*row),
                        _ => None,
                    });
                println!(
                    "{}\t{}\t{:?}\t{}\t{}",
                    path.display(),
                    checker.id,
                    issue.level,
                    row.map(|row| row.to_string()).unwrap_or_default(),
                    issue.description,
                );
            }
        }
    }
    Ok(())
}

/// The files at and below a path that the bundle looks at, by name.
fn gather(bundle: &Bundle, path: &Path, files: &mut Vec<PathBuf>) {
    if !path.is_dir() {
        files.push(path.to_owned());
        return;
    }
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
    let mut entries: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    entries.sort();
    for entry in entries {
        let wanted = FileKind::of_path(&entry).is_some_and(|kind| bundle.kinds.contains(&kind));
        if entry.is_dir() || wanted {
            gather(bundle, &entry, files);
        }
    }
}
