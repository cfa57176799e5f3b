use crate::families::object_parts::listed;
use crate::families::own_schema::OwnSchema;
use crate::families::vocabularies::{VOCABULARIES, Vocabulary};
use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    versions: "..1.7.0",
    run,
    ..Rule::after(READABLE)
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    // The schemas of these versions list all of these words, as those from 1.7 on do.
    let lists_all = [(1, 4), (1, 5)].map(|(major, minor)| Version::new(major, minor));
    if found
        .version()
        .is_some_and(|version| lists_all.contains(&version))
    {
        return;
    }
    let schema = OwnSchema::new(*document);
    for vocabulary in VOCABULARIES {
        for name in vocabulary.elements {
            for node in document.elements(name) {
                check(vocabulary, node, &schema, found);
            }
        }
    }
}

fn check(vocabulary: &Vocabulary, node: Node<'_>, schema: &OwnSchema<'_>, found: &mut Sink<'_>) {
    let Some(attribute) = node.attribute(vocabulary.attribute) else {
        return;
    };
    let word = attribute.value().trim();
    // An empty word counts as missing.
    if word.is_empty() || vocabulary.words.contains(&word) {
        return;
    }
    let is_there = |parent: Node<'_>| vocabulary.parents.iter().any(|name| parent.is(name));
    if !node.parent().is_some_and(is_there) || is_user_data(node) || is_idle(node, vocabulary) {
        return;
    }
    if schema.lists(attribute) {
        return;
    }
    let text = format!(
        "`{}` of this `{}` is `{word}`, which no version of OpenDRIVE defines; the allowed values are {}",
        attribute.name(),
        node.name(),
        listed(vocabulary.words)
    );
    found.issue(attribute, text).level(vocabulary.level);
}

/// Checks whether a contact point is ignored because the link leads to a junction.
fn is_idle(node: Node<'_>, vocabulary: &Vocabulary) -> bool {
    vocabulary.attribute == "contactPoint" && node.attr("elementType") == Some("junction")
}
