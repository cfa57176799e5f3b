//! Problems found during an expansion.

use qcbus_document::{Attribute, Node};

/// An error in the structure of a modular scenario.
#[derive(Debug, Clone)]
pub struct Problem<'d> {
    /// Kind of problem.
    pub what: What,
    /// Place that must be fixed.
    pub at: Spot<'d>,
    /// Related place, usually in the referenced file.
    pub target: Option<Spot<'d>>,
    /// Message for people: the found and the expected content.
    pub text: String,
}

/// Maximum number of listed problems.
const MOST: usize = 1000;

/// The problems of an expansion, up to a maximum number.
#[derive(Debug, Default)]
pub(super) struct Problems<'d> {
    pub list: Vec<Problem<'d>>,
    /// Pairs of keys whose overlap was reported.
    overlaps: Vec<[Node<'d>; 2]>,
}

/// Number of the last problems that are compared with a new one.
const LAST: usize = 64;

impl<'d> Problems<'d> {
    /// Adds a problem. The first problem of each kind that stops the expansion is always added,
    /// even above the maximum.
    pub fn push(&mut self, problem: Problem<'d>) {
        let is_first = |what| !self.list.iter().any(|other| other.what == what);
        if self.list.len() < MOST || (problem.what.stops() && is_first(problem.what)) {
            self.list.push(problem);
        }
    }

    /// Checks whether one of the last problems matches.
    pub fn lately(&self, is_it: impl Fn(&Problem<'d>) -> bool) -> bool {
        self.list.iter().rev().take(LAST).any(is_it)
    }

    /// Notes that two keys overlap. Returns `false` if this was noted lately.
    pub fn is_new_overlap(&mut self, best: Node<'d>, other: Node<'d>) -> bool {
        let pair = [best, other];
        let is_new = !self.overlaps.iter().rev().take(LAST).any(|it| *it == pair);
        if is_new {
            self.overlaps.push(pair);
        }
        is_new
    }
}

/// An element or one of its attributes.
#[derive(Debug, Clone, Copy)]
pub enum Spot<'d> {
    /// The element.
    Node(Node<'d>),
    /// The attribute.
    Attribute(Attribute<'d>),
}

impl<'d> Spot<'d> {
    /// Returns the attribute of this name, or the element if the attribute is missing.
    pub fn of(node: Node<'d>, attribute: &str) -> Spot<'d> {
        node.attribute(attribute)
            .map_or(Spot::Node(node), Spot::Attribute)
    }

    /// Returns the element.
    pub fn node(&self) -> Node<'d> {
        match self {
            Spot::Node(node) => *node,
            Spot::Attribute(attribute) => attribute.node(),
        }
    }

    /// Returns the offset in the text of its document.
    pub fn offset(&self) -> u32 {
        match self {
            Spot::Node(node) => node.offset(),
            Spot::Attribute(attribute) => attribute.offset(),
        }
    }
}

impl<'d> From<Node<'d>> for Spot<'d> {
    fn from(node: Node<'d>) -> Spot<'d> {
        Spot::Node(node)
    }
}

impl<'d> From<Attribute<'d>> for Spot<'d> {
    fn from(attribute: Attribute<'d>) -> Spot<'d> {
        Spot::Attribute(attribute)
    }
}

/// Kinds of problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum What {
    /// A `ScenarioReference` has no file name, or the file does not exist.
    FileNotFound,
    /// The file name ends in neither `.xosc` nor `.mosc`.
    Extension,
    /// The file name leads out of the archive.
    Escapes,
    /// The file exists, but it is damaged or not a scenario.
    Unreadable,
    /// A reference leads back to a scenario that refers to it.
    Cycle,
    /// References from scenario to scenario are nested too deeply.
    Depth,
    /// The expanded scenario exceeds a size limit.
    Size,
    /// A `ScenarioReference` is not in a `ManeuverGroup`.
    Placement,
    /// A group has more than one `ScenarioReference`.
    SecondReference,
    /// A `ParameterReference` is directly in a `ScenarioReference`.
    DirectForm,
    /// One `ScenarioReference` uses both forms.
    MixedForm,
    /// A reference contains an unknown element.
    ForeignElement,
    /// A reference contains an unknown attribute or a text.
    ForeignAttribute,
    /// A `ManeuverGroupReference` has no name, or the file has no group of this name.
    GroupUnknown,
    /// The file has several groups of this name.
    GroupAmbiguous,
    /// One group is referenced twice.
    GroupTwice,
    /// A `ParameterReference` has no key or no value.
    KeyMalformed,
    /// A key fits no attribute.
    KeyUnmatched,
    /// One key occurs twice.
    KeyTwice,
    /// Two equally specific keys give one attribute different values.
    KeyTie,
    /// Several keys fit one attribute.
    KeyOverlap,
    /// The referring group or the referenced group has no actor for the maneuvers.
    Actor,
}

impl What {
    /// Checks whether this kind of problem prevents the expansion.
    pub fn stops(self) -> bool {
        matches!(
            self,
            What::FileNotFound
                | What::Extension
                | What::Escapes
                | What::Unreadable
                | What::Cycle
                | What::Depth
                | What::Size
                | What::Placement
                | What::ForeignElement
                | What::GroupUnknown
                | What::KeyTie
        )
    }
}
