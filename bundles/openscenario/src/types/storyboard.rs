//! The storyboard as a tree of names: `story::act::group::maneuver::event::action`.

use std::borrow::Cow;

use foldhash::HashMap;
use qcbus_document::Node;

use crate::types::scope::ContextId;

/// Kind of a storyboard element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "names of the standard")]
pub enum StoryKind {
    Story,
    Act,
    ManeuverGroup,
    Maneuver,
    Event,
    Action,
}

impl StoryKind {
    /// Returns the kind of an element of this name.
    pub fn of_element(name: &str) -> Option<StoryKind> {
        Some(match name {
            "Story" => StoryKind::Story,
            "Act" => StoryKind::Act,
            "ManeuverGroup" => StoryKind::ManeuverGroup,
            "Maneuver" => StoryKind::Maneuver,
            "Event" => StoryKind::Event,
            "Action" => StoryKind::Action,
            _ => return None,
        })
    }

    /// Returns the kind that a `storyboardElementType` names.
    pub fn of_word(word: &str) -> Option<StoryKind> {
        StoryKind::ALL.into_iter().find(|kind| kind.word() == word)
    }

    /// All kinds from the outermost to the innermost.
    pub const ALL: [StoryKind; 6] = [
        StoryKind::Story,
        StoryKind::Act,
        StoryKind::ManeuverGroup,
        StoryKind::Maneuver,
        StoryKind::Event,
        StoryKind::Action,
    ];

    /// Returns the word of `storyboardElementType`.
    pub fn word(self) -> &'static str {
        match self {
            StoryKind::Story => "story",
            StoryKind::Act => "act",
            StoryKind::ManeuverGroup => "maneuverGroup",
            StoryKind::Maneuver => "maneuver",
            StoryKind::Event => "event",
            StoryKind::Action => "action",
        }
    }
}

/// An element of the storyboard.
#[derive(Debug, Clone)]
pub struct StoryElement<'d> {
    pub(crate) node: Node<'d>,
    pub(crate) context: ContextId,
    pub(crate) kind: StoryKind,
    pub(crate) name: Option<Cow<'d, str>>,
    pub(crate) parent: Option<u32>,
}

impl<'d> StoryElement<'d> {
    /// Returns its kind.
    pub fn kind(&self) -> StoryKind {
        self.kind
    }

    /// Returns its name with parameters replaced. Returns `None` if the name is missing or unknown.
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Returns the index of its parent in [`Storyboard::elements`].
    pub fn parent(&self) -> Option<usize> {
        self.parent.map(|parent| parent as usize)
    }
}

/// All elements of the storyboard.
#[derive(Debug, Default)]
pub struct Storyboard<'d> {
    elements: Vec<StoryElement<'d>>,
    by_name: HashMap<String, Vec<u32>>,
    /// Whether the name of an element is unknown.
    pub(crate) incomplete: bool,
}

impl<'d> Storyboard<'d> {
    /// Adds an element and returns its place.
    pub(crate) fn add(&mut self, element: StoryElement<'d>) -> u32 {
        let place = u32::try_from(self.elements.len()).unwrap_or(u32::MAX);
        match element.name() {
            Some(name) => self.by_name.entry(name.to_owned()).or_default().push(place),
            None => self.incomplete = true,
        }
        self.elements.push(element);
        place
    }

    /// Returns all elements. An element comes before its descendants.
    pub fn elements(&self) -> &[StoryElement<'d>] {
        &self.elements
    }

    /// Checks whether every name is known. A reference may mean a maneuver that was not found in a
    /// catalog, an element that the schema does not know, or a name that cannot be resolved.
    pub fn is_complete(&self) -> bool {
        !self.incomplete
    }

    /// Returns the elements that a reference may mean. `leaf` means any element of this name.
    /// `a::b::leaf` means those directly within a `b` that is directly within an `a`.
    pub fn find(&self, reference: &str) -> Vec<&StoryElement<'d>> {
        let mut path = reference.rsplit("::");
        let leaf = path.next().unwrap_or("");
        let outward: Vec<&str> = path.collect();
        self.named(leaf)
            .filter(|element| self.lies_in(element, &outward))
            .collect()
    }

    /// Returns the elements of a name.
    pub(crate) fn named(&self, name: &str) -> impl Iterator<Item = &StoryElement<'d>> {
        let places = self.by_name.get(name).map_or(&[][..], Vec::as_slice);
        places
            .iter()
            .filter_map(|place| self.elements.get(*place as usize))
    }

    fn lies_in(&self, element: &StoryElement<'d>, outward: &[&str]) -> bool {
        let mut at = element;
        outward.iter().all(|name| {
            let parent = at.parent().and_then(|parent| self.elements.get(parent));
            match parent {
                Some(parent) if parent.name() == Some(*name) => {
                    at = parent;
                    true
                }
                _ => false,
            }
        })
    }

    /// Returns the names of all elements, for suggestions.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.elements.iter().filter_map(StoryElement::name)
    }
}
