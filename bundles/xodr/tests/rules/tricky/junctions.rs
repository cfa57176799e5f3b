//! Tests of junctions of all types.

use super::Row;
use super::build::{PI, Road, lane, link, section};

fn connection(id: &str, roads: [&str; 2], contact: &str, links: [&str; 2], to: &str) -> String {
    format!(
        r#"<connection id="{id}" incomingRoad="{}" {to}="{}" contactPoint="{contact}"><laneLink from="{}" to="{}"/></connection>"#,
        roads[0], roads[1], links[0], links[1]
    )
}

/// Two roads with lanes on both sides, and a connecting road for each direction.
struct Common<'a> {
    rule: &'a str,
    id: &'a str,
    /// Links of the incoming road 1 and of the connecting road 2, then the pose of road 2 and its
    /// lane.
    incoming: &'a [&'a str],
    links: &'a [&'a str],
    pose: [&'a str; 3],
    lane: [&'a str; 2],
    connections: String,
}

impl Common<'_> {
    fn new() -> Common<'static> {
        Common {
            rule: "RHT",
            id: "7",
            incoming: &["sJ 7"],
            links: &["p1 end", "s3 start"],
            pose: ["100", "0", "0"],
            lane: ["-1", "p-1 s-1"],
            connections: format!(
                "{}{}",
                connection("0", ["1", "2"], "start", ["-1", "-1"], "connectingRoad"),
                connection("1", ["3", "4"], "end", ["1", "1"], "connectingRoad")
            ),
        }
    }

    fn text(&self) -> String {
        let both = section("\"0\"", &lane("1", ""), &lane("-1", ""));
        let own = lane(self.lane[0], self.lane[1]);
        let own = match self.lane[0].starts_with('-') {
            true => section("\"0\"", "", &own),
            false => section("\"0\"", &own, ""),
        };
        let base = Road {
            rule: self.rule,
            ..Road::default()
        };
        let road = |road: Road<'_>| road.text();
        let roads = [
            road(Road {
                link: &link(self.incoming),
                lanes: &both,
                ..base
            }),
            road(Road {
                id: "2",
                length: "20",
                junction: self.id,
                pose: self.pose,
                link: &link(self.links),
                lanes: &own,
                rule: self.rule,
                ..Road::default()
            }),
            road(Road {
                id: "3",
                pose: ["120", "0", "0"],
                link: &link(&[&format!("pJ {}", self.id)]),
                lanes: &both,
                rule: self.rule,
                ..Road::default()
            }),
            road(Road {
                id: "4",
                length: "20",
                junction: self.id,
                pose: ["100", "0", "0"],
                link: &link(&["p1 end", "s3 start"]),
                lanes: &section("\"0\"", &lane("1", "p1 s1"), ""),
                rule: self.rule,
                ..Road::default()
            }),
        ];
        let onto = match self.rule {
            "LHT" => lane("1", ""),
            // No lane leads onto it.
            _ => lane("1", "").replace("driving", "restricted"),
        };
        // A junction needs a third road.
        let third = Road {
            id: "5",
            length: "50",
            pose: ["110", "-65", "1.5707963267948966"],
            link: &link(&[&format!("sJ {}", self.id)]),
            lanes: &section("\"0\"", &onto, &lane("-1", "")),
            rule: self.rule,
            ..Road::default()
        };
        let turn = Road {
            id: "6",
            length: "15",
            junction: self.id,
            pose: ["110", "-15", "1.5707963267948966"],
            link: &link(&["p5 end"]),
            lanes: &section(
                "\"0\"",
                "",
                // The lane leads nowhere, so it is restricted.
                &lane("-1", "p-1").replace("driving", "restricted"),
            ),
            rule: self.rule,
            ..Road::default()
        };
        let last = match self.rule {
            "LHT" => String::new(),
            _ => connection("2", ["5", "6"], "start", ["-1", "-1"], "connectingRoad"),
        };
        format!(
            "{}{}{}<junction id=\"{}\" name=\"\">{}{last}</junction>\n",
            roads.concat(),
            third.text(),
            turn.text(),
            self.id,
            self.connections
        )
    }
}

#[test]
fn common_junctions_give_expected_findings() {
    let against = Common {
        links: &["p3 start", "s1 end"],
        pose: ["120", "0", PI],
        lane: ["1", "p-1 s-1"],
        ..Common::new()
    };
    let with = |contact: &str| Common {
        connections: format!(
            "{}{}",
            connection("0", ["1", "2"], contact, ["-1", "1"], "connectingRoad"),
            connection("1", ["3", "4"], "end", ["1", "1"], "connectingRoad")
        ),
        ..Common {
            links: against.links,
            pose: against.pose,
            lane: against.lane,
            ..Common::new()
        }
    };
    let replaced = |from: &str, to: &str| Common {
        connections: Common::new().connections.replace(from, to),
        ..Common::new()
    };
    let rows: Vec<Row> = vec![
        ("plain", Common::new().text(), &[]),
        (
            "an id that means no junction",
            ["junction=", "elementId=", "<junction id="]
                .iter()
                .fold(Common::new().text(), |text, at| {
                    text.replace(&format!("{at}\"7\""), &format!("{at}\"-1\""))
                }),
            &["error junctions_cross_path_correct_junction_id"],
        ),
        (
            "an id in words",
            Common {
                id: "seven",
                incoming: &["sJ seven"],
                ..Common::new()
            }
            .text(),
            &[],
        ),
        ("a connecting road that runs back", with("end").text(), &[]),
        (
            "a connecting road that lies elsewhere",
            Common {
                pose: ["100", "400", "0"],
                ..Common::new()
            }
            .text(),
            &["error road_linkage_ends_meet"],
        ),
        (
            "a connecting road that runs back, at the wrong end",
            with("start").text(),
            &[
                "error junctions_connection_one_link_to_incoming",
                "error junctions_connection_start_along_linkage",
            ],
        ),
        (
            "no contact point",
            replaced(
                "connectingRoad=\"2\" contactPoint=\"start\"",
                "connectingRoad=\"2\"",
            )
            .text(),
            &["error junctions_connection_required_attributes"],
        ),
        (
            "no such lane",
            replaced("from=\"-1\"", "from=\"-3\"").text(),
            &["error ids_only_ref_defined_ids"],
        ),
        (
            "a linked road",
            replaced("connectingRoad=\"2\"", "linkedRoad=\"2\"").text(),
            &["error junctions_type_default_no_linked_road"],
        ),
        (
            "an incoming road that does not know it",
            Common {
                incoming: &[],
                ..Common::new()
            }
            .text(),
            &["error junctions_incoming_road_linked"],
        ),
        (
            "left-hand traffic, linked as if it were right-hand",
            Common {
                rule: "LHT",
                ..Common::new()
            }
            .text(),
            &[
                "error junctions_connection_one_link_to_incoming",
                "error road_linkage_both_sides_consistency",
                "warning junctions_common_when_to_use",
                "warning junctions_incoming_lane_used",
            ],
        ),
    ];
    super::run(&rows);
}

/// Returns a road of two lanes and the roads that it splits into.
fn direct(ramp: &[&str], heading: &str, roads: [&str; 2]) -> String {
    let lanes = format!("{}{}", lane("-1", ""), lane("-2", ""));
    let first = Road {
        link: &link(&["sJ 7"]),
        lanes: &section("\"0\"", "", &lanes),
        ..Road::default()
    };
    let main = Road {
        id: "2",
        pose: ["100", "0", "0"],
        link: &link(&["pJ 7"]),
        ..Road::default()
    };
    let exit = Road {
        id: "3",
        pose: ["100", "-3.5", heading],
        link: &link(ramp),
        ..Road::default()
    };
    format!(
        "{}{}{}<junction id=\"7\" name=\"\" type=\"direct\">{}{}</junction>\n",
        first.text(),
        main.text(),
        exit.text(),
        connection("0", ["1", roads[0]], "start", ["-1", "-1"], "linkedRoad"),
        connection("1", ["1", roads[1]], "start", ["-2", "-1"], "linkedRoad")
    )
}

#[test]
fn direct_junctions_give_expected_findings() {
    let rows: Vec<Row> = vec![
        ("plain", direct(&["pJ 7"], "0", ["2", "3"]), &[]),
        (
            "an exit that does not know it",
            direct(&[], "0", ["2", "3"]),
            &["error road_linkage_both_sides_consistency"],
        ),
        (
            "an exit that bends off at once",
            direct(&["pJ 7"], "-0.1", ["2", "3"]),
            &[
                "warning junctions_direct_linked_lane_smoothness",
                "error junctions_direct_road_ramp_heading",
                "error lane_smoothness_contact_point_no_horizontal_gaps",
            ],
        ),
        (
            "lanes crosswise",
            direct(&["pJ 7"], "0", ["3", "2"]),
            &[
                "error junctions_direct_split_or_merge",
                "error lane_smoothness_contact_point_no_horizontal_gaps",
            ],
        ),
    ];
    super::run(&rows);
}

#[test]
fn virtual_junctions_give_expected_findings() {
    let with = |attributes: &str| {
        format!(
            "{}<junction id=\"7\" name=\"\" type=\"virtual\" {attributes}/>\n",
            Road::default().text()
        )
    };
    let rows: Vec<Row> = vec![
        (
            "without connections",
            with(r#"mainRoad="1" sStart="40" sEnd="60" orientation="none""#),
            &[],
        ),
        (
            "without a place",
            with(""),
            &["error junctions_virtual_only_one_start_end"],
        ),
        (
            "from back to front",
            with(r#"mainRoad="1" sStart="60" sEnd="40" orientation="+""#),
            &["error junctions_virtual_only_one_start_end"],
        ),
        (
            "beyond the main road",
            with(r#"mainRoad="1" sStart="60" sEnd="140" orientation="+""#),
            &["error junctions_virtual_only_one_start_end"],
        ),
    ];
    super::run(&rows);
}
