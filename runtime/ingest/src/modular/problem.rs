//! What an expansion stumbles over.

use qcbus_document::{Attribute, Node};

/// Something that is wrong with how a modular scenario is put together.
#[derive(Debug, Clone)]
pub struct Problem<'d> {
    /// What sort.
    pub what: What,
    /// Where it is to be mended.
    pub at: Spot<'d>,
    /// What it is about in another place: mostly in the file that is referred to.
    pub target: Option<Spot<'d>>,
    /// For people: what was found, what is expected.
    pub text: String,
}

/// Most problems that are listed.
const MOST: usize = 1000;

/// The problems of an expansion, as many as anybody may want to read.
#[derive(Debug, Default)]
pub(super) struct Problems<'d>(pub Vec<Problem<'d>>);

impl<'d> Problems<'d> {
    /// Adds one. One that stops the expansion is never left out for those that do not.
    pub fn push(&mut self, problem: Problem<'d>) {
        let is_first = |what| !self.0.iter().any(|other| other.what == what);
        if self.0.len() < MOST || (problem.what.stops() && is_first(problem.what)) {
            self.0.push(problem);
        }
    }

    /// Whether one of the last few is such.
    pub fn lately(&self, is_it: impl Fn(&Problem<'d>) -> bool) -> bool {
        self.0.iter().rev().take(64).any(is_it)
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
    /// The attribute of this name, or the element that lacks it.
    pub fn of(node: Node<'d>, attribute: &str) -> Spot<'d> {
        node.attribute(attribute)
            .map_or(Spot::Node(node), Spot::Attribute)
    }

    /// The element.
    pub fn node(&self) -> Node<'d> {
        match self {
            Spot::Node(node) => *node,
            Spot::Attribute(attribute) => attribute.node(),
        }
    }

    /// Offset in the text of its document.
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

/// The sorts of problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum What {
    /// A `ScenarioReference` without a file name, or with one that leads nowhere.
    FileNotFound,
    /// The name of the file ends in neither `.xosc` nor `.mosc`.
    Extension,
    /// The name of the file leads out of the archive.
    Escapes,
    /// The file is there, and not whole or no scenario.
    Unreadable,
    /// A reference that leads back to a scenario that refers to it.
    Cycle,
    /// Scenarios refer to scenarios too deeply.
    Depth,
    /// The expanded scenario grows beyond what is allowed.
    Size,
    /// A `ScenarioReference` that lies in no `ManeuverGroup`.
    Placement,
    /// More than one `ScenarioReference` in a group.
    SecondReference,
    /// `ParameterReference` directly in a `ScenarioReference`.
    DirectForm,
    /// Both forms in one `ScenarioReference`.
    MixedForm,
    /// An element in a reference that nobody knows.
    ForeignElement,
    /// An attribute or a text in a reference that nobody knows.
    ForeignAttribute,
    /// A `ManeuverGroupReference` without a name, or with one that the file does not have.
    GroupUnknown,
    /// The file has several groups of the name.
    GroupAmbiguous,
    /// One group is referred to twice.
    GroupTwice,
    /// A `ParameterReference` that lacks its key or value.
    KeyMalformed,
    /// A key that fits no attribute.
    KeyUnmatched,
    /// One key twice.
    KeyTwice,
    /// Two keys, equally specific, give one attribute different values.
    KeyTie,
    /// Several keys fit one attribute.
    KeyOverlap,
    /// The referring group has no actor whom the maneuvers could be for, or the other one none.
    Actor,
}

impl What {
    /// Whether nothing can be made of the scenario.
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
