//! Events that wait for the start of an element around them.

use qcbus_openscenario::{
    Comparison, Condition, Edge, Logic, Moment, Plan, Priority, Spans, Start, State, StoryKind,
    StoryPart, Strictness, Takes, Trigger,
};

fn part(kind: StoryKind, parent: Option<usize>, start: Start) -> StoryPart {
    StoryPart {
        kind,
        parent,
        start,
        stop: None,
        executions: Some(1),
        priority: Priority::Parallel,
        takes: Takes::Seconds(1.0),
        rivals: Vec::new(),
        is_open: false,
    }
}

fn when(logic: Logic, edge: Edge, delay: f64) -> Start {
    let condition = Condition {
        logic,
        edge,
        delay: Some(delay),
        is_certain: true,
    };
    Start::By(Trigger {
        groups: vec![vec![condition]],
    })
}

/// Returns the start of an event that waits for the start of the element at `of`. The act starts
/// after 2 s.
fn start(of: usize, edge: Edge, delay: f64, strictness: Strictness) -> Moment {
    let after = Logic::Time(Comparison::GreaterThan, 2.0);
    let waits = when(Logic::State(of, State::StartTransition), edge, delay);
    let plan = Plan {
        parts: vec![
            part(StoryKind::Story, None, Start::WithParent),
            part(StoryKind::Act, Some(0), when(after, Edge::None, 0.0)),
            part(StoryKind::ManeuverGroup, Some(1), Start::WithParent),
            part(StoryKind::Maneuver, Some(2), Start::WithParent),
            part(StoryKind::Event, Some(3), waits),
            part(StoryKind::Action, Some(4), Start::WithParent),
        ],
        stop: None,
    };
    let spans = Spans::of(&plan, strictness);
    spans.get(4).map_or(Moment::NEVER, |span| span.start)
}

#[test]
fn event_starts_with_its_act_whose_start_it_waits_for() {
    for strictness in [Strictness::Standard, Strictness::Tolerant] {
        for of in [1, 2, 3] {
            let found = start(of, Edge::None, 0.0, strictness);
            assert!(found.earliest >= 2.0 && found.latest < 2.45, "{found:?}");
        }
    }
}

#[test]
fn delay_counts_from_the_start_of_the_act() {
    let found = start(1, Edge::None, 3.0, Strictness::Standard);
    assert!(found.earliest >= 5.0 && found.latest < 5.45, "{found:?}");
}

#[test]
fn start_of_the_own_act_does_not_rise_after_the_first_look() {
    let found = start(1, Edge::Rising, 0.0, Strictness::Standard);
    assert_eq!(found, Moment::NEVER);
    // Some simulators take the time before the first look as false.
    let found = start(1, Edge::Rising, 0.0, Strictness::Tolerant);
    assert!(!found.is_never() && !found.is_certain(), "{found:?}");
}

#[test]
fn start_of_the_own_act_falls_one_step_later() {
    let found = start(1, Edge::Falling, 0.0, Strictness::Standard);
    assert!(found.earliest >= 2.0 && found.latest < 2.6, "{found:?}");
}

#[test]
fn start_of_the_story_is_over_when_the_event_waits() {
    // The story starts at 0 s, the event waits from 2 s on.
    let found = start(0, Edge::None, 0.0, Strictness::Standard);
    assert!(!found.is_certain(), "{found:?}");
}
