//! Texts of violations: the value found, the expected value and a suggestion.

use qcbus_document::{Attribute, Node};

use super::memo::Memo;
use super::types::XSI;
use crate::assertion::Assertion;
use crate::constraint::{Constraint, Step};
use crate::defects;
use crate::model::{AttributeUse, ElementDecl, Model, Schema};
use crate::names::NameId;
use crate::similar::closest;
use crate::simple::{EXPRESSION, SimpleType};
use crate::work::steps;

/// A violation without its position.
#[derive(Debug, Default)]
pub(super) struct Wording {
    pub(super) found: String,
    pub(super) expected: Vec<String>,
    pub(super) suggestion: Option<String>,
    pub(super) defect: Option<&'static str>,
    pub(super) text: String,
}

impl Wording {
    fn new(found: &str, text: String) -> Self {
        Self {
            found: found.to_owned(),
            text,
            ..Self::default()
        }
    }

    fn expecting(mut self, expected: Vec<String>) -> Self {
        self.expected = expected;
        self
    }

    fn suggesting(mut self, suggestion: Option<&str>) -> Self {
        if let Some(meant) = suggestion {
            self.text += &format!("; did you mean \"{meant}\"?");
            self.suggestion = Some(meant.to_owned());
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

fn elements(names: &[String]) -> String {
    const SHOWN: usize = 12;
    let mut list: Vec<String> = names
        .iter()
        .take(SHOWN)
        .map(|name| format!("<{name}>"))
        .collect();
    if names.len() > SHOWN {
        list.push(format!("{} more", names.len() - SHOWN));
    }
    list.join(", ")
}

fn texts(names: impl Iterator<Item = NameId>, schema: &Schema) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for name in names {
        let text = schema.names.text(name);
        if !all.iter().any(|have| have == text) {
            all.push(text.to_owned());
        }
    }
    all
}

/// Returns the text "expected <a> or the end of <b>".
fn expected_here(
    model: &Model,
    state: u16,
    parent: Node<'_>,
    schema: &Schema,
) -> (Vec<String>, String) {
    let names = texts(model.edges(state).iter().map(|edge| edge.name), schema);
    let may_end = model
        .states
        .get(usize::from(state))
        .is_some_and(|row| row.accepts);
    let end = format!("the end of <{}>", parent.name());
    let words = match (names.is_empty(), may_end) {
        (true, _) => end,
        (false, true) => format!("{} or {end}", elements(&names)),
        (false, false) => elements(&names),
    };
    (names, words)
}

pub(super) fn unknown_root(root: Node<'_>, known: &[&str], title: &str) -> Wording {
    let names: Vec<String> = known.iter().map(|name| (*name).to_owned()).collect();
    let text = format!(
        "the root element <{}> is not defined in {title}; expected {}",
        root.name(),
        elements(&names)
    );
    Wording::new(root.name(), text)
        .expecting(names)
        .suggesting(closest(root.name(), known.iter().copied()))
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
    Wording::new(node.name(), text).expecting(vec![limit])
}

pub(super) fn no_children(node: Node<'_>, parent: Node<'_>, title: &str) -> Wording {
    Wording::new(
        node.name(),
        format!(
            "<{}> may not contain elements, but contains <{}>",
            parent.name(),
            node.name()
        ),
    )
    .excused(defects::children_of_none(parent, title))
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
    let text = if comes_later() {
        format!("<{name}> in <{parent_name}> comes too early: {list} must come before it")
    } else {
        format!("<{parent_name}> lacks {list}, which must come before <{name}>")
    };
    Wording::new(node.name(), text)
        .expecting(names)
        .excused(defect)
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
    let (expected, words) = expected_here(model, state, parent, schema);
    let (name, parent_name) = (node.name(), parent.name());
    let text = match obstacle(node, parent, model, schema, memo) {
        Some(Obstacle::Before(later)) => {
            format!("<{name}> in <{parent_name}> comes too late: it must come before <{later}>")
        }
        Some(Obstacle::Instead(other)) => format!(
            "<{name}> cannot occur together with <{other}>: <{parent_name}> takes one or the other"
        ),
        None => format!(
            "<{name}> may occur in <{parent_name}>, but not here: children have a fixed order, expected here: {words}"
        ),
    };
    Wording::new(name, text)
        .expecting(expected)
        .excused(defects::misplaced_child(node, parent, &schema.title))
}

pub(super) fn unexpected_child(
    node: Node<'_>,
    parent: Node<'_>,
    model: &Model,
    state: u16,
    suggestion: Option<&str>,
    schema: &Schema,
) -> Wording {
    let (expected, words) = expected_here(model, state, parent, schema);
    let text = format!(
        "<{}> has no child <{}>, expected here: {words}",
        parent.name(),
        node.name()
    );
    let home = if suggestion.is_none() {
        homes(node.name(), schema)
    } else {
        String::new()
    };
    Wording::new(node.name(), text + &home)
        .expecting(expected)
        .suggesting(suggestion)
}

pub(super) fn unexpected_member(
    node: Node<'_>,
    parent: Node<'_>,
    members: &[ElementDecl],
    suggestion: Option<&str>,
    schema: &Schema,
) -> Wording {
    let names = texts(members.iter().map(|member| member.name), schema);
    let list = elements(&names);
    let text = format!(
        "<{}> has no child <{}>, expected in any order: {list}",
        parent.name(),
        node.name()
    );
    let home = if suggestion.is_none() {
        homes(node.name(), schema)
    } else {
        String::new()
    };
    Wording::new(node.name(), text + &home)
        .expecting(names)
        .suggesting(suggestion)
}

/// Returns "; it belongs in <a>" for a name that the schema knows elsewhere.
fn homes(name: &str, schema: &Schema) -> String {
    let Some(id) = schema.names.find(name) else {
        return String::new();
    };
    let found: Vec<String> = schema
        .parents_of(id)
        .into_iter()
        .map(str::to_owned)
        .collect();
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
        let text = format!("<{}> is incomplete, expected next: {list}", node.name());
        return Wording::new("", text).expecting(names);
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
    Wording::new("", text).expecting(needed).excused(defect)
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
    let suggestion =
        closest(value.trim(), expectation.values.iter().map(String::as_str)).map(str::to_owned);
    let text = format!(
        "{}={} of <{}> is invalid; it must be {}{}",
        attribute.name(),
        quote(value),
        node.name(),
        expectation.sentence(),
        foreign_to_expressions(value, &expectation.words)
    );
    let mut expected = expectation.values;
    expected.extend(expectation.words);
    Wording::new(value, text)
        .expecting(expected)
        .suggesting(suggestion.as_deref())
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
    let expectation = ty.expectation(schema);
    let suggestion =
        closest(value.trim(), expectation.values.iter().map(String::as_str)).map(str::to_owned);
    let text = format!(
        "the text {} of <{}> is invalid; it must be {}",
        quote(value),
        node.name(),
        expectation.sentence()
    );
    let mut expected = expectation.values;
    expected.extend(expectation.words);
    Wording::new(value, text)
        .expecting(expected)
        .suggesting(suggestion.as_deref())
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
    let free = declared
        .iter()
        .map(|one| schema.names.text(one.name))
        .filter(|name| !used(name));
    let free: Vec<String> = free.map(str::to_owned).collect();
    let text = format!(
        "{} defines no attribute `{}` for `{}`",
        schema.title,
        attribute.name(),
        node.name()
    );
    let suggestion = closest(attribute.name(), free.iter().map(String::as_str)).map(str::to_owned);
    let longer = || {
        free.iter()
            .find(|name| is_short_for(attribute.name(), name))
            .cloned()
    };
    let shorter = || {
        free.iter()
            .find(|name| is_abbreviation(name, attribute.name()))
            .cloned()
    };
    let suggestion = suggestion.or_else(longer).or_else(shorter);
    let list = match (&suggestion, free.as_slice()) {
        (Some(_), _) => String::new(),
        (None, []) if declared.is_empty() => ", which has no attributes".to_owned(),
        (None, []) => format!("; its only attributes are {}", names_of(declared, schema)),
        (None, free) => {
            let free: Vec<String> = free.iter().map(|name| format!("`{name}`")).collect();
            format!("; further allowed attributes are {}", free.join(", "))
        }
    };
    Wording::new(attribute.name(), text + &list)
        .expecting(free)
        .suggesting(suggestion.as_deref())
}

/// Returns the allowed attributes of an element. A long list is cut.
fn names_of(declared: &[AttributeUse], schema: &Schema) -> String {
    const SHOWN: usize = 8;
    let names = declared.iter().map(|one| schema.names.text(one.name));
    let mut list: Vec<String> = names.take(SHOWN).map(str::to_owned).collect();
    if let Some(more) = declared.len().checked_sub(SHOWN).filter(|more| *more > 0) {
        list.push(format!("{more} more"));
    }
    list.join(", ")
}

/// Reports an attribute such as `xsi:type` with a prefix that has another meaning or none.
pub(super) fn unbound_prefix(node: Node<'_>, attribute: Attribute<'_>, prefix: &str) -> Wording {
    let text = format!(
        "{} of <{}> has no meaning: xmlns:{prefix} must be \"{XSI}\"",
        attribute.name(),
        node.name()
    );
    Wording::new(attribute.name(), text).expecting(vec![XSI.to_owned()])
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
    Wording::new("", text).expecting(vec![name.to_owned()])
}

pub(super) fn unexpected_text(node: Node<'_>, text: &str) -> Wording {
    let trimmed = text.trim();
    Wording::new(
        trimmed,
        format!(
            "<{}> may not contain text, but contains {}",
            node.name(),
            quote(trimmed)
        ),
    )
}

pub(super) fn blank_text(node: Node<'_>) -> Wording {
    Wording::new(
        "",
        format!(
            "<{}> must be empty, but contains white space between its tags",
            node.name()
        ),
    )
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
    let tests: Vec<String> = tests.map(|test| test.notation(&schema.names)).collect();
    let text = if undecided && !tests.is_empty() {
        format!(
            "the allowed content of <{}> is undefined; one of these conditions must hold: {}",
            node.name(),
            tests.join(", ")
        )
    } else {
        format!(
            "the schema defines only an abstract type for <{}>",
            node.name()
        )
    };
    Wording::new("", text).expecting(tests)
}

pub(super) fn bad_xsi_type(node: Node<'_>, written: &str) -> Wording {
    Wording::new(
        written,
        format!(
            "xsi:type names {}, which is not a valid type for <{}>",
            quote(written),
            node.name()
        ),
    )
}

pub(super) fn condition_failed(node: Node<'_>, assertion: &Assertion, schema: &Schema) -> Wording {
    let condition = assertion.notation(&schema.names);
    let known = defects::condition(node, &condition);
    let text = match defects::explanation(node, &condition) {
        Some(words) => format!("<{}> is invalid: {words}", node.name()),
        None => format!(
            "<{}> breaks a condition of its type: {condition}",
            node.name()
        ),
    };
    Wording::new("", text)
        .expecting(vec![condition])
        .excused(known)
}

pub(super) fn duplicate(attribute: Attribute<'_>, key: &str) -> Wording {
    let text = format!(
        "{} {} of <{}> occurs twice, but must be unique (key {key})",
        attribute.name(),
        quote(attribute.value()),
        attribute.node().name()
    );
    Wording::new(attribute.value(), text)
}

pub(super) fn missing_key(node: Node<'_>, field: &str, key: &str) -> Wording {
    let text = format!(
        "<{}> needs the attribute {field}, which identifies it (key {key})",
        node.name()
    );
    Wording::new("", text).expecting(vec![field.to_owned()])
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
    let targets: Vec<String> = texts(targets, schema)
        .iter()
        .map(|name| format!("<{name}>"))
        .collect();
    let what = if targets.is_empty() {
        "element".to_owned()
    } else {
        targets.join(" or ")
    };
    let field = key.map_or("key", |key| schema.names.text(key.field));
    let text = format!(
        "{} {} of <{}> is not defined: no {what} has it as its {field}",
        attribute.name(),
        quote(attribute.value()),
        attribute.node().name()
    );
    Wording::new(attribute.value(), text)
}
