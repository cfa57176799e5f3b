//! A story for people.

use qcbus_messages::shown;
use qcbus_openscenario::story::{End, Opening, StartPosition, Story, StoryboardElement};
use qcbus_openscenario::wording::short;
use qcbus_openscenario::{Moment, StoryKind};

use crate::talk;

/// Maximum number of unknown parts of the storyboard that are listed.
const MOST_GAPS: usize = 10;

/// Returns the story as text. Only colours in it are control codes.
pub(super) fn of(story: &Story) -> String {
    let mut lines = vec![
        match story.openings.is_empty() && story.globals.is_empty() {
            true => "Init: no entities and no global actions".to_owned(),
            false => "Init".to_owned(),
        },
    ];
    lines.extend(story.openings.iter().map(opening));
    if !story.globals.is_empty() {
        lines.push(plain(&format!(
            "  global: `{}`",
            story.globals.join("`, `")
        )));
    }
    if !story.is_timed {
        lines.extend(gaps(story));
    }
    let all: Vec<Facts> = match story.is_timed {
        true => facts(story),
        false => story.elements.iter().map(untimed).collect(),
    };
    for (element, facts) in story.elements.iter().zip(all) {
        if element.depth == 0 {
            lines.push(String::new());
        }
        let indent = "  ".repeat(element.depth);
        let facts = facts.line();
        let colon = if facts.is_empty() { "" } else { ": " };
        lines.push(format!("{indent}{}{colon}{facts}", bold(&head(element))));
    }
    lines.push(String::new());
    lines.push(run(&story.end));
    lines.join("\n") + "\n"
}

fn opening(opening: &Opening) -> String {
    let mut facts = Vec::new();
    facts.push(match &opening.position {
        None => "no position in `Init`".to_owned(),
        Some(position) => place(position),
    });
    facts.extend(opening.speed.map(|speed| format!("{} m/s", short(speed))));
    if !opening.actions.is_empty() {
        facts.push(format!("`{}`", opening.actions.join("`, `")));
    }
    plain(&format!("  `{}`: {}", opening.entity, facts.join("; ")))
}

/// Formats a position as it is written, and its place in the world.
fn place(position: &StartPosition) -> String {
    let written = &position.written;
    let Some([x, y, heading]) = position.world else {
        return format!("{written}; place on the map unknown");
    };
    let place = format!("x {} m, y {} m", short(x), short(y));
    let heading = format!("heading {} rad", short(heading));
    match written.starts_with(&place) {
        true => format!("{written}, {heading}"),
        false => format!("{written}; {place}, {heading}"),
    }
}

fn gaps(story: &Story) -> Vec<String> {
    let mut lines = vec![
        String::new(),
        "The times are unknown, because a part of the storyboard is unknown:".to_owned(),
    ];
    let listed = story.gaps.iter().take(MOST_GAPS);
    lines.extend(listed.map(|gap| plain(&format!("  {}: {}", gap.place, gap.text))));
    match story.gaps.len().saturating_sub(MOST_GAPS) {
        0 => {}
        more => lines.push(format!("  and {more} more")),
    }
    lines
}

fn head(element: &StoryboardElement) -> String {
    let kind = match element.kind {
        StoryKind::ManeuverGroup => "maneuver group",
        kind => kind.word(),
    };
    let mut head = match &element.name {
        Some(name) => format!("{kind} `{name}`"),
        None => format!("{kind} of unknown name"),
    };
    let actors = element.actors.iter().map(|name| format!("`{name}`"));
    let triggering = element.are_triggering_actors;
    let triggering = triggering.then(|| "the triggering entities".to_owned());
    let actors: Vec<String> = actors.chain(triggering).collect();
    if !actors.is_empty() {
        head.push_str(&format!(" of {}", actors.join(", ")));
    }
    if let Some(action) = &element.action {
        head.push_str(&format!(" (`{action}`)"));
    }
    head
}

/// Facts about an element. A fact that its parent shares is left out.
#[derive(Default)]
struct Facts {
    start: Option<String>,
    end: Option<String>,
    waits: Option<String>,
}

impl Facts {
    fn line(self) -> String {
        let waits = self
            .waits
            .map(|waits| format!("waits until {}", plain(&waits)));
        let facts = [self.start, self.end, waits];
        let facts: Vec<String> = facts.into_iter().flatten().collect();
        facts.join("; ")
    }
}

fn untimed(element: &StoryboardElement) -> Facts {
    Facts {
        waits: element.waits.clone(),
        ..Facts::default()
    }
}

/// Returns the facts about all elements.
fn facts(story: &Story) -> Vec<Facts> {
    let elements = story.elements.iter();
    let facts = elements.map(|element| {
        let above = element.parent.and_then(|parent| story.elements.get(parent));
        match above {
            Some(above) if above.standard.start.is_never() => untimed(element),
            above => own_facts(story, element, above),
        }
    });
    facts.collect()
}

fn own_facts(
    story: &Story,
    element: &StoryboardElement,
    above: Option<&StoryboardElement>,
) -> Facts {
    if element.standard.start.is_never() {
        // The reason of an element that never starts already names its conditions.
        return Facts {
            start: Some(start(element, 0.0)),
            ..Facts::default()
        };
    }
    // An element starts after its parent in any case.
    let known = above.map_or(0.0, |above| above.standard.start.earliest);
    // The start of an element with a trigger is a fact of its own.
    let is_own = |above: &StoryboardElement| {
        element.waits.is_some() || start(above, 0.0) != start(element, 0.0)
    };
    let start = above.is_none_or(is_own).then(|| start(element, known));
    let end_above = above.map(|above| end(story, above));
    let end = Some(end(story, element)).filter(|end| end_above.as_ref() != Some(end));
    let waits = element.waits.clone();
    match start.as_deref().zip(end.as_deref()).and_then(at_once) {
        Some(both) => Facts {
            start: Some(both),
            end: None,
            waits,
        },
        None => Facts { start, end, waits },
    }
}

/// Joins "starts at 3 s" and "ends at 3 s".
fn at_once((start, end): (&str, &str)) -> Option<String> {
    if (start, end) == ("start unknown", "end unknown") {
        return Some("start and end unknown".to_owned());
    }
    let (start, end) = (start.strip_prefix("starts ")?, end.strip_prefix("ends ")?);
    let rough = start
        .strip_prefix("at ")
        .map(|time| format!("at about {time}"));
    let is_same = start == end || rough.as_deref() == Some(end);
    is_same.then(|| format!("starts and ends {end}"))
}

/// Describes the start of an element. The reader knows that it is not before `known`.
fn start(element: &StoryboardElement, known: f64) -> String {
    let standard = element.standard.start;
    let own = moment("start", standard, known);
    let tolerant = moment("start", element.tolerant.start, 0.0);
    let differs = is_definite(standard) && tolerant != own;
    let mut text = match standard.is_never() {
        true => format!("{}{}", red(&own), because(&element.never_starts)),
        false => own,
    };
    if differs {
        let tolerant = match tolerant.as_str() {
            "start unknown" => "may start at any time or never",
            text => text,
        };
        text.push_str(&format!("; in some simulators it {tolerant}"));
    }
    text
}

fn end(story: &Story, element: &StoryboardElement) -> String {
    let end = element.standard.end;
    let run = story.end.standard;
    let why = because(&element.never_ends);
    match (end.is_never(), run.is_never()) {
        (true, true) => format!("never ends{why}"),
        (true, false) => format!("runs until the end of the run{why}"),
        (false, false) if end.earliest >= run.latest => "runs until the end of the run".to_owned(),
        (false, _) => moment("end", end, element.standard.start.earliest),
    }
}

fn run(end: &End) -> String {
    let Some(waits) = &end.waits else {
        return "The run has no stop trigger, so the scenario does not end it".to_owned();
    };
    let mut text = match moment("end", end.standard, 0.0).as_str() {
        "end unknown" => bold("The end of the run is unknown"),
        "never ends" => format!("{}{}", red("The run never ends"), because(&end.never)),
        when => bold(&format!("The run {when}")),
    };
    if !end.standard.is_never() {
        text.push_str(&format!("; its stop trigger waits until {}", plain(waits)));
    }
    let tolerant = moment("end", end.tolerant, 0.0);
    if is_definite(end.standard) && tolerant != moment("end", end.standard, 0.0) {
        text.push_str(&match tolerant.as_str() {
            "end unknown" => "; in some simulators its end is unknown".to_owned(),
            when => format!("; in some simulators it {when}"),
        });
    }
    text
}

fn because(why: &Option<String>) -> String {
    let why = why.iter().map(|why| format!(", because {}", plain(why)));
    why.collect()
}

/// Checks whether the standard fixes that a moment comes, or that it never comes.
fn is_definite(moment: Moment) -> bool {
    moment.is_certain() || moment.is_never()
}

/// Range in seconds that is shown as one time. Simulators need some steps for a transition.
const ONE_TIME: f64 = 0.45;

/// Range in seconds that is shown as one rough time. Transitions often follow each other.
const ROUGH_TIME: f64 = 1.0;

/// Difference in seconds that is not shown.
const ROUNDED: f64 = 0.001;

/// Formats a moment: "starts at 3 s", "starts between 2 and 5 s", "start unknown". The reader knows
/// that it is not before `known`.
fn moment(word: &str, moment: Moment, known: f64) -> String {
    let earliest = short(moment.earliest);
    if moment.is_never() {
        return format!("never {word}s");
    }
    if !moment.is_certain() {
        return match moment.earliest > known + ROUNDED {
            true => format!("{word}s at {earliest} s at the earliest, or never"),
            false => format!("{word} unknown"),
        };
    }
    match moment.latest - moment.earliest {
        range if range <= ONE_TIME => format!("{word}s at {earliest} s"),
        range if range <= ROUGH_TIME => format!("{word}s at about {earliest} s"),
        _ => format!("{word}s between {earliest} and {} s", short(moment.latest)),
    }
}

fn bold(text: &str) -> String {
    painted("1", text)
}

fn red(text: &str) -> String {
    painted("1;91", text)
}

fn painted(code: &str, text: &str) -> String {
    match talk::color() {
        true => format!("\u{1b}[{code}m{}\u{1b}[0m", plain(text)),
        false => plain(text),
    }
}

/// Returns a text of the file without control codes.
fn plain(text: &str) -> String {
    shown::line(text).into_owned()
}
