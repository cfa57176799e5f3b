use crate::families::ids::{KINDS, Kind, Scope};
use crate::prelude::*;
use foldhash::{HashMap, HashSet};
use qcbus_sdk::{fault_of, fault_of_attribute};
use std::cell::OnceCell;

pub const RULE: Rule<Document> = Rule {
    readers: Some(Readers::by_case(
        "readers suffer from a signal or object whose id occurs twice only where something refers to it",
    )),
    versions: "1.1.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    for kind in KINDS {
        check(kind, document, found);
    }
}

/// Returns the ids of all signals and objects that something refers to.
fn used<'d>(document: &Document<'d>) -> HashSet<&'d str> {
    const REFERENCES: [(&str, &str); 5] = [
        ("signalReference", "id"),
        ("objectReference", "id"),
        ("control", "signalId"),
        ("dependency", "id"),
        ("reference", "elementId"),
    ];
    let ids = REFERENCES.into_iter().flat_map(|(element, attribute)| {
        let elements = document.elements(element);
        elements.filter_map(move |node| node.attr(attribute))
    });
    ids.collect()
}

fn check<'d>(kind: &Kind, document: &Document<'d>, found: &mut Sink<'_>) {
    let mut exact: HashMap<(Option<Node<'d>>, &str), Node<'d>> = HashMap::default();
    let mut numeric: HashMap<u64, Node<'d>> = HashMap::default();
    let used_ids = OnceCell::new();
    for node in kind.nodes(document) {
        // An empty id does not count as an id. Another rule reports it.
        let given = node.attr("id").filter(|id| !id.trim().is_empty());
        let Some(id) = given else { continue };
        let place = Place::attribute_or_node(node, "id");
        let home = kind.home(node);
        if let Some(first) = exact.get(&(home, id)) {
            let whole = home.map_or("this file", |_| "the same parent");
            let text = format!(
                "the id `{id}` is already used by another {} of {whole}; each needs its own id",
                kind.name
            );
            let finding = found
                .issue(node, text)
                .at(*first, format!("the first {} with this id", kind.name))
                .fault(format!("id of {}", fault_of(*first)))
                .fault(fault_of_attribute(node, "id"));
            // Readers place each signal and object. Only a reference to it would be ambiguous.
            let beside = ["signal", "object"].contains(&kind.name);
            if beside && !used_ids.get_or_init(|| used(document)).contains(id) {
                finding.readers_level(Level::Warning);
            }
            continue;
        }
        exact.insert((home, id), node);
        if let (Scope::File, Ok(number)) = (kind.scope, id.parse()) {
            match numeric.get(&number) {
                Some(like) => {
                    let other = like.attr("id").unwrap_or_default();
                    let text = format!(
                        "the {name} ids `{id}` and `{other}` differ as text but are the same number; readers \
                         that parse ids as numbers confuse them",
                        name = kind.name
                    );
                    found
                        .issue(place, text)
                        .level(Level::Information)
                        .at(*like, "the other one");
                }
                None => _ = numeric.insert(number, node),
            }
        }
    }
}
