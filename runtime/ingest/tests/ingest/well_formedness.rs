//! A construct that XML 1.0 forbids is a fault with its place. An allowed construct is none.

use std::path::Path;

use qcbus_document::{Document, FaultCode};
use qcbus_ingest::{Limits, prepare_bytes};

fn image(text: &str) -> Vec<u8> {
    let image = prepare_bytes(
        Path::new("/x/a.xodr"),
        text.as_bytes().to_vec(),
        &Limits::default(),
    )
    .build();
    Document::open(&image).unwrap().validate().unwrap();
    image
}

/// Returns the code, row and column of each fault.
fn faults(text: &str) -> Vec<(FaultCode, u32, u32)> {
    let image = image(text);
    let document = Document::open(&image).unwrap();
    let place = |offset| {
        (
            document.position(offset).row,
            document.position(offset).column,
        )
    };
    document
        .faults()
        .map(|fault| (fault.code, place(fault.offset).0, place(fault.offset).1))
        .collect()
}

#[test]
fn well_formed_documents_have_no_fault() {
    for text in [
        "<a/>",
        "<?xml version=\"1.0\"?><a/>",
        "<?xml version=\"1.3\"?><a/>",
        "<?xml version='1.0' encoding='UTF-8' standalone='yes' ?>\n<a></a >\n",
        "\u{FEFF}<?xml version=\"1.0\"?><a/>",
        "<!-- before --><a b='1' c=\"2\"\n d = '>'/><!-- after - - --><?go on?>",
        "<a xmlns='urn:x' xmlns:x='urn:y' x:b='1'><x:c x:b='1' b='2'/></a>",
        "<a xml:space='preserve'>x &amp; y &#65; <![CDATA[<&]]]> ]]</a>",
        "<straße ä='ö'><b><b/></b></straße>",
        "<a><?pi?><!----></a>",
        "<?xml version='1.0'?>\n<!DOCTYPE a>\n<a/>",
        "<!-- x --><!DOCTYPE  a-b\n ><a/>",
        "<a>\u{7F}\u{85}\u{FFFD}</a>",
    ] {
        assert_eq!(faults(text), [], "{text}");
    }
}

#[test]
fn each_violation_is_found_at_its_place() {
    use FaultCode as F;
    for (text, code, row, column) in [
        ("", F::Empty, 1, 1),
        (" \n ", F::Empty, 1, 1),
        ("<!-- only -->", F::NoRoot, 1, 14),
        ("<a/>\n<b/>", F::SecondRoot, 2, 1),
        ("<a/>\n text", F::TextOutsideRoot, 2, 2),
        ("text<a/>", F::TextOutsideRoot, 1, 1),
        ("<a/>&amp;", F::TextOutsideRoot, 1, 5),
        ("<a/><![CDATA[x]]>", F::TextOutsideRoot, 1, 5),
        ("\u{FEFF}\u{FEFF}<a/>", F::TextOutsideRoot, 1, 1),
        ("<a b='1'c='2'/>", F::MissingSpace, 1, 9),
        ("<a b='1' c='2' b='3'/>", F::DuplicateAttribute, 1, 16),
        ("<1a/>", F::BadName, 1, 1),
        ("<a>\n < b/></a>", F::BadName, 2, 2),
        ("<a 1b=''/>", F::BadName, 1, 4),
        ("<a b/>", F::BadAttribute, 1, 4),
        ("<a b=1/>", F::BadAttribute, 1, 6),
        ("<a b='x<y'/>", F::BadAttribute, 1, 8),
        ("<a b='&nbsp;'/>", F::BadReference, 1, 7),
        ("<a>\n&nbsp;</a>", F::BadReference, 2, 1),
        ("<a>x & y</a>", F::BadReference, 1, 6),
        ("<a>&#0;</a>", F::BadReference, 1, 4),
        ("<a>x ]]> y</a>", F::BadText, 1, 6),
        ("<a><!-- x -- y --></a>", F::BadComment, 1, 11),
        ("<a><!-- x ---></a>", F::BadComment, 1, 11),
        (" <?xml version='1.0'?><a/>", F::BadDeclaration, 1, 2),
        ("<?xml encoding='UTF-8'?><a/>", F::BadDeclaration, 1, 7),
        ("<?xml version='2.0'?><a/>", F::BadDeclaration, 1, 7),
        (
            "<?xml version='1.0' standalone='maybe'?><a/>",
            F::BadDeclaration,
            1,
            21,
        ),
        ("<?XML version='1.0'?><a/>", F::BadDeclaration, 1, 1),
        ("<a>\n<b></a>", F::MismatchedTag, 2, 4),
        ("<a></a></b>", F::MismatchedTag, 1, 8),
        ("<a>\n<b>", F::Unclosed, 2, 4),
        ("<a>\n<b c='1", F::Unclosed, 2, 6),
        ("<a>\n<b x='' c='1>\n<d e='2'/></b></a>", F::Unclosed, 2, 11),
        ("<a>\n <!-- ", F::Unclosed, 2, 2),
        ("<a>\n <![CDATA[ ", F::Unclosed, 2, 2),
        ("<a>\n <!wrong></a>", F::Syntax, 2, 2),
        ("<a>x\0y</a>", F::BadCharacter, 1, 5),
        ("<a>\u{FFFF}</a>", F::BadCharacter, 1, 4),
        ("<a>x\0\0\0\0y</a>", F::BadCharacter, 1, 5),
        ("<a/>\n\0\0\0\0", F::BadCharacter, 2, 1),
        ("<a>\n <p:b/></a>", F::UnboundPrefix, 2, 3),
        ("<a p:b=''/>", F::UnboundPrefix, 1, 4),
        ("<!DOCTYPE a [<!ENTITY x 'y'>]><a>&x;</a>", F::Doctype, 1, 1),
        ("<!DOCTYPE a []><a/>", F::Doctype, 1, 1),
        ("<!DOCTYPE a SYSTEM 'a.dtd'><a/>", F::Doctype, 1, 1),
        ("<!DOCTYPE a PUBLIC 'a' 'a.dtd'><a/>", F::Doctype, 1, 1),
        ("<!DOCTYPE a>\n<!DOCTYPE a><a/>", F::Doctype, 2, 1),
        ("<a/>\n<!DOCTYPE a>", F::Doctype, 2, 1),
        ("<a>\n<!DOCTYPE a></a>", F::Doctype, 2, 1),
        ("<!DOCTYPE 1><a/>", F::Doctype, 1, 1),
        ("<!DOCTYPE a><a>&x;</a>", F::BadReference, 1, 16),
    ] {
        assert_eq!(faults(text), [(code, row, column)], "{text:?}");
    }
}

#[test]
fn readable_part_of_a_faulty_file_is_kept() {
    let text = "<a><b><c/></a><d/>";
    let image = image(text);
    let document = Document::open(&image).unwrap();
    assert_eq!(
        document
            .root()
            .unwrap()
            .child("b")
            .unwrap()
            .child("c")
            .unwrap()
            .offset(),
        6
    );
    assert!(!document.is_well_formed());
    let texts: Vec<&str> = document.faults().map(|fault| fault.text).collect();
    assert_eq!(
        texts,
        [
            "found </a>, expected </b> for the element opened in row 1",
            "a second root element <d>; only one is allowed"
        ]
    );
}

#[test]
fn values_and_character_data_are_resolved() {
    let text = "<a b='&lt;1&#x20AC;&gt;' c='x\n\ty'> x &amp; y<d/>\r\n<![CDATA[<z>]]></a>";
    let image = image(text);
    let document = Document::open(&image).unwrap();
    let root = document.root().unwrap();
    assert_eq!(root.attr("b"), Some("<1€>"));
    assert_eq!(root.attr("c"), Some("x  y"));
    assert_eq!(root.text(), " x & y<z>");
    let image = self::image("<a> &lt;<![CDATA[ ]]>b&#13;</a>");
    assert_eq!(
        Document::open(&image).unwrap().root().unwrap().text(),
        " < b\r"
    );
}

/// Returns the text of the first fault.
fn first_text(text: &str) -> String {
    let image = image(text);
    let document = Document::open(&image).unwrap();
    let first = document.faults().next();
    first.map_or_else(String::new, |fault| fault.text.to_owned())
}

#[test]
fn common_content_of_other_kinds_is_named() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
    let conflict = "<a>\n<<<<<<< HEAD\n<b/>\n=======\n<c/>\n>>>>>>> other\n</a>";
    for (text, expected) in [
        (pointer, "Git LFS pointer"),
        (conflict, "merge conflict marker"),
        ("<a b=“1”/>", "typographic quotes"),
    ] {
        let found = first_text(text);
        assert!(found.contains(expected), "{found}");
    }
}
