//! Tests that written data can be read back unchanged.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use qcbus_formats::location::OtherPlace;
use qcbus_formats::xqar::{
    Checker, CheckerBundle, Dialect, DomainInfo, InfoElement, Issue, Level, Location, Locations,
    Metadata, Param, Results, Status, read, write,
};

/// Generates text that XML can contain, with everything that needs escaping.
fn text() -> impl Strategy<Value = String> {
    vec(
        prop_oneof![
            Just('<'),
            Just('>'),
            Just('&'),
            Just('"'),
            Just('\''),
            Just('\n'),
            Just('\r'),
            Just('\t'),
            Just(' '),
            Just(']'),
            prop::char::range('a', 'z'),
            prop::char::range('\u{20}', '\u{D7FF}'),
            prop::char::range('\u{10000}', '\u{10FFFF}'),
        ],
        0..12,
    )
    .prop_map(|chars| chars.into_iter().collect())
}

fn anything() -> impl Strategy<Value = String> {
    vec(any::<char>(), 0..12).prop_map(|chars| chars.into_iter().collect())
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>().prop_filter("NaN is not equal to itself", |x| !x.is_nan()),
        -1e3..1e3
    ]
}

fn location() -> impl Strategy<Value = Location> {
    prop_oneof![
        (1..u64::MAX, any::<u64>(), option::of(any::<u64>())).prop_map(|(row, column, offset)| {
            Location::File {
                row,
                column,
                offset,
            }
        }),
        text().prop_map(|xpath| Location::Xml { xpath }),
        (number(), number(), number()).prop_map(|(x, y, z)| Location::Inertial { x, y, z }),
        number().prop_map(|time| Location::Time { time }),
        (
            any::<u64>(),
            option::of(text()),
            option::of(text()),
            option::of(number())
        )
            .prop_map(|(index, channel, field, time)| Location::Message {
                index,
                channel,
                field,
                time
            }),
    ]
}

fn road() -> impl Strategy<Value = Location> {
    (text(), number(), number()).prop_map(|(road_id, s, t)| Location::Road { road_id, s, t })
}

fn elsewhere() -> impl Strategy<Value = OtherPlace> {
    let path = "/[a-zA-Z0-9:. ]{0,12}";
    (path, 1..1000_u64, 1..1000_u64, option::of("/[a-z]{1,5}")).prop_map(
        |(path, row, column, xpath)| OtherPlace {
            path,
            row,
            column,
            xpath,
        },
    )
}

/// Generates places in the order of this project: road positions are last in a place, and places
/// with only roads come at the end.
fn locations() -> impl Strategy<Value = Vec<Locations>> {
    let mixed = (
        text(),
        option::of(elsewhere()),
        vec(location(), 1..4),
        vec(road(), 0..3),
    )
        .prop_map(|(description, elsewhere, mut places, roads)| {
            places.extend(roads);
            Locations {
                description,
                elsewhere,
                places,
            }
        });
    let roads = (text(), vec(road(), 1..3)).prop_map(|(description, places)| Locations {
        description,
        elsewhere: None,
        places,
    });
    (vec(mixed, 0..3), vec(roads, 0..3)).prop_map(|(mut mixed, roads)| {
        mixed.extend(roads);
        mixed
    })
}

fn info_element() -> impl Strategy<Value = InfoElement> {
    let attributes = || {
        prop::collection::btree_map("[a-zA-Z_][a-zA-Z0-9._-]{0,6}", text(), 0..3).prop_map(|map| {
            map.into_iter()
                .filter(|(name, _)| name != "xmlns")
                .collect::<Vec<_>>()
        })
    };
    let leaf =
        ("[a-z]{1,6}", attributes(), text()).prop_map(|(name, attributes, text)| InfoElement {
            name,
            attributes,
            text,
            children: Vec::new(),
        });
    leaf.prop_recursive(3, 8, 3, move |inner| {
        let text = text().prop_map(|text| {
            if text.trim().is_empty() {
                String::new()
            } else {
                text
            }
        });
        ("[a-z]{1,6}", attributes(), text, vec(inner, 1..3)).prop_map(
            |(name, attributes, text, children)| InfoElement {
                name,
                attributes,
                text,
                children,
            },
        )
    })
}

fn issue() -> impl Strategy<Value = Issue> {
    let level = prop_oneof![
        Just(Level::Error),
        Just(Level::Warning),
        Just(Level::Information)
    ];
    let info = ("[a-z.]{1,8}", vec(info_element(), 0..3))
        .prop_map(|(name, content)| DomainInfo { name, content });
    (any::<u64>(), text(), level, locations(), vec(info, 0..2)).prop_map(
        |(id, description, level, locations, domain_info)| Issue {
            id,
            description,
            level,
            rule_uid: String::from("asam.net:xodr:1.4.0:a.b"),
            locations,
            domain_info,
        },
    )
}

fn param() -> impl Strategy<Value = Param> {
    ("[a-zA-Z.]{1,8}", text()).prop_map(|(name, value)| Param { name, value })
}

fn checker() -> impl Strategy<Value = Checker> {
    let status = prop_oneof![
        Just(None),
        Just(Some(Status::Completed)),
        Just(Some(Status::Skipped)),
        Just(Some(Status::Error)),
    ];
    let metadata = (text(), text(), text()).prop_map(|(key, value, description)| Metadata {
        key,
        value,
        description,
    });
    (
        text(),
        text(),
        status,
        vec(param(), 0..3),
        vec(issue(), 0..3),
        vec(metadata, 0..2),
    )
        .prop_map(|(id, summary, status, params, issues, metadata)| Checker {
            description: summary.as_str().into(),
            id: id.into(),
            summary: summary.into(),
            status,
            params,
            issues,
            addressed_rules: ["asam.net:xodr:1.4.0:a.b".into()].into(),
            metadata,
        })
}

fn results() -> impl Strategy<Value = Results> {
    let bundle = (text(), text(), vec(param(), 0..3), vec(checker(), 0..3)).prop_map(
        |(name, description, params, checkers)| CheckerBundle {
            version: description.clone(),
            build_date: String::from("2025-01-31"),
            summary: description.clone(),
            name,
            description,
            params,
            checkers,
        },
    );
    ("[0-9.]{1,5}", vec(bundle, 0..3)).prop_map(|(version, bundles)| Results { version, bundles })
}

/// Generates elements with any names and texts, as a careless or hostile bundle may send them.
fn wild_element() -> impl Strategy<Value = InfoElement> {
    let name = || prop_oneof![anything(), "[a-z:]{0,4}", Just(String::from("xmlns:a"))];
    let attributes = move || vec((name(), anything()), 0..4);
    let leaf =
        (name(), attributes(), anything()).prop_map(|(name, attributes, text)| InfoElement {
            name,
            attributes,
            text,
            children: Vec::new(),
        });
    leaf.prop_recursive(3, 8, 3, move |inner| {
        (name(), attributes(), anything(), vec(inner, 0..3)).prop_map(
            |(name, attributes, text, children)| InfoElement {
                name,
                attributes,
                text,
                children,
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn current_format_is_lossless(results in results()) {
        let written = write(&results, Dialect::Current);
        let back = read(written.as_bytes());
        prop_assert_eq!(back.as_ref(), Ok(&results), "{}", written);
        prop_assert_eq!(write(&results, Dialect::Current), written);
    }

    #[test]
    fn old_format_is_stable_when_written_again(results in results()) {
        let written = write(&results, Dialect::Qc4Openx);
        let back = read(written.as_bytes()).unwrap();
        prop_assert_eq!(write(&back, Dialect::Qc4Openx), written);
    }

    #[test]
    fn any_text_and_names_can_be_read_again(
        texts in vec(anything(), 4),
        content in vec(wild_element(), 0..3),
    ) {
        let info = DomainInfo { name: texts[0].clone(), content };
        let issue = Issue {
            id: 0,
            description: texts[1].clone(),
            level: Level::Error,
            rule_uid: texts[2].clone(),
            locations: vec![Locations { description: texts[3].clone(), ..Locations::default() }],
            domain_info: vec![info],
        };
        let checker = Checker { id: texts[3].as_str().into(), issues: vec![issue], ..Checker::default() };
        let bundle = CheckerBundle { checkers: vec![checker], ..CheckerBundle::default() };
        let results = Results { version: texts[0].clone(), bundles: vec![bundle] };
        for dialect in [Dialect::Current, Dialect::Qc4Openx] {
            let written = write(&results, dialect);
            let back = read(written.as_bytes());
            prop_assert!(back.is_ok(), "{:?}\n{}", back, written);
            prop_assert_eq!(write(&back.unwrap(), dialect), written);
        }
    }
}
