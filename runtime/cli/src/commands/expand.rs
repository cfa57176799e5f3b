//! `qcbus expand`: writes a modular scenario as one plain scenario.

use std::io::Write as _;
use std::path::Path;

use qcbus_messages::path_text::{from_text, split_archive, to_text};
use qcbus_messages::{Absence, DocumentRole, Exit, Verdict};
use qcbus_sdk::modular::{Expansion, SearchPath};
use qcbus_sdk::{Level, Loaded, Plan};

use crate::args::ExpandArgs;
use crate::talk;

/// Runs the command.
pub fn run(args: &ExpandArgs) -> Exit {
    match expanded(args) {
        Ok(exit) => exit,
        Err((exit, why)) => {
            talk::fail(&why);
            exit
        }
    }
}

pub(super) type Failed = (Exit, String);

fn expanded(args: &ExpandArgs) -> Result<Exit, Failed> {
    if let Some(output) = args.output.as_deref().filter(|output| output.is_dir()) {
        let text = format!("{} is a directory; name a file", to_text(output));
        return Err((Exit::Usage, text));
    }
    let loaded = load(&args.file)?;
    let (said, _) = say_findings(&loaded)?;
    let subject = loaded
        .subject(&qcbus_modular::BUNDLE)
        .map_err(|error| internal(&error))?;
    let expansion = subject.expansion();
    let name = to_text(&args.file);
    if let Some(why) = in_the_way(&expansion) {
        // A reason that was already printed with its place is not repeated.
        let why = match said.contains(&why.text) {
            true => String::new(),
            false => format!(": {}: {}", why.place, why.text),
        };
        return Err((Exit::Rejected, format!("{name} cannot be expanded{why}")));
    }
    if expansion.references.is_empty() {
        talk::say(&format!(
            "{name} refers to no other scenario: there is nothing to expand"
        ));
    }
    say_moved(&expansion, args);
    let text = expansion.text();
    let Some(output) = &args.output else {
        return written_out(&text);
    };
    if let Some(source) = source_at(&expansion, output) {
        let output = to_text(output);
        let text =
            format!("{output} is not written: it is a source file of the scenario ({source})");
        return Err((Exit::Usage, text));
    }
    qcbus_disk::write_named(output, text.as_bytes(), false).map_err(|error| {
        let text = format!("cannot write {}: {error}", to_text(output));
        (Exit::Internal, text)
    })?;
    Ok(Exit::Accepted)
}

/// Writes the scenario to stdout. A failed write is an error; a closed pipe is not, because the
/// reader closed it itself.
fn written_out(text: &str) -> Result<Exit, Failed> {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    match written {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err((Exit::Internal, format!("cannot write to stdout: {error}")))
        }
        _ => Ok(Exit::Accepted),
    }
}

/// Reads a modular scenario and all files that belong to it.
pub(super) fn load(path: &Path) -> Result<Loaded, Failed> {
    let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
    let boundary = folder.unwrap_or(Path::new("."));
    let usage = |error: qcbus_sdk::LoadError| (Exit::Usage, format!("failed to {error}"));
    let loaded = Loaded::from_path(path, boundary).map_err(usage)?;
    if qcbus_modular::BUNDLE.kinds.contains(&loaded.kind()) {
        return Ok(loaded);
    }
    let text = format!(
        "{} is not a scenario: its name ends in neither .xosc nor .mosc",
        to_text(path)
    );
    Err((Exit::Usage, text))
}

/// Prints the errors and warnings of the rules about modular scenarios on stderr. Returns the text
/// and its verdict.
pub(super) fn say_findings(loaded: &Loaded) -> Result<(String, Verdict), Failed> {
    let plan = Plan::by_default(&qcbus_modular::BUNDLE);
    let (text, verdict) =
        qcbus_sdk::findings(&plan, loaded, Level::Warning).map_err(|error| internal(&error))?;
    if !text.is_empty() {
        talk::say_lines(text.trim_end());
    }
    Ok((text, verdict))
}

fn internal(error: &qcbus_sdk::LoadError) -> Failed {
    (Exit::Internal, format!("failed to {error}"))
}

/// Warns about relative paths in the scenario if the output is in another directory. Such paths
/// start at the directory of the scenario.
fn say_moved(expansion: &Expansion<'_>, args: &ExpandArgs) {
    let Some(output) = &args.output else { return };
    let directory = |path: &Path| {
        let whole = std::path::absolute(path).ok()?;
        whole.parent()?.canonicalize().ok()
    };
    if directory(output) == directory(&args.file) {
        return;
    }
    let Some(piece) = expansion.pieces.first() else {
        return;
    };
    let all = qcbus_ingest::references(&piece.document, &SearchPath::default());
    let of_main = all.iter().filter(|it| {
        let is_file = it.unresolved != Some(Absence::SimulatorMap);
        matches!(it.role, DocumentRole::Map | DocumentRole::Catalog) && is_file
    });
    let paths = of_main.map(|it| it.text.as_str());
    let is_relative = |path: &&str| !path.starts_with(['/', '$']) && !path.contains("://");
    for path in paths.filter(is_relative) {
        talk::say(&format!(
            "warning: `{path}` is relative to the directory of the scenario, but {} is in another directory than \
             {}",
            to_text(output),
            to_text(&args.file)
        ));
    }
}

/// Reason why no plain scenario can be made, with its place.
pub(super) struct InTheWay {
    pub(super) place: String,
    pub(super) text: String,
}

/// Returns the first reason why no plain scenario can be made, or `None`.
pub(super) fn in_the_way(expansion: &Expansion<'_>) -> Option<InTheWay> {
    let root = expansion.pieces.first()?.document;
    if root.root().is_none() {
        let fault = root.faults().next();
        return Some(InTheWay {
            place: root.path().to_owned(),
            text: fault
                .map_or("it has no content", |fault| fault.text)
                .to_owned(),
        });
    }
    let obstacle = expansion.obstacles().next()?;
    let document = obstacle.at.node().document();
    Some(InTheWay {
        place: document.position(obstacle.at.offset()).to_string(),
        text: obstacle.text.clone(),
    })
}

/// Returns the source file of the scenario that the output would overwrite.
fn source_at(expansion: &Expansion<'_>, output: &Path) -> Option<String> {
    let output = output.canonicalize().ok()?;
    let files = expansion.pieces.iter().map(|piece| piece.document.path());
    // The source file of an archive member is the archive.
    let mut files = files.map(|path| split_archive(path).map_or(path, |(archive, _)| archive));
    files
        .find(|file| {
            from_text(file)
                .canonicalize()
                .is_ok_and(|file| file == output)
        })
        .map(str::to_owned)
}
