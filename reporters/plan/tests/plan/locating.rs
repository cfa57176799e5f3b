//! Tests of the places of findings.

use crate::support::{TWO_LANES, line, road, with_map};
use qcbus_plan::{How, Locator, Said, Spot, Target};

/// Returns two roads with the same id, 100 m long, side by side, and two junctions, one of them
/// with an outline.
fn network() -> String {
    let lanes = "<laneOffset s='0' a='0' b='0' c='0' d='0'/><laneOffset s='40' a='1' b='0' c='0' d='0'/>\
        <laneSection s='0'><left><lane id='1'><width sOffset='0' a='3' b='0' c='0' d='0'/></lane></left>\
        <center><lane id='0'/></center><right><lane id='-1'><link><predecessor id='-1'/><successor id='-1'/></link>\
        <width sOffset='0' a='4' b='0' c='0' d='0'/><roadMark sOffset='12' type='solid'/></lane>\
        <lane id='-2'><width sOffset='0' a='2' b='0' c='0' d='0'/></lane></right></laneSection>\
        <laneSection s='60'><center><lane id='0'/></center>\
        <right><lane id='-1'><width sOffset='0' a='4' b='0' c='0' d='0'/></lane></right><left><lane id='x'/></left></laneSection>";
    let geometries = line(0.0, 0.0, 0.0, 0.0, 70.0) + &line(70.0, 70.0, 0.0, 0.0, 30.0);
    let more = "<link><predecessor elementType='road' elementId='9'/><successor elementType='road' elementId='9'/></link>";
    let rest = "<elevationProfile><elevation s='0' a='0' b='0' c='0' d='0'/><elevation s='25' a='0' b='0' c='0' d='0'/>\
        <elevation s='500' a='0' b='0' c='0' d='0'/></elevationProfile>\
        <objects><object id='o' s='30' t='6'/><object id='o' s='31' t='7'><outline><cornerRoad s='32' t='8'/></outline></object></objects>\
        <signals><signal id='s' s='35' t='-5'><validity fromLane='-1' toLane='-1'/></signal><signalReference id='s' s='36' t='2'/></signals>";
    let one = road("5", "junction='j'", 100.0, &geometries, lanes)
        .replace("<planView>", &format!("{more}<planView>"))
        .replace("</road>", &format!("{rest}</road>"));
    let other = one.replace("y='0'", "y='50'");
    one + &other
        + "<junction id='j'><connection id='0' incomingRoad='5' connectingRoad='5' contactPoint='end'>\
           <laneLink from='-1' to='-1'/></connection></junction>\
           <junction id='k'><connection id='0' incomingRoad='5' linkedRoad='5' contactPoint='end'/></junction>\
           <controller id='c'/>"
}

fn locate(said: &Said<'_>) -> Spot {
    with_map(&network(), |map| Locator::new(map).locate(said))
}

fn element(xpath: &str) -> Spot {
    locate(&Said {
        xpath: Some(xpath),
        ..Said::default()
    })
}

fn expect(at: [f64; 2], how: How, on: &[Target]) -> Spot {
    Spot {
        at: Some(at),
        how: Some(how),
        on: on.to_vec(),
    }
}

const ROAD: Target = Target::Road { road: 0 };

fn section(section: usize) -> Target {
    Target::Section { road: 0, section }
}

fn lane(section: usize, lane: i64) -> Target {
    Target::Lane {
        road: 0,
        section,
        lane,
    }
}

#[test]
fn each_element_of_road_has_its_place() {
    let all: &[(&str, [f64; 2], Target)] = &[
        ("", [50.0, 0.0], ROAD),
        ("/@length", [50.0, 0.0], ROAD),
        ("/link/predecessor", [0.0, 0.0], ROAD),
        ("/link/successor/@elementId", [100.0, 0.0], ROAD),
        ("/planView", [50.0, 0.0], ROAD),
        ("/planView/geometry[2]", [70.0, 0.0], ROAD),
        ("/planView/geometry[2]/line", [70.0, 0.0], ROAD),
        ("/elevationProfile/elevation[2]/@a", [25.0, 0.0], ROAD),
        ("/elevationProfile/elevation[3]", [100.0, 0.0], ROAD),
        ("/lanes/laneOffset[2]", [40.0, 0.0], ROAD),
        ("/lanes/laneSection[1]", [30.0, 0.0], section(0)),
        ("/lanes/laneSection[2]", [80.0, 1.0], section(1)),
        ("/lanes/laneSection[1]/right", [30.0, 0.0], section(0)),
        ("/lanes/laneSection[1]/left/lane", [30.0, 1.5], lane(0, 1)),
        ("/lanes/laneSection[1]/center/lane", [30.0, 0.0], lane(0, 0)),
        (
            "/lanes/laneSection[1]/right/lane[@id='-1']",
            [30.0, -2.0],
            lane(0, -1),
        ),
        (
            "/lanes/laneSection[1]/right/lane[@id='-2']",
            [30.0, -5.0],
            lane(0, -2),
        ),
        (
            "/lanes/laneSection[2]/right/lane[1]",
            [80.0, -1.0],
            lane(1, -1),
        ),
        (
            "/lanes/laneSection[2]/left/lane[@id='x']",
            [80.0, 1.0],
            section(1),
        ),
        (
            "/lanes/laneSection[1]/right/lane[1]/roadMark/@type",
            [12.0, -2.0],
            lane(0, -1),
        ),
        (
            "/lanes/laneSection[1]/right/lane[1]/width[1]/@a",
            [0.0, -2.0],
            lane(0, -1),
        ),
        (
            "/lanes/laneSection[1]/right/lane[1]/link/predecessor",
            [0.0, -2.0],
            lane(0, -1),
        ),
        (
            "/lanes/laneSection[1]/right/lane[1]/link/successor",
            [60.0, -1.0],
            lane(0, -1),
        ),
        (
            "/objects/object[1]",
            [30.0, 6.0],
            Target::Object { object: 0 },
        ),
        (
            "/objects/object[2]/outline/cornerRoad",
            [31.0, 7.0],
            Target::Object { object: 1 },
        ),
        (
            "/signals/signal/validity",
            [35.0, -5.0],
            Target::Signal { signal: 0 },
        ),
        ("/signals/signalReference", [36.0, 2.0], ROAD),
    ];
    for (path, at, on) in all {
        let xpath = format!("/OpenDRIVE/road[1]{path}");
        assert_eq!(
            element(&xpath),
            expect(*at, How::Element, &[*on]),
            "{xpath}"
        );
    }
}

#[test]
fn duplicate_ids_resolve_to_intended_element() {
    let second = element("/OpenDRIVE/road[2]/objects/object[2]");
    let on = Target::Object { object: 3 };
    assert_eq!(second, expect([31.0, 57.0], How::Element, &[on]));
    let said = Said {
        xpath: Some("/OpenDRIVE/road[2]"),
        road: Some(("5", 10.0, 2.0)),
        position: None,
    };
    let on = Target::Road { road: 1 };
    assert_eq!(locate(&said), expect([10.0, 52.0], How::Road, &[on]));
    assert_eq!(element("/OpenDRIVE/road[@id='5']").on, [ROAD]);
}

#[test]
fn junctions_and_connections_have_places() {
    let junction = Target::Junction { junction: 0 };
    let middle = element("/OpenDRIVE/junction[1]");
    assert_eq!(
        (middle.how, &middle.on[..]),
        (Some(How::Element), &[junction][..])
    );
    let [x, y] = middle.at.unwrap();
    // Both roads with this id belong to the junction, so the hull surrounds both.
    assert!(
        (45.0..55.0).contains(&x) && (20.0..30.0).contains(&y),
        "{x}, {y}"
    );
    for path in ["/connection", "/connection/laneLink/@from"] {
        let found = element(&format!("/OpenDRIVE/junction[1]{path}"));
        assert_eq!(found, expect([0.0, 0.0], How::Element, &[ROAD, junction]));
    }
    let without_outline = element("/OpenDRIVE/junction[@id='k']");
    let junction = Target::Junction { junction: 1 };
    assert_eq!(
        without_outline,
        expect([100.0, 0.0], How::Element, &[junction])
    );
}

#[test]
fn most_exact_position_wins_and_target_comes_from_element() {
    let mut said = Said {
        xpath: Some("/OpenDRIVE/road[1]/lanes/laneSection[1]/right/lane[1]"),
        road: Some(("5", 10.0, 2.0)),
        position: Some((1.5, 2.5)),
    };
    let on = [lane(0, -1)];
    assert_eq!(locate(&said), expect([1.5, 2.5], How::Position, &on));
    said.position = Some((f64::NAN, 0.0));
    assert_eq!(locate(&said), expect([10.0, 2.0], How::Road, &on));
    said.position = Some((1e300, 0.0));
    said.road = Some(("5", 1e9, 0.0));
    assert_eq!(locate(&said), expect([30.0, -2.0], How::Element, &on));
    said.xpath = None;
    assert_eq!(
        locate(&said),
        Spot {
            at: None,
            how: None,
            on: vec![ROAD]
        }
    );
    said.road = Some(("nowhere", 0.0, 0.0));
    assert_eq!(locate(&said), Spot::default());
}

#[test]
fn elements_outside_plan_have_no_place() {
    let nothing = [
        "/OpenDRIVE",
        "/OpenDRIVE/header",
        "/OpenDRIVE/controller",
        "/OpenDRIVE/road[3]",
        "/OpenSCENARIO/road[1]",
        "/OpenDRIVE/road[0]",
        "/OpenDRIVE/road[@id='",
        "/OpenDRIVE//",
        "road[",
        "",
    ];
    for xpath in nothing {
        assert_eq!(element(xpath), Spot::default(), "{xpath}");
    }
}

#[test]
fn xpaths_of_other_tools_are_located() {
    let on = lane(0, -1);
    for xpath in [
        "//lane[@id='-1']",
        "/OpenDRIVE/road[1]/lanes/laneSection/right/lane[@id=\"-1\"]",
        "/OpenDRIVE[1]/road[1]/lanes[1]/laneSection[1]/right[1]/lane[1]",
        "/OpenDRIVE/road/lanes/laneSection[@s='0' and @s='0']/right/*[1]",
    ] {
        assert_eq!(element(xpath).on, [on], "{xpath}");
    }
}

#[test]
fn ten_thousand_findings_are_located_on_their_roads() {
    let roads: String = (0..500)
        .map(|id| {
            let geometry = line(0.0, 0.0, f64::from(id), 0.0, 100.0);
            road(&format!("r{id}"), "", 100.0, &geometry, TWO_LANES)
        })
        .collect();
    with_map(&roads, |map| {
        let locator = Locator::new(map);
        for finding in 0..10_000 {
            let id = finding % 500;
            let steps = "lanes/laneSection/right/lane[@id='-1']";
            let by_id = format!("/OpenDRIVE/road[@id='r{id}']/{steps}");
            let by_number = format!("/OpenDRIVE/road[{}]/{steps}", id + 1);
            for xpath in [&by_id, &by_number] {
                let said = Said {
                    xpath: Some(xpath),
                    ..Said::default()
                };
                let on = Target::Lane {
                    road: id,
                    section: 0,
                    lane: -1,
                };
                let at = [50.0, id as f64 - 1.5];
                assert_eq!(locator.locate(&said), expect(at, How::Element, &[on]));
            }
        }
    });
}
