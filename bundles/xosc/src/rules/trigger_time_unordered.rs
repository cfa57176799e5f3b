use crate::families::actions::short;
use crate::families::timeline::{self, differs};
use crate::families::triggers::{self, called, earliest, groups, holds_at_once, time, time_or_day};
use crate::prelude::*;
use qcbus_openscenario::Cause;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

/// A time that a condition names.
type Moment<'m, 'd> = (f64, Element<'m, 'd>);

/// Factor of the end time from which a late start is intentional.
const FAR: f64 = 10.0;

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(storyboard) = scenario.root().child("Storyboard") else {
        return;
    };
    // If the run ends at once, a report about each element would be redundant.
    let run_ends = end(storyboard)
        .filter(|_| !ends_at_once(storyboard))
        .map(|moment| (moment, "the run"));
    let mut said: Vec<Node<'_>> = Vec::new();
    for story in storyboard.children_named("Story") {
        for act in story.children_named("Act") {
            let act_ends = end(act).map(|moment| (moment, "its act"));
            let ends = [run_ends, act_ends].into_iter().flatten();
            let Some(((at, by), what)) = ends.min_by(|one, other| one.0.0.total_cmp(&other.0.0))
            else {
                continue;
            };
            // Elements in an act that never starts need no report of their own.
            if too_late(act, at, what, by, found) {
                said.push(act.node());
                continue;
            }
            for event in triggers::events(act) {
                if too_late(event, at, what, by, found) {
                    said.push(event.node());
                }
            }
        }
    }
    if !ends_at_once(storyboard) {
        others(scenario, &said, found);
    }
}

/// Reports elements that are too late for other reasons, such as the duration of an action before.
fn others(scenario: &Scenario<'_>, said: &[Node<'_>], found: &mut Sink<'_>) {
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    for never in timeline::never_started(scenario, timeline) {
        let late = never.causes.iter().map(|cause| match cause {
            Cause::AfterTheEnd { first } => Some(*first),
            _ => None,
        });
        let late: Option<Vec<f64>> = late.collect();
        let first = late.into_iter().flatten().reduce(f64::min);
        let (Some(first), Some(owner)) = (first, never.owner()) else {
            continue;
        };
        let end = timeline.end_around(never.place);
        let is_said =
            said.contains(&owner.node()) || timeline::waits_for_itself(timeline, never.place);
        if is_said || first <= end.latest {
            continue;
        }
        let what = match end.earliest < timeline.standard.ends.earliest {
            true => "its act",
            false => "the run",
        };
        let text = format!(
            "{} starts at {} s at the earliest, but {what} ends at {} s; it never \
             starts{}",
            called(owner),
            short((first * 10.0).round() / 10.0),
            short((end.earliest * 10.0).round() / 10.0),
            differs(&never)
        );
        let condition = never.condition((0, 0)).unwrap_or(owner);
        found
            .about(condition, "", text)
            .maybe_fault(timeline::start_of(condition));
    }
}

fn ends_at_once(storyboard: Element<'_, '_>) -> bool {
    let at_once = |group: Vec<Element<'_, '_>>| {
        !group.is_empty() && group.iter().all(|one| holds_at_once(*one))
    };
    let trigger = storyboard.child("StopTrigger");
    trigger.is_some_and(|trigger| groups(trigger).any(at_once))
}

/// Reports that an element cannot start before the end.
fn too_late(
    element: Element<'_, '_>,
    end: f64,
    what: &str,
    by: Element<'_, '_>,
    found: &mut Sink<'_>,
) -> bool {
    let Some((start, condition)) = start(element).filter(|(start, _)| *start > end) else {
        return false;
    };
    let what = if element.is("Act") && what == "its act" {
        "its own `StopTrigger`"
    } else {
        what
    };
    let ends = if what.ends_with('`') {
        "stops it"
    } else {
        "ends"
    };
    let text = format!(
        "{} starts at {} s at the earliest, but {what} {ends} at {} s; it never starts",
        called(element),
        short(start),
        short(end)
    );
    // A time this far away is meant as never. A time of day is not.
    let is_day = condition.is("TimeOfDayCondition");
    let on_purpose = start >= FAR * end && !is_day;
    let attribute = if is_day { "dateTime" } else { "value" };
    let level = if on_purpose {
        Level::Information
    } else {
        Level::Warning
    };
    found
        .about(condition, attribute, text)
        .level(level)
        .at(by.node(), "the condition that ends it")
        .maybe_fault(timeline::start_of(condition));
    true
}

/// Returns the time at which the stop trigger of an element is certainly true. It needs a group
/// with only one condition about the time.
fn end<'m, 'd>(element: Element<'m, 'd>) -> Option<Moment<'m, 'd>> {
    let alone = |group: Vec<Element<'m, 'd>>| match group.as_slice() {
        [condition] => {
            let time = time(*condition)?;
            let lasting = matches!(&*time.word("rule")?, "greaterThan" | "greaterOrEqual")
                && matches!(&*condition.word("conditionEdge")?, "none" | "rising");
            Some((earliest(*condition).filter(|_| lasting)?, time))
        }
        _ => None,
    };
    groups(element.child("StopTrigger")?)
        .filter_map(alone)
        .min_by(|(one, _), (other, _)| one.total_cmp(other))
}

/// Returns the time before which the start trigger of an element cannot be true. Returns `None` if
/// it can be true at any time.
fn start<'m, 'd>(element: Element<'m, 'd>) -> Option<Moment<'m, 'd>> {
    let mut first: Option<Moment<'m, 'd>> = None;
    for group in groups(element.child("StartTrigger")?) {
        let moments = group
            .iter()
            .filter_map(|condition| Some((earliest(*condition)?, time_or_day(*condition)?)));
        let last = moments.max_by(|(one, _), (other, _)| one.total_cmp(other))?;
        if first.is_none_or(|(moment, _)| last.0 < moment) {
            first = Some(last);
        }
    }
    first
}
