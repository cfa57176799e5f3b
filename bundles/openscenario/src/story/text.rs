//! The story in words, as `qcbus timeline` prints it.

use super::{End, Opening, StartPosition, Story, StoryboardElement};
use crate::timeline::Moment;
use crate::types::storyboard::StoryKind;
use crate::wording::short;

/// A storyboard element in words.
#[derive(Debug)]
pub struct Sentence {
    /// Its kind, name and actors: "event `brake`".
    pub head: String,
    /// Its start, such as "starts at 3 s" or "never starts, because …". `None` if its parent starts
    /// at the same time.
    pub start: Option<String>,
    /// Its end. `None` if its parent ends at the same time.
    pub end: Option<String>,
    /// Conditions of its start trigger: "waits until …".
    pub waits: Option<String>,
}

impl Sentence {
    /// Returns the facts after the head, joined by semicolons.
    pub fn facts(&self) -> String {
        let facts = [&self.start, &self.end, &self.waits];
        let facts: Vec<&str> = facts.into_iter().flatten().map(String::as_str).collect();
        facts.join("; ")
    }
}

impl Story {
    /// Returns the storyboard elements in words. A fact that the parent of an element shares is
    /// left out.
    pub fn sentences(&self) -> Vec<Sentence> {
        self.in_words(false)
    }

    /// Returns the storyboard elements in words, each with all its facts.
    pub fn complete_sentences(&self) -> Vec<Sentence> {
        self.in_words(true)
    }

    fn in_words(&self, is_complete: bool) -> Vec<Sentence> {
        let elements = self.elements.iter();
        let sentences = elements.map(|element| {
            let above = element.parent.and_then(|parent| self.elements.get(parent));
            let facts = match above {
                _ if !self.is_timed => untimed(element),
                Some(above) if above.standard.start.is_never() && !is_complete => untimed(element),
                above => own_facts(self, element, above, is_complete),
            };
            let waits = facts.waits.map(|waits| format!("waits until {waits}"));
            Sentence {
                head: head(element),
                start: facts.start,
                end: facts.end,
                waits,
            }
        });
        sentences.collect()
    }
}

impl Opening {
    /// Returns the start of the entity in words, without its name.
    pub fn sentence(&self) -> String {
        let mut facts = Vec::new();
        facts.push(match &self.position {
            None => "no position in `Init`".to_owned(),
            Some(position) => place(position),
        });
        facts.extend(self.speed.map(|speed| format!("{} m/s", short(speed))));
        if !self.actions.is_empty() {
            facts.push(format!("`{}`", self.actions.join("`, `")));
        }
        facts.join("; ")
    }
}

impl End {
    /// Returns the end of the run in words: "The run ends at 30 s", and the reason.
    pub fn sentence(&self) -> (String, String) {
        let Some(waits) = &self.waits else {
            let text = "The run has no stop trigger, so the scenario does not end it";
            return (String::new(), text.to_owned());
        };
        let when = moment("end", self.standard, 0.0);
        let (head, mut text) = match when.as_str() {
            "end unknown" => ("The end of the run is unknown".to_owned(), String::new()),
            "never ends" => ("The run never ends".to_owned(), because(&self.never)),
            when => (format!("The run {when}"), String::new()),
        };
        if !self.standard.is_never() {
            text.push_str(&format!("; its stop trigger waits until {waits}"));
        }
        let tolerant = moment("end", self.tolerant, 0.0);
        if is_definite(self.standard) && tolerant != when {
            text.push_str(&match tolerant.as_str() {
                "end unknown" => "; in some simulators its end is unknown".to_owned(),
                when => format!("; in some simulators it {when}"),
            });
        }
        (head, text)
    }
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

fn untimed(element: &StoryboardElement) -> Facts {
    Facts {
        waits: element.waits.clone(),
        ..Facts::default()
    }
}

fn own_facts(
    story: &Story,
    element: &StoryboardElement,
    above: Option<&StoryboardElement>,
    is_complete: bool,
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
    let start = (is_complete || above.is_none_or(is_own)).then(|| start(element, known));
    let end_above = above.filter(|_| !is_complete);
    let end_above = end_above.map(|above| end(story, above));
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
        true => format!("{own}{}", because(&element.never_starts)),
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

fn because(why: &Option<String>) -> String {
    let why = why.iter().map(|why| format!(", because {why}"));
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
