//! Modular scenarios: their expansion, and its robustness against arbitrary archives.

use crate::fuzzing::{self, Outcome};
use proptest::prelude::*;
use proptest::strategy::ValueTree as _;

fn main_with(groups: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenSCENARIO>\n  <Entities/>\n  <Storyboard><Story><Act>\n\
         {groups}\n  </Act></Story></Storyboard>\n</OpenSCENARIO>\n"
    )
}

fn referring(file: &str, uses: &str) -> String {
    format!(
        "    <ManeuverGroup name=\"P\"><Actors><EntityRef entityRef='Ego'/></Actors>\
         <ScenarioReference scenarioFileName=\"{file}\">{uses}</ScenarioReference></ManeuverGroup>"
    )
}

fn named(group: &str, keys: &str) -> String {
    format!("<ManeuverGroupReference maneuverGroupName=\"{group}\">{keys}</ManeuverGroupReference>")
}

fn key(key: &str, value: &str) -> String {
    format!("<ParameterReference key=\"{key}\" value=\"{value}\"/>")
}

fn group(name: &str, content: &str) -> String {
    format!(
        "<ManeuverGroup name='{name}' maximumExecutionCount='2'>\n  <Actors><EntityRef entityRef=\"veh\"/></Actors>\n\
         {content}\n</ManeuverGroup>"
    )
}

const SPEED: &str = "  <Position><World  x = '1' y='2'\n parameterAttributes=\"x, y\" /></Position>\
                     <!-- kept --><Text parameterAttributes='a'>a &lt; b <![CDATA[<c>]]></Text>";

fn expand(files: &[(&str, String)]) -> Outcome {
    let files: Vec<_> = files
        .iter()
        .map(|(name, text)| ((*name).to_owned(), text.clone().into_bytes()))
        .collect();
    fuzzing::assembled(&files)
}

fn expanded(files: &[(&str, String)]) -> String {
    match expand(files) {
        Outcome::Expanded(text) => text,
        Outcome::Stopped(why) => panic!("the expansion must succeed: {why}"),
    }
}

fn stopped(files: &[(&str, String)]) -> String {
    match expand(files) {
        Outcome::Expanded(text) => panic!("the expansion must fail, found {text}"),
        Outcome::Stopped(why) => why,
    }
}

#[test]
fn group_replaces_its_reference_as_written() {
    let uses = named("G", &key("World.x", "7&quot;&lt;"));
    let text = expanded(&[
        ("main.xosc", main_with(&referring("lib.xosc", &uses))),
        ("lib.xosc", main_with(&group("G", SPEED))),
    ]);
    let copy = "    <ManeuverGroup name='P.G' maximumExecutionCount='2'>\n  \
                <Actors><EntityRef entityRef=\"Ego\"/></Actors>\n  \
                <Position><World  x = '7\"&lt;' y='2' /></Position>\
                <!-- kept --><Text>a &lt; b <![CDATA[<c>]]></Text>\n</ManeuverGroup>";
    assert_eq!(text, main_with(copy));
}

#[test]
fn scenario_without_references_is_unchanged() {
    let plain = main_with("<!-- c --><ManeuverGroup name='a>b' x='&#10;'/>");
    assert_eq!(expanded(&[("main.xosc", plain.clone())]), plain);
}

#[test]
fn direct_form_takes_all_groups() {
    let lib = format!("{}{}", group("G", SPEED), group("H", SPEED));
    let text = expanded(&[
        (
            "main.xosc",
            main_with(&referring("lib.xosc", &key("x", "9"))),
        ),
        ("lib.xosc", main_with(&lib)),
    ]);
    assert!(
        text.contains("name='P'") && text.contains("name='P_2'"),
        "{text}"
    );
    assert_eq!(text.matches("x = '9'").count(), 2, "{text}");
}

#[test]
fn most_specific_key_wins() {
    for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
        let keys = [
            key("x", "1"),
            key("World.x", "2"),
            key("Position.World.x", "3"),
        ];
        let keys: String = order.iter().map(|&at| keys[at].clone()).collect();
        let text = expanded(&[
            (
                "main.xosc",
                main_with(&referring("lib.xosc", &named("G", &keys))),
            ),
            ("lib.xosc", main_with(&group("G", SPEED))),
        ]);
        assert!(text.contains("x = '3'"), "{order:?}: {text}");
    }
}

#[test]
fn nested_archives_have_separate_names() {
    let inner = fuzzing_pack(&[
        (
            "main.xosc",
            main_with(&referring("lib.xosc", &named("G", &key("y", "5")))),
        ),
        ("lib.xosc", main_with(&group("G", SPEED))),
    ]);
    let other = SPEED.replace("'1'", "'outer'");
    let both = format!(
        "{}\n{}",
        referring("in.mosc", &named("P.G", &key("x", "6"))),
        referring("lib.xosc", &named("G", ""))
    );
    let files = [
        ("main.xosc".to_owned(), main_with(&both).into_bytes()),
        (
            "lib.xosc".to_owned(),
            main_with(&group("G", &other)).into_bytes(),
        ),
        ("in.mosc".to_owned(), inner),
    ];
    let Outcome::Expanded(text) = fuzzing::assembled(&files) else {
        panic!("the expansion must succeed")
    };
    assert!(
        text.contains("name='P.P.G'") && text.contains("x = '6' y='5'"),
        "{text}"
    );
    assert!(
        text.contains("name='P.G'") && text.contains("x = 'outer' y='2'"),
        "{text}"
    );
}

fn fuzzing_pack(files: &[(&str, String)]) -> Vec<u8> {
    let files: Vec<_> = files
        .iter()
        .map(|(name, text)| ((*name).to_owned(), text.clone().into_bytes()))
        .collect();
    match qcbus_ingest::modular::pack(&files) {
        Ok(bytes) => bytes,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn reason_for_a_stopped_expansion_is_given() {
    let lib = ("lib.xosc", main_with(&group("G", SPEED)));
    let of = |groups: &str| stopped(&[("main.xosc", main_with(groups)), lib.clone()]);
    let cases = [
        (
            referring("li.xosc", &named("G", "")),
            "not found in the archive",
        ),
        (
            referring("lib.XOSC", &named("G", "")),
            "must end in `.xosc`",
        ),
        (
            referring("in.mosc!lib.xosc", &named("G", "")),
            "points into an archive",
        ),
        (
            referring("../lib.xosc", &named("G", "")),
            "points outside the archive",
        ),
        (referring("lib.xosc", &named("g", "")), "did you mean `G`?"),
        (
            referring("lib.xosc", "<ManeuverGroupReference/>"),
            "maneuverGroupName",
        ),
        (
            referring("main.xosc", &named("P", "")),
            "fuzz.mosc!main.xosc → fuzz.mosc!main.xosc",
        ),
        (
            referring("lib.xosc", &named("G", &(key("x", "1") + &key("x", "2")))),
            "gives it `1` and `2`",
        ),
        (
            "<ScenarioReference scenarioFileName='lib.xosc'/>".to_owned(),
            "must be in a `ManeuverGroup`",
        ),
    ];
    for (groups, part) in cases {
        let why = of(&groups);
        assert!(why.contains(part), "{groups}: {why}");
    }
    let broken = stopped(&[
        (
            "main.xosc",
            main_with(&referring("lib.xosc", &named("G", ""))),
        ),
        (
            "lib.xosc",
            "<OpenSCENARIO><ManeuverGroup name='G'>".to_owned(),
        ),
    ]);
    assert!(broken.contains("lib.xosc:1:"), "{broken}");
}

#[test]
fn too_deep_chain_is_stopped() {
    let chain = |length: usize| {
        let mut files = vec![(
            "main.xosc".to_owned(),
            main_with(&referring("l0.xosc", &named("P", ""))),
        )];
        for at in 0..length {
            let next = format!("l{}.xosc", at + 1);
            files.push((
                format!("l{at}.xosc"),
                main_with(&referring(&next, &named("P", ""))),
            ));
        }
        files.push((format!("l{length}.xosc"), main_with(&group("P", SPEED))));
        let files: Vec<_> = files
            .into_iter()
            .map(|(name, text)| (name, text.into_bytes()))
            .collect();
        fuzzing::assembled(&files)
    };
    assert!(matches!(chain(31), Outcome::Expanded(_)));
    assert!(matches!(chain(32), Outcome::Stopped(_)));
}

#[test]
fn unbounded_growth_is_stopped() {
    // Each level uses the one below it four times: 4^11 groups.
    let four: String = (0..4).map(|_| referring("NEXT", "")).collect();
    let mut files = vec![(
        "main.xosc".to_owned(),
        main_with(&four.replace("NEXT", "l0.xosc")),
    )];
    for at in 0..10 {
        let text = main_with(&four.replace("NEXT", &format!("l{}.xosc", at + 1)));
        files.push((format!("l{at}.xosc"), text));
    }
    files.push(("l10.xosc".to_owned(), main_with(&group("G", SPEED))));
    let files: Vec<_> = files
        .into_iter()
        .map(|(name, text)| (name, text.into_bytes()))
        .collect();
    let Outcome::Stopped(why) = fuzzing::assembled(&files) else {
        panic!("expanded")
    };
    assert!(why.contains("too large"), "{why}");
}

#[test]
fn prefixes_of_a_library_follow_its_groups() {
    let lib = main_with(&group("G", "<x:a x:b='1'/>"))
        .replace("<OpenSCENARIO>", "<OpenSCENARIO xmlns:x='u' xmlns:y='v'>");
    let text = expanded(&[
        (
            "main.xosc",
            main_with(&referring("lib.xosc", &named("G", ""))),
        ),
        ("lib.xosc", lib),
    ]);
    assert!(
        text.contains("<ManeuverGroup xmlns:x=\"u\" name='P.G'"),
        "{text}"
    );
}

const NAMES: [&str; 9] = [
    "lib.xosc",
    "lib.xosc",
    "lib.xosc",
    "other.xosc",
    "other.xosc",
    "in.mosc",
    "in.xosc",
    "main.xosc",
    "../lib.xosc",
];
const GROUPS: [&str; 8] = ["G", "H", "G", "H", "G", "P", "P.G", "P.P.G"];
const ELEMENTS: [&str; 4] = ["A", "B", "Position", "EntityRef"];
const ATTRIBUTES: [&str; 4] = ["x", "y", "value", "entityRef"];
const VALUES: [&str; 7] = [
    "1",
    "",
    "a&lt;b",
    "&quot;",
    "&apos;&amp;&#10;",
    "$p",
    "ü]]>",
];
const TEXTS: [&str; 5] = [
    "",
    "a &amp; b",
    "<![CDATA[<x>]]>",
    "<!-- -- -->",
    "<!--c--><?p i?>",
];

fn element() -> impl Strategy<Value = String> {
    let attribute = (0..ATTRIBUTES.len(), 0..VALUES.len(), any::<bool>());
    let leaf = (
        0..ELEMENTS.len(),
        prop::collection::vec(attribute, 0..4),
        prop::sample::select(vec![
            "",
            "x",
            "x,y",
            "value, entityRef",
            "x;y",
            "parameterAttributes",
            "z,",
        ]),
        0..TEXTS.len(),
    )
        .prop_map(|(name, attributes, offers, text)| {
            let mut seen = Vec::new();
            let mut start = format!("<{}", ELEMENTS[name]);
            for (attribute, value, single) in attributes {
                if seen.contains(&attribute) {
                    continue;
                }
                seen.push(attribute);
                let quote = if single { '\'' } else { '"' };
                start += &format!(" {}={quote}{}{quote}", ATTRIBUTES[attribute], VALUES[value]);
            }
            if !offers.is_empty() {
                start += &format!(" parameterAttributes='{offers}'");
            }
            (start, ELEMENTS[name], TEXTS[text].replace("-- --", "--"))
        });
    let whole = leaf
        .clone()
        .prop_map(|(start, name, text)| format!("{start}>{text}</{name}>"));
    whole.prop_recursive(3, 12, 3, move |inner| {
        (leaf.clone(), prop::collection::vec(inner, 0..3)).prop_map(
            |((start, name, text), children)| {
                format!("{start}>{text}{}</{name}>", children.concat())
            },
        )
    })
}

fn keys() -> impl Strategy<Value = String> {
    let part = prop::sample::select(vec![
        "A",
        "B",
        "Position",
        "ManeuverGroup",
        "",
        "x",
        "EntityRef",
    ]);
    let one = (
        prop::collection::vec(part, 0..3),
        0..ATTRIBUTES.len(),
        0..VALUES.len(),
    )
        .prop_map(|(path, attribute, value)| {
            let mut path: Vec<&str> = path;
            path.push(ATTRIBUTES[attribute]);
            key(&path.join("."), VALUES[value])
        });
    prop::collection::vec(one, 0..4).prop_map(|keys| keys.concat())
}

fn scenario() -> impl Strategy<Value = String> {
    let taken = (
        0..NAMES.len(),
        prop::collection::vec((0..GROUPS.len(), keys()), 0..3),
        keys(),
        any::<bool>(),
    )
        .prop_map(|(name, uses, direct, both)| {
            let mut inside: String = uses
                .iter()
                .map(|(group, keys)| named(GROUPS[*group], keys))
                .collect();
            if both {
                inside += &direct;
            }
            referring(NAMES[name], &inside)
        });
    let plain = (
        prop::sample::select(vec!["G", "H"]),
        prop::collection::vec(element(), 0..4),
    )
        .prop_map(|(name, content)| group(name, &content.concat()));
    let one = prop_oneof![1 => taken, 2 => plain];
    prop::collection::vec(one, 0..4).prop_map(|groups| main_with(&groups.concat()))
}

/// Generates a scenario that has at least one plain group `G` and one `H`.
fn library() -> impl Strategy<Value = String> {
    let content = || prop::collection::vec(element(), 1..4);
    (scenario(), content(), content()).prop_map(|(scenario, one, other)| {
        let groups = group("G", &one.concat()) + &group("H", &other.concat());
        scenario.replace("<Act>", &format!("<Act>{groups}"))
    })
}

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 800,
        rng_seed: prop::test_runner::RngSeed::Fixed(11),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

#[test]
fn random_scenarios_expand_the_same_every_time() {
    let mut runner = proptest::test_runner::TestRunner::new(config());
    let files = (scenario(), library(), library(), library(), library());
    let mut whole = 0;
    for _ in 0..800 {
        let Ok(tree) = files.new_tree(&mut runner) else {
            panic!("a scenario must be generated")
        };
        let (main, lib, other, inner, deep) = tree.current();
        let inner = fuzzing_pack(&[("main.xosc", inner), ("lib.xosc", deep)]);
        let files = [
            ("main.xosc".to_owned(), main.into_bytes()),
            ("lib.xosc".to_owned(), lib.into_bytes()),
            ("other.xosc".to_owned(), other.into_bytes()),
            ("in.mosc".to_owned(), inner),
        ];
        let first = fuzzing::assembled(&files);
        assert_eq!(
            first,
            fuzzing::assembled(&files),
            "the result is always the same"
        );
        let from_library = |text: &String| text.contains("P.G") || text.contains("name='P'");
        whole += usize::from(matches!(&first, Outcome::Expanded(text) if from_library(text)));
    }
    assert!(whole > 80, "only {whole} of 800 scenarios used a library");
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn damaged_archives_never_panic(
        main in scenario(),
        lib in scenario(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4u8), 1..6),
    ) {
        let mut bytes = fuzzing_pack(&[("main.xosc", main), ("lib.xosc", lib)]);
        for (at, byte, kind) in edits {
            if bytes.is_empty() { break; }
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => { bytes.remove(at); }
                2 => bytes.insert(at, byte),
                _ => bytes.truncate(at.max(1)),
            }
        }
        fuzzing::archive(&bytes);
    }
}
