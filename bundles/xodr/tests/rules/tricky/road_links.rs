//! Tests of links between roads, in all combinations of contact points.

use super::Row;
use super::build::{PI, Road, lane, link, section};

/// Two roads of 100 m with a lane on each side, end to end.
struct Pair<'a> {
    links: [&'a str; 2],
    /// x and heading of the second road.
    second: [&'a str; 2],
    /// Links of the lanes 1 and -1, in the first and in the second road.
    lanes: [[&'a str; 2]; 2],
    profiles: [&'a str; 2],
}

/// End to start.
const ALONG: Pair<'_> = Pair {
    links: ["s2 start", "p1 end"],
    second: ["100", "0"],
    lanes: [["s1", "s-1"], ["p1", "p-1"]],
    profiles: ["", ""],
};

/// End to end.
const HEAD_ON: Pair<'_> = Pair {
    links: ["s2 end", "s1 end"],
    second: ["200", PI],
    lanes: [["s-1", "s1"], ["s-1", "s1"]],
    profiles: ["", ""],
};

impl Pair<'_> {
    fn text(&self) -> String {
        let lanes = self
            .lanes
            .map(|[left, right]| section("\"0\"", &lane("1", left), &lane("-1", right)));
        let links = self.links.map(|one| match one {
            "" => String::new(),
            one => link(&[one]),
        });
        let first = Road {
            link: &links[0],
            lanes: &lanes[0],
            profiles: self.profiles[0],
            ..Road::default()
        };
        let second = Road {
            id: "2",
            pose: [self.second[0], "0", self.second[1]],
            link: &links[1],
            lanes: &lanes[1],
            profiles: self.profiles[1],
            ..Road::default()
        };
        format!("{}{}", first.text(), second.text())
    }
}

const RISING: &str =
    r#"<elevationProfile><elevation s="0" a="0" b="0.1" c="0" d="0"/></elevationProfile>"#;
const FALLING: &str =
    r#"<elevationProfile><elevation s="0" a="20" b="-0.1" c="0" d="0"/></elevationProfile>"#;
const LEFT_UP: &str =
    r#"<lateralProfile><superelevation s="0" a="0.05" b="0" c="0" d="0"/></lateralProfile>"#;
const RIGHT_UP: &str =
    r#"<lateralProfile><superelevation s="0" a="-0.05" b="0" c="0" d="0"/></lateralProfile>"#;

#[test]
fn links_between_two_roads_give_expected_findings() {
    let rows: Vec<Row> = vec![
        ("end to start", ALONG.text(), &[]),
        ("end to end", HEAD_ON.text(), &[]),
        (
            "start to start",
            Pair {
                links: ["p2 start", "p1 start"],
                second: ["0", PI],
                lanes: [["p-1", "p1"], ["p-1", "p1"]],
                ..ALONG
            }
            .text(),
            &[],
        ),
        (
            "end to end with the signs of end to start",
            Pair {
                lanes: [["s1", "s-1"], ["s1", "s-1"]],
                ..HEAD_ON
            }
            .text(),
            &[
                "error lane_smoothness_contact_point_no_horizontal_gaps",
                "error road_lane_link_direction",
            ],
        ),
        (
            "a slope goes on against s",
            Pair {
                profiles: [RISING, FALLING],
                ..HEAD_ON
            }
            .text(),
            &[],
        ),
        (
            "a hill with a sharp top",
            Pair {
                profiles: [RISING, RISING],
                ..HEAD_ON
            }
            .text(),
            &["warning lane_smoothness_contact_point_no_vertical_kinks"],
        ),
        (
            "a crossfall goes on against s",
            Pair {
                profiles: [LEFT_UP, RIGHT_UP],
                ..HEAD_ON
            }
            .text(),
            &[],
        ),
        (
            "a crossfall that turns over",
            Pair {
                profiles: [LEFT_UP, LEFT_UP],
                ..HEAD_ON
            }
            .text(),
            &["error lane_smoothness_contact_point_no_vertical_gaps"],
        ),
        (
            "one side only",
            Pair {
                links: ["s2 start", ""],
                lanes: [["", ""], ["", ""]],
                ..ALONG
            }
            .text(),
            &[
                "error road_linkage_both_sides_consistency",
                "warning road_lane_link_lanes_across_roads",
            ],
        ),
        (
            "lanes that nobody links",
            Pair {
                lanes: [["", ""], ["", ""]],
                ..ALONG
            }
            .text(),
            &["warning road_lane_link_lanes_across_roads"],
        ),
        (
            "lanes that nobody links, end to end",
            Pair {
                lanes: [["", ""], ["", ""]],
                ..HEAD_ON
            }
            .text(),
            &["warning road_lane_link_lanes_across_roads"],
        ),
        (
            "a metre in between",
            Pair {
                second: ["101", "0"],
                ..ALONG
            }
            .text(),
            &["error road_geometry_contact_point"],
        ),
        (
            "half a metre in between: the roads touch, their lanes do not",
            Pair {
                second: ["100.5", "0"],
                ..ALONG
            }
            .text(),
            &[
                "error lane_smoothness_contact_point_no_horizontal_gaps",
                "error road_geometry_contact_point",
            ],
        ),
        (
            "three centimetres in between",
            Pair {
                second: ["100.03", "0"],
                ..ALONG
            }
            .text(),
            &[
                "warning lane_smoothness_contact_point_no_horizontal_gaps",
                "warning road_geometry_contact_point",
            ],
        ),
        (
            "the wrong end",
            Pair {
                links: ["s2 end", "p1 end"],
                ..ALONG
            }
            .text(),
            &[
                "error road_geometry_contact_point",
                "warning road_lane_link_lanes_across_lane_sections",
                "error road_lane_link_lanes_across_lane_sections",
                "error road_linkage_both_sides_consistency",
            ],
        ),
    ];
    super::run(&rows);
}

#[test]
fn self_following_road_gives_expected_findings() {
    let lanes = section("\"0\"", "", &lane("-1", "p-1 s-1"));
    let ring = Road {
        length: "62.83185307179586",
        link: &link(&["p1 end", "s1 start"]),
        lanes: &lanes,
        ..Road::default()
    };
    let circle = super::build::geometry(
        "0",
        "0",
        "0",
        "0",
        "62.83185307179586",
        r#"<arc curvature="0.1"/>"#,
    );
    let straight = Road {
        link: &link(&["p1 end", "s1 start"]),
        lanes: &lanes,
        ..Road::default()
    };
    let rows: Vec<Row> = vec![
        ("a circle", ring.with_plan_view(&circle), &[]),
        (
            "a straight line",
            straight.text(),
            &[
                "error lane_smoothness_contact_point_no_horizontal_gaps",
                "error road_geometry_contact_point",
            ],
        ),
    ];
    super::run(&rows);
}

#[test]
fn lanes_far_from_reference_lines_give_expected_findings() {
    const LANES: &[&str] = &["error lane_smoothness_contact_point_no_horizontal_gaps"];
    const LINES: &[&str] = &["error road_geometry_contact_point"];
    let row = |offset: &str, y: &str| {
        let section =
            |links: [&str; 2]| section("\"0\"", &lane("1", links[0]), &lane("-1", links[1]));
        let second = format!(
            "<laneOffset s=\"0\" a=\"{offset}\" b=\"0\" c=\"0\" d=\"0\"/>{}",
            section(["p1", "p-1"])
        );
        let first = Road {
            link: &link(&["s2 start"]),
            lanes: &section(["s1", "s-1"]),
            ..Road::default()
        };
        let second = Road {
            id: "2",
            pose: ["100", y, "0"],
            link: &link(&["p1 end"]),
            lanes: &second,
            ..Road::default()
        };
        format!("{}{}", first.text(), second.text())
    };
    let rows: Vec<Row> = vec![
        (
            "to the left",
            row("30", "0"),
            &["error road_linkage_ends_meet"],
        ),
        (
            "to the right",
            row("-8", "0"),
            &["error road_linkage_ends_meet"],
        ),
        ("mouths that touch", row("7", "0"), LANES),
        ("an offset that makes up for a place", row("7", "-7"), LINES),
        (
            "half a metre between the lines as well",
            row("30", "0.5"),
            &[
                "error road_geometry_contact_point",
                "error road_linkage_ends_meet",
            ],
        ),
        ("neither lines nor roads", row("30", "2"), LINES),
    ];
    super::run(&rows);
}
