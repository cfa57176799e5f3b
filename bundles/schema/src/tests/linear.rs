//! Tests that validation is linear in the size of the document, for any content. They count steps
//! and do not measure time.

use std::fmt::Write as _;

use qcbus_document::FileKind;

use super::generate::Dice;
use super::{image, open};
use crate::work::counted;
use crate::{Limits, SHIPPED, Schema, compile};

/// Maximum steps per element and attribute. A valid one needs a few. A wrong one needs the width of
/// the widest type and about thirty siblings.
const PER_PART: u64 = 200;
/// Limits of listed violations, and the maximum steps for their texts.
const LISTED: Limits = Limits {
    per_kind: 5,
    total: 50,
};
const WORDING: u64 = 100_000;
/// Maximum growth of the steps for a doubled document. Quadratic time would give four.
const GROWTH: f64 = 2.3;

/// Returns the steps for a document, and the number of its elements and attributes.
fn work(schema: &Schema, text: &str) -> (u64, u64) {
    let image = image("a.xodr", text);
    let document = open(&image);
    assert!(
        document.is_well_formed(),
        "{}",
        &text[..text.len().min(300)]
    );
    let nodes = (0..document.len()).filter_map(|index| document.node(index));
    let parts: u64 = nodes.map(|node| 1 + node.attributes().count() as u64).sum();
    let steps = counted(|| {
        schema.validate(&document, LISTED);
    });
    (steps, parts)
}

/// Checks that a document of size `2 n` takes at most its linear number of steps.
fn assert_linear(what: &str, schema: &Schema, size: usize, make: impl Fn(usize) -> String) {
    let (once, _) = work(schema, &make(size));
    let (twice, parts) = work(schema, &make(2 * size));
    assert!(twice > 0, "{what}: nothing was counted");
    assert!(
        twice <= PER_PART * parts + WORDING,
        "{what}: {twice} steps for {parts} parts"
    );
    assert!(
        twice as f64 <= GROWTH * once as f64,
        "{what}: {once} steps became {twice}"
    );
}

fn shipped(kind: FileKind, minor: u32) -> &'static Schema {
    let found = SHIPPED
        .iter()
        .find(|one| one.kind == kind && one.version.minor == minor);
    found.expect("a version").schema().expect("a sound table")
}

fn compiled(body: &str) -> Schema {
    try_compiled(body).expect("a sound schema")
}

fn try_compiled(body: &str) -> Result<Schema, String> {
    let text =
        format!("<xs:schema xmlns:xs=\"http://www.w3.org/2001/XMLSchema\">{body}</xs:schema>");
    let image = image("a.xsd", &text);
    let document = open(&image);
    compile("made", &[document]).map_err(|error| error.to_string())
}

fn repeat(from: usize, to: usize, one: impl Fn(usize) -> String) -> String {
    (from..to).map(one).collect()
}

/// Generates a document of random nested names below the root of a schema, with its attributes.
fn soup(schema: &Schema, size: usize, depth: usize) -> String {
    let names: Vec<&str> = (0..u16::MAX)
        .map(|id| schema.names.text(crate::names::NameId(id)))
        .take_while(|name| !name.is_empty())
        // Ingest would follow an include.
        .filter(|name| *name != "include" && name.bytes().all(|byte| byte.is_ascii_alphanumeric()))
        .collect();
    let root = schema.names.text(schema.roots[0].name);
    let mut dice = Dice::new(11);
    let mut open = vec![root];
    let mut text = format!("<{root}>");
    for _ in 0..size {
        if open.len() > 1 && dice.below(2) == 0 {
            let _ = write!(text, "</{}>", open.pop().unwrap_or_default());
            continue;
        }
        let name = names[dice.below(names.len())];
        let attribute = names[dice.below(names.len())];
        let end = if open.len() < depth { "" } else { "/" };
        let _ = write!(text, "<{name} {attribute}=\"{}\"{end}>", dice.below(5));
        if open.len() < depth {
            open.push(name);
        }
    }
    while let Some(name) = open.pop() {
        let _ = write!(text, "</{name}>");
    }
    text
}

#[test]
fn random_documents_of_shipped_schemas_take_linear_time() {
    for one in &SHIPPED {
        let schema = one.schema().expect("a sound table");
        for depth in [2, 4, 300] {
            let what = format!("{:?} {} depth {depth}", one.kind, one.version);
            assert_linear(&what, schema, 5_000, |size| soup(schema, size, depth));
        }
    }
}

#[test]
fn thousands_of_equal_mistakes_take_linear_time() {
    let newest = shipped(FileKind::Xodr, 8);
    let road = |inside: String| format!("<OpenDRIVE><header/><road>{inside}</road></OpenDRIVE>");
    let cases: [(&str, &dyn Fn(usize) -> String); 7] = [
        ("unknown", &|_| "<plainView/>".to_owned()),
        ("many unknown", &|n| format!("<plainView{}/>", n % 997)),
        ("repeated", &|_| "<planView/>".to_owned()),
        ("backwards", &|n| {
            ["<lanes/>", "<planView/>", "<type/>", "<link/>"][n % 4].to_owned()
        }),
        ("attributes", &|_| {
            "<link a='1' b='2' c='3' d='4' e='5' f='6'/>".to_owned()
        }),
        ("text", &|_| "x<link/>".to_owned()),
        ("blanks", &|_| "<link> </link>".to_owned()),
    ];
    for (what, one) in cases {
        assert_linear(what, newest, 2_000, |size| road(repeat(0, size, one)));
    }
    assert_linear("attributes of one element", newest, 2_000, |size| {
        let attributes = repeat(0, size, |n| format!(" a{n}='1'"));
        format!("<OpenDRIVE><header/><road{attributes}/></OpenDRIVE>")
    });
}

#[test]
fn large_scope_does_not_slow_small_ones() {
    let newest = shipped(FileKind::Xodr, 8);
    assert_linear("junctions", newest, 2_000, |size| {
        let connections = repeat(0, size, |n| format!("<connection id='{n}'/>"));
        let small = repeat(0, size, |n| {
            format!("<junction id='{n}'><connection id='0'/></junction>")
        });
        format!("<OpenDRIVE><header/><junction id='x'>{connections}</junction>{small}</OpenDRIVE>")
    });
}

#[test]
fn prefix_lookup_takes_linear_time() {
    let newest = shipped(FileKind::Xodr, 8);
    assert_linear("prefixes on one element", newest, 2_000, |size| {
        let bound = repeat(0, size, |n| format!(" xmlns:p{n}='x' p{n}:type='t'"));
        format!("<OpenDRIVE{bound}><header/></OpenDRIVE>")
    });
    assert_linear("prefixes far above", newest, 2_000, |size| {
        let bound = repeat(0, size, |n| format!(" xmlns:p{n}='x'"));
        let roads = repeat(0, size, |n| format!("<road p{n}:type='t'/>"));
        format!("<OpenDRIVE{bound}><header/>{roads}</OpenDRIVE>")
    });
}

/// Returns a schema with all constructs that could cost more than linear time, in realistic sizes.
fn made(wide: usize) -> Schema {
    let optional = repeat(0, wide, |n| {
        format!("<xs:element name='s{n}' minOccurs='0'/>")
    });
    let choice = repeat(0, wide, |n| format!("<xs:element name='c{n}'/>"));
    let all = repeat(0, wide.min(60), |n| {
        format!("<xs:element name='a{n}' minOccurs='0'/>")
    });
    let attributes = repeat(0, wide, |n| {
        format!("<xs:attribute name='s{n}' type='xs:int'/>")
    });
    compiled(&format!(
        "<xs:element name='root' type='t'><xs:key name='k'><xs:selector xpath='*/inner'/>\
         <xs:field xpath='@s1'/></xs:key></xs:element>\
         <xs:complexType name='t'><xs:choice minOccurs='0' maxOccurs='unbounded'>{choice}\
         <xs:element name='inner' type='t'><xs:unique name='u'><xs:selector xpath='*'/>\
         <xs:field xpath='@s0'/></xs:unique></xs:element>\
         <xs:element name='order'><xs:complexType><xs:sequence>{optional}</xs:sequence></xs:complexType></xs:element>\
         <xs:element name='any'><xs:complexType><xs:all>{all}</xs:all></xs:complexType></xs:element>\
         </xs:choice>{attributes}<xs:assert test='count(inner) &lt; 5 or c1/@s1'/></xs:complexType>"
    ))
}

#[test]
fn generated_schemas_validate_in_linear_time() {
    for wide in [3, 20, 60] {
        let schema = made(wide);
        for depth in [2, 5, 300] {
            let what = format!("{wide} wide, depth {depth}");
            assert_linear(&what, &schema, 5_000, |size| soup(&schema, size, depth));
        }
        assert_linear("nested as deep as it goes", &schema, 400, |size| {
            let (open, close) = (
                "<inner s1='1' s0='2'>".repeat(size),
                "</inner>".repeat(size),
            );
            format!("<root>{open}{close}</root>")
        });
    }
}

#[test]
fn assertion_that_is_not_linear_is_refused() {
    let body = "<xs:element name='a' type='t'/>\n<xs:complexType name='t'><xs:sequence>\
                <xs:element name='a' type='t' minOccurs='0'/></xs:sequence>\
                <xs:assert test='count(.//b) = 0'/></xs:complexType>";
    let error = try_compiled(body).expect_err("a condition over all descendants of itself");
    assert!(
        error.contains("a.xsd:2:1") && error.contains("`t`"),
        "{error}"
    );
    // The same condition is accepted for a type that does not contain itself.
    compiled(&body.replace("type='t' minOccurs", "minOccurs"));
}
