//! A header that names an older version than the file is written for: what the file uses of later ones.

use foldhash::{HashMap, HashSet};
use qcbus_document::{Attribute, Document, FileKind, Node};

use crate::defects;
use crate::typing::{FewTypes, Member, Typing, came_with};
use crate::versions::{SHIPPED, Version};
use crate::violation::{Code, Report};

/// What a document uses of versions after the one that its header names.
#[derive(Clone, Debug)]
pub struct Later<'a> {
    /// The `revMinor` of the header, which would have to be another.
    pub header: Attribute<'a>,
    /// The first version that has all of it.
    pub version: Version,
    /// One of each kind, where it is first: the newest before the others.
    pub things: Vec<Thing<'a>>,
    /// How many there are, those that are said several times included.
    pub count: usize,
}

/// Something that the version of the header does not have.
#[derive(Clone, Debug)]
pub struct Thing<'a> {
    /// The element it is about.
    pub node: Node<'a>,
    /// The attribute it is about.
    pub attribute: Option<Attribute<'a>>,
    /// What it is: `` `name` of `Element` ``.
    pub what: String,
    /// The version that it came with.
    pub since: Version,
    /// All elements that it is about, in document order.
    pub nodes: Vec<Node<'a>>,
}

/// By the number of the type and what it does not have: the place in the list, when a later version has it.
type Known<'a> = HashMap<(u32, Member<'a>), Option<usize>>;

/// Which elements may use something of later versions.
enum Suspects<'a> {
    All,
    /// Those of these names.
    Named(HashSet<&'a str>),
}

impl<'a> Suspects<'a> {
    /// `None` when there are none. What a map has of later versions its own version finds fault with; a
    /// scenario may have expressions where any text is allowed.
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

/// Whether a violation may be something that a later version has.
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
    /// How the later versions type the same document, once that has been asked for.
    successors: Option<Vec<(Version, FewTypes)>>,
    known: Known<'a>,
    things: Vec<Thing<'a>>,
    count: usize,
}

/// What a document uses of later versions; `None` when that is nothing. `report` is what its version finds.
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
        things,
        count,
    })
}

impl<'a> Search<'a> {
    fn look(&mut self, node: Node<'a>) {
        // What is within something unknown is not known to be new.
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

    /// The first later version that has it, unless its lack is a defect of this version's schema.
    fn came_with(
        &mut self,
        owner: Node<'a>,
        member: Member<'a>,
        (node, attribute): (Node<'a>, Option<Attribute<'a>>),
    ) -> Option<Version> {
        if self.kind != FileKind::Xodr {
            return came_with(self.kind, self.version, self.typing.class(owner)?, member);
        }
        // The types of OpenDRIVE have other names in every version: its elements are told by their place.
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
        // What has gone again is no reason to take a later version for the one that is meant.
        let is_there_still = successors.last().is_some_and(|(_, typing)| has(typing));
        let mut having = successors.iter().filter(|(_, typing)| has(typing));
        having
            .next()
            .filter(|_| is_there_still)
            .map(|(version, _)| *version)
    }
}
