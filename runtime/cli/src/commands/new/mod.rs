//! `qcbus bundle new`: a directory with a bundle of one's own.

mod python;
mod rust;

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

use qcbus_messages::Exit;
use qcbus_messages::path_text::to_text;

use super::manifests::{Refusal, good_name, said, usage};
use super::settings::absolute;
use crate::args::BundleNewArgs;

/// What a bundle is written in. A language more is a file beside `rust.rs`, with its templates below.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Language {
    Python,
    Rust,
}

/// A directory to be made.
struct Layout {
    /// Paths in it, and what they hold.
    files: Vec<(&'static str, String)>,
    /// What to type next, in it.
    next: String,
}

/// Runs the command.
pub fn run(args: &BundleNewArgs) -> Exit {
    said(new(args))
}

fn new(args: &BundleNewArgs) -> Result<String, Refusal> {
    good_name(&args.name)?;
    let layout = match language(args) {
        Language::Python => python::layout(&args.name),
        Language::Rust => rust::layout(&args.name, args.sdk.as_deref())?,
    };
    let directory = absolute(Path::new(&args.name));
    let shown = to_text(&directory);
    // It must be ours: nothing of anybody is written over.
    std::fs::create_dir(&directory)
        .map_err(|error| usage(format!("cannot make {shown}: {error}")))?;
    for (path, text) in &layout.files {
        write_new(&directory.join(path), text).map_err(|error| {
            (
                Exit::Internal,
                format!("cannot write {shown}/{path}: {error}"),
            )
        })?;
    }
    let name = &args.name;
    Ok(format!(
        "{shown} is made; next:\n  cd {name}\n{}",
        layout.next
    ))
}

/// Exactly one is given.
fn language(args: &BundleNewArgs) -> Language {
    match args.python {
        true => Language::Python,
        false => Language::Rust,
    }
}

fn write_new(path: &Path, text: &str) -> std::io::Result<()> {
    if let Some(above) = path.parent() {
        std::fs::create_dir_all(above)?;
    }
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(text.as_bytes())
}
