use crate::families::ids::{KINDS, Kind, Scope};
use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Document> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    for kind in KINDS {
        check(kind, document, found);
    }
}

fn check<'d>(kind: &Kind, document: &Document<'d>, found: &mut Sink<'_>) {
    let mut exact: HashMap<(Option<Node<'d>>, &str), Node<'d>> = HashMap::default();
    let mut numeric: HashMap<u64, Node<'d>> = HashMap::default();
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
            found
                .issue(node, text)
                .at(*first, format!("the first {} with this id", kind.name));
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
