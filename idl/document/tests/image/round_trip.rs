//! Tests that an image returns its input: any tree, any values, any position.

use proptest::prelude::*;
use qcbus_document::{Document, Node, XPaths};
use qcbus_fuzzing::{Child, Tree};

fn name() -> impl Strategy<Value = String> {
    prop::sample::select(vec![
        "road",
        "lane",
        "od:lane",
        "laneSection",
        "width",
        "straße",
        "a",
    ])
    .prop_map(String::from)
}

/// Generates characters that matter to XML, to XPath's quotes and to the counting of characters.
fn value() -> impl Strategy<Value = String> {
    prop::string::string_regex("[a-c0-2<>&'\" äß€😀\n]{0,6}").unwrap()
}

fn attributes() -> impl Strategy<Value = Vec<(String, String)>> {
    let names = prop::sample::subsequence(vec!["id", "name", "s", "xsi:type", "lane"], 0..4);
    names.prop_flat_map(|names| {
        names
            .into_iter()
            .map(|name| (Just(name.to_owned()), value()))
            .collect::<Vec<_>>()
    })
}

fn tree() -> impl Strategy<Value = Tree> {
    let leaf = (name(), attributes()).prop_map(|(name, attributes)| Tree {
        name,
        attributes,
        children: Vec::new(),
    });
    leaf.prop_recursive(5, 60, 6, |inner| {
        let child =
            prop_oneof![4 => inner.prop_map(Child::Element), 1 => value().prop_map(Child::Text)];
        (name(), attributes(), prop::collection::vec(child, 0..6)).prop_map(
            |(name, attributes, children)| Tree {
                name,
                attributes,
                children,
            },
        )
    })
}

fn local(name: &str) -> &str {
    name.rsplit(':').next().unwrap()
}

/// Compares a view with its expected tree, and each position with the XML's own bytes.
fn assert_shows(node: Node<'_>, tree: &Tree, xml: &str) {
    assert_eq!(node.name(), local(&tree.name));
    assert_eq!(
        node.prefix(),
        tree.name
            .strip_suffix(local(&tree.name))
            .unwrap()
            .trim_end_matches(':')
    );
    assert!(xml[node.offset() as usize..].starts_with(&format!("<{}", tree.name)));
    assert!(xml[..node.end_offset() as usize].ends_with(&format!("</{}>", tree.name)));
    let shown: Vec<_> = node
        .attributes()
        .map(|a| (a.name().to_owned(), a.value().to_owned()))
        .collect();
    assert_eq!(shown, tree.attributes);
    for attribute in node.attributes() {
        assert!(
            xml[attribute.offset() as usize..].starts_with(&format!("{}=\"", attribute.name()))
        );
        assert_eq!(xml.as_bytes()[attribute.value_offset() as usize - 1], b'"');
        assert_eq!(attribute.node(), node);
        assert_eq!(node.attr(attribute.name()), Some(attribute.value()));
    }
    let (mut text, mut children) = (String::new(), Vec::new());
    for child in &tree.children {
        match child {
            Child::Text(said) if said.trim_matches([' ', '\n']).is_empty() => {}
            Child::Text(said) => text.push_str(said),
            Child::Element(element) => children.push(element),
        }
    }
    assert_eq!(node.text(), text);
    assert_eq!(node.children().count(), children.len());
    let mut sibling = node.child(children.first().map_or("", |child| local(&child.name)));
    for (child, tree) in node.children().zip(children) {
        assert_eq!(child.parent(), Some(node));
        assert_eq!(sibling, Some(child));
        sibling = child.next_sibling();
        assert_shows(child, tree, xml);
    }
    assert_eq!(sibling, None);
}

/// Computes a row and a column in the simple way.
fn counted(xml: &str, offset: usize) -> (u32, u32) {
    let before = &xml[..offset];
    let line = before.rsplit('\n').next().unwrap();
    (
        before.matches('\n').count() as u32 + 1,
        line.chars().count() as u32 + 1,
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn image_shows_tree_it_was_built_from(tree in tree()) {
        let image = tree.image("maps/any.xodr").unwrap();
        let document = Document::open(&image).unwrap();
        prop_assert_eq!(document.validate(), Ok(()));
        prop_assert!(document.is_well_formed());
        prop_assert_eq!(document.path(), "maps/any.xodr");
        prop_assert_eq!(document.content_hash(), [0x11; 32]);
        assert_shows(document.root().unwrap(), &tree, &tree.xml());
    }

    #[test]
    fn equal_trees_make_equal_images(tree in tree()) {
        prop_assert_eq!(tree.image("a").unwrap(), tree.image("a").unwrap());
    }

    #[test]
    fn postings_list_same_elements_as_tree_walk(tree in tree()) {
        let image = tree.image("a").unwrap();
        let document = Document::open(&image).unwrap();
        let all: Vec<_> = std::iter::once(document.root().unwrap()).chain(document.root().unwrap().descendants()).collect();
        for name in ["road", "lane", "straße", "id", "nothing"] {
            let walked: Vec<_> = all.iter().copied().filter(|node| node.is(name)).collect();
            prop_assert_eq!(document.elements(name).collect::<Vec<_>>(), walked);
            for &node in &all {
                let below: Vec<_> = node.descendants().filter(|other| other.is(name)).collect();
                prop_assert_eq!(node.descendants_named(name).collect::<Vec<_>>(), below);
            }
        }
    }

    #[test]
    fn every_xpath_evaluates_to_its_element_only(tree in tree()) {
        let image = tree.image("a").unwrap();
        let document = Document::open(&image).unwrap();
        let root = document.root().unwrap();
        let mut paths = XPaths::new(document);
        for node in std::iter::once(root).chain(root.descendants()) {
            for xpath in [node.xpath(), node.positional_xpath(), format!("{}/@id", node.xpath())] {
                prop_assert_eq!(document.evaluate(&xpath).unwrap(), vec![node], "{}", xpath);
            }
            prop_assert_eq!(paths.xpath(node), node.xpath());
            prop_assert_eq!(paths.positional_xpath(node), node.positional_xpath());
        }
    }

    #[test]
    fn any_xpath_is_evaluated_or_refused(xpath in "[/a-b@*'\"=\\[\\]() 0-9.:|]{0,20}") {
        let image = Tree::new("a").holding(Tree::new("b")).image("a").unwrap();
        let document = Document::open(&image).unwrap();
        if let Err(error) = document.evaluate(&xpath) {
            prop_assert!(error.at <= xpath.chars().count() + 1);
        }
    }

    #[test]
    fn positions_match_naive_counting(tree in tree(), pad in 0usize..9000) {
        // The text is long enough for checkpoints at any position, also within characters.
        let tree = Tree::new("road").saying(&"ß\n€".repeat(pad / 6)).holding(tree);
        let (image, xml) = (tree.image("a").unwrap(), tree.xml());
        let document = Document::open(&image).unwrap();
        let offsets = document.root().unwrap().descendants().map(|node| node.offset()).chain([0, xml.len() as u32]);
        for offset in offsets {
            let position = document.position(offset);
            prop_assert_eq!((position.row, position.column), counted(&xml, offset as usize));
            prop_assert_eq!(position.offset, offset);
        }
    }
}
