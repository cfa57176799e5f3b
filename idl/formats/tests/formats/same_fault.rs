//! Joining of findings about one fault.

use proptest::prelude::*;
use qcbus_formats::Verdict;
use qcbus_formats::pool::{self, ALSO, ALSO_HERE, Cause, NoPlaces, PoolInput, Pooled};
use qcbus_formats::xqar::{Issue, Level, Locations};

use crate::common::{OTHER_UID, bundle, checker, input, issue, xml_place};

fn about(key: &str, follows: bool, issue: Issue) -> Issue {
    let cause = Cause {
        key: key.to_owned(),
        follows,
    };
    Issue {
        domain_info: vec![cause.to_info()],
        ..issue
    }
}

fn at(xpath: &str, issue: Issue) -> Issue {
    Issue {
        locations: vec![xml_place(xpath)],
        ..issue
    }
}

fn pooled(checkers: Vec<(&str, Vec<Issue>)>, separate: bool) -> Pooled {
    let checkers = checkers.into_iter().map(|(id, issues)| checker(id, issues));
    let input = PoolInput {
        separate,
        ..input(vec![bundle("xodrBundle", "xodr", checkers.collect())])
    };
    pool::pool(input, &mut NoPlaces)
}

fn issues(pooled: &Pooled) -> Vec<&Issue> {
    let checkers = pooled.results.bundles.iter().flat_map(|it| &it.checkers);
    checkers.flat_map(|it| &it.issues).collect()
}

fn places(issue: &Issue) -> Vec<&str> {
    issue
        .locations
        .iter()
        .map(|it| it.description.as_str())
        .collect()
}

#[test]
fn consequence_becomes_place_of_its_cause() {
    let lane = about("gap", true, issue(Level::Error, "the lanes lie apart"));
    let road = about("gap", false, issue(Level::Error, "the roads lie apart"));
    let pooled = pooled(vec![("lanes", vec![lane]), ("roads", vec![road])], false);
    let issues = issues(&pooled);
    assert_eq!(issues.len(), 1, "{issues:?}");
    assert_eq!(issues[0].description, "the roads lie apart");
    assert_eq!(
        places(issues[0]),
        ["also: the lanes lie apart [road.length]"]
    );
    assert_eq!(issues[0].domain_info, [], "causes are not for people");
    assert_eq!(pooled.counts.errors, 1);
    let summaries: Vec<&str> = pooled.results.bundles[0]
        .checkers
        .iter()
        .map(|it| &*it.summary)
        .collect();
    assert_eq!(
        summaries,
        [
            "1 issue. 1 of them is a place of another issue.",
            "1 issue."
        ]
    );
}

#[test]
fn error_is_never_a_place_of_a_warning() {
    let cause = about("gap", false, issue(Level::Warning, "the roads lie apart"));
    let consequence = about("gap", true, issue(Level::Error, "the lanes lie apart"));
    let pooled = pooled(
        vec![("roads", vec![cause]), ("lanes", vec![consequence])],
        false,
    );
    let issues = issues(&pooled);
    assert_eq!(issues.len(), 1);
    assert_eq!(issues[0].level, Level::Error);
    assert_eq!(pooled.verdict(), Verdict::Rejected);
}

#[test]
fn findings_of_two_checkers_about_one_attribute_are_joined() {
    let xpath = "/OpenDRIVE/road[@id='1']/@length";
    let one = at(xpath, issue(Level::Error, "the length must be a number"));
    let other = at(xpath, issue(Level::Error, "the length must be positive"));
    let other = Issue {
        rule_uid: OTHER_UID.to_owned(),
        ..other
    };
    let elsewhere = at(
        "/OpenDRIVE/road[@id='2']/@length",
        issue(Level::Error, "the length is 2"),
    );
    let element = at("/OpenDRIVE/road[@id='1']", issue(Level::Error, "no lanes"));
    let pooled = pooled(
        vec![
            ("schema", vec![one]),
            ("length", vec![other, elsewhere, element]),
        ],
        false,
    );
    let issues = issues(&pooled);
    let texts: Vec<&str> = issues.iter().map(|it| it.description.as_str()).collect();
    assert_eq!(
        texts,
        ["the length must be a number", "the length is 2", "no lanes"]
    );
    let last = "also: the length must be positive [header.attributes]";
    assert_eq!(places(issues[0]), ["the road", last]);
    assert_eq!(issues[0].domain_info, [pool::rule_info(OTHER_UID)]);
}

#[test]
fn same_words_at_several_places_are_one_finding() {
    let road = |id: u32, text: &str| {
        at(
            &format!("/OpenDRIVE/road[@id='{id}']"),
            issue(Level::Warning, text),
        )
    };
    let found = vec![road(1, "no type"), road(2, "no type"), road(3, "no lanes")];
    let pooled = pooled(vec![("roads", found)], false);
    let issues = issues(&pooled);
    assert_eq!(issues.len(), 2);
    assert_eq!(places(issues[0]), ["the road", ALSO_HERE]);
    assert_eq!(places(issues[1]), ["the road"]);
}

#[test]
fn issues_of_own_rules_stay_separate_unless_they_name_a_fault() {
    let own = |text: &str| Issue {
        rule_uid: "acme.example:xodr:1.0.0:lane.paint".to_owned(),
        ..at(
            "/OpenDRIVE/road[@id='1']/@name",
            issue(Level::Warning, text),
        )
    };
    let unnamed = |text: &str| Issue {
        rule_uid: String::new(),
        ..own(text)
    };
    let found = vec![own("no paint"), own("no paint"), own("no name")];
    let nameless = vec![unnamed("no paint"), unnamed("no paint")];
    let apart = pooled(vec![("paint", found), ("nameless", nameless)], false);
    assert_eq!(issues(&apart).len(), 5);
    let named = vec![
        about("paint", false, own("no paint")),
        about("paint", false, own("no paint")),
    ];
    assert_eq!(issues(&pooled(vec![("paint", named)], false)).len(), 1);
}

#[test]
fn findings_stay_separate_on_request() {
    let found = vec![
        about("gap", false, issue(Level::Error, "a")),
        about("gap", true, issue(Level::Error, "b")),
    ];
    let pooled = pooled(vec![("roads", found)], true);
    let issues = issues(&pooled);
    assert_eq!(issues.len(), 2);
    assert!(issues.iter().all(|it| it.domain_info.is_empty()));
}

fn any_issue() -> impl Strategy<Value = Issue> {
    let level = prop_oneof![
        Just(Level::Error),
        Just(Level::Warning),
        Just(Level::Information)
    ];
    let key = proptest::option::of((0..4_u8, any::<bool>()));
    (level, 0..6_u8, key, 0..5_u8).prop_map(|(level, text, key, place)| {
        let xpath = match place {
            0 => "/OpenDRIVE/header".to_owned(),
            place => format!("/OpenDRIVE/road[@id='{place}']/@length"),
        };
        let issue = at(&xpath, issue(level, &format!("fault {text}")));
        match key {
            Some((key, follows)) => about(&key.to_string(), follows, issue),
            None => issue,
        }
    })
}

proptest! {
    /// Joining changes neither the verdict nor the worst level, and every finding is still told.
    #[test]
    fn nothing_is_lost_and_no_verdict_changes(
        all in prop::collection::vec(prop::collection::vec(any_issue(), 0..6), 1..4)
    ) {
        let ids = ["a", "b", "c"];
        let checkers: Vec<_> = ids.into_iter().zip(all).collect();
        let apart = pooled(checkers.clone(), true);
        let joined = pooled(checkers, false);
        prop_assert_eq!(apart.verdict(), joined.verdict());
        let worst = |pooled: &Pooled| issues(pooled).iter().map(|it| it.level).min();
        prop_assert_eq!(worst(&apart), worst(&joined));
        // Each finding is an issue or a place.
        let told: usize = issues(&joined).iter().map(|it| it.locations.len()).sum();
        prop_assert_eq!(told, issues(&apart).len());
        for issue in issues(&apart) {
            let also = format!("{ALSO}{} [", issue.description);
            let is_told = issues(&joined).iter().any(|it| {
                it.description == issue.description || places(it).iter().any(|it| it.starts_with(&also))
            });
            prop_assert!(is_told, "{} is lost", issue.description);
        }
        // No two findings that are left are about one attribute.
        let attributes: Vec<&Locations> = issues(&joined)
            .iter()
            .flat_map(|it| it.locations.first())
            .filter(|it| format!("{it:?}").contains("/@"))
            .collect();
        for (number, one) in attributes.iter().enumerate() {
            let others = &attributes[number + 1..];
            prop_assert!(others.iter().all(|it| it.places != one.places));
        }
    }
}
