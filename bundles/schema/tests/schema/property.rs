//! Checks that documents made from the tables are valid, and that a violating edit is always found.

use crate::support::{image, name_of, open};
use proptest::prelude::*;
use qcbus_document::{Document, Node};
use qcbus_schema::generate::{Dice, document};
use qcbus_schema::{Limits, SHIPPED, Schema};

proptest! {
    #![proptest_config(ProptestConfig { cases: 240, ..ProptestConfig::default() })]

    #[test]
    fn generated_document_is_valid_and_single_edit_is_found(which in 0..SHIPPED.len(), seed in 0..u64::from(u32::MAX)) {
        let shipped = &SHIPPED[which];
        let schema = shipped.schema().expect("the table is valid");
        let name = format!("made.{}", &name_of(shipped)[..4]);
        let text = document(schema, 0, seed, 120).expect("a document");
        let bytes = image(&name, &text);
        let sound = open(&bytes);
        let report = schema.validate(&sound, Limits::default());
        prop_assert!(report.is_valid(), "{:?}\n{text}", report.violations.first().map(|one| &one.text));

        let (broken, what) = violate(&sound, &text, &mut Dice::new(seed));
        let bytes = image(&name, &broken);
        let found = schema.validate(&open(&bytes), Limits::default());
        prop_assert!(!found.is_valid(), "{what} must be found in\n{broken}");
    }
}

/// Breaks the document in one place with an edit that no shipped schema allows.
fn violate(document: &Document<'_>, text: &str, dice: &mut Dice) -> (String, String) {
    let nodes: Vec<Node<'_>> = (0..document.len())
        .filter_map(|index| document.node(index))
        .filter(checked)
        .collect();
    let node = nodes[dice.below(nodes.len())];
    let after_name = node.offset() as usize + 1 + node.name().len();
    let insert = |at: usize, what: &str| format!("{}{what}{}", &text[..at], &text[at..]);
    match dice.below(4) {
        0 => (
            insert(after_name, " qcbusUnknown=\"1\""),
            format!("an unknown attribute of {}", node.name()),
        ),
        1 => {
            let end = node.end_offset() as usize;
            let at = if text[..end].ends_with("/>") {
                return (
                    opened(text, end, node, "<qcbusUnknown/>"),
                    "an unknown child".into(),
                );
            } else {
                end - node.name().len() - 3
            };
            (
                insert(at, "<qcbusUnknown/>"),
                format!("an unknown child of {}", node.name()),
            )
        }
        2 => {
            let renamed = insert(after_name, "Qcbus");
            let end = node.end_offset() as usize + 5;
            let closing = format!("</{}>", node.name());
            let at = end - 1;
            if renamed[..end].ends_with(&closing) {
                return (
                    format!("{}Qcbus{}", &renamed[..at], &renamed[at..]),
                    format!("{} renamed", node.name()),
                );
            }
            (renamed, format!("{} renamed", node.name()))
        }
        _ => {
            let root = nodes[0];
            let at = root.offset() as usize + 1 + root.name().len();
            (
                insert(at, " qcbusUnknown=\"1\""),
                "an unknown attribute of the root".into(),
            )
        }
    }
}

/// Returns whether the schema checks an element. `any` allows everything below `userData`.
fn checked(node: &Node<'_>) -> bool {
    node.is_element() && !node.ancestors().any(|above| above.is("userData")) && !node.is("userData")
}

/// Opens an empty element and inserts content.
fn opened(text: &str, end: usize, node: Node<'_>, what: &str) -> String {
    format!(
        "{}>{what}</{}>{}",
        &text[..end - 2],
        node.name(),
        &text[end..]
    )
}

/// Runs fuzz bodies over seeds. Every input gets an answer.
#[test]
fn arbitrary_documents_are_validated_without_panic() {
    let mut dice = Dice::new(7);
    for turn in 0..400 {
        let shipped = &SHIPPED[turn % SHIPPED.len()];
        let schema = shipped.schema().expect("the table is valid");
        let text = soup(schema, &mut dice);
        let bytes = image("soup.xodr", &text);
        let report = schema.validate(
            &open(&bytes),
            Limits {
                per_kind: 2,
                total: 10,
            },
        );
        assert!(report.violations.len() <= 10);
    }
}

/// Returns elements and attributes of a schema in random order.
fn soup(schema: &Schema, dice: &mut Dice) -> String {
    let words: Vec<&str> = schema
        .to_notation()
        .leak()
        .split_whitespace()
        .filter(|word| word.bytes().all(|b| b.is_ascii_alphabetic()))
        .collect();
    let mut text = if dice.below(2) == 0 {
        "<OpenDRIVE>".to_owned()
    } else {
        "<OpenSCENARIO>".to_owned()
    };
    let mut open: Vec<&str> = vec![text.trim_matches(['<', '>']).to_owned().leak()];
    for _ in 0..60 {
        let word = words[dice.below(words.len())];
        match dice.below(5) {
            0 if open.len() > 1 => text += &format!("</{}>", open.pop().unwrap_or_default()),
            1 => {
                text += &format!(
                    "<{word} {}=\"{}\"/>",
                    words[dice.below(words.len())],
                    dice.below(9)
                );
            }
            2 => text += "text &amp; more",
            _ => {
                text += &format!("<{word} id=\"{}\">", dice.below(4));
                open.push(word);
            }
        }
    }
    while let Some(word) = open.pop() {
        text += &format!("</{word}>");
    }
    text
}
