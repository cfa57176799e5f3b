//! Detection of files that are written for a later version than their header names, and the later
//! features they use.

use foldhash::{HashMap, HashSet};
use qcbus_document::{Attribute, Document, FileKind, Node};

use crate::defects;
use crate::typing::{FewTypes, Member, Typing, came_with};
use crate::versions::{SHIPPED, Version};
use crate::violation::{Code, Report};

/// Features in a document that came after the version in its header.
#[derive(Clone, Debug)]
pub struct Later<'a> {
    /// The `revMinor` of the header that would have to change.
    pub header: Attribute<'a>,
    /// The first version that has all of these features.
    pub version: Version,
    /// The version that the header may name instead: the one with the fewest violations. `None` if
    /// the document violates every version with these features at more places than its own.
    pub advice: Option<Version>,
    /// One entry for each kind of feature at its first use. The newest ones come first.
    pub things: Vec<Thing<'a>>,
    /// Number of uses, including repeated ones.
    pub count: usize,
}

/// A feature that the version of the header does not have.
#[derive(Clone, Debug)]
pub struct Thing<'a> {
    /// Element with the feature.
    pub node: Node<'a>,
    /// Attribute with the feature, if any.
    pub attribute: Option<Attribute<'a>>,
    /// Name of the feature: `` `name` of `Element` ``.
    pub what: String,
    /// Version that introduced the feature.
    pub since: Version,
    /// All elements with the feature, in document order.
    pub nodes: Vec<Node<'a>>,
}

/// Index in the list for the number of a type and a missing member, if a later version has it.
type Known<'a> = HashMap<(u32, Member<'a>), Option<usize>>;

/// Elements that may use features of later versions.
enum Suspects<'a> {
    All,
    /// Elements with these names.
    Named(HashSet<&'a str>),
}

impl<'a> Suspects<'a> {
    /// Returns `None` if there are no such elements. In a map, the header's schema reports all
    /// later features. A scenario may also have expressions in attributes that allow any text.
    fn of(kind: FileKind, report: &'a Report<'_>) -> Option<Suspects<'a>> {
        if kind != FileKind::Xodr {
            return Some(Suspects::All);
        }
        let mut names = HashSet::default();
        let listed = report.violations.iter();
        names.extend(
            listed
                .filter(|one| is_strange(one.code))
                .map(|one| one.node.name()),
        );
        for rest in report.rest.iter().filter(|rest| is_strange(rest.code)) {
            let name = rest.subject.split_once("/@").map(|(name, _)| name);
            names.insert(name.unwrap_or(&rest.subject));
        }
        if names.contains(Report::VARIOUS) {
            return Some(Suspects::All);
        }
        (!names.is_empty()).then_some(Suspects::Named(names))
    }

    fn has(&self, node: Node<'_>) -> bool {
        match self {
            Suspects::All => true,
            Suspects::Named(names) => names.contains(node.name()),
        }
    }
}

/// Checks whether a violation may be a feature of a later version.
pub(crate) fn is_strange(code: Code) -> bool {
    matches!(
        code,
        Code::UnexpectedElement | Code::UnexpectedAttribute | Code::InvalidValue
    )
}

struct Search<'a> {
    document: Document<'a>,
    kind: FileKind,
    version: Version,
    typing: Typing,
    /// Types of the same document in later versions, computed on first use.
    successors: Option<Vec<(Version, FewTypes)>>,
    known: Known<'a>,
    things: Vec<Thing<'a>>,
    count: usize,
}

/// Returns the uses of later features, or `None` if there are none. `report` is the result for the
/// header's version.
pub(crate) fn later<'a>(
    document: &Document<'a>,
    kind: FileKind,
    version: Version,
    report: &Report<'a>,
) -> Option<Later<'a>> {
    let suspects = Suspects::of(kind, report)?;
    let root = document.root()?;
    let name = match kind {
        FileKind::Xodr => "header",
        _ => "FileHeader",
    };
    let header = root.child(name)?.attribute("revMinor")?;
    let mut search = Search {
        document: *document,
        kind,
        version,
        typing: Typing::of(document, kind, version)?,
        successors: None,
        known: Known::default(),
        things: Vec::new(),
        count: 0,
    };
    let all = std::iter::once(root).chain(root.descendants());
    for node in all.filter(|node| suspects.has(*node)) {
        search.look(node);
    }
    let Search {
        mut things, count, ..
    } = search;
    things.sort_by_key(|thing| std::cmp::Reverse(thing.since));
    let version = things.first()?.since;
    Some(Later {
        header,
        version,
        advice: None,
        things,
        count,
    })
}

impl<'a> Search<'a> {
    fn look(&mut self, node: Node<'a>) {
        // Content of an unknown element is not necessarily new.
        let unknown = self.typing.number(node).is_none();
        let Some(parent) = node.parent().filter(|_| unknown) else {
            for attribute in node.attributes() {
                self.look_at(attribute);
            }
            return;
        };
        if self.typing.declares(node) {
            return;
        }
        self.note(parent, Member::Child(node.name()), (node, None), || {
            format!("`{}` in `{}`", node.name(), parent.name())
        });
    }

    fn look_at(&mut self, attribute: Attribute<'a>) {
        let (node, name) = (attribute.node(), attribute.name());
        let at = (node, Some(attribute));
        let Some(value) = self.typing.value(attribute) else {
            self.note(node, Member::Attribute(name), at, || {
                format!("`{name}` of `{}`", node.name())
            });
            return;
        };
        let word = attribute.value().trim();
        if word.starts_with("${") && !value.takes_expressions() {
            self.note(node, Member::Expression(name), at, || {
                format!("an expression as `{name}` of `{}`", node.name())
            });
            return;
        }
        let words = value.words().unwrap_or(&[]);
        if !words.is_empty() && words.iter().all(|known| **known != *word) {
            self.note(node, Member::Word(name, word), at, || {
                format!("`{word}` as `{name}` of `{}`", node.name())
            });
        }
    }

    fn note(
        &mut self,
        owner: Node<'a>,
        member: Member<'a>,
        (node, attribute): (Node<'a>, Option<Attribute<'a>>),
        say: impl FnOnce() -> String,
    ) {
        let Some(number) = self.typing.number(owner) else {
            return;
        };
        if let Some(place) = self.known.get(&(number, member)) {
            if let Some(thing) = place.and_then(|place| self.things.get_mut(place)) {
                thing.nodes.push(node);
                self.count += 1;
            }
            return;
        }
        let since = self.came_with(owner, member, (node, attribute));
        let place = since.map(|since| {
            self.things.push(Thing {
                node,
                attribute,
                what: say(),
                since,
                nodes: vec![node],
            });
            self.count += 1;
            self.things.len() - 1
        });
        self.known.insert((number, member), place);
    }

    /// Returns the first later version with the member, unless its lack is a schema defect.
    fn came_with(
        &mut self,
        owner: Node<'a>,
        member: Member<'a>,
        (node, attribute): (Node<'a>, Option<Attribute<'a>>),
    ) -> Option<Version> {
        if self.kind != FileKind::Xodr {
            return came_with(self.kind, self.version, self.typing.class(owner)?, member);
        }
        // OpenDRIVE renames its types in every version, so elements are matched by their position
        // in the document.
        let title = &self.typing.schema().title;
        let code = match member {
            Member::Attribute(_) => Code::UnexpectedAttribute,
            _ => Code::InvalidValue,
        };
        let is_defect = |one| defects::attribute(code, one, title).is_some();
        if attribute.is_some_and(is_defect) {
            return None;
        }
        let (document, kind, version) = (self.document, self.kind, self.version);
        let successors = self.successors.get_or_insert_with(|| {
            let later = SHIPPED.iter().map(|one| (one.kind, one.version));
            let later = later.filter(|(of, later)| *of == kind && *later > version);
            later
                .filter_map(|(_, later)| Some((later, FewTypes::of(&document, kind, later)?)))
                .collect()
        });
        let has = |typing: &FewTypes| match attribute {
            None => typing.declares(node),
            Some(attribute) => typing.value(attribute).is_some_and(|value| {
                let word = attribute.value().trim();
                let words = value.words().unwrap_or(&[]);
                words.is_empty() || words.iter().any(|known| **known == *word)
            }),
        };
        // A feature that was removed again does not indicate a later version.
        let is_there_still = successors.last().is_some_and(|(_, typing)| has(typing));
        let mut having = successors.iter().filter(|(_, typing)| has(typing));
        having
            .next()
            .filter(|_| is_there_still)
            .map(|(version, _)| *version)
    }
}
