//! Random storyboards.

use proptest::collection::vec;
use proptest::prelude::*;
use qcbus_openscenario::{
    Comparison, Condition, Edge, Logic, Plan, Priority, Start, State, StoryKind, StoryPart, Takes,
    Trigger,
};

/// A storyboard that is shown with one line per element.
#[derive(Clone)]
pub struct Random(pub Plan);

impl std::fmt::Debug for Random {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (at, part) in self.0.parts.iter().enumerate() {
            let depth = StoryKind::ALL
                .iter()
                .position(|kind| *kind == part.kind)
                .unwrap();
            write!(f, "\n{}{at} {:?}", "  ".repeat(depth), part.kind)?;
            match &part.start {
                Start::By(trigger) => write!(f, " starts by {}", shown(trigger))?,
                Start::WithParent | Start::Unknown => {}
            }
            if let Some(stop) = &part.stop {
                write!(f, " stops by {}", shown(stop))?;
            }
            if part.executions != Some(1) {
                write!(f, " executions {:?}", part.executions)?;
            }
            match part.kind {
                StoryKind::Event => write!(f, " {:?}", part.priority)?,
                StoryKind::Action => write!(f, " {:?} rivals {:?}", part.takes, part.rivals)?,
                _ => {}
            }
        }
        match &self.0.stop {
            Some(stop) => write!(f, "\nstops by {}", shown(stop)),
            None => Ok(()),
        }
    }
}

fn shown(trigger: &Trigger) -> String {
    let condition =
        |it: &Condition| format!("{:?}/{:?}+{:?}", it.logic, it.edge, it.delay.unwrap());
    let group = |it: &Vec<Condition>| it.iter().map(condition).collect::<Vec<_>>().join(" and ");
    let groups: Vec<String> = trigger.groups.iter().map(group).collect();
    groups.join(" or ")
}

/// A number that later becomes an index of a part.
type Draw = usize;

fn comparison() -> impl Strategy<Value = Comparison> {
    use Comparison as C;
    prop_oneof![
        4 => Just(C::GreaterThan),
        3 => Just(C::GreaterOrEqual),
        2 => Just(C::LessThan),
        1 => Just(C::LessOrEqual),
        1 => Just(C::EqualTo),
        1 => Just(C::NotEqualTo),
    ]
}

fn state() -> impl Strategy<Value = State> {
    use State as S;
    prop_oneof![
        1 => Just(S::Standby),
        2 => Just(S::Running),
        4 => Just(S::Complete),
        3 => Just(S::StartTransition),
        4 => Just(S::EndTransition),
        1 => Just(S::StopTransition),
        1 => Just(S::SkipTransition),
    ]
}

fn logic() -> impl Strategy<Value = Logic> {
    prop_oneof![
        5 => (comparison(), (-2_i32..60).prop_map(|it| f64::from(it) / 4.0))
            .prop_map(|(comparison, value)| Logic::Time(comparison, value)),
        6 => (any::<Draw>(), state()).prop_map(|(place, state)| Logic::State(place, state)),
        1 => Just(Logic::Never),
        2 => Just(Logic::Unknown),
    ]
}

fn condition() -> impl Strategy<Value = Condition> {
    let edge = prop_oneof![
        4 => Just(Edge::None),
        4 => Just(Edge::Rising),
        1 => Just(Edge::Falling),
        1 => Just(Edge::RisingOrFalling),
    ];
    let delay = prop_oneof![6 => Just(0.0), 1 => Just(1.0), 1 => Just(2.5)];
    (logic(), edge, delay).prop_map(|(logic, edge, delay)| Condition {
        logic,
        edge,
        delay: Some(delay),
        is_certain: true,
    })
}

fn trigger() -> impl Strategy<Value = Trigger> {
    let group = prop_oneof![4 => vec(condition(), 1..2), 2 => vec(condition(), 2..4)];
    let groups = prop_oneof![5 => vec(group.clone(), 1..2), 1 => vec(group, 2..3)];
    groups.prop_map(|groups| Trigger { groups })
}

fn takes() -> impl Strategy<Value = Takes> {
    prop_oneof![
        3 => Just(Takes::NoTime),
        4 => (1_u32..12).prop_map(|it| Takes::Seconds(f64::from(it) / 2.0)),
        2 => Just(Takes::Forever),
        1 => Just(Takes::ForeverInTheory),
        2 => Just(Takes::Unknown),
    ]
}

fn executions() -> impl Strategy<Value = Option<u32>> {
    prop_oneof![6 => Just(Some(1)), 1 => Just(Some(2)), 1 => Just(Some(3))]
}

fn priority() -> impl Strategy<Value = Priority> {
    prop_oneof![
        2 => Just(Priority::Parallel),
        3 => Just(Priority::Override),
        1 => Just(Priority::Skip),
    ]
}

/// An event: its trigger, executions, priority, and actions with a draw for a rival.
type Event = (
    Option<Trigger>,
    Option<u32>,
    Priority,
    Vec<(Takes, Option<Draw>)>,
);

fn event() -> impl Strategy<Value = Event> {
    (
        prop_oneof![6 => trigger().prop_map(Some), 1 => Just(None)],
        executions(),
        priority(),
        vec((takes(), prop::option::weighted(0.3, any::<Draw>())), 1..3),
    )
}

/// An act: its triggers, and its groups with executions, maneuvers and events.
type Act = (
    Option<Trigger>,
    Option<Trigger>,
    Vec<(Option<u32>, Vec<Vec<Event>>)>,
);

fn act() -> impl Strategy<Value = Act> {
    (
        prop::option::weighted(0.7, trigger()),
        prop::option::weighted(0.3, trigger()),
        vec((executions(), vec(vec(event(), 1..4), 1..3)), 1..3),
    )
}

/// Returns random storyboards with one story.
pub fn random() -> impl Strategy<Value = Random> {
    (vec(act(), 1..3), prop::option::weighted(0.7, trigger()))
        .prop_map(|(acts, stop)| Random(build(acts, stop)))
}

struct Builder {
    parts: Vec<StoryPart>,
}

impl Builder {
    fn add(&mut self, kind: StoryKind, parent: Option<usize>, start: Option<Trigger>) -> usize {
        self.parts.push(StoryPart {
            kind,
            parent,
            start: start.map_or(Start::WithParent, Start::By),
            stop: None,
            executions: Some(1),
            priority: Priority::Parallel,
            takes: Takes::NoTime,
            rivals: Vec::new(),
            is_open: false,
        });
        self.parts.len() - 1
    }
}

fn build(acts: Vec<Act>, stop: Option<Trigger>) -> Plan {
    let mut builder = Builder { parts: Vec::new() };
    let mut rivals = Vec::new();
    let story = builder.add(StoryKind::Story, None, None);
    for (start, stop, groups) in acts {
        let act = builder.add(StoryKind::Act, Some(story), start);
        builder.parts[act].stop = stop;
        for (executions, maneuvers) in groups {
            let group = builder.add(StoryKind::ManeuverGroup, Some(act), None);
            builder.parts[group].executions = executions;
            for events in maneuvers {
                let maneuver = builder.add(StoryKind::Maneuver, Some(group), None);
                for (start, executions, priority, actions) in events {
                    let event = builder.add(StoryKind::Event, Some(maneuver), start);
                    builder.parts[event].executions = executions;
                    builder.parts[event].priority = priority;
                    for (takes, rival) in actions {
                        let action = builder.add(StoryKind::Action, Some(event), None);
                        builder.parts[action].takes = takes;
                        rivals.extend(rival.map(|rival| (action, rival)));
                    }
                }
            }
        }
    }
    finish(builder.parts, stop, &rivals)
}

/// Replaces draws by indices.
fn finish(mut parts: Vec<StoryPart>, mut stop: Option<Trigger>, rivals: &[(usize, Draw)]) -> Plan {
    let actions: Vec<usize> = (0..parts.len())
        .filter(|at| parts[*at].kind == StoryKind::Action)
        .collect();
    for (action, draw) in rivals {
        let rival = actions[draw % actions.len()];
        if parts[rival].parent != parts[*action].parent {
            parts[*action].rivals.push(rival);
            parts[rival].rivals.push(*action);
        }
    }
    let count = parts.len();
    let mut place = |trigger: &mut Trigger| {
        for condition in trigger.groups.iter_mut().flatten() {
            if let Logic::State(at, _) = &mut condition.logic {
                *at %= count;
            }
        }
    };
    for part in &mut parts {
        if let Start::By(trigger) = &mut part.start {
            place(trigger);
        }
        part.stop.iter_mut().for_each(&mut place);
    }
    stop.iter_mut().for_each(&mut place);
    Plan { parts, stop }
}
