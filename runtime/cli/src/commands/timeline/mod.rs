//! `qcbus timeline`: shows when the elements of a scenario start and end, and why.

mod json;
mod text;

use std::path::Path;

use qcbus_formats::xqar::{Issue, Level, Location};
use qcbus_messages::Exit;
use qcbus_messages::path_text::to_text;
use qcbus_openscenario::story::Story;
use qcbus_sdk::{LoadError, Subject};

use super::expand::{Failed, in_the_way, load};
use crate::args::TimelineArgs;
use crate::talk;

/// A story and the references of the scenario that have no target.
struct Told {
    /// Absolute path of the scenario, and its member if it is in an archive.
    file: String,
    story: Story,
    warnings: Vec<Warning>,
}

/// A reference without a target.
struct Warning {
    text: String,
    /// File, row and column.
    place: String,
}

/// Runs the command.
pub fn run(args: &TimelineArgs) -> Exit {
    talk::set_color(args.color);
    match told(&args.file) {
        Ok(told) => {
            for Warning { text, place } in &told.warnings {
                talk::say(&format!("warning: {place}: {text}"));
            }
            if !told.story.is_timed {
                talk::say(
                    "warning: the times are unknown, because a part of the storyboard is unknown",
                );
            }
            talk::print(&match args.json {
                true => format!("{:#}\n", json::of(&told)),
                false => text::of(&told.story),
            });
            // Without times, the elements that are shown may be incomplete.
            talk::exit(match told.story.is_timed {
                true => Exit::Accepted,
                false => Exit::Undetermined,
            })
        }
        Err((exit, why)) => {
            talk::fail(&why);
            exit
        }
    }
}

fn told(path: &Path) -> Result<Told, Failed> {
    let loaded = load(path)?;
    let subject = loaded
        .subject(&qcbus_xosc::BUNDLE)
        .map_err(|error| internal(&error))?;
    refuse_unreadable(&subject)?;
    let root = subject.root().root();
    if root.is_none_or(|root| root.child("Storyboard").is_none()) {
        let text = format!(
            "{} is not a scenario: it has no `Storyboard`",
            to_text(path)
        );
        return Err((Exit::Usage, text));
    }
    let story = qcbus_xosc::story(&subject).map_err(|why| {
        let text = format!("the story of {} is unknown: {why}", to_text(path));
        (Exit::Rejected, text)
    })?;
    let remarks = loaded.remarks(&[]).map_err(|error| internal(&error))?;
    let issues = remarks.iter().filter_map(|remark| remark.issue.as_ref());
    let issues = issues.filter(|issue| issue.level != Level::Information);
    let file = subject.written().path();
    Ok(Told {
        file: file.to_owned(),
        story,
        warnings: issues.map(|issue| warning(file, issue)).collect(),
    })
}

fn internal(error: &LoadError) -> Failed {
    (Exit::Internal, format!("failed to {error}"))
}

/// Returns an error if the scenario or a scenario that it refers to cannot be read.
fn refuse_unreadable(subject: &Subject<'_>) -> Result<(), Failed> {
    if subject.is_expanded() {
        return Ok(());
    }
    let Some(why) = in_the_way(&subject.expansion()) else {
        return Ok(());
    };
    // The reason often begins with its place.
    let text = match why.text.starts_with(subject.written().path()) {
        true => why.text,
        false => format!("{}: {}", why.place, why.text),
    };
    Err((Exit::Rejected, text))
}

fn warning(file: &str, issue: &Issue) -> Warning {
    let places = issue.locations.iter().flat_map(|it| &it.places);
    let mut positions = places.filter_map(|place| match place {
        Location::File { row, column, .. } => Some(format!("{file}:{row}:{column}")),
        _ => None,
    });
    Warning {
        text: issue.description.clone(),
        place: positions.next().unwrap_or_else(|| file.to_owned()),
    }
}
