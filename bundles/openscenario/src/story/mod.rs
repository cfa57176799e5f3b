//! A scenario as a story: the start of its entities, and when each storyboard element runs and why.
//!
//! The rules report what is wrong with a scenario. The story shows what it does, for people.

mod gaps;
mod init;
mod never;
mod reasons;
mod text;
mod waits;

use std::fmt;

use crate::queries::actors::Actors;
use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::timeline::{Moment, Span, Strictness, Timeline};
use crate::types::storyboard::{StoryElement, StoryKind};

pub use gaps::Gap;
pub use init::{Opening, StartPosition};
pub use reasons::{NoEdge, edge_of_time, never_starts_within, state_never_comes, time};
pub use text::Sentence;

/// What a scenario does in a run.
#[derive(Debug)]
pub struct Story {
    /// Private actions of `Init`, one entry for each entity.
    pub openings: Vec<Opening>,
    /// Names of the global actions of `Init`.
    pub globals: Vec<String>,
    /// Whether times are known. They are unknown if a part of the storyboard is.
    pub is_timed: bool,
    /// Unknown parts of the storyboard.
    pub gaps: Vec<Gap>,
    /// Storyboard elements. Each comes after its parent and before its next sibling.
    pub elements: Vec<StoryboardElement>,
    /// End of the run.
    pub end: End,
}

/// A storyboard element.
#[derive(Debug)]
pub struct StoryboardElement {
    /// Its kind.
    pub kind: StoryKind,
    /// Its name with parameters replaced, if it is known.
    pub name: Option<String>,
    /// Number of elements around it.
    pub depth: usize,
    /// Index of its parent.
    pub parent: Option<usize>,
    /// Name of the action's element, such as `SpeedAction`.
    pub action: Option<String>,
    /// Named actors of a maneuver group.
    pub actors: Vec<String>,
    /// Whether the entities that trigger the act are actors of the maneuver group, too.
    pub are_triggering_actors: bool,
    /// Its place.
    pub place: FilePlace,
    /// Times by the standard.
    pub standard: Times,
    /// Times that hold in every known simulator.
    pub tolerant: Times,
    /// Condition of the start trigger.
    pub waits: Option<String>,
    /// Reason why it never starts by the standard.
    pub never_starts: Option<String>,
    /// Reason why it never ends by the standard.
    pub never_ends: Option<String>,
}

/// Start and end of a storyboard element. Both are [`Moment::UNKNOWN`] if no times are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// First start.
    pub start: Moment,
    /// Moment from which it is complete, after its last execution.
    pub end: Moment,
}

/// A place in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FilePlace {
    /// Path of the file.
    pub path: String,
    /// Row, from 1.
    pub row: u32,
    /// Column, from 1.
    pub column: u32,
    /// Row in which the element ends.
    pub last_row: u32,
}

impl FilePlace {
    fn of(element: Element<'_, '_>) -> FilePlace {
        let node = element.node();
        let at = node.position();
        let end = node.document().position(node.end_offset());
        FilePlace {
            path: at.path.to_owned(),
            row: at.row,
            column: at.column,
            last_row: end.row,
        }
    }
}

impl fmt::Display for FilePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.path, self.row, self.column)
    }
}

/// End of the run.
#[derive(Debug)]
pub struct End {
    /// Condition of the stop trigger, if there is one.
    pub waits: Option<String>,
    /// By the standard.
    pub standard: Moment,
    /// In every known simulator.
    pub tolerant: Moment,
    /// Reason why the stop trigger is never true by the standard.
    pub never: Option<String>,
}

impl Story {
    /// Returns the story of a scenario. A catalog or a distribution has an empty story.
    pub fn of(scenario: &Scenario<'_>) -> Story {
        let timeline = scenario.timeline();
        let elements = scenario.storyboard().elements();
        let mut depths: Vec<usize> = Vec::with_capacity(elements.len());
        let mut parts = Vec::with_capacity(elements.len());
        for (place, one) in elements.iter().enumerate() {
            let above = one.parent().and_then(|parent| depths.get(parent));
            depths.push(above.map_or(0, |depth| depth + 1));
            let depth = depths.last().copied().unwrap_or(0);
            parts.push(told(scenario, timeline, place, one, depth));
        }
        let (openings, globals) = init::read(scenario);
        Story {
            openings,
            globals,
            is_timed: timeline.is_some(),
            gaps: gaps::all(scenario),
            elements: parts,
            end: end(scenario, timeline),
        }
    }
}

fn told<'d>(
    scenario: &Scenario<'d>,
    timeline: Option<&Timeline>,
    place: usize,
    one: &StoryElement<'d>,
    depth: usize,
) -> StoryboardElement {
    let element = one.element(scenario);
    let times = |strictness| match timeline.and_then(|it| it.spans(strictness).get(place)) {
        Some(span) => Times::of(span),
        None => Times::UNKNOWN,
    };
    let trigger = element
        .child("StartTrigger")
        .filter(|_| matches!(one.kind(), StoryKind::Act | StoryKind::Event));
    let (actors, are_triggering_actors) = match one.kind() {
        StoryKind::ManeuverGroup => actors(element),
        _ => (Vec::new(), false),
    };
    StoryboardElement {
        kind: one.kind(),
        name: one.name().map(str::to_owned),
        depth,
        parent: one.parent(),
        action: action_of(element),
        actors,
        are_triggering_actors,
        place: FilePlace::of(element),
        standard: times(Strictness::Standard),
        tolerant: times(Strictness::Tolerant),
        waits: trigger.map(waits::trigger),
        never_starts: timeline.and_then(|it| never::starts(scenario, it, place)),
        never_ends: timeline.and_then(|it| never::ends(scenario, it, place)),
    }
}

fn end(scenario: &Scenario<'_>, timeline: Option<&Timeline>) -> End {
    let trigger = scenario.root().path(&["Storyboard", "StopTrigger"]);
    let trigger = trigger.filter(|it| it.child("ConditionGroup").is_some());
    let ends =
        |strictness| timeline.map_or(Moment::UNKNOWN, |timeline| timeline.spans(strictness).ends);
    End {
        waits: trigger.map(waits::trigger),
        standard: ends(Strictness::Standard),
        tolerant: ends(Strictness::Tolerant),
        never: timeline.and_then(|it| never::run_ends(scenario, it)),
    }
}

impl Times {
    const UNKNOWN: Times = Times {
        start: Moment::UNKNOWN,
        end: Moment::UNKNOWN,
    };

    fn of(span: &Span) -> Times {
        Times {
            start: span.start,
            end: span.complete,
        }
    }
}

/// Returns the kind of an `Action`, such as `SpeedAction`.
fn action_of(element: Element<'_, '_>) -> Option<String> {
    if !element.is("Action") {
        return None;
    }
    inner(element.children().next()?)
}

/// Returns the name of the innermost element that says which action it is.
fn inner(mut kind: Element<'_, '_>) -> Option<String> {
    const AROUND: [&str; 5] = [
        "PrivateAction",
        "GlobalAction",
        "LongitudinalAction",
        "LateralAction",
        "RoutingAction",
    ];
    while AROUND.contains(&kind.name()) {
        kind = kind.children().next()?;
    }
    Some(kind.name().to_owned())
}

/// Returns the named actors, and whether the triggering entities are actors, too.
fn actors(group: Element<'_, '_>) -> (Vec<String>, bool) {
    let Some(actors) = Actors::of(group) else {
        return (Vec::new(), false);
    };
    let named = actors.named.iter();
    let names = named
        .filter_map(|one| one.text("entityRef"))
        .map(std::borrow::Cow::into_owned);
    (names.collect(), actors.triggering)
}
