//! `qcbus timeline`: shows when the elements of a scenario start and end, and why.

use std::path::Path;

use qcbus_messages::Exit;
use qcbus_messages::path_text::to_text;
use qcbus_sdk::Loaded;
use qcbus_xosc::story::{Moment, Opening, Part, Story, Times};
use serde_json::{Value, json};

use crate::args::TimelineArgs;
use crate::talk;

/// Runs the command.
pub fn run(args: &TimelineArgs) -> Exit {
    talk::set_color(args.color);
    match story(&args.file) {
        Ok(story) => {
            talk::print(&match args.json {
                true => format!("{:#}\n", as_json(&args.file, &story)),
                false => as_text(&story),
            });
            Exit::Accepted
        }
        Err((exit, why)) => {
            talk::fail(&why);
            exit
        }
    }
}

fn story(path: &Path) -> Result<Story, (Exit, String)> {
    let usage = |text: String| (Exit::Usage, text);
    let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
    let loaded = Loaded::from_path(path, folder.unwrap_or(Path::new(".")))
        .map_err(|error| usage(format!("failed to {error}")))?;
    let name = to_text(path);
    if !qcbus_xosc::BUNDLE.kinds.contains(&loaded.kind()) {
        let text = format!("{name} is not a scenario: its name ends in neither .xosc nor .mosc");
        return Err(usage(text));
    }
    let subject = loaded
        .subject(&qcbus_xosc::BUNDLE)
        .map_err(|error| (Exit::Internal, format!("failed to {error}")))?;
    let rejected = |text: String| (Exit::Rejected, text);
    if let Some(fault) = subject.root().faults().next() {
        return Err(rejected(format!("{name} cannot be read: {}", fault.text)));
    }
    let root = subject.root().root();
    if root.is_none_or(|root| root.child("Storyboard").is_none()) {
        return Err(usage(format!(
            "{name} is not a scenario: it has no `Storyboard`"
        )));
    }
    if !subject.is_expanded() && subject.expansion().obstacles().next().is_some() {
        let text = format!("{name} cannot be expanded; `qcbus expand` shows the reason");
        return Err(rejected(text));
    }
    for missing in subject.missing() {
        if !missing.path.is_empty() {
            talk::say(&format!("warning: {} cannot be read", missing.path));
        }
    }
    Story::of(&subject).map_err(|_| rejected(format!("{name} has an unsupported version")))
}

fn as_text(story: &Story) -> String {
    let mut text = String::from("Init\n");
    for opening in &story.openings {
        text.push_str(&format!("  {}\n", opening_line(opening)));
    }
    if !story.globals.is_empty() {
        text.push_str(&format!("  global: `{}`\n", story.globals.join("`, `")));
    }
    if !story.is_timed {
        text.push_str(
            "\nThe times are unknown, because a part of the storyboard is unknown, such as a \
             maneuver of a missing catalog.\n",
        );
    }
    for part in &story.elements {
        if part.depth == 0 {
            text.push('\n');
        }
        let indent = "  ".repeat(part.depth);
        text.push_str(&format!("{indent}{}\n", part_line(story, part)));
    }
    text.push_str(&format!("\n{}\n", end_line(story)));
    text
}

fn opening_line(opening: &Opening) -> String {
    let mut facts = Vec::new();
    match &opening.place {
        None => facts.push("no position in `Init`".to_owned()),
        Some(place) => {
            facts.push(place.written.clone());
            match place.world {
                Some([x, y, heading]) => facts.push(format!(
                    "x {} m, y {} m, heading {} rad",
                    short(x),
                    short(y),
                    short(heading)
                )),
                None => facts.push("place on the map unknown".to_owned()),
            }
        }
    }
    facts.extend(opening.speed.map(|speed| format!("{} m/s", short(speed))));
    if !opening.actions.is_empty() {
        facts.push(format!("`{}`", opening.actions.join("`, `")));
    }
    format!("`{}`: {}", opening.entity, facts.join("; "))
}

fn part_line(story: &Story, part: &Part) -> String {
    let name = part.name.as_deref().unwrap_or("?");
    let mut head = match part.kind.word() {
        "maneuverGroup" => format!("maneuver group `{name}`"),
        word => format!("{word} `{name}`"),
    };
    if !part.actors.is_empty() {
        head.push_str(&format!(" of {}", part.actors.join(", ")));
    }
    if let Some(action) = &part.action {
        head.push_str(&format!(" (`{action}`)"));
    }
    if !story.is_timed {
        return match &part.waits {
            Some(waits) => format!("{}: waits for {waits}", bold(&head)),
            None => bold(&head),
        };
    }
    let Times { start, end } = part.standard;
    let mut facts = Vec::new();
    if start.is_never() {
        let why = part.never_starts.iter();
        let why: String = why.map(|why| format!(", because {why}")).collect();
        facts.push(format!("{}{why}", red("never starts")));
    } else {
        facts.push(moment("start", start));
    }
    let tolerant = moment("start", part.tolerant.start);
    if tolerant != moment("start", start) {
        facts.push(format!("in some simulators it {}", verb(&tolerant)));
    }
    if !start.is_never() {
        facts.push(end_of(end, story, part));
    }
    // The reason of an element that never starts already names its conditions.
    let waits = part.waits.as_ref().filter(|_| !start.is_never());
    facts.extend(waits.map(|waits| format!("waits for {waits}")));
    format!("{}: {}", bold(&head), facts.join("; "))
}

/// Makes "start unknown" the predicate of a sentence.
fn verb(text: &str) -> String {
    match text {
        "start unknown" => "may start at any time or never".to_owned(),
        text => text.to_owned(),
    }
}

fn end_of(end: Moment, story: &Story, part: &Part) -> String {
    if end.is_never() {
        let why = part.never_ends.iter();
        let why: String = why.map(|why| format!(", because {why}")).collect();
        return match story.end.standard.is_never() {
            true => format!("never ends{why}"),
            false => format!("runs until the end of the run{why}"),
        };
    }
    match end.earliest >= story.end.standard.latest {
        true => "runs until the end of the run".to_owned(),
        false => moment("end", end),
    }
}

fn end_line(story: &Story) -> String {
    let end = &story.end;
    let Some(waits) = &end.waits else {
        return "stop trigger: none; the scenario does not end the run".to_owned();
    };
    let mut facts = Vec::new();
    if end.standard.is_never() {
        let why = end.never.iter();
        let why: String = why.map(|why| format!(", because {why}")).collect();
        facts.push(format!("{}{why}", red("the run never ends")));
    } else {
        facts.push(format!("the run: {}", moment("end", end.standard)));
        facts.push(format!("waits for {waits}"));
    }
    let tolerant = moment("end", end.tolerant);
    if tolerant != moment("end", end.standard) {
        facts.push(format!("in some simulators: {tolerant}"));
    }
    format!("{}: {}", bold("stop trigger"), facts.join("; "))
}

/// Range in seconds that is shown as one time. Simulators need some steps for a transition.
const ONE_TIME: f64 = 0.45;

/// Formats a moment: "starts at 3 s", "starts between 2 and 5 s", "start unknown".
fn moment(word: &str, moment: Moment) -> String {
    let earliest = short(moment.earliest);
    if moment.is_never() {
        return format!("never {word}s");
    }
    if !moment.is_certain() {
        return match moment.earliest > 0.0 {
            true => format!("{word}s at {earliest} s at the earliest, or never"),
            false => format!("{word} unknown"),
        };
    }
    match moment.latest - moment.earliest <= ONE_TIME {
        true => format!("{word}s at {earliest} s"),
        false => format!("{word}s between {earliest} and {} s", short(moment.latest)),
    }
}

fn short(value: f64) -> String {
    let rounded = (value * 1000.0).round() / 1000.0;
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded })
}

fn bold(text: &str) -> String {
    painted("1", text)
}

fn red(text: &str) -> String {
    painted("1;91", text)
}

fn painted(code: &str, text: &str) -> String {
    match talk::color() {
        true => format!("\u{1b}[{code}m{text}\u{1b}[0m"),
        false => text.to_owned(),
    }
}

fn as_json(path: &Path, story: &Story) -> Value {
    let init = story.openings.iter().map(|it| {
        let place = it.place.as_ref();
        let world = place.and_then(|place| place.world);
        json!({
            "entity": it.entity,
            "position": place.map(|place| &place.written),
            "x": world.map(|[x, _, _]| x),
            "y": world.map(|[_, y, _]| y),
            "heading": world.map(|[_, _, heading]| heading),
            "speed": it.speed,
            "actions": it.actions,
        })
    });
    let elements = story.elements.iter().map(|it| {
        json!({
            "kind": it.kind.word(),
            "name": it.name,
            "parent": it.parent,
            "action": it.action,
            "actors": it.actors,
            "place": it.place,
            "start": moment_json(it.standard.start),
            "end": moment_json(it.standard.end),
            "tolerant": {
                "start": moment_json(it.tolerant.start),
                "end": moment_json(it.tolerant.end),
            },
            "waitsFor": it.waits,
            "neverStarts": it.never_starts,
            "neverEnds": it.never_ends,
        })
    });
    json!({
        "schema": 1,
        "file": to_text(path),
        "timesKnown": story.is_timed,
        "init": init.collect::<Vec<_>>(),
        "globalActions": story.globals,
        "elements": elements.collect::<Vec<_>>(),
        "run": {
            "waitsFor": story.end.waits,
            "end": moment_json(story.end.standard),
            "tolerantEnd": moment_json(story.end.tolerant),
            "neverEnds": story.end.never,
        },
    })
}

/// Returns a moment for programs: `earliest` is null for never, `latest` if it may never come.
fn moment_json(moment: Moment) -> Value {
    let finite = |seconds: f64| seconds.is_finite().then_some(seconds);
    json!({"earliest": finite(moment.earliest), "latest": finite(moment.latest)})
}
