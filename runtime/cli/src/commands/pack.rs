//! `qcbus pack`: packs a scenario and its files into an archive.

use std::path::{Path, PathBuf};

use qcbus_document::FileKind;
use qcbus_ingest::Limits;
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Exit, Verdict};
use qcbus_sdk::Loaded;
use qcbus_sdk::modular::pack;

use super::expand::{Failed, say_findings};
use crate::args::PackArgs;
use crate::talk;

/// Name of the main scenario in an archive.
const MAIN: &str = "main.xosc";

/// Runs the command.
pub fn run(args: &PackArgs) -> Exit {
    let (exit, why) = match packed(args) {
        Ok(exit) => return exit,
        Err(failed) => failed,
    };
    talk::fail(&why);
    exit
}

fn packed(args: &PackArgs) -> Result<Exit, Failed> {
    let usage = |text: String| (Exit::Usage, text);
    let output = &args.output;
    if FileKind::of_path(output) != Some(FileKind::Mosc) {
        let text = format!(
            "{}: the name of an archive must end in .mosc",
            to_text(output)
        );
        return Err(usage(text));
    }
    let members = members(&args.files).map_err(usage)?;
    let mut files = Vec::new();
    for (name, path) in members {
        let is_output = path
            .canonicalize()
            .ok()
            .is_some_and(|path| Some(path) == output.canonicalize().ok());
        if is_output {
            return Err(usage(format!(
                "{} cannot be packed into itself",
                to_text(&path)
            )));
        }
        files.push((name, read(&path).map_err(usage)?));
    }
    let archive = pack(&files).map_err(|error| usage(format!("failed to {error}")))?;
    qcbus_disk::write_named(output, &archive, false).map_err(|error| {
        (
            Exit::Internal,
            format!("cannot write {}: {error}", to_text(output)),
        )
    })?;
    let folder = output.parent().filter(|it| !it.as_os_str().is_empty());
    let loaded = Loaded::from_path(output, folder.unwrap_or(Path::new(".")))
        .map_err(|error| (Exit::Internal, format!("failed to {error}")))?;
    let (_, verdict) = say_findings(&loaded)?;
    Ok(match verdict {
        Verdict::Rejected => Exit::Rejected,
        _ => Exit::Accepted,
    })
}

/// Reads a file for an archive. Anything but a regular file is refused, because it may have no end.
fn read(path: &Path) -> Result<Vec<u8>, String> {
    let most = Limits::default().max_archive;
    let failed = |error: std::io::Error| format!("cannot read {}: {error}", to_text(path));
    let data = std::fs::metadata(path).map_err(failed)?;
    if !data.is_file() {
        return Err(format!("cannot read {}: it is not a file", to_text(path)));
    }
    if data.len() > most {
        let (path, found) = (to_text(path), data.len());
        return Err(format!(
            "{path} has {found} bytes; an archive may have at most {most} in total"
        ));
    }
    std::fs::read(path).map_err(failed)
}

/// Returns the names of the files in the archive, with their paths.
fn members(files: &[PathBuf]) -> Result<Vec<(String, PathBuf)>, String> {
    let Some((main, others)) = files.split_first() else {
        return Err("there is nothing to pack".to_owned());
    };
    if FileKind::of_path(main) != Some(FileKind::Xosc) {
        return Err(format!(
            "{}: the main scenario must come first, and its name must end in .xosc",
            to_text(main)
        ));
    }
    let folder = absolute(main).parent().map(Path::to_path_buf);
    let mut members = vec![(MAIN.to_owned(), main.clone())];
    for path in others {
        let whole = absolute(path);
        let below = folder
            .as_deref()
            .and_then(|folder| whole.strip_prefix(folder).ok());
        let name = below.or_else(|| whole.file_name().map(Path::new));
        let name = name
            .and_then(Path::to_str)
            .ok_or_else(|| format!("{}: names in archives must be UTF-8", to_text(path)))?;
        if let Some((_, other)) = members.iter().find(|(other, _)| other == name) {
            return Err(format!(
                "{} and {} would both be called {name} in the archive",
                to_text(other),
                to_text(path)
            ));
        }
        members.push((name.to_owned(), path.clone()));
    }
    Ok(members)
}

/// Returns the absolute path. Links are followed, so that each file has one name.
fn absolute(path: &Path) -> PathBuf {
    let whole = path.canonicalize().or_else(|_| std::path::absolute(path));
    whole.unwrap_or_else(|_| path.to_path_buf())
}
