//! Tests of positions (files, rows and columns), XPaths, and numbers in attributes.

use qcbus_document::{BuildError, Capacities, Document, FaultCode, ImageBuilder};
use qcbus_fuzzing::Tree;

fn road(id: &str) -> Tree {
    Tree::new("road").with("id", id)
}

fn with_document<T>(tree: &Tree, ask: impl FnOnce(Document<'_>) -> T) -> T {
    let image = tree.image("maps/a.xodr").unwrap();
    ask(Document::open(&image).unwrap())
}

fn xpaths(tree: &Tree, name: &str) -> Vec<String> {
    with_document(tree, |document| {
        document.elements(name).map(|node| node.xpath()).collect()
    })
}

#[test]
fn xpath_uses_id_only_if_unique_among_siblings() {
    let map = Tree::new("OpenDRIVE")
        .holding(road("5"))
        .holding(road("6"))
        .holding(road("6"))
        .holding(road(""));
    assert_eq!(
        xpaths(&map, "road"),
        [
            "/OpenDRIVE/road[@id='5']",
            "/OpenDRIVE/road[2]",
            "/OpenDRIVE/road[3]",
            "/OpenDRIVE/road[4]"
        ]
    );
    let other_name = Tree::new("OpenDRIVE")
        .holding(road("5"))
        .holding(Tree::new("junction").with("id", "5"));
    assert_eq!(xpaths(&other_name, "road"), ["/OpenDRIVE/road[@id='5']"]);
}

#[test]
fn xpath_quotes_depend_on_the_value() {
    let map = Tree::new("OpenDRIVE")
        .holding(road("a'b"))
        .holding(road("a\"b"))
        .holding(road("a'\"b"));
    assert_eq!(
        xpaths(&map, "road"),
        [
            "/OpenDRIVE/road[@id=\"a'b\"]",
            "/OpenDRIVE/road[@id='a\"b']",
            "/OpenDRIVE/road[3]"
        ]
    );
}

#[test]
fn name_identifies_elements_in_scenarios_but_not_maps() {
    let named = |name: &str| Tree::new("Event").with("name", name);
    let scenario = Tree::new("OpenSCENARIO")
        .holding(named("brake"))
        .holding(named("turn"));
    assert_eq!(
        xpaths(&scenario, "Event"),
        [
            "/OpenSCENARIO/Event[@name='brake']",
            "/OpenSCENARIO/Event[@name='turn']"
        ]
    );
    let map = Tree::new("OpenDRIVE")
        .holding(Tree::new("header").with("name", "town"))
        .holding(named("x"))
        .holding(named("y"));
    assert_eq!(xpaths(&map, "header"), ["/OpenDRIVE/header"]);
    assert_eq!(
        xpaths(&map, "Event"),
        ["/OpenDRIVE/Event[1]", "/OpenDRIVE/Event[2]"]
    );
}

#[test]
fn positional_xpaths_number_every_step() {
    let map = Tree::new("OpenDRIVE")
        .holding(road("1"))
        .holding(Tree::new("header"))
        .holding(road("2"));
    let found: Vec<_> = with_document(&map, |document| {
        document
            .root()
            .unwrap()
            .descendants()
            .map(|node| node.positional_xpath())
            .collect()
    });
    assert_eq!(
        found,
        [
            "/OpenDRIVE[1]/road[1]",
            "/OpenDRIVE[1]/header[1]",
            "/OpenDRIVE[1]/road[2]"
        ]
    );
}

#[test]
fn xpaths_of_other_tools_are_evaluated() {
    let lanes = || {
        Tree::new("lanes")
            .holding(Tree::new("laneSection").with("s", "0"))
            .holding(Tree::new("laneSection").with("s", "5"))
    };
    let map = Tree::new("OpenDRIVE")
        .holding(Tree::new("header"))
        .holding(road("1").holding(lanes()))
        .holding(road("2").holding(lanes()));
    let cases: [(&str, &[u32]); 21] = [
        // Nodes: 0 OpenDRIVE, 1 header, 2 road 1 (3 lanes, 4, 5 sections), 6 road 2 (7 lanes, 8, 9).
        ("/", &[0]),
        ("/OpenDRIVE", &[0]),
        ("/*", &[0]),
        ("/*/*", &[1, 2, 6]),
        ("/*/*[2]", &[2]),
        ("/OpenDRIVE/road[1]/lanes", &[3]),
        ("OpenDRIVE/road", &[2, 6]),
        ("//road", &[2, 6]),
        ("//road[2]", &[6]),
        ("//laneSection[1]", &[4, 8]),
        ("//laneSection[last()]", &[5, 9]),
        ("/OpenDRIVE//laneSection[@s='5'][1]", &[5, 9]),
        ("/OpenDRIVE/road[@id=\"2\"]//laneSection[@s]", &[8, 9]),
        ("/OpenDRIVE/road[ @id = '2' and @id ]", &[6]),
        ("//lanes//laneSection", &[4, 5, 8, 9]),
        ("//*[@id='1']/@id", &[2]),
        ("/OpenDRIVE/road[2]/@missing", &[6]),
        ("/ns:OpenDRIVE/ns:road[2]", &[6]),
        (
            "/*[local-name()='OpenDRIVE']/*[local-name()='road'][1]",
            &[2],
        ),
        ("/OpenDRIVE/road[0]", &[]),
        ("/OpenDRIVE/road[99999999999999999999999]", &[]),
    ];
    with_document(&map, |document| {
        for (xpath, expected) in cases {
            let found: Vec<_> = document
                .evaluate(xpath)
                .unwrap()
                .iter()
                .map(|node| node.index())
                .collect();
            assert_eq!(found, expected, "{xpath}");
        }
    });
}

#[test]
fn xpath_is_evaluated_from_an_element() {
    let section = |s: &str| Tree::new("laneSection").with("s", s);
    let lanes = || {
        let lanes = Tree::new("lanes").holding(section("0"));
        lanes.holding(section("5").holding(Tree::new("lanes")))
    };
    let map = Tree::new("OpenDRIVE")
        .holding(road("1").holding(lanes()))
        .holding(road("2").holding(lanes()));
    // Nodes: 0 OpenDRIVE, 1 road 1 (2 lanes, 3 and 4 sections, 5 lanes), 6 road 2 (7, 8 and 9, 10).
    let cases: [(u32, &str, &[u32]); 18] = [
        (1, ".", &[1]),
        (1, "./", &[1]),
        (1, "lanes", &[2]),
        (1, "./lanes/laneSection[2]", &[4]),
        (1, ".//lanes", &[2, 5]),
        (6, ".//laneSection[@s='5']", &[9]),
        (6, ".//laneSection[1]", &[8]),
        (6, ".//*", &[7, 8, 9, 10]),
        (6, "*", &[7]),
        (6, "road", &[]),
        (9, "..", &[7]),
        (9, "../..", &[6]),
        (9, "../laneSection[1]", &[8]),
        (9, ".././../../road[1]", &[1]),
        (9, "..//lanes", &[10]),
        (0, "..", &[]),
        (6, "//lanes", &[2, 5, 7, 10]),
        (6, "/OpenDRIVE/road[1]", &[1]),
    ];
    with_document(&map, |document| {
        for (from, xpath, expected) in cases {
            let found = document.node(from).unwrap().evaluate(xpath);
            let found = found.map(|found| found.iter().map(|node| node.index()).collect());
            assert_eq!(
                found.unwrap_or_else(|_| Vec::new()),
                expected,
                "{from} {xpath}"
            );
        }
        let said = |xpath| {
            document
                .node(1)
                .unwrap()
                .evaluate(xpath)
                .unwrap_err()
                .to_string()
        };
        for (xpath, expected) in [
            ("", "evaluate the XPath '': expected '/' at character 1"),
            (
                "../a[",
                "evaluate the XPath '../a[': expected a number, 'last()', 'local-name()' or '@' at character 6",
            ),
            (
                "a[",
                "evaluate the XPath 'a[': expected a number, 'last()', 'local-name()' or '@' at character 3",
            ),
            (
                "...",
                "evaluate the XPath '...': expected the name of an element, or '*' at character 1",
            ),
        ] {
            assert_eq!(said(xpath), expected);
        }
    });
}

#[test]
fn unsupported_xpath_is_reported_at_its_position() {
    with_document(&Tree::new("a"), |document| {
        for (xpath, said) in [
            ("", "evaluate the XPath '': expected '/' at character 1"),
            (
                "/a[",
                "evaluate the XPath '/a[': expected a number, 'last()', 'local-name()' or '@' at character 4",
            ),
            (
                "/ä[@b='c]",
                "evaluate the XPath '/ä[@b='c]': expected a closing quote at character 8",
            ),
            (
                "/a/..",
                "evaluate the XPath '/a/..': expected the name of an element, or '*' at character 4",
            ),
            (
                "/a | /b",
                "evaluate the XPath '/a | /b': expected '/', '[' or the end at character 4",
            ),
            (
                "/child::a",
                "evaluate the XPath '/child::a': expected the name of an element, or '*' at character 2",
            ),
        ] {
            assert_eq!(document.evaluate(xpath).unwrap_err().to_string(), said);
        }
    });
}

/// Returns the image of a root file with two includes. The second include is empty.
fn three_files() -> Vec<u8> {
    let root = "\u{feff}<OpenDRIVE>\n<include file='b'/></OpenDRIVE>";
    let included = "<OpenDRIVE>\n\n  <road/></OpenDRIVE>";
    let capacities = Capacities {
        text: 200,
        nodes: 9,
        names: 9,
        heap: 200,
        sources: 3,
        faults: 2,
        ..Capacities::default()
    };
    let mut out = vec![0; capacities.image_len()];
    let mut builder = ImageBuilder::new(&mut out, &capacities).unwrap();
    assert_eq!(builder.source("a.xodr", root), Ok(0));
    builder.open_element("OpenDRIVE", 3).unwrap();
    let start = builder.source("b.xml", included).unwrap();
    builder.open_element("road", start + 15).unwrap();
    builder.close_element(start + 22).unwrap();
    let empty = builder.source("c.xml", "").unwrap();
    builder.close_element(root.len() as u32).unwrap();
    builder
        .fault(FaultCode::NoRoot, empty, "an empty file")
        .unwrap();
    builder
        .fault(
            FaultCode::EncodingTranscoded,
            root.len() as u32,
            "transcoded",
        )
        .unwrap();
    let used = builder.finish([0; 32]).unwrap();
    out.truncate(used);
    out
}

#[test]
fn offset_is_mapped_to_its_source_file() {
    let image = three_files();
    let document = Document::open(&image).unwrap();
    assert_eq!(document.validate(), Ok(()));
    let paths: Vec<_> = document.sources().map(|source| source.path).collect();
    assert_eq!(paths, ["a.xodr", "b.xml", "c.xml"]);
    let road = document.elements("road").next().unwrap();
    assert_eq!(road.position().to_string(), "b.xml:3:3");
    assert!(!road.position().is_root_file);
    assert_eq!(road.position().offset, 15);
    assert_eq!(
        document.root().unwrap().position().to_string(),
        "a.xodr:1:1",
        "a byte order mark does not count as a column"
    );
    let faults: Vec<_> = document
        .faults()
        .map(|fault| document.position(fault.offset).to_string())
        .collect();
    // The end of the root file belongs to the root file, although another file follows.
    assert_eq!(faults, ["c.xml:1:1", "a.xodr:2:32"]);
    assert_eq!(document.position(u32::MAX).path, "c.xml");
}

#[test]
fn fault_codes_mark_partial_trees_and_have_unique_names() {
    let image = three_files();
    assert!(!Document::open(&image).unwrap().is_well_formed());
    assert!(!FaultCode::EncodingTranscoded.makes_partial());
    let names: std::collections::BTreeSet<_> =
        FaultCode::ALL.iter().map(|code| code.as_str()).collect();
    assert_eq!(names.len(), FaultCode::ALL.len(), "two codes share a name");
    assert!(names.iter().all(|name| {
        name.bytes()
            .all(|byte| byte.is_ascii_lowercase() || byte == b'-')
    }));
}

#[test]
fn invalid_numbers_are_explained() {
    let tree = road(" 12 ")
        .with("length", "12,5")
        .with("s", "1e999")
        .with("t", "inf")
        .with("z", "")
        .with("h", " +1.5e1\n");
    with_document(&tree, |document| {
        let road = document.root().unwrap();
        assert_eq!(road.i64("id"), Ok(12));
        assert_eq!(road.f64("h"), Ok(15.0));
        let said = |name| road.f64(name).unwrap_err().to_string();
        assert_eq!(said("missing"), "<road> has no attribute 'missing'");
        assert_eq!(
            said("length"),
            "attribute 'length' of <road> is '12,5', which is not a number: the decimal separator is a point, as in 12.5"
        );
        assert_eq!(
            said("s"),
            "attribute 's' of <road> is '1e999', which is beyond the largest double, about 1.8e308"
        );
        assert_eq!(
            said("t"),
            "attribute 't' of <road> is 'inf', which is not a number: write INF, -INF or NaN, in exactly this spelling"
        );
        assert_eq!(
            said("z"),
            "attribute 'z' of <road> is empty, but a number is expected"
        );
        assert_eq!(
            road.i64("h").unwrap_err().to_string(),
            "attribute 'h' of <road> is ' +1.5e1\n', which is not an integer; write it like 12 or -3"
        );
        assert_eq!(
            road.f64("length").unwrap_err().offset(),
            road.attribute("length").unwrap().offset()
        );
    });
}

#[test]
fn builder_refuses_to_write_beyond_capacity() {
    let capacities = Capacities {
        text: 20,
        nodes: 1,
        attributes: 1,
        names: 2,
        heap: 10,
        sources: 1,
        faults: 0,
    };
    let mut out = vec![0x5A; capacities.image_len() + 64];
    let needed = capacities.image_len();
    assert!(matches!(
        ImageBuilder::new(&mut out[..10], &capacities),
        Err(BuildError::SmallBuffer { found: 10, .. })
    ));
    let mut builder = ImageBuilder::new(&mut out, &capacities).unwrap();
    let no_room = |what, capacity| Err(BuildError::NoRoom { what, capacity });
    builder.source("a", "<road id='5' s='6'/>").unwrap();
    assert_eq!(
        builder.source("b", "<road/>").map(drop),
        no_room("text", 21)
    );
    assert_eq!(
        builder.attribute("id", 6, 10, 1, None),
        Err(BuildError::Misplaced {
            event: "an attribute"
        })
    );
    builder.open_element("road", 0).unwrap();
    builder.attribute("id", 6, 10, 1, None).unwrap();
    assert_eq!(
        builder.attribute("id", 6, 10, 1, None),
        no_room("attributes", 1)
    );
    assert_eq!(builder.attribute("s", 13, 16, 1, None), no_room("names", 2));
    assert_eq!(builder.open_element("road", 0), no_room("nodes", 1));
    assert_eq!(
        builder.fault(FaultCode::Unclosed, 0, ""),
        no_room("faults", 0)
    );
    assert_eq!(
        builder.close_element(21),
        Err(BuildError::OutsideText { offset: 21, len: 0 })
    );
    let used = builder.finish([0; 32]).unwrap();
    assert_eq!(Document::open(&out[..used]).unwrap().validate(), Ok(()));
    assert!(
        out[needed..].iter().all(|&byte| byte == 0x5A),
        "bytes after the image must be unchanged"
    );
}
