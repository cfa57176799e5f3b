//! Files and directories that a run checks.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use qcbus_document::{FileKind, Suffix};
use qcbus_formats::config::Config;
use qcbus_messages::path_text::{from_text, to_text};
use qcbus_watch::is_excluded;

use super::{Refusal, usage};
use crate::args::CheckArgs;
use crate::commands::settings::{looks_into, named, outermost};

/// Files and directories to be checked.
pub(super) struct Targets {
    pub roots: Vec<PathBuf>,
    pub files: Vec<PathBuf>,
    /// Files that are named explicitly but excluded by a `.qcignore`.
    pub excluded: Vec<PathBuf>,
}

/// Returns the directories and files from the command line or from the configuration.
pub(super) fn targets(
    args: &CheckArgs,
    config_path: Option<&Path>,
    config: Option<&Config>,
) -> Result<Targets, Refusal> {
    let mut paths = args.paths.clone();
    if paths.is_empty() {
        let Some(config) = config else {
            return Err(usage(
                "nothing to check: name files or directories, or a configuration with -c",
            ));
        };
        let Some(input) = config.input_file() else {
            return Err(usage(
                "the configuration has no InputFile; add one, or name a file after -c CONFIG",
            ));
        };
        paths.push(input_path(&from_text(input), config_path));
    }
    let (mut roots, mut files) = (BTreeSet::new(), BTreeSet::new());
    for path in &paths {
        let real = std::fs::canonicalize(path)
            .map_err(|error| usage(format!("cannot check {}: {error}", to_text(path))))?;
        // A link to a file is checked under its own name, as in a directory scan.
        let file = named(path);
        if real.is_dir() {
            roots.insert(real);
        } else if !real.is_file() {
            let shown = to_text(path);
            return Err(usage(format!(
                "cannot check {shown}: it is not a regular file"
            )));
        } else if FileKind::of_path(&file).is_some() {
            files.insert(file);
        } else if FileKind::of_path(&real).is_some() {
            files.insert(real);
        } else {
            let shown = to_text(path);
            return Err(usage(format!(
                "{shown} is not a file type that qcbus checks ({})",
                Suffix::list()
            )));
        }
    }
    let mut excluded = BTreeSet::new();
    if args.force_exclude {
        excluded = files
            .iter()
            .filter(|file| is_excluded(file))
            .cloned()
            .collect();
        files.retain(|file| !excluded.contains(file));
    }
    let roots = outermost(roots);
    files.retain(|file| !file.parent().is_some_and(|it| looks_into(&roots, it)));
    Ok(Targets {
        roots,
        files: files.into_iter().collect(),
        excluded: excluded.into_iter().collect(),
    })
}

/// Resolves a relative InputFile against the current directory, as ASAM's bundles do, else against
/// the directory of the configuration.
fn input_path(input: &Path, config: Option<&Path>) -> PathBuf {
    let beside = config
        .and_then(Path::parent)
        .map(|directory| directory.join(input));
    match beside {
        Some(beside) if !input.exists() && beside.exists() => beside,
        _ => input.to_path_buf(),
    }
}

/// Returns the kinds of files that may have to be checked. Maps refer to no other files; scenarios
/// may refer to files of any kind.
pub(super) fn kinds(
    roots: &[PathBuf],
    files: &[PathBuf],
    own_verdicts: bool,
) -> BTreeSet<FileKind> {
    let kinds = files.iter().filter_map(|file| FileKind::of_path(file));
    let kinds: BTreeSet<FileKind> = kinds.collect();
    let alone = kinds.iter().all(|kind| *kind == FileKind::Xodr) || own_verdicts;
    match roots.is_empty() && alone {
        true => kinds,
        false => FileKind::ALL.into_iter().collect(),
    }
}
