//! Tests of the compiler with small schemas: constructs that it accepts, and constructs that it
//! rejects with name and line.

use crate::support::{compiled, image, open, table, violations};

fn schema(body: &str) -> String {
    format!("<xs:schema xmlns:xs=\"http://www.w3.org/2001/XMLSchema\">\n{body}\n</xs:schema>")
}

#[test]
fn unsupported_schema_construct_is_named_with_line() {
    for (body, expected) in [
        ("<xs:import namespace='x'/>", "test.xsd:2:1: <xs:import>"),
        (
            "<xs:redefine schemaLocation='x'/>",
            "<xs:redefine schemaLocation=\"x\">",
        ),
        (
            "<xs:element name='a' substitutionGroup='b'/>",
            "substitutionGroup",
        ),
        (
            "<xs:element name='a' type='missing'/>",
            "`missing` is not declared",
        ),
        (
            "<xs:include schemaLocation='elsewhere.xsd'/>",
            "elsewhere.xsd",
        ),
        (
            "<xs:element name='a'><xs:complexType><xs:anyAttribute/></xs:complexType></xs:element>",
            "<xs:anyAttribute>",
        ),
        (
            "<xs:element name='a'><xs:complexType><xs:openContent/></xs:complexType></xs:element>",
            "<xs:openContent>",
        ),
        (
            "<xs:element name='a'><xs:complexType><xs:assert test='matches(@b, \"x\")'/></xs:complexType></xs:element>",
            "parse the XPath",
        ),
        (
            "<xs:element name='a'><xs:simpleType><xs:restriction base='xs:string'><xs:pattern value='\\p{L}'/></xs:restriction></xs:simpleType></xs:element>",
            "\\p{L}",
        ),
        ("<xs:element name='a' type='xs:ENTITY'/>", "ENTITY"),
        ("<xs:complexType name='t'/>", "no global element"),
        (
            "<xs:complexType name='t'><xs:complexContent><xs:extension base='t'/></xs:complexContent></xs:complexType><xs:element name='a' type='t'/>",
            "too deeply",
        ),
        (
            "<xs:element name='a'><xs:complexType><xs:sequence><xs:element name='b' type='xs:int'/><xs:element name='b' type='xs:string'/></xs:sequence></xs:complexType></xs:element>",
            "two different types",
        ),
    ] {
        let error = compiled(&schema(body)).expect_err(body);
        assert!(error.contains(expected), "{body}: {error}");
        assert!(
            error.contains("test.xsd:2") || error.contains("no global"),
            "{error}"
        );
    }
}

#[test]
fn schema_that_expands_beyond_limits_is_refused() {
    let doubling: String = (1..20)
        .map(|n| format!("<xs:group name='g{n}'><xs:sequence><xs:group ref='g{0}'/><xs:group ref='g{0}'/></xs:sequence></xs:group>", n - 1))
        .collect();
    let body = format!(
        "<xs:group name='g0'><xs:sequence><xs:element name='b'/></xs:sequence></xs:group>{doubling}\
         <xs:element name='a'><xs:complexType><xs:group ref='g19'/></xs:complexType></xs:element>"
    );
    assert!(
        compiled(&schema(&body))
            .expect_err("too large")
            .contains("more than")
    );
    let many = "<xs:element name='a'><xs:complexType><xs:sequence maxOccurs='2000'><xs:element name='b' maxOccurs='2000'/></xs:sequence></xs:complexType></xs:element>";
    assert!(
        compiled(&schema(many))
            .expect_err("too large")
            .contains("more than")
    );
}

#[test]
fn content_model_checks_count_and_order() {
    let schema = compiled(&schema(
        "<xs:element name='a'><xs:complexType><xs:sequence>\
           <xs:element name='b' minOccurs='2' maxOccurs='3' type='xs:int'/>\
           <xs:choice minOccurs='0'><xs:element name='c'/><xs:element name='d'/></xs:choice>\
         </xs:sequence></xs:complexType></xs:element>",
    ))
    .expect("a schema");
    let codes = |text: &str| {
        violations(&schema, "t.xml", text)
            .into_iter()
            .map(|one| one.0)
            .collect::<Vec<_>>()
    };
    assert_eq!(codes("<a><b>1</b><b>2</b></a>"), [""; 0]);
    assert_eq!(codes("<a><b>1</b><b>2</b><b>3</b><d/></a>"), [""; 0]);
    assert_eq!(codes("<a><b>1</b></a>"), ["missing-element"]);
    assert_eq!(
        codes("<a><b>1</b><b>2</b><b>3</b><b>4</b></a>"),
        ["repeated-element"]
    );
    assert_eq!(codes("<a><b>1</b><b>x</b></a>"), ["invalid-text"]);
    assert_eq!(
        codes("<a><b>1</b><b>2</b><c/><d/></a>"),
        ["misplaced-element"]
    );
    assert_eq!(codes("<a><b>1</b><c/></a>"), ["missing-element"]);
}

#[test]
fn misplaced_children_get_distinct_messages() {
    let schema = compiled(&schema(
        "<xs:element name='a'><xs:complexType><xs:sequence>\
           <xs:element name='b' minOccurs='0' maxOccurs='unbounded'/>\
           <xs:element name='c' maxOccurs='2'/>\
           <xs:choice minOccurs='0'><xs:element name='d'/><xs:element name='e'/></xs:choice>\
           <xs:element name='c' minOccurs='0'/>\
           <xs:element name='f' minOccurs='0'><xs:complexType><xs:all>\
             <xs:element name='g'/><xs:element name='h' minOccurs='0'/></xs:all></xs:complexType></xs:element>\
         </xs:sequence></xs:complexType></xs:element>",
    ))
    .expect("a schema");
    for (children, said) in [
        ("<c/><c/><c/><f><g/></f>", None),
        (
            "<c/><c/><c/><c/><c/>",
            Some("<c> occurs 5 times in <a>, but may occur at most 3 times"),
        ),
        // Its number is unlimited, but it must not occur here.
        (
            "<b/><c/><b/>",
            Some("<b> in <a> comes too late: it must come before <c>"),
        ),
        ("<d/>", Some("<a> lacks <c>, which must come before <d>")),
        (
            "<e/><c/>",
            Some("<e> in <a> comes too early: <c> must come before it"),
        ),
        (
            "<c/><d/><e/>",
            Some("<e> cannot occur together with <d>: <a> takes one or the other"),
        ),
        (
            "<c/><e/><e/>",
            Some("<e> occurs 2 times in <a>, but may occur at most once"),
        ),
        (
            "<c/><f><g/><h/><g/><g/></f>",
            Some("<g> occurs 3 times in <f>, but may occur at most once"),
        ),
    ] {
        let found = violations(&schema, "t.xml", &format!("<a>{children}</a>"));
        let texts: Vec<&str> = found.iter().map(|one| one.1.as_str()).collect();
        assert_eq!(texts, said.into_iter().collect::<Vec<_>>(), "{children}");
    }
    // A missing element before a sibling counts as present.
    let found = violations(&schema, "t.xml", "<a><d/><b/></a>");
    assert_eq!(
        found[1].1,
        "<b> in <a> comes too late: it must come before <d>"
    );
}

#[test]
fn violation_messages_suggest_the_correction() {
    let table = table("xodr-1.7");
    let road = |inner: &str| {
        format!("<OpenDRIVE><header revMajor=\"1\" revMinor=\"7\"/>{inner}</OpenDRIVE>")
    };
    let found = violations(
        table,
        "t.xodr",
        &road("<road id=\"1\" junction=\"-1\" length=\"abc\"><planVeiw/></road>"),
    );
    let texts: Vec<&str> = found.iter().map(|one| one.1.as_str()).collect();
    assert!(texts.contains(&"<road> lacks <lanes>"), "{texts:?}");
    assert!(
        texts[0].contains(
            "length=\"abc\" of <road> is invalid; it must be a number greater than 0.0 (double)"
        ),
        "{texts:?}"
    );
    assert!(
        texts
            .iter()
            .any(|text| text.contains("did you mean \"planView\"?")),
        "{texts:?}"
    );
    for (attributes, said) in [
        (
            "xmlns:xsi='http://www.w3.org/2001/XMLSchema' xsi:noNamespaceSchemaLocation='a.xsd'",
            Some(
                "xsi:noNamespaceSchemaLocation of <OpenDRIVE> has no meaning: xmlns:xsi must be \"http://www.w3.org/2001/XMLSchema-instance\"",
            ),
        ),
        (
            "xmlns:i='http://www.w3.org/2001/XMLSchema-instance' i:noNamespaceSchemaLocation='a.xsd'",
            None,
        ),
        (
            "version='1.7'",
            Some(
                "OpenDRIVE 1.7 defines no attribute `version` for `OpenDRIVE`, which has no attributes",
            ),
        ),
    ] {
        let text = road("").replacen("<OpenDRIVE", &format!("<OpenDRIVE {attributes}"), 1);
        let found = violations(table, "t.xodr", &text);
        let first = found.iter().map(|one| one.1.as_str()).next();
        assert_eq!(
            first.filter(|text| *text != "<OpenDRIVE> lacks <road>"),
            said,
            "{attributes}"
        );
    }
    let found = violations(table, "t.xodr", &road("<raod/>"));
    assert!(
        found
            .iter()
            .any(|one| one.1.contains("did you mean \"road\"?")),
        "{found:?}"
    );
}

#[test]
fn single_cause_gives_single_violation() {
    let table = table("xosc-1.3");
    let scenario = |bounds: &str| {
        format!(
            "<OpenSCENARIO><FileHeader author=\"a\" date=\"2024-05-01T00:00:00\" description=\"d\" revMajor=\"1\" revMinor=\"3\"/>\
             <CatalogLocations/><RoadNetwork/><Entities><ScenarioObject name=\"o\"><MiscObject mass=\"1\" miscObjectCategory=\"tree\" name=\"m\">\
             <BoundingBox>{bounds}</BoundingBox></MiscObject></ScenarioObject></Entities>\
             <Storyboard><Init><Actions/></Init><StopTrigger/></Storyboard></OpenSCENARIO>"
        )
    };
    let good =
        "<Center x=\"0\" y=\"0\" z=\"0\"/><Dimensions width=\"1\" length=\"1\" height=\"1\"/>";
    assert_eq!(violations(table, "t.xosc", &scenario(good)), []);
    let renamed = good.replace("Center", "Position");
    let found = violations(table, "t.xosc", &scenario(&renamed));
    assert_eq!(found.len(), 1, "{found:?}");
    let lower = good.replace("Center", "center");
    let found = violations(table, "t.xosc", &scenario(&lower));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].1.contains("did you mean \"Center\"?"), "{found:?}");
}

#[test]
fn duplicate_key_is_reported() {
    let table = table("xodr-1.7");
    let text = |second: &str| {
        let road = |id: &str| {
            format!(
                "<road id=\"{id}\" junction=\"-1\" length=\"1\"><planView><geometry hdg=\"0\" length=\"1\" s=\"0\" x=\"0\" y=\"0\"><line/></geometry></planView>\
                 <lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/></center></laneSection></lanes></road>"
            )
        };
        format!(
            "<OpenDRIVE><header revMajor=\"1\" revMinor=\"7\"/>{}{}</OpenDRIVE>",
            road("1"),
            road(second)
        )
    };
    assert_eq!(violations(table, "t.xodr", &text("2")), []);
    let found = violations(table, "t.xodr", &text("1"));
    assert_eq!(
        found.iter().map(|one| one.0).collect::<Vec<_>>(),
        ["duplicate-key"],
        "{found:?}"
    );
}

#[test]
fn known_schema_defect_is_marked_in_violation() {
    let table = table("xodr-1.8");
    let notation = table.to_notation();
    for condition in qcbus_schema::known_conditions() {
        assert!(
            notation.contains(condition),
            "{condition} must be in a table"
        );
    }
    let text = "<OpenDRIVE><header revMajor=\"1\" revMinor=\"8\"/><vmsGroup id=\"1\"><vmsBoardReference/></vmsGroup></OpenDRIVE>";
    let image = image("t.xodr", text);
    let report = table.validate(&open(&image), qcbus_schema::Limits::default());
    let defect = report
        .violations
        .iter()
        .filter_map(|one| one.known_schema_defect)
        .next();
    assert!(
        defect.is_some_and(|words| words.contains("_OpenDriveElement")),
        "{:?}",
        report.violations
    );
}

/// Compiles bounded random XSDs. Each gets an answer, and none may panic.
#[test]
fn arbitrary_schemas_compile_or_are_refused() {
    let pieces = [
        "<xs:sequence>",
        "</xs:sequence>",
        "<xs:choice maxOccurs='unbounded'>",
        "</xs:choice>",
        "<xs:element name='a' type='t'/>",
        "<xs:element name='b' type='xs:int' minOccurs='3' maxOccurs='9'/>",
        "<xs:any processContents='skip'/>",
        "<xs:group ref='g'/>",
        "<xs:attribute name='x' type='s' use='required'/>",
        "<xs:all>",
        "</xs:all>",
        "<xs:assert test='count(a) gt 1'/>",
        "<xs:attributeGroup ref='h'/>",
    ];
    let mut dice = fastrand::Rng::with_seed(11);
    let (mut good, mut bad) = (0, 0);
    for _ in 0..600 {
        let body: String = (0..dice.usize(..9))
            .map(|_| pieces[dice.usize(..pieces.len())])
            .collect();
        let text = schema(&format!(
            "<xs:element name='a' type='t'/><xs:complexType name='t'>{body}</xs:complexType>\
             <xs:simpleType name='s'><xs:restriction base='xs:double'><xs:minInclusive value='{}'/></xs:restriction></xs:simpleType>\
             <xs:group name='g'><xs:sequence>{}</xs:sequence></xs:group><xs:attributeGroup name='h'/>",
            ["0", "x", "-1e3"][dice.usize(..3)],
            pieces[dice.usize(..pieces.len())],
        ));
        match compiled(&text) {
            Ok(schema) => {
                good += 1;
                violations(&schema, "t.xml", "<a x='1'><a/><b>1</b></a>");
                let again = qcbus_schema::Schema::from_notation(&schema.to_notation())
                    .expect("the notation of a compiled schema is readable");
                assert_eq!(again.to_notation(), schema.to_notation());
            }
            Err(_) => bad += 1,
        }
    }
    assert!(good > 20 && bad > 20, "{good} good, {bad} bad");
}
