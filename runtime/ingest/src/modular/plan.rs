//! Decides which groups replace which references.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use qcbus_document::{Document, Node};
use qcbus_formats::distance::{did_you_mean, some_of};
use qcbus_messages::path_text::name_of;

use super::copy::{Copy, Value};
use super::keys::{self, Key};
use super::problem::{Problem, Problems, Spot, What};
use super::refusal::{catalog_of, not_found, trouble};
use super::{MAX_DEPTH, Piece, actor, foreign, is_archive};

/// Result of expanding a modular scenario.
#[derive(Debug)]
pub struct Expansion<'d> {
    /// The documents, the root first.
    pub pieces: Vec<Piece<'d>>,
    /// The followed references. Those of inner scenarios come before the references that lead
    /// there.
    pub references: Vec<Followed<'d>>,
    /// All problems found.
    pub problems: Vec<Problem<'d>>,
    /// Replacements for groups of the root, by the index of their node.
    pub(super) replaced: BTreeMap<u32, Vec<Arc<Copy<'d>>>>,
    /// Indices of the pieces whose text is in the expanded scenario, the root first.
    pub(super) used: BTreeSet<usize>,
}

/// A `ScenarioReference` that was followed.
#[derive(Debug)]
pub struct Followed<'d> {
    /// Index of the piece that contains it.
    pub piece: usize,
    /// The element.
    pub node: Node<'d>,
    /// The group that contains it.
    pub group: Node<'d>,
    /// Index of the piece that it leads to.
    pub target: Option<usize>,
    /// Form in which the reference names its groups.
    pub form: Form,
    /// Number of references from the root up to and including this one.
    pub depth: u32,
    /// The groups that the reference takes, if they exist.
    pub uses: Vec<Use<'d>>,
}

/// Form in which a `ScenarioReference` names its groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// `ManeuverGroupReference` elements name groups, each with keys of its own.
    Named,
    /// `ParameterReference` elements are direct children: all groups of the file are taken. This is
    /// the documented form, but later versions of the reference tool do not support it.
    Direct,
}

/// Groups that a reference takes from another file.
#[derive(Debug)]
pub struct Use<'d> {
    /// The `ManeuverGroupReference`, or the `ScenarioReference` of the direct form.
    pub node: Node<'d>,
    /// Keys of this use.
    pub keys: Vec<Key<'d>>,
    /// Copies that replace the referring group.
    pub copies: Vec<Arc<Copy<'d>>>,
}

impl<'d> Expansion<'d> {
    /// Checks whether the expanded scenario is complete: each reference leads to a scenario, and
    /// each value is known.
    pub fn is_complete(&self) -> bool {
        self.obstacles().next().is_none()
    }

    /// Returns the problems that prevent the expansion.
    pub fn obstacles(&self) -> impl Iterator<Item = &Problem<'d>> {
        self.problems.iter().filter(|problem| problem.what.stops())
    }
}

/// Maximum number of copied groups. Groups of inner scenarios count each time.
const MOST_COPIES: usize = 1 << 16;

/// Replaces the references of a modular scenario by the groups that they refer to. The first of
/// `pieces` is the root. `max_text` is the maximum number of copied bytes.
///
/// # Panics
/// If `pieces` is empty.
pub fn expand(pieces: Vec<Piece<'_>>, max_text: u64) -> Expansion<'_> {
    let mut expander = Expander {
        expanded: vec![None; pieces.len()],
        chain: Vec::new(),
        left: max_text,
        copies: 0,
        written: HashMap::new(),
        problems: Problems::default(),
        out: Expansion {
            pieces,
            references: Vec::new(),
            problems: Vec::new(),
            replaced: BTreeMap::new(),
            used: BTreeSet::from([0]),
        },
    };
    expander.root();
    expander.out.problems = expander.problems.list;
    expander.out
}

struct Expander<'d> {
    /// Groups of each piece after its own expansion. Each entry is computed on first use.
    expanded: Vec<Option<Arc<Vec<Expanded<'d>>>>>,
    /// Pieces that are being expanded, the root first.
    chain: Vec<usize>,
    /// Number of bytes that may still be copied.
    left: u64,
    copies: usize,
    /// Groups of a piece by their written names: the first, and a second one with the same name.
    written: HashMap<usize, HashMap<&'d str, (Node<'d>, Option<Node<'d>>)>>,
    problems: Problems<'d>,
    out: Expansion<'d>,
}

/// A group of a piece with its replacement. A group without references is its own replacement.
struct Expanded<'d> {
    group: Node<'d>,
    copies: Vec<Arc<Copy<'d>>>,
}

impl<'d> Expander<'d> {
    fn document(&self, piece: usize) -> Document<'d> {
        self.out.pieces[piece].document
    }

    fn say(&mut self, what: What, at: Spot<'d>, target: Option<Spot<'d>>, text: String) {
        self.problems.push(Problem {
            what,
            at,
            target,
            text,
        });
    }

    fn root(&mut self) {
        self.chain.push(0);
        let document = self.document(0);
        if let (Some(why), Some(root)) = (trouble(document), document.root()) {
            self.say(What::Unreadable, root.into(), None, why);
        }
        self.say_misplaced(document);
        for group in document.elements("ManeuverGroup") {
            if let Some(copies) = self.group(0, group) {
                let used = copies.iter().flat_map(|copy| {
                    let values = copy.name.iter().chain(copy.edits.values());
                    values.map(|value| value.piece).chain([copy.piece])
                });
                self.out.used.extend(used);
                self.out.replaced.insert(group.index(), copies);
            }
        }
    }

    fn say_misplaced(&mut self, document: Document<'d>) {
        for node in document.elements("ScenarioReference") {
            let parent = node.parent();
            if parent.is_some_and(|parent| parent.is("ManeuverGroup")) {
                continue;
            }
            let text = format!(
                "`ScenarioReference` must be in a `ManeuverGroup`, which the groups that it refers to replace; \
                 found in `{}`",
                parent.map_or("", |parent| parent.name())
            );
            self.say(What::Placement, node.into(), None, text);
        }
    }

    /// Returns the replacement for a group, or `None` for a group without references.
    fn group(&mut self, piece: usize, group: Node<'d>) -> Option<Vec<Arc<Copy<'d>>>> {
        let references: Vec<Node<'d>> = group.children_named("ScenarioReference").collect();
        let first = *references.first()?;
        let mut copies = Vec::new();
        for &reference in &references {
            if reference != first {
                let text = "a `ManeuverGroup` may have only one `ScenarioReference`, this is another one: the \
                            reference tool skips it and gives its values to the first; put it into a separate \
                            group"
                    .to_owned();
                self.say(
                    What::SecondReference,
                    reference.into(),
                    Some(first.into()),
                    text,
                );
            }
            copies.extend(self.reference(piece, group, reference));
        }
        Some(copies)
    }

    fn reference(&mut self, piece: usize, group: Node<'d>, node: Node<'d>) -> Vec<Arc<Copy<'d>>> {
        let named: Vec<Node<'d>> = node.children_named("ManeuverGroupReference").collect();
        let form = match named.is_empty() {
            true => Form::Direct,
            false => Form::Named,
        };
        self.say_form(node, form);
        let depth = self.chain.len() as u32;
        let target = self.target(piece, node);
        let mut uses = Vec::new();
        if let Some(target) = target {
            let referring = Referring { piece, group };
            uses = match form {
                Form::Named => named
                    .iter()
                    .filter_map(|&named| self.named(referring, named, target))
                    .collect(),
                Form::Direct => vec![self.direct(referring, node, target)],
            };
            self.say_twice(&named);
        }
        let copies = uses.iter().flat_map(|one| one.copies.clone()).collect();
        self.out.references.push(Followed {
            piece,
            node,
            group,
            target,
            form,
            depth,
            uses,
        });
        copies
    }

    fn say_form(&mut self, node: Node<'d>, form: Form) {
        let is_open = foreign::say(node, &mut self.problems);
        let direct = node.child("ParameterReference");
        match (form, direct) {
            // An unknown element hides which form was intended.
            (Form::Direct, _) if is_open => {}
            (Form::Direct, _) => {
                let text = "without a `ManeuverGroupReference` all groups of the file are taken; this form is \
                            documented, but later versions of the reference tool delete the referring group \
                            without a message: name the groups in `ManeuverGroupReference`"
                    .to_owned();
                self.say(What::DirectForm, node.into(), None, text);
            }
            (Form::Named, Some(direct)) => {
                let text = "`ParameterReference` beside `ManeuverGroupReference` applies to no group, and its \
                            value is not used; move it into one of the `ManeuverGroupReference` elements"
                    .to_owned();
                self.say(What::MixedForm, direct.into(), Some(node.into()), text);
            }
            (Form::Named, None) => {}
        }
    }

    /// Returns the piece that a reference leads to, if its groups are available.
    fn target(&mut self, piece: usize, node: Node<'d>) -> Option<usize> {
        let at = Spot::of(node, "scenarioFileName");
        let links = &self.out.pieces[piece].links;
        let link = links.iter().find(|link| link.at == node.offset());
        // The collection of the documents does not follow references any deeper either.
        let is_too_deep = self.chain.len() > MAX_DEPTH as usize;
        let Some(target) = link.map(|link| link.to as usize) else {
            let (what, text) = match is_too_deep {
                true => (What::Depth, self.too_deep()),
                false => not_found(node),
            };
            self.say(what, at, None, text);
            return None;
        };
        if target >= self.out.pieces.len() {
            let text = "the scenario that is referred to is not available".to_owned();
            self.say(What::FileNotFound, at, None, text);
            return None;
        }
        if let Some(from) = self.chain.iter().position(|&it| it == target) {
            let chain = self.chain[from..].iter().chain([&target]);
            let names: Vec<String> = chain.map(|&piece| self.short_name(piece)).collect();
            let text = format!(
                "the scenario refers to itself in an endless cycle: {}",
                names.join(" → ")
            );
            self.say(What::Cycle, at, None, text);
            return None;
        }
        if is_too_deep {
            let text = self.too_deep();
            self.say(What::Depth, at, None, text);
            return None;
        }
        let document = self.document(target);
        if let Some(why) = trouble(document) {
            let root = document.root().map(Spot::from);
            self.say(What::Unreadable, at, root, why);
            return None;
        }
        if let Some(catalog) = catalog_of(document) {
            let file = self.short_name(target);
            let text = format!("`{file}` is a catalog; groups can be taken only from scenarios");
            self.say(What::Unreadable, at, Some(catalog.into()), text);
            return None;
        }
        Some(target)
    }

    fn too_deep(&self) -> String {
        let last = self.chain.last();
        let last = last.map_or_else(String::new, |&piece| self.short_name(piece));
        format!(
            "references between scenarios are more than {MAX_DEPTH} deep; the reference in `{last}` is not \
             followed"
        )
    }

    /// Returns the groups of a piece after its own expansion.
    fn expanded(&mut self, piece: usize) -> Arc<Vec<Expanded<'d>>> {
        if let Some(groups) = &self.expanded[piece] {
            return groups.clone();
        }
        self.chain.push(piece);
        let document = self.document(piece);
        self.say_misplaced(document);
        let mut groups = Vec::new();
        for group in document.elements("ManeuverGroup") {
            let copies = self
                .group(piece, group)
                .unwrap_or_else(|| vec![Arc::new(Copy::as_is(piece, group))]);
            groups.push(Expanded { group, copies });
        }
        self.chain.pop();
        let groups = Arc::new(groups);
        self.expanded[piece] = Some(groups.clone());
        groups
    }

    /// Returns all groups of a piece after its own expansion.
    fn all_copies(&mut self, piece: usize) -> Vec<Arc<Copy<'d>>> {
        let groups = self.expanded(piece);
        groups.iter().flat_map(|it| it.copies.clone()).collect()
    }

    /// Finds a group by name: the first one, like the reference tool, and a second one with the
    /// same name if it exists. An archive offers its groups after expansion. A plain file offers
    /// the groups written in it, and faults of its other groups do not matter here.
    fn find(&mut self, target: usize, name: &str) -> (Vec<Arc<Copy<'d>>>, Option<Node<'d>>) {
        let document = self.document(target);
        let is_archive = is_archive(document);
        let written = self.written.entry(target).or_insert_with(|| {
            let mut written: HashMap<&str, (Node<'d>, Option<Node<'d>>)> = HashMap::new();
            for group in document.elements("ManeuverGroup") {
                let Some(name) = group.attr("name") else {
                    continue;
                };
                let known = written.entry(name).or_insert((group, None));
                if known.0 != group {
                    known.1.get_or_insert(group);
                }
            }
            written
        });
        let written = written.get(name).copied().filter(|_| !is_archive);
        if let Some((first, second)) = written {
            if first.child("ScenarioReference").is_none() {
                return (vec![Arc::new(Copy::as_is(target, first))], second);
            }
            let groups = self.expanded(target);
            let own = groups.iter().find(|it| it.group == first);
            return (own.map_or_else(Vec::new, |it| it.copies.clone()), second);
        }
        let copies = self.all_copies(target);
        let mut called = copies.into_iter().filter(|copy| copy.name() == name);
        let first: Vec<_> = called.next().into_iter().collect();
        (first, called.next().map(|copy| copy.group))
    }

    fn named(
        &mut self,
        referring: Referring<'d>,
        node: Node<'d>,
        target: usize,
    ) -> Option<Use<'d>> {
        let Some(wanted) = node.attribute("maneuverGroupName") else {
            let text =
                "`ManeuverGroupReference` needs the attribute `maneuverGroupName`: the group to take is \
                 undefined".to_owned();
            self.say(What::GroupUnknown, node.into(), None, text);
            return None;
        };
        let (found, second) = self.find(target, wanted.value());
        let Some(first) = found.first() else {
            let text = self.unknown_group(target, wanted.value());
            let root = self.document(target).root().map(Spot::from);
            self.say(What::GroupUnknown, wanted.into(), root, text);
            return None;
        };
        if let Some(second) = second {
            let text = format!(
                "`{}` has several maneuver groups called `{}`; the first is taken, the others cannot be referred to",
                self.short_name(target),
                wanted.value()
            );
            self.say(
                What::GroupAmbiguous,
                wanted.into(),
                Some(second.into()),
                text,
            );
        }
        let keys = keys::read(node, &mut self.problems);
        let prefix = referring.group.attr("name").unwrap_or("");
        let mut copies = Vec::new();
        for group in &found {
            let name = match prefix {
                "" => group.name().to_owned(),
                prefix => format!("{prefix}.{}", group.name()),
            };
            let name = Value::of(referring.piece, wanted).saying(&name);
            copies.extend(self.copy(referring, group, name, &keys));
        }
        keys::say_unmatched(&keys, first.group, &mut self.problems);
        Some(Use { node, keys, copies })
    }

    /// Takes all groups. The first gets the name of the referring group, the next ones are called
    /// `name_2` and so on.
    fn direct(&mut self, referring: Referring<'d>, node: Node<'d>, target: usize) -> Use<'d> {
        let keys = keys::read(node, &mut self.problems);
        let groups = self.all_copies(target);
        let own = referring.group.attr("name").unwrap_or("");
        let mut copies = Vec::new();
        for (index, group) in groups.iter().enumerate() {
            let name = match index {
                0 => own.to_owned(),
                _ => format!("{own}_{}", index + 1),
            };
            let Some(file) = node.attribute("scenarioFileName") else {
                break;
            };
            let name = Value::of(referring.piece, file).saying(&name);
            copies.extend(self.copy(referring, group, name, &keys));
        }
        match groups.first() {
            Some(first) => {
                keys::say_unmatched(&keys, first.group, &mut self.problems);
            }
            None => {
                let text = format!("`{}` has no maneuver group", self.short_name(target));
                let root = self.document(target).root().map(Spot::from);
                self.say(
                    What::GroupUnknown,
                    Spot::of(node, "scenarioFileName"),
                    root,
                    text,
                );
            }
        }
        Use { node, keys, copies }
    }

    /// Copies a group. Returns `None` if a limit is exceeded.
    fn copy(
        &mut self,
        referring: Referring<'d>,
        group: &Copy<'d>,
        name: Value,
        keys: &[Key<'d>],
    ) -> Option<Arc<Copy<'d>>> {
        let bytes = group
            .group
            .end_offset()
            .saturating_sub(group.group.offset());
        let bytes = u64::from(bytes) + name.text.len() as u64;
        self.copies += 1;
        if bytes > self.left || self.copies > MOST_COPIES {
            let text = format!(
                "the expanded scenario becomes too large: more than {MOST_COPIES} groups, or more bytes than the \
                 limit max_archive allows"
            );
            if !self.problems.list.iter().any(|it| it.what == What::Size) {
                self.say(What::Size, referring.group.into(), None, text);
            }
            return None;
        }
        self.left -= bytes;
        let mut copy = Copy {
            name: Some(name),
            ..group.clone()
        };
        actor::replace(
            &mut copy,
            referring.piece,
            referring.group,
            &mut self.problems,
        );
        keys::apply(&mut copy, referring.piece, keys, &mut self.problems);
        Some(Arc::new(copy))
    }

    fn say_twice(&mut self, named: &[Node<'d>]) {
        let mut first: HashMap<&str, Node<'d>> = HashMap::new();
        for &node in named {
            let Some(name) = node.attr("maneuverGroupName") else {
                continue;
            };
            if let Some(&before) = first.get(name) {
                let text = format!(
                    "the group `{name}` is referred to twice here, so two groups get the same name, and the \
                     reference tool gives both the values of the last; refer to it from a separate \
                     `ManeuverGroup`"
                );
                let at = Spot::of(node, "maneuverGroupName");
                self.say(What::GroupTwice, at, Some(before.into()), text);
            } else {
                first.insert(name, node);
            }
        }
    }

    fn unknown_group(&mut self, target: usize, name: &str) -> String {
        let groups = self.all_copies(target);
        let mut names: Vec<&str> = groups.iter().map(|copy| copy.name()).collect();
        names.dedup();
        let file = self.short_name(target);
        // The group is written in the file, but it is replaced by groups with other names.
        let inner = |copy: &&Arc<Copy<'d>>| {
            let rest = copy.name().strip_prefix(name);
            rest.is_some_and(|rest| rest.starts_with('.'))
        };
        let mut written = self.document(target).elements("ManeuverGroup");
        let refers = written.any(|group| {
            group.attr("name") == Some(name) && group.child("ScenarioReference").is_some()
        });
        if let Some(inner) = groups.iter().find(inner).filter(|_| refers) {
            return format!(
                "the maneuver group `{name}` of `{file}` refers to other groups itself; the group that replaces \
                 it is called `{}`",
                inner.name()
            );
        }
        let meant = did_you_mean(name, names.iter().copied());
        let known = match some_of(names) {
            _ if !meant.is_empty() => meant,
            None => "; it has none".to_owned(),
            Some(names) => format!("; it has {names}"),
        };
        format!("`{file}` has no maneuver group `{name}`{known}")
    }

    /// Returns the short name of a piece: the name of the file, or of the member after its archive.
    fn short_name(&self, piece: usize) -> String {
        name_of(self.document(piece).path()).to_owned()
    }
}

/// The group that contains a reference.
#[derive(Clone, Copy)]
struct Referring<'d> {
    piece: usize,
    group: Node<'d>,
}
