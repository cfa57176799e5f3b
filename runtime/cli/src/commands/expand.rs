//! `qcbus expand`.

use std::path::Path;

use qcbus_messages::Exit;
use qcbus_messages::path_text::from_text;
use qcbus_sdk::modular::Expansion;
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

type Failed = (Exit, String);

fn expanded(args: &ExpandArgs) -> Result<Exit, Failed> {
    let internal = |error: qcbus_sdk::LoadError| (Exit::Internal, format!("failed to {error}"));
    let loaded = load(&args.file)?;
    say_findings(&loaded);
    let subject = loaded.subject(&qcbus_modular::BUNDLE).map_err(internal)?;
    let expansion = subject.expansion();
    if let Some(why) = in_the_way(&expansion) {
        let text = format!("{} is not expanded: {why}", args.file.display());
        return Err((Exit::Rejected, text));
    }
    let text = expansion.text();
    let Some(output) = &args.output else {
        talk::print(&text);
        return Ok(Exit::Accepted);
    };
    if let Some(source) = source_at(&expansion, output) {
        let output = output.display();
        let text = format!("{output} is not written: the scenario is made of it ({source})");
        return Err((Exit::Usage, text));
    }
    qcbus_disk::write_whole(output, text.as_bytes(), false).map_err(|error| {
        let text = format!("cannot write {}: {error}", output.display());
        (Exit::Internal, text)
    })?;
    Ok(Exit::Accepted)
}

/// Reads a modular scenario and all that belongs to it.
fn load(path: &Path) -> Result<Loaded, Failed> {
    let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
    let boundary = folder.unwrap_or(Path::new("."));
    let usage = |error: qcbus_sdk::LoadError| (Exit::Usage, format!("failed to {error}"));
    let loaded = Loaded::from_path(path, boundary).map_err(usage)?;
    if qcbus_modular::BUNDLE.kinds.contains(&loaded.kind()) {
        return Ok(loaded);
    }
    let text = format!(
        "{} is no scenario: its name ends in neither .xosc nor .mosc",
        path.display()
    );
    Err((Exit::Usage, text))
}

/// What the rules about modular scenarios find, as errors and warnings on stderr.
pub(super) fn say_findings(loaded: &Loaded) {
    let plan = Plan::by_default(&qcbus_modular::BUNDLE);
    match qcbus_sdk::findings(&plan, loaded, Level::Warning) {
        Ok(text) if text.is_empty() => {}
        Ok(text) => talk::say(text.trim_end()),
        Err(error) => talk::fail(&format!("failed to {error}")),
    }
}

/// Why no plain scenario can be made.
fn in_the_way(expansion: &Expansion<'_>) -> Option<String> {
    let root = expansion.pieces.first()?.document;
    if root.root().is_none() {
        let fault = root.faults().next();
        return Some(
            fault
                .map_or("there is nothing in it", |fault| fault.text)
                .to_owned(),
        );
    }
    let obstacle = expansion.obstacles().next()?;
    let place = obstacle.at.node().document().position(obstacle.at.offset());
    Some(format!("{place}: {}", obstacle.text))
}

/// The file that the scenario is made of and that would be overwritten.
fn source_at(expansion: &Expansion<'_>, output: &Path) -> Option<String> {
    let output = output.canonicalize().ok()?;
    let files = expansion.pieces.iter().map(|piece| piece.document.path());
    // Of a member the archive counts.
    let mut files = files.map(|path| match path.split_once(".mosc!") {
        Some((archive, _)) => format!("{archive}.mosc"),
        None => path.to_owned(),
    });
    files.find(|file| {
        from_text(file)
            .canonicalize()
            .is_ok_and(|file| file == output)
    })
}
