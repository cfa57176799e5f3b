//! Elements with an id and the references to them.

use crate::prelude::*;

/// A kind of element that has an id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Class {
    Road,
    Junction,
    JunctionGroup,
    Controller,
    Object,
    Bridge,
    Tunnel,
    Signal,
    Switch,
    Station,
    Platform,
    VmsGroup,
    Connection,
    CrossPath,
    RoadSection,
    Outline,
    Corner,
    Polyline,
    Vertex,
}

/// Scope in which the ids of a class must be unique.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scope {
    /// The whole file.
    File,
    /// The nearest ancestor with this name.
    Within(&'static str),
}

/// Elements of a class: elements with these names below one of these parents.
pub(crate) struct Kind {
    pub class: Class,
    /// Name for texts: `road`, `signal`.
    pub name: &'static str,
    pub elements: &'static [&'static str],
    /// Allowed parents; empty means any. Elsewhere, the name is a reference or something else.
    pub parents: &'static [&'static str],
    pub scope: Scope,
}

const fn kind(
    class: Class,
    name: &'static str,
    elements: &'static [&'static str],
    parents: &'static [&'static str],
    scope: Scope,
) -> Kind {
    Kind {
        class,
        name,
        elements,
        parents,
        scope,
    }
}

/// All classes. Lanes are not included, because separate rules check their numbers.
pub(crate) const KINDS: &[Kind] = &[
    kind(Class::Road, "road", &["road"], &["OpenDRIVE"], Scope::File),
    kind(
        Class::Junction,
        "junction",
        &["junction"],
        &["OpenDRIVE"],
        Scope::File,
    ),
    kind(
        Class::JunctionGroup,
        "junction group",
        &["junctionGroup"],
        &["OpenDRIVE"],
        Scope::File,
    ),
    // A `controller` of a junction is a reference to one.
    kind(
        Class::Controller,
        "controller",
        &["controller"],
        &["OpenDRIVE"],
        Scope::File,
    ),
    kind(
        Class::Object,
        "object",
        &["object"],
        &["objects"],
        Scope::File,
    ),
    kind(
        Class::Bridge,
        "bridge",
        &["bridge"],
        &["objects"],
        Scope::File,
    ),
    kind(
        Class::Tunnel,
        "tunnel",
        &["tunnel"],
        &["objects"],
        Scope::File,
    ),
    kind(
        Class::Signal,
        "signal",
        &["signal", "sign"],
        &["signals", "staticBoard"],
        Scope::File,
    ),
    kind(
        Class::Switch,
        "switch",
        &["switch"],
        &["railroad"],
        Scope::File,
    ),
    kind(
        Class::Station,
        "station",
        &["station"],
        &["OpenDRIVE"],
        Scope::File,
    ),
    kind(
        Class::Platform,
        "platform",
        &["platform"],
        &["station"],
        Scope::File,
    ),
    kind(
        Class::VmsGroup,
        "group of message signs",
        &["vmsGroup"],
        &[],
        Scope::File,
    ),
    kind(
        Class::Connection,
        "connection",
        &["connection"],
        &["junction"],
        Scope::Within("junction"),
    ),
    kind(
        Class::CrossPath,
        "cross path",
        &["crossPath"],
        &["junction"],
        Scope::Within("junction"),
    ),
    kind(
        Class::RoadSection,
        "road section",
        &["roadSection"],
        &[],
        Scope::Within("junction"),
    ),
    kind(
        Class::Outline,
        "outline",
        &["outline"],
        &["outlines", "object"],
        Scope::Within("object"),
    ),
    kind(
        Class::Corner,
        "corner",
        &["cornerRoad", "cornerLocal"],
        &["outline"],
        Scope::Within("outline"),
    ),
    kind(
        Class::Polyline,
        "polyline",
        &["polyline"],
        &["skeleton"],
        Scope::Within("object"),
    ),
    kind(
        Class::Vertex,
        "vertex",
        &["vertexRoad", "vertexLocal"],
        &["polyline"],
        Scope::Within("polyline"),
    ),
];

/// Returns a whole number without leading zeros. Outlines and their points have whole numbers as
/// ids, so `0` and `00` are the same.
pub(crate) fn plain(id: &str) -> &str {
    let id = id.trim();
    if id.is_empty() || !id.bytes().all(|byte| byte.is_ascii_digit()) {
        return id;
    }
    let digits = id.trim_start_matches('0');
    if digits.is_empty() { "0" } else { digits }
}

impl Kind {
    /// Returns the kind of a class.
    pub fn of(class: Class) -> &'static Kind {
        KINDS
            .iter()
            .find(|kind| kind.class == class)
            .unwrap_or(&KINDS[0])
    }

    /// Returns the elements of this kind in document order, including those without an id.
    pub fn nodes<'d>(&self, document: &Document<'d>) -> Vec<Node<'d>> {
        let mut nodes: Vec<Node<'d>> = self
            .elements
            .iter()
            .flat_map(|name| document.elements(name))
            .filter(|node| {
                let fits = |parent: Node<'d>| self.parents.iter().any(|name| parent.is(name));
                self.parents.is_empty() || node.parent().is_some_and(fits)
            })
            .filter(|node| !is_user_data(*node))
            .collect();
        if self.elements.len() > 1 {
            nodes.sort();
        }
        nodes
    }

    /// Returns the element within which a node's id must be unique, or `None` for the whole file.
    pub fn home<'d>(&self, node: Node<'d>) -> Option<Node<'d>> {
        match self.scope {
            Scope::File => None,
            Scope::Within(name) => node.ancestors().find(|ancestor| ancestor.is(name)),
        }
    }
}
