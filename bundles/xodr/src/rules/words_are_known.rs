use qcbus_document::{Document, Node};
use qcbus_opendrive::is_user_data;
use qcbus_sdk::{Rule, Sink};

use crate::families::object_parts::listed;
use crate::families::own_schema::OwnSchema;
use crate::families::vocabularies::{VOCABULARIES, Vocabulary};

pub static RULE: Rule<Document> = Rule {
    id: "check_qcbus_xodr_words_are_known",
    uids: &["qcbus.dev:xodr:1.0.0:words.are_known"],
    after: super::READABLE,
    page: include_str!("words_are_known.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
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
    // An empty word is none.
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
        "`{}` of this `{}` is `{word}`, which no version of OpenDRIVE knows; the words are {}",
        attribute.name(),
        node.name(),
        listed(vocabulary.words)
    );
    found.issue(attribute, text).level(vocabulary.level);
}

/// What a link to a junction says of an end of a road is not read.
fn is_idle(node: Node<'_>, vocabulary: &Vocabulary) -> bool {
    vocabulary.attribute == "contactPoint" && node.attr("elementType") == Some("junction")
}
