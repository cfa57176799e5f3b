//! Tests of connections of roads and lanes around junctions, and in the whole map.

use super::Row;
use super::build::{PI, Road, lane, link, section};

/// Road 1 into junction 7, road 2 through it, road 3 out of it, and further elements.
struct Way<'a> {
    links: [&'a [&'a str]; 3],
    lanes: [String; 3],
    rule: &'a str,
    connection: &'a str,
    junction: &'a str,
}

const ONE: &str = r#"<connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start"><laneLink from="-1" to="-1"/></connection>"#;

impl Way<'_> {
    fn new() -> Way<'static> {
        let right = |links: &str| section("\"0\"", "", &lane("-1", links));
        Way {
            links: [&["sJ 7"], &["p1 end", "s3 start"], &["pJ 7"]],
            lanes: [right(""), right("p-1 s-1"), right("")],
            rule: "RHT",
            connection: ONE,
            junction: "7",
        }
    }

    fn text(&self) -> String {
        let pieces = [
            ("1", "0", "100", "-1"),
            ("2", "100", "20", self.junction),
            ("3", "120", "100", "-1"),
        ];
        let places = pieces.into_iter().zip(self.links).zip(&self.lanes);
        let roads = places.map(|(((id, x, length, junction), links), lanes)| {
            let road = Road {
                id,
                pose: [x, "0", "0"],
                length,
                junction,
                rule: self.rule,
                link: &link(links),
                lanes,
                ..Road::default()
            };
            road.text()
        });
        format!(
            "{}<junction id=\"7\" name=\"\">{}</junction>\n",
            roads.collect::<String>(),
            self.connection
        )
    }
}

/// Two roads do not need a junction, so every map of this kind has this finding.
const TWO: &str = "warning junctions_common_when_to_use";

#[test]
fn lanes_entering_junctions_give_expected_findings() {
    let with = |lanes: [String; 3], connection| Way {
        lanes,
        connection,
        ..Way::new()
    };
    let right = |lanes: &[(&str, &str)]| {
        let lanes: String = lanes.iter().map(|(id, links)| lane(id, links)).collect();
        section("\"0\"", "", &lanes)
    };
    let left = |links: &str| section("\"0\"", &lane("1", links), "");
    let rows: [Row; 6] = [
        ("plain", Way::new().text(), &[TWO]),
        (
            "one connection for each lane",
            with(
                [
                    right(&[("-1", ""), ("-2", "")]),
                    right(&[("-1", "p-1 s-1"), ("-2", "p-2 s-2")]),
                    right(&[("-1", ""), ("-2", "")]),
                ],
                r#"<connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start"><laneLink from="-1" to="-1"/></connection><connection id="1" incomingRoad="1" connectingRoad="2" contactPoint="start"><laneLink from="-2" to="-2"/></connection>"#,
            )
            .text(),
            &[TWO, "error junctions_connection_one_link_to_incoming"],
        ),
        (
            "the lane links say all, the lanes nothing about where they begin",
            with([right(&[("-1", "")]), right(&[("-1", "s-1")]), right(&[("-1", "")])], ONE).text(),
            &[TWO],
        ),
        (
            "a lane that is linked where it begins and not where it ends",
            with([right(&[("-1", "")]), right(&[("-1", "p-1")]), right(&[("-1", "")])], ONE).text(),
            &[TWO, "error junctions_connecting_lane_linked"],
        ),
        (
            "left-hand traffic on the left",
            Way {
                rule: "LHT",
                ..with(
                    [left(""), left("p1 s1"), left("")],
                    r#"<connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start"><laneLink from="1" to="1"/></connection>"#,
                )
            }
            .text(),
            &[TWO],
        ),
        (
            "no lane links, and lanes of the same number",
            with(
                [right(&[("-1", "")]), right(&[("-1", "p-1 s-1")]), right(&[("-1", "")])],
                r#"<connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start"/>"#,
            )
            .text(),
            &[TWO],
        ),
    ];
    super::run(&rows);
}

#[test]
fn lanes_leaving_junctions_give_expected_findings() {
    let right = |lanes: &[(&str, &str)]| {
        let lanes: String = lanes.iter().map(|(id, links)| lane(id, links)).collect();
        section("\"0\"", "", &lanes)
    };
    let both = |links: [&str; 2]| section("\"0\"", &lane("1", links[0]), &lane("-1", links[1]));
    let through = || both(["p1 s1", "p-1 s-1"]);
    let plain = || both(["", ""]);
    let back = |contact: &str, link: &str| {
        let from = format!(
            r#"<connection id="1" incomingRoad="3" connectingRoad="2" contactPoint="{contact}">{link}</connection>"#
        );
        ONE.to_owned() + &from
    };
    let there_and_back = back("end", r#"<laneLink from="1" to="1"/>"#);
    const UNREACHED: &[&str] = &[TWO, "warning junctions_outgoing_lane_reached"];
    let rows: [Row; 5] = [
        (
            "a lane beside the one that is led to",
            Way {
                lanes: [
                    right(&[("-1", "")]),
                    right(&[("-1", "p-1 s-1")]),
                    right(&[("-1", ""), ("-2", "")]),
                ],
                ..Way::new()
            }
            .text(),
            UNREACHED,
        ),
        (
            "left-hand traffic: the way out of the first road is on the right",
            Way {
                lanes: [
                    both(["", ""]),
                    section("\"0\"", &lane("1", "p1 s1"), ""),
                    section("\"0\"", &lane("1", ""), ""),
                ],
                rule: "LHT",
                connection: r#"<connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start"><laneLink from="1" to="1"/></connection>"#,
                ..Way::new()
            }
            .text(),
            UNREACHED,
        ),
        (
            "both ways with a connection for each",
            Way {
                lanes: [plain(), through(), plain()],
                connection: &there_and_back,
                ..Way::new()
            }
            .text(),
            &[TWO],
        ),
        (
            "both ways with a connection for one",
            Way {
                lanes: [plain(), through(), plain()],
                ..Way::new()
            }
            .text(),
            &[TWO, "warning junctions_connection_lane_links_agree"],
        ),
        (
            "both ways, and lanes that name no lanes",
            Way {
                lanes: [plain(), both(["", ""]), plain()],
                connection: &there_and_back,
                ..Way::new()
            }
            .text(),
            &[TWO, "warning junctions_connecting_lane_linked"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn touching_road_ends_give_expected_findings() {
    let road = |id: &str, x: &str, hdg: &str| {
        let pose = [x, "0", hdg];
        Road {
            id,
            pose,
            ..Road::default()
        }
        .text()
    };
    let both = |id: &str, x: &str, hdg: &str| {
        let lanes = section("\"0\"", &lane("1", ""), &lane("-1", ""));
        let pose = [x, "0", hdg];
        Road {
            id,
            pose,
            lanes: &lanes,
            ..Road::default()
        }
        .text()
    };
    let half = "1.5707963267948966";
    let rows: [Row; 4] = [
        (
            "roads that touch head to head",
            both("1", "0", "0") + &both("2", "200", PI),
            &["warning road_linkage_touching_ends"],
        ),
        (
            "two roads from one place into opposite directions",
            both("1", "0", "0") + &both("2", "0", PI),
            &["warning road_linkage_touching_ends"],
        ),
        (
            "at a right angle",
            road("1", "0", "0") + &road("2", "100", half),
            &[],
        ),
        (
            "a decimetre apart",
            road("1", "0", "0") + &road("2", "100.1", "0"),
            &[],
        ),
    ];
    super::run(&rows);
}
