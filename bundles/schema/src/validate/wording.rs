//! Texts of violations: the value found, the expected value and a suggestion.

use qcbus_document::{Attribute, Node};

use super::memo::Memo;
use super::names::XSI;
use crate::assertion::Assertion;
use crate::constraint::{Constraint, Step};
use crate::defects;
use crate::model::{AttributeUse, ElementDecl, Model, Schema};
use crate::names::NameId;
use crate::similar::closest;
use crate::simple::{EXPRESSION, Expectation, SimpleType, XML_SPACE};
use crate::violation::Detail;
use crate::work::steps;

/// The text of a violation, what it is about, and the schema defect that causes it, if one is known.
#[derive(Debug)]
pub(super) struct Wording {
    pub(super) text: String,
    pub(super) detail: Detail,
    pub(super) defect: Option<&'static str>,
}

impl From<String> for Wording {
    fn from(text: String) -> Self {
        Self {
            text,
            detail: Detail::None,
            defect: None,
        }
    }
}

impl Wording {
    fn about(mut self, detail: Detail) -> Self {
        self.detail = detail;
        self
    }

    fn suggesting(mut self, suggestion: Option<&str>) -> Self {
        if let Some(meant) = suggestion {
            self.text += &format!("; did you mean \"{meant}\"?");
        }
        self
    }

    pub(super) fn excused(mut self, defect: Option<&'static str>) -> Self {
        if let Some(defect) = defect {
            self.text += &format!("; known defect of the published schema: {defect}");
            self.defect = Some(defect);
        }
        self
    }
}

/// Maximum length of a value quoted in a message.
const MAX_QUOTED: usize = 80;

fn quote(text: &str) -> String {
    let mut short: String = text.chars().take(MAX_QUOTED).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    format!("\"{short}\"")
}

fn elements(names: &[&str]) -> String {
    const SHOWN: usize = 12;
    let shown = names.iter().take(SHOWN);
    let mut list: Vec<String> = shown.map(|name| format!("<{name}>")).collect();
    if names.len() > SHOWN {
        list.push(format!("{} more", names.len() - SHOWN));
    }
    list.join(", ")
}

fn texts(names: impl Iterator<Item = NameId>, schema: &Schema) -> Vec<&str> {
    let mut all: Vec<&str> = Vec::new();
    for name in names {
        let text = schema.names.text(name);
        if !all.contains(&text) {
            all.push(text);
        }
    }
    all
}

/// Returns the text "<a> or the end of <b>".
fn expected_here(model: &Model, state: u16, parent: Node<'_>, schema: &Schema) -> String {
    let names = texts(model.edges(state).iter().map(|edge| edge.name), schema);
    let row = model.states.get(usize::from(state));
    let end = format!("the end of <{}>", parent.name());
    match (names.is_empty(), row.is_some_and(|row| row.accepts)) {
        (true, _) => end,
        (false, true) => format!("{} or {end}", elements(&names)),
        (false, false) => elements(&names),
    }
}

pub(super) fn unknown_root(root: Node<'_>, known: &[&str], title: &str) -> Wording {
    let text = format!(
        "the root element <{}> is not defined in {title}; expected {}",
        root.name(),
        elements(known)
    );
    Wording::from(text).suggesting(closest(root.name(), known.iter().copied()))
}

pub(super) fn repeated(node: Node<'_>, parent: Node<'_>, count: u32, most: u32) -> Wording {
    let limit = match most {
        1 => "at most once".to_owned(),
        most => format!("at most {most} times"),
    };
    let text = format!(
        "<{}> occurs {count} times in <{}>, but may occur {limit}",
        node.name(),
        parent.name()
    );
    text.into()
}

pub(super) fn no_children(node: Node<'_>, parent: Node<'_>, title: &str) -> Wording {
    let text = format!(
        "<{}> may not contain elements, but contains <{}>",
        parent.name(),
        node.name()
    );
    Wording::from(text).excused(defects::children_of_none(parent, title))
}

/// Maximum number of siblings examined to explain the place of a child.
const MAX_SIBLINGS: usize = 200;

pub(super) fn missing_before(
    node: Node<'_>,
    parent: Node<'_>,
    skipped: &[NameId],
    schema: &Schema,
) -> Wording {
    let names = texts(skipped.iter().copied(), schema);
    let defect = defects::missing_child(parent, &names, &schema.title);
    let (name, parent_name, list) = (node.name(), parent.name(), elements(&names));
    let comes_later = || {
        let mut siblings = parent.children().take(MAX_SIBLINGS);
        siblings.any(|one| {
            steps(names.len());
            names.iter().any(|name| one.is(name))
        })
    };
    let wording = if comes_later() {
        let text =
            format!("<{name}> in <{parent_name}> comes too early: {list} must come before it");
        Wording::from(text).about(Detail::Later)
    } else {
        let text = format!("<{parent_name}> lacks {list}, which must come before <{name}>");
        Wording::from(text).about(Detail::Before)
    };
    wording.excused(defect)
}

/// Sibling that makes a child misplaced.
enum Obstacle<'a> {
    /// The child must come before it.
    Before(&'a str),
    /// Only one of the two is allowed.
    Instead(&'a str),
}

fn obstacle<'a, 's>(
    node: Node<'a>,
    parent: Node<'a>,
    model: &'s Model,
    schema: &Schema,
    memo: &mut Memo<'s>,
) -> Option<Obstacle<'a>> {
    let name = schema.names.find(node.name())?;
    let mut way = |state, name| memo.way(model, state, Some(name)).map(|way| way.0);
    let (mut state, mut obstacle) = (0, None);
    for sibling in parent
        .children()
        .take(MAX_SIBLINGS)
        .take_while(|one| *one != node)
    {
        let Some(known) = schema.names.find(sibling.name()) else {
            continue;
        };
        // As in the walk, children that are missing before a sibling count as present.
        let Some(to) = way(state, known).filter(|to| *to != state) else {
            continue;
        };
        match (way(state, name), way(to, name)) {
            (Some(after), None) => {
                obstacle = Some(match way(after, known) {
                    Some(_) => Obstacle::Before(sibling.name()),
                    None => Obstacle::Instead(sibling.name()),
                });
            }
            (_, Some(_)) => obstacle = None,
            (None, None) => {}
        }
        state = to;
    }
    obstacle
}

pub(super) fn misplaced<'s>(
    node: Node<'_>,
    parent: Node<'_>,
    (model, state): (&'s Model, u16),
    schema: &Schema,
    memo: &mut Memo<'s>,
) -> Wording {
    let (name, parent_name) = (node.name(), parent.name());
    let text = match obstacle(node, parent, model, schema, memo) {
        Some(Obstacle::Before(later)) => {
            format!("<{name}> in <{parent_name}> comes too late: it must come before <{later}>")
        }
        Some(Obstacle::Instead(other)) => format!(
            "<{name}> cannot occur together with <{other}>: <{parent_name}> takes one or the other"
        ),
        None => format!(
            "<{name}> may occur in <{parent_name}>, but not here: children have a fixed order, expected here: {}",
            expected_here(model, state, parent, schema)
        ),
    };
    Wording::from(text).excused(defects::misplaced_child(node, parent, &schema.title))
}

pub(super) fn unexpected_child(
    node: Node<'_>,
    parent: Node<'_>,
    (model, state): (&Model, u16),
    suggestion: Option<&str>,
    schema: &Schema,
) -> Wording {
    let words = expected_here(model, state, parent, schema);
    unknown_child(node, parent, &format!("here: {words}"), suggestion, schema)
}

pub(super) fn unexpected_member(
    node: Node<'_>,
    parent: Node<'_>,
    members: &[ElementDecl],
    suggestion: Option<&str>,
    schema: &Schema,
) -> Wording {
    let names = texts(members.iter().map(|member| member.name), schema);
    let words = format!("in any order: {}", elements(&names));
    unknown_child(node, parent, &words, suggestion, schema)
}

fn unknown_child(
    node: Node<'_>,
    parent: Node<'_>,
    expected: &str,
    suggestion: Option<&str>,
    schema: &Schema,
) -> Wording {
    let (name, parent) = (node.name(), parent.name());
    let mut text = format!("<{name}> is not allowed in <{parent}>, expected {expected}");
    if suggestion.is_none() {
        text += &homes(name, schema);
    }
    Wording::from(text).suggesting(suggestion)
}

/// Returns "; it belongs in <a>" for a name that the schema knows elsewhere.
fn homes(name: &str, schema: &Schema) -> String {
    let Some(id) = schema.names.find(name) else {
        return String::new();
    };
    let found = schema.parents_of(id);
    if found.is_empty() {
        String::new()
    } else {
        format!("; it belongs in {}", elements(&found))
    }
}

pub(super) fn missing_children(
    node: Node<'_>,
    skipped: &[NameId],
    expected: &[NameId],
    schema: &Schema,
) -> Wording {
    let names = texts(expected.iter().copied(), schema);
    let needed = texts(skipped.iter().copied(), schema);
    let defect = defects::missing_child(node, &needed, &schema.title);
    if needed.is_empty() {
        let list = elements(&names);
        return format!("<{}> is incomplete, expected next: {list}", node.name()).into();
    }
    let there = match &*needed {
        [one] => node.children_named(one).count(),
        _ => 0,
    };
    let text = match there {
        0 => format!("<{}> lacks {}", node.name(), elements(&needed)),
        _ => format!(
            "<{}> has {there} {}, but needs more",
            node.name(),
            elements(&needed)
        ),
    };
    Wording::from(text).excused(defect)
}

pub(super) fn invalid_value(
    node: Node<'_>,
    attribute: Attribute<'_>,
    declared: &AttributeUse,
    ty: &SimpleType,
    schema: &Schema,
) -> Wording {
    let value = attribute.value();
    let mut expectation = ty.expectation(schema);
    if let Some(fixed) = &declared.fixed {
        expectation.values = vec![fixed.to_string()];
        expectation.words.clear();
    }
    let subject = format!("{}={} of <{}>", attribute.name(), quote(value), node.name());
    let hint = foreign_to_expressions(value, &expectation.words);
    let wording = invalid(&subject, value, &expectation, &hint);
    match expectation.is_number() {
        true => wording.about(Detail::Number),
        false => wording,
    }
}

fn invalid(subject: &str, value: &str, expectation: &Expectation, hint: &str) -> Wording {
    let suggestion = closest(value.trim(), expectation.values.iter().map(String::as_str));
    let expected = expectation.sentence();
    let text = format!("{subject} is invalid; it must be {expected}{hint}");
    Wording::from(text).suggesting(suggestion)
}

/// Returns the reason why an intended expression of OpenSCENARIO is invalid.
fn foreign_to_expressions(value: &str, expected: &[String]) -> String {
    let takes_one = expected.iter().any(|words| words.starts_with(EXPRESSION));
    let inner = value.strip_prefix("${").filter(|_| takes_one);
    let Some(inner) = inner.map(|inner| inner.strip_suffix('}').unwrap_or(inner)) else {
        return String::new();
    };
    let admitted = |c: char| c.is_ascii_alphanumeric() || " _+-*/%$().,".contains(c);
    match inner.chars().find(|c| !admitted(*c)) {
        Some(sign) => format!(
            "; {} is not allowed in expressions, which consist of numbers, words, parameters and the signs + - * \
             / % ( ) ,",
            quote(&sign.to_string())
        ),
        None => String::new(),
    }
}

pub(super) fn invalid_text(
    node: Node<'_>,
    value: &str,
    ty: &SimpleType,
    schema: &Schema,
) -> Wording {
    let subject = format!("the text {} of <{}>", quote(value), node.name());
    invalid(&subject, value, &ty.expectation(schema), "")
}

/// Checks whether `written` is the beginning of `name`: `from` of `fromLane`.
pub(super) fn is_short_for(written: &str, name: &str) -> bool {
    written.len() >= 2 && name.starts_with(written)
}

/// Checks whether `name` is `written` without some letters: `hdg` of `heading`, `curvStart` of
/// `curvatureStart`.
pub(super) fn is_abbreviation(name: &str, written: &str) -> bool {
    let mut letters = written.chars();
    let mut wanted = name.chars();
    name.len() >= 3
        && wanted.next() == letters.next()
        && wanted.all(|one| letters.any(|letter| letter == one))
}

/// Maximum number of attributes examined to find the unused ones.
pub(super) const MAX_ATTRIBUTES: usize = 64;

pub(super) fn unexpected_attribute(
    node: Node<'_>,
    attribute: Attribute<'_>,
    declared: &[AttributeUse],
    schema: &Schema,
) -> Wording {
    // More attributes are not a typing error, and this may run for each of them.
    let used = |name: &str| {
        let mut some = node.attributes().take(MAX_ATTRIBUTES);
        some.any(|one| {
            steps(1);
            one.name() == name
        })
    };
    let names = declared.iter().map(|one| schema.names.text(one.name));
    let free: Vec<&str> = names.filter(|name| !used(name)).collect();
    let text = format!(
        "{} defines no attribute `{}` for `{}`",
        schema.title,
        attribute.name(),
        node.name()
    );
    let suggestion = closest(attribute.name(), free.iter().copied());
    let longer = || {
        free.iter()
            .find(|name| is_short_for(attribute.name(), name))
    };
    let shorter = || {
        free.iter()
            .find(|name| is_abbreviation(name, attribute.name()))
    };
    let suggestion = suggestion.or_else(|| longer().or_else(shorter).copied());
    let list = match (&suggestion, free.as_slice()) {
        (Some(_), _) => String::new(),
        (None, []) if declared.is_empty() => ", which has no attributes".to_owned(),
        (None, []) => format!("; its only attributes are {}", names_of(declared, schema)),
        (None, free) => {
            let free: Vec<String> = free.iter().map(|name| format!("`{name}`")).collect();
            format!("; further allowed attributes are {}", free.join(", "))
        }
    };
    Wording::from(text + &list).suggesting(suggestion)
}

/// Returns the allowed attributes of an element. A long list is cut.
fn names_of(declared: &[AttributeUse], schema: &Schema) -> String {
    const SHOWN: usize = 8;
    let names = declared.iter().map(|one| schema.names.text(one.name));
    let list: Vec<&str> = names.take(SHOWN).collect();
    match declared.len().saturating_sub(SHOWN) {
        0 => list.join(", "),
        more => format!("{}, {more} more", list.join(", ")),
    }
}

/// Reports an attribute such as `xsi:type` with a prefix that has another meaning or none.
pub(super) fn unbound_prefix(node: Node<'_>, attribute: Attribute<'_>, prefix: &str) -> Wording {
    let (name, of) = (attribute.name(), node.name());
    format!("{name} of <{of}> has no meaning: xmlns:{prefix} must be \"{XSI}\"").into()
}

pub(super) fn missing_attribute(
    node: Node<'_>,
    declared: &AttributeUse,
    schema: &Schema,
) -> Wording {
    let name = schema.names.text(declared.name);
    let ty = schema.simple.get(declared.value as usize);
    let value = ty
        .map(|ty| ty.expectation(schema).sentence())
        .unwrap_or_default();
    let text = format!(
        "<{}> lacks the attribute {name}, which must be {value}",
        node.name()
    );
    Wording::from(text).about(Detail::Missing(name.to_owned()))
}

pub(super) fn unexpected_text(node: Node<'_>, text: &str) -> Wording {
    let text = text.trim_matches(XML_SPACE);
    // Some editors insert spaces that are no white space in XML. In quotes they would be invisible.
    let invisible = text.chars().next().filter(|_| text.trim().is_empty());
    let shown = match invisible {
        Some(c) => format!("the invisible character U+{:04X}", u32::from(c)),
        None => quote(text),
    };
    format!(
        "<{}> may not contain text, but contains {shown}",
        node.name()
    )
    .into()
}

pub(super) fn blank_text(node: Node<'_>) -> Wording {
    let name = node.name();
    format!("<{name}> must be empty, but contains white space between its tags").into()
}

pub(super) fn no_type(
    node: Node<'_>,
    declared: &ElementDecl,
    undecided: bool,
    schema: &Schema,
) -> Wording {
    let tests = declared
        .alternatives
        .iter()
        .filter_map(|one| one.test.as_ref());
    let tests: Vec<String> = tests.map(|test| test.xpath(&schema.names)).collect();
    let name = node.name();
    let text = if undecided && !tests.is_empty() {
        format!(
            "the allowed content of <{name}> is undefined; one of these conditions must hold: {}",
            tests.join(", ")
        )
    } else {
        format!("the schema defines only an abstract type for <{name}>")
    };
    text.into()
}

pub(super) fn bad_xsi_type(node: Node<'_>, written: &str) -> Wording {
    let (name, written) = (node.name(), quote(written));
    format!("xsi:type names {written}, which is not a valid type for <{name}>").into()
}

pub(super) fn condition_failed(node: Node<'_>, assertion: &Assertion, schema: &Schema) -> Wording {
    let condition = assertion.notation(&schema.names);
    let known = defects::condition(node, &condition);
    let text = match defects::explanation(node, &condition) {
        Some(words) => format!("<{}> is invalid: {words}", node.name()),
        None => format!(
            "<{}> breaks a condition of its type: {}",
            node.name(),
            assertion.xpath(&schema.names)
        ),
    };
    Wording::from(text).excused(known)
}

pub(super) fn duplicate(attribute: Attribute<'_>, key: &str) -> Wording {
    let (name, value) = (attribute.name(), quote(attribute.value()));
    let of = attribute.node().name();
    format!("{name} {value} of <{of}> occurs twice, but must be unique (key {key})").into()
}

pub(super) fn missing_key(node: Node<'_>, field: &str, key: &str) -> Wording {
    let name = node.name();
    format!("<{name}> needs the attribute {field}, which identifies it (key {key})").into()
}

pub(super) fn dangling(
    attribute: Attribute<'_>,
    key: Option<&Constraint>,
    schema: &Schema,
) -> Wording {
    let targets = key.iter().flat_map(|key| &key.paths);
    let targets = targets.filter_map(|path| match path.last()? {
        Step::Child(name) => Some(*name),
        Step::Any => None,
    });
    let what = match texts(targets, schema) {
        none if none.is_empty() => "element".to_owned(),
        names => format!("<{}>", names.join("> or <")),
    };
    let field = key.map_or("key", |key| schema.names.text(key.field));
    let (name, value) = (attribute.name(), quote(attribute.value()));
    let of = attribute.node().name();
    format!("{name} {value} of <{of}> is not defined: no {what} has it as its {field}").into()
}
