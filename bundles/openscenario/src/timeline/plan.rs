//! The storyboard as a state machine: what starts, stops and ends its elements. Names and places
//! are left out; the elements keep the order of [`crate::Storyboard::elements`].

use crate::types::storyboard::StoryKind;

/// What a storyboard does, without the world around it.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// Elements; each comes after its parent.
    pub parts: Vec<StoryPart>,
    /// Trigger that ends the run.
    pub stop: Option<Trigger>,
}

/// An element of the storyboard.
#[derive(Debug, Clone)]
pub struct StoryPart {
    /// Its kind.
    pub kind: StoryKind,
    /// Index of its parent; `None` for a story.
    pub parent: Option<usize>,
    /// What starts it.
    pub start: Start,
    /// What stops it; acts only.
    pub stop: Option<Trigger>,
    /// Number of times that an event or a maneuver group is executed; `None` if it is unknown.
    pub executions: Option<u32>,
    /// What an event does while others of its maneuver run.
    pub priority: Priority,
    /// How long an action takes.
    pub takes: Takes,
    /// Actions that stop this action when they start, because they control the same thing.
    pub rivals: Vec<usize>,
    /// Whether further actions may stop it.
    pub is_open: bool,
}

/// What starts an element.
#[derive(Debug, Clone)]
pub enum Start {
    /// It starts with its parent.
    WithParent,
    /// It starts when its trigger is true.
    By(Trigger),
    /// Nothing is known about its start.
    Unknown,
}

/// Condition groups, of which one must be true. All conditions of a group must be true at once.
#[derive(Debug, Clone, Default)]
pub struct Trigger {
    /// The groups.
    pub groups: Vec<Vec<Condition>>,
}

/// A condition: a logical expression with its edge and delay.
#[derive(Debug, Clone)]
pub struct Condition {
    /// The expression.
    pub logic: Logic,
    /// Which change of the expression counts.
    pub edge: Edge,
    /// Delay in seconds; `None` if it is unknown.
    pub delay: Option<f64>,
    /// Whether every known simulator evaluates the expression like this.
    pub is_certain: bool,
}

/// A logical expression.
#[derive(Debug, Clone, PartialEq)]
pub enum Logic {
    /// The simulation time compared with a number of seconds.
    Time(Comparison, f64),
    /// The state of the element with this index.
    State(usize, State),
    /// The scenario itself makes it impossible.
    Never,
    /// Only the run can tell.
    Unknown,
}

/// How two numbers are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "names of the standard")]
pub enum Comparison {
    EqualTo,
    GreaterThan,
    LessThan,
    GreaterOrEqual,
    LessOrEqual,
    NotEqualTo,
}

/// Which change of an expression makes a condition true.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// The expression itself.
    None,
    /// From false to true.
    Rising,
    /// From true to false.
    Falling,
    /// Both.
    RisingOrFalling,
    /// The word is unknown.
    Unknown,
}

/// A state or a transition of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "names of the standard")]
pub enum State {
    Standby,
    Running,
    Complete,
    StartTransition,
    EndTransition,
    StopTransition,
    SkipTransition,
}

/// What an event does while others of its maneuver run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Priority {
    /// It runs beside them.
    Parallel,
    /// It stops them.
    Override,
    /// It does not start.
    Skip,
    /// The word is unknown.
    Unknown,
}

/// How long an action takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Takes {
    /// It ends at once.
    NoTime,
    /// It takes this many seconds.
    Seconds(f64),
    /// It does not end by itself.
    Forever,
    /// It does not end by itself, but some simulators end it.
    ForeverInTheory,
    /// Only the run can tell.
    Unknown,
}

impl Plan {
    /// Returns an element and its ancestors, the innermost first.
    pub(super) fn around(&self, place: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(place), |place| self.parent(*place))
    }

    pub(super) fn parent(&self, place: usize) -> Option<usize> {
        self.parts.get(place)?.parent
    }

    /// Checks whether a maneuver group around the element is executed more than once, or may be.
    pub(super) fn is_looped(&self, place: usize) -> bool {
        self.around(place).any(|at| {
            let part = self.parts.get(at);
            part.is_some_and(|it| it.kind == StoryKind::ManeuverGroup && it.executions != Some(1))
        })
    }

    /// Returns the event at or around the element if it may be executed more than once.
    pub(super) fn repeated_event(&self, place: usize) -> Option<usize> {
        self.around(place).find(|at| {
            let part = self.parts.get(*at);
            part.is_some_and(|it| it.kind == StoryKind::Event && it.executions != Some(1))
        })
    }

    /// Checks whether the element may start more than once.
    pub(super) fn repeats(&self, place: usize) -> bool {
        self.is_looped(place) || self.repeated_event(place).is_some()
    }
}

/// A plan with the children of each element.
pub(super) struct Tree<'p> {
    pub(super) plan: &'p Plan,
    children: Vec<Vec<usize>>,
    /// Children of each element that stop others of it. They are few, also in a large storyboard.
    overriding: Vec<Vec<usize>>,
}

impl<'p> Tree<'p> {
    pub(super) fn of(plan: &'p Plan) -> Tree<'p> {
        let mut children = vec![Vec::new(); plan.parts.len()];
        let mut overriding = children.clone();
        for (at, part) in plan.parts.iter().enumerate() {
            let Some(parent) = part.parent else { continue };
            if let Some(of) = children.get_mut(parent) {
                of.push(at);
            }
            let overrides = matches!(part.priority, Priority::Override | Priority::Unknown);
            if let Some(of) = overriding.get_mut(parent).filter(|_| overrides) {
                of.push(at);
            }
        }
        Tree {
            plan,
            children,
            overriding,
        }
    }

    /// Returns the other elements with the same parent that stop an element, or may.
    pub(super) fn overriding(&self, place: usize) -> impl Iterator<Item = usize> + '_ {
        let parent = self.plan.parent(place);
        let all = parent.and_then(|parent| self.overriding.get(parent));
        let all = all.into_iter().flatten().copied();
        all.filter(move |at| *at != place)
    }

    pub(super) fn children(&self, place: usize) -> &[usize] {
        self.children.get(place).map_or(&[], Vec::as_slice)
    }

    /// Returns the other elements with the same parent.
    pub(super) fn siblings(&self, place: usize) -> impl Iterator<Item = usize> + '_ {
        let parent = self.plan.parent(place);
        let all = parent.map_or(&[][..], |parent| self.children(parent));
        all.iter().copied().filter(move |at| *at != place)
    }
}
