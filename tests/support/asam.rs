//! Describes ASAM's result file element by element, as its schema does. The output is therefore
//! compared with more than the project's own reader.

use roxmltree::{Document, Node};

/// One element of the format.
struct Shape {
    name: &'static str,
    /// Required attributes.
    required: &'static [&'static str],
    /// Optional attributes.
    optional: &'static [&'static str],
    /// Children in their required order.
    children: &'static [&'static str],
    /// Whether the order of the children is free.
    any_order: bool,
}

const fn shape(name: &'static str, required: &'static [&'static str]) -> Shape {
    Shape {
        name,
        required,
        optional: &[],
        children: &[],
        any_order: false,
    }
}

const SHAPES: &[Shape] = &[
    Shape {
        children: &["CheckerBundle"],
        ..shape("CheckerResults", &["version"])
    },
    Shape {
        children: &["Param", "Checker"],
        ..shape(
            "CheckerBundle",
            &["build_date", "description", "name", "summary", "version"],
        )
    },
    shape("Param", &["name", "value"]),
    Shape {
        children: &["Param", "Issue", "AddressedRule", "Metadata"],
        ..shape(
            "Checker",
            &["checkerId", "description", "status", "summary"],
        )
    },
    shape("AddressedRule", &["ruleUID"]),
    shape("Metadata", &["key", "value", "description"]),
    Shape {
        children: &["Locations", "DomainSpecificInfo"],
        ..shape("Issue", &["issueId", "description", "level", "ruleUID"])
    },
    Shape {
        children: &[
            "FileLocation",
            "XMLLocation",
            "InertialLocation",
            "TimeLocation",
            "MessageLocation",
        ],
        any_order: true,
        ..shape("Locations", &["description"])
    },
    Shape {
        optional: &["row", "column", "offset"],
        ..shape("FileLocation", &[])
    },
    shape("XMLLocation", &["xpath"]),
    shape("InertialLocation", &["x", "y", "z"]),
    shape("TimeLocation", &["time"]),
    Shape {
        optional: &["channel", "field", "time"],
        ..shape("MessageLocation", &["index"])
    },
];

/// Returns all violations of ASAM's current schema and readers in a result file.
pub fn complaints(text: &str) -> Vec<String> {
    let document = match Document::parse(text) {
        Ok(document) => document,
        Err(error) => return vec![format!("not well-formed: {error}")],
    };
    let mut found = Vec::new();
    if document.root_element().tag_name().name() != "CheckerResults" {
        found.push("the root is no CheckerResults".to_owned());
    }
    element(document.root_element(), &mut found);
    for (expected, issue) in all(&document, "Issue").enumerate() {
        if issue.attribute("issueId") != Some(&expected.to_string()) {
            found.push(format!(
                "issue {expected} has the id {:?}",
                issue.attribute("issueId")
            ));
        }
    }
    for bundle in all(&document, "CheckerBundle") {
        unique(bundle, "Checker", "checkerId", &mut found);
    }
    unique(document.root_element(), "CheckerBundle", "name", &mut found);
    found
}

fn all<'a>(document: &'a Document<'_>, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    document
        .descendants()
        .filter(move |node| node.has_tag_name(name))
}

fn element(node: Node<'_, '_>, found: &mut Vec<String>) {
    let name = node.tag_name().name();
    let shape = match SHAPES.iter().find(|shape| shape.name == name) {
        Some(shape) => shape,
        // The content of this element is private to its author.
        None if name == "DomainSpecificInfo" => {
            if node.attribute("name").is_none() {
                found.push("DomainSpecificInfo without a name".to_owned());
            }
            return;
        }
        None => return found.push(format!("there is no element {name}")),
    };
    attributes(node, shape, found);
    values(node, found);
    let mut last = 0;
    for child in node.children().filter(Node::is_element) {
        let name = child.tag_name().name();
        match shape.children.iter().position(|it| *it == name) {
            None => found.push(format!("{name} in {}", shape.name)),
            Some(rank) if rank < last && !shape.any_order => {
                found.push(format!("{name} comes too late in {}", shape.name));
            }
            Some(rank) => last = rank,
        }
        element(child, found);
    }
    let text = node
        .children()
        .filter(Node::is_text)
        .filter_map(|text| text.text());
    if text.into_iter().any(|text| !text.trim().is_empty()) {
        found.push(format!("text in {name}"));
    }
}

fn attributes(node: Node<'_, '_>, shape: &Shape, found: &mut Vec<String>) {
    for required in shape.required {
        if node.attribute(*required).is_none() {
            found.push(format!("{} without {required}", shape.name));
        }
    }
    for attribute in node.attributes() {
        let name = attribute.name();
        if !shape.required.contains(&name) && !shape.optional.contains(&name) {
            found.push(format!("{} with {name}", shape.name));
        }
    }
}

fn values(node: Node<'_, '_>, found: &mut Vec<String>) {
    for attribute in node.attributes() {
        let (name, value) = (attribute.name(), attribute.value());
        let good = match name {
            "status" => ["completed", "skipped", "error"].contains(&value),
            "level" => ["1", "2", "3"].contains(&value),
            "row" | "column" => value.parse::<u32>().is_ok_and(|it| it >= 1),
            "offset" | "index" | "issueId" => value.parse::<u64>().is_ok(),
            "x" | "y" | "z" | "time" => value.parse::<f64>().is_ok_and(f64::is_finite),
            "ruleUID" => is_rule_uid(value),
            "xpath" => value.starts_with('/'),
            _ => true,
        };
        if !good {
            found.push(format!("{}: {name}={value:?}", node.tag_name().name()));
        }
    }
    match node.tag_name().name() {
        "FileLocation" if node.attributes().len() == 0 => {
            found.push("a FileLocation says nothing".into());
        }
        "Locations" if !node.has_children() => found.push("Locations without a location".into()),
        "Checker" => checker(node, found),
        _ => {}
    }
}

/// Checks the requirements of ASAM's reader beyond its schema.
fn checker(node: Node<'_, '_>, found: &mut Vec<String>) {
    let children = |name| node.children().filter(move |it| it.has_tag_name(name));
    let id = node.attribute("checkerId").unwrap_or_default();
    if node.attribute("status") == Some("skipped") && children("Issue").next().is_some() {
        found.push(format!("{id} was skipped and has issues"));
    }
    for issue in children("Issue") {
        let uid = issue.attribute("ruleUID");
        if !children("AddressedRule").any(|rule| rule.attribute("ruleUID") == uid) {
            found.push(format!(
                "{id} has an issue of {uid:?}, which it does not address"
            ));
        }
    }
    unique(node, "AddressedRule", "ruleUID", found);
}

fn unique(node: Node<'_, '_>, name: &str, attribute: &str, found: &mut Vec<String>) {
    let mut seen = std::collections::BTreeSet::new();
    for child in node.children().filter(|child| child.has_tag_name(name)) {
        if !seen.insert(child.attribute(attribute)) {
            found.push(format!(
                "two {name} with {attribute} {:?}",
                child.attribute(attribute)
            ));
        }
    }
}

/// Checks the form `entity:standard:x.y.z:set.name`. Sets may be nested.
fn is_rule_uid(uid: &str) -> bool {
    let parts: Vec<&str> = uid.split(':').collect();
    let [entity, standard, version, name] = parts[..] else {
        return false;
    };
    let word = |text: &str, more: &str| {
        !text.is_empty()
            && text
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || more.contains(c))
    };
    let numbers: Vec<&str> = version.split('.').collect();
    entity.split('.').count() >= 2
        && entity.split('.').all(|it| word(it, "-"))
        && word(standard, "")
        && numbers.len() == 3
        && numbers.iter().all(|it| it.parse::<u32>().is_ok())
        && name.split('.').count() >= 2
        && name.split('.').all(|it| word(it, "_"))
}
