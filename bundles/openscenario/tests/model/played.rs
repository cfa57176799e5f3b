//! The bounds of the timeline hold in random runs of random storyboards.

#![allow(
    clippy::unwrap_used,
    reason = "this is all test code, including functions without `#[test]`"
)]

mod player;
mod storyboards;

use player::{Run, play};
use proptest::prelude::*;
use qcbus_openscenario::{
    Comparison, Condition, Edge, Logic, Moment, Plan, Priority, Spans, Start, StoryKind, StoryPart,
    Strictness, Takes, Trigger,
};

/// Tolerance for comparisons of times, in seconds.
const CLOSE: f64 = 1e-3;

/// Checks a moment of a run against its bounds. `until` is the end of the run.
fn holds(what: &str, place: usize, bounds: Moment, found: Option<f64>, until: f64) {
    match found {
        Some(time) => assert!(
            time >= bounds.earliest - CLOSE && time <= bounds.latest + CLOSE,
            "{what} of {place} at {time}, expected within {bounds:?}"
        ),
        None => assert!(
            bounds.latest + CLOSE >= until,
            "{what} of {place} never came before {until}, expected within {bounds:?}"
        ),
    }
}

fn check(plan: &Plan, run: &Run, readings: &[Strictness]) {
    for strictness in readings.iter().copied() {
        let spans = Spans::of(plan, strictness);
        for (place, lived) in run.lives.iter().enumerate() {
            let span = spans.get(place).unwrap();
            holds("start", place, span.start, lived.start, run.until);
            holds("end", place, span.end, lived.end, run.until);
            holds(
                "completion",
                place,
                span.complete,
                lived.complete,
                run.until,
            );
            if let Some(time) = lived.stopped {
                assert!(
                    time >= span.stopped.earliest - CLOSE,
                    "stop of {place} at {time}: {span:?}"
                );
            }
        }
        match run.stopped {
            true => holds("end of the run", 0, spans.ends, Some(run.until), run.until),
            false => holds("end of the run", 0, spans.ends, None, run.until),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

    #[test]
    fn bounds_hold_in_every_run(plan in storyboards::random(), seed in any::<u64>()) {
        let run = play(&plan.0, seed, false);
        check(&plan.0, &run, &[Strictness::Standard, Strictness::Tolerant]);
    }

    #[test]
    fn tolerant_bounds_hold_in_runs_of_lenient_simulators(
        plan in storyboards::random(),
        seed in any::<u64>(),
    ) {
        check(&plan.0, &play(&plan.0, seed, true), &[Strictness::Tolerant]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

    /// With less knowledge, no bound becomes narrower.
    #[test]
    fn unknown_condition_never_narrows_bounds(plan in storyboards::random(), which in any::<prop::sample::Index>()) {
        let known = plan.0;
        let mut unknown = known.clone();
        let mut conditions = conditions_of(&mut unknown);
        if conditions.is_empty() {
            return Ok(());
        }
        let condition = conditions.swap_remove(which.index(conditions.len()));
        condition.logic = Logic::Unknown;
        for strictness in [Strictness::Standard, Strictness::Tolerant] {
            let (narrow, wide) = (Spans::of(&known, strictness), Spans::of(&unknown, strictness));
            // Nothing is said about storyboards that never settle.
            if narrow.get(0).unwrap().start == Moment::UNKNOWN {
                continue;
            }
            for place in 0..known.parts.len() {
                let (narrow, wide) = (narrow.get(place).unwrap(), wide.get(place).unwrap());
                includes("start", place, wide.start, narrow.start);
                includes("end", place, wide.end, narrow.end);
            }
            includes("end of the run", 0, wide.ends, narrow.ends);
        }
    }
}

fn conditions_of(plan: &mut Plan) -> Vec<&mut Condition> {
    let starts = plan
        .parts
        .iter_mut()
        .filter_map(|part| match &mut part.start {
            Start::By(trigger) => Some(trigger),
            Start::WithParent | Start::Unknown => None,
        });
    let triggers = starts.chain(&mut plan.stop);
    triggers.flat_map(|it| &mut it.groups).flatten().collect()
}

fn includes(what: &str, place: usize, wide: Moment, narrow: Moment) {
    assert!(
        wide.earliest <= narrow.earliest + CLOSE && wide.latest >= narrow.latest - CLOSE,
        "{what} of {place}: {wide:?} does not include {narrow:?}"
    );
}

/// Returns a storyboard with one action. Its event has this start trigger.
fn with_event(group: &[Condition]) -> Plan {
    let part = |(at, kind): (usize, &StoryKind)| StoryPart {
        kind: *kind,
        parent: at.checked_sub(1),
        start: match kind {
            StoryKind::Event => Start::By(Trigger {
                groups: vec![group.to_vec()],
            }),
            _ => Start::WithParent,
        },
        stop: None,
        executions: Some(1),
        priority: Priority::Parallel,
        takes: Takes::NoTime,
        rivals: Vec::new(),
        is_open: false,
    };
    Plan {
        parts: StoryKind::ALL.iter().enumerate().map(part).collect(),
        stop: None,
    }
}

#[test]
fn edge_is_missed_if_the_condition_is_looked_at_with_the_one_before_it() {
    let after = |seconds, edge, delay| Condition {
        logic: Logic::Time(Comparison::GreaterThan, seconds),
        edge,
        delay: Some(delay),
        is_certain: true,
    };
    let late = after(5.0, Edge::None, 1.0);
    let plan = with_event(&[late, after(6.0, Edge::Rising, 0.0)]);
    let action = plan.parts.len() - 1;
    let latest = |strictness| {
        Spans::of(&plan, strictness)
            .get(action)
            .unwrap()
            .start
            .latest
    };
    assert!(latest(Strictness::Standard) < 6.5);
    assert_eq!(latest(Strictness::Tolerant), f64::INFINITY);
    let start = |is_lenient| play(&plan, 1, is_lenient).lives[action].start;
    assert!(start(false).is_some());
    assert_eq!(start(true), None);
}

fn cases() -> u32 {
    let wanted = std::env::var("QCBUS_RUNS").ok();
    wanted.and_then(|it| it.parse().ok()).unwrap_or(2000)
}
