//! `qcbus schema compile`: compiles schemas into tables.

use std::path::{Path, PathBuf};

use qcbus_document::Document;
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_messages::Exit;
use qcbus_messages::path_text::to_text;

use crate::talk;

/// Runs the command.
pub fn compile(path: &Path, output: &Path) -> Exit {
    let files = match schema_files(path) {
        Ok(files) if files.is_empty() => {
            talk::fail(&format!("no .xsd file found in {}", to_text(path)));
            return Exit::Usage;
        }
        Ok(files) => files,
        Err(error) => {
            talk::fail(&format!("cannot read {}: {error}", to_text(path)));
            return Exit::Usage;
        }
    };
    match tables(path, &files) {
        Ok(text) => write(output, &text, files.len()),
        Err(why) => {
            talk::fail(&why);
            Exit::Usage
        }
    }
}

/// Returns the schema itself, or every schema file of a directory. The files of one schema lie
/// together.
fn schema_files(path: &Path) -> std::io::Result<Vec<PathBuf>> {
    if path.is_file() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut files: Vec<PathBuf> = std::fs::read_dir(path)?
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| {
            path.extension()
                .is_some_and(|it| it.eq_ignore_ascii_case("xsd"))
        })
        .collect();
    files.sort();
    Ok(files)
}

fn tables(path: &Path, files: &[PathBuf]) -> Result<String, String> {
    let mut images = Vec::new();
    for file in files {
        let bytes = std::fs::read(file)
            .map_err(|error| format!("cannot read {}: {error}", to_text(file)))?;
        images.push(prepare_bytes(file, bytes, &Limits::default()).build());
    }
    let mut documents = Vec::new();
    for (image, file) in images.iter().zip(files) {
        let document = Document::open(image).map_err(|error| error.to_string())?;
        if let Some(fault) = document.faults().find(|fault| fault.code.makes_partial()) {
            let at = document.position(fault.offset);
            return Err(format!(
                "{}:{}:{}: {}",
                to_text(file),
                at.row,
                at.column,
                fault.text
            ));
        }
        documents.push(document);
    }
    qcbus_schema::compile(&title(path), &documents)
        .map(|schema| schema.to_notation())
        .map_err(|error| format!("failed to {error}"))
}

/// Returns the name of the file without its ending, or the full name of the directory. The version
/// in it (`xodr-1.7`) tells `--schema-dir` what the tables are for.
fn title(path: &Path) -> String {
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let name = if path.is_dir() {
        whole.file_name()
    } else {
        path.file_stem()
    };
    name.map(|it| it.to_string_lossy().into_owned())
        .unwrap_or_default()
}

fn write(output: &Path, text: &str, files: usize) -> Exit {
    match std::fs::write(output, text) {
        Ok(()) => {
            let files = match files {
                1 => "1 file".to_owned(),
                files => format!("{files} files"),
            };
            talk::say(&format!(
                "{files} compiled to {output}; use it with --schema-dir {output}",
                output = to_text(output)
            ));
            Exit::Accepted
        }
        Err(error) => {
            talk::fail(&format!("cannot write {}: {error}", to_text(output)));
            Exit::Internal
        }
    }
}
