//! `qcbus bundle new`: creates a directory with a new bundle.

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

/// Programming language of a new bundle. To add one, write a file beside `rust.rs` and put its
/// templates in a directory of that name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Language {
    Python,
    Rust,
}

/// A directory to be created.
struct Layout {
    /// Relative paths of the files, and their contents.
    files: Vec<(&'static str, String)>,
    /// Commands to type next in the directory.
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
    // The directory must be new, so that no existing file is overwritten.
    std::fs::create_dir(&directory)
        .map_err(|error| usage(format!("cannot create {shown}: {error}")))?;
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
        "{shown} is created; next:\n  cd {name}\n{}",
        layout.next
    ))
}

/// Returns the language. The arguments contain exactly one.
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
