//! Tests of lanes that close a way, of steps and corners, and of objects in the way.

use super::Row;
use super::build::{LINE, Road, geometry, lane, section};

/// Returns a road of three sections with these types of the right lanes in the middle one.
fn middle(kinds: &[&str], extra: &str) -> String {
    let lanes = |links: &str, kinds: &[&str], extra: &str| {
        let one = |(index, kind): (usize, &&str)| {
            let id = format!("-{}", index + 1);
            let links = links.replace("-1", &id);
            let own = lane(&id, &links).replace("driving", kind);
            own.replace("</lane>", &format!("{extra}</lane>"))
        };
        kinds.iter().enumerate().map(one).collect::<String>()
    };
    let around = vec!["driving"; kinds.len()];
    let lanes = format!(
        "{}{}{}",
        section("\"0\"", "", &lanes("s-1", &around, "")),
        section("\"40\"", "", &lanes("p-1 s-1", kinds, extra)),
        section("\"60\"", "", &lanes("p-1", &around, ""))
    );
    Road {
        lanes: &lanes,
        ..Road::default()
    }
    .text()
}

#[test]
fn lanes_between_driving_lanes_give_expected_findings() {
    let closed: &[&str] = &["warning road_lane_link_types"];
    let rows: Vec<Row> = vec![
        ("a road that ends in nothing", middle(&["none"], ""), closed),
        ("a border across the road", middle(&["border"], ""), closed),
        ("bicycles only", middle(&["biking"], ""), closed),
        (
            "both lanes closed",
            middle(&["none", "restricted"], ""),
            closed,
        ),
        (
            "a lane beside the closed one",
            middle(&["driving", "restricted"], ""),
            &[],
        ),
        (
            "a lane for both directions on the other side",
            middle(&["restricted"], "").replace(
                "<center>",
                "<left><lane id=\"1\" type=\"bidirectional\" level=\"false\"><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></left><center>",
            ),
            // The lanes on the left have no links.
            &["warning road_lane_link_lanes_across_lane_sections"],
        ),
        (
            "another type of lane for vehicles",
            middle(&["bidirectional"], ""),
            &[],
        ),
        (
            "a type with a meaning of its own",
            middle(&["special1"], ""),
            &[],
        ),
        (
            "open to buses",
            middle(
                &["restricted"],
                r#"<access sOffset="0" rule="allow"><restriction type="bus"/></access>"#,
            ),
            &[],
        ),
        (
            "bicycles and cars together",
            middle(&["biking"], "").replace("type=\"biking\"", "type=\"biking\" advisory=\"both\""),
            &[],
        ),
    ];
    super::run(&rows);
}

fn step(height: &str) -> String {
    let profile = format!(
        r#"<elevationProfile><elevation s="0" a="0" b="0" c="0" d="0"/><elevation s="50" a="{height}" b="0" c="0" d="0"/></elevationProfile>"#
    );
    let road = Road {
        profiles: &profile,
        ..Road::default()
    };
    super::build::file("4", &road.text().replace(" rule=\"RHT\"", ""))
}

fn corner(hdg: &str) -> String {
    let line = format!(
        "{}{}",
        geometry("0", "0", "0", "0", "50", LINE),
        geometry("50", "50", "0", hdg, "50", LINE)
    );
    let road = Road::default().with_plan_view(&line);
    super::build::file("4", &road.replace(" rule=\"RHT\"", ""))
}

#[test]
fn steps_and_corners_of_old_maps_give_expected_findings() {
    let rows: Vec<Row> = vec![
        (
            "a step of a kerb",
            step("0.25"),
            &["warning lane_smoothness_profile_no_vertical_gaps"],
        ),
        (
            "a step of a wheel",
            step("-0.31"),
            &["error lane_smoothness_profile_no_vertical_gaps"],
        ),
        (
            "a corner that a car can follow",
            corner("0.7"),
            &["warning road_geometry_refline_no_kinks"],
        ),
        (
            "a corner of 46 degrees, and a full turn more",
            corner("7.086"),
            &["error road_geometry_refline_no_kinks"],
        ),
        (
            "a corner to the right",
            corner("-1.5"),
            &["error road_geometry_refline_no_kinks"],
        ),
        (
            "a corner of a footway",
            corner("-1.5").replace("type=\"driving\"", "type=\"sidewalk\""),
            &[
                "warning road_geometry_refline_no_kinks",
                "warning road_network_drivable",
            ],
        ),
    ];
    super::run_files(&rows);
}

/// Returns a road with a driving lane on both sides and these elements.
fn with(tail: &str) -> String {
    Road {
        lanes: &section("\"0\"", &lane("1", ""), &lane("-1", "")),
        tail,
        ..Road::default()
    }
    .text()
}

fn object(id: &str, kind: &str, s: &str, t: &str, rest: &str) -> String {
    format!(
        r#"<object id="{id}" type="{kind}" s="{s}" t="{t}" zOffset="0" orientation="none" hdg="0" pitch="0" roll="0" {rest}"#
    )
}

const MEDIAN: &str = r#"<lane id="-1" type="median" level="false"><width sOffset="0" a="0.8" b="0" c="0" d="0"/></lane>"#;

fn objects(list: &[String]) -> String {
    with(&format!("<objects>{}</objects>", list.concat()))
}

fn outline(kind: &str, corners: &str) -> String {
    let corner = |place: &str| {
        let (s, t) = place.split_once(' ').unwrap();
        format!(r#"<cornerRoad s="{s}" t="{t}" dz="0" height="1"/>"#)
    };
    let corners: String = corners.split(", ").map(corner).collect();
    let rest = format!(
        r#"length="60" width="8" height="1"><outlines><outline id="0" outer="true" closed="true">{corners}</outline></outlines></object>"#
    );
    objects(&[object("1", kind, "80", "6", &rest)])
}

#[test]
fn objects_in_the_way_give_expected_findings() {
    let pole = |t: &str| objects(&[object("1", "pole", "50", t, r#"radius="0.1" height="4"/>"#)]);
    let house = |t: &str| {
        let size = r#"length="8" width="8" height="5"/>"#;
        objects(&[object("1", "building", "50", t, size)])
    };
    let bays = |at: &str, z: &str| {
        let size = r#"length="2.5" width="5" height="0"/>"#;
        let other = object("2", "parkingSpace", at, "-7", size);
        let other = other.replace(r#"zOffset="0""#, &format!(r#"zOffset="{z}""#));
        objects(&[object("1", "parkingSpace", "50", "-7", size), other])
    };
    let blocked: &[&str] = &["warning road_roadside_clear_of_lanes"];
    let rows: Vec<Row> = vec![
        ("a pole on the line in the middle", pole("0.2"), blocked),
        ("a pole at the edge of the road", pole("3.4"), &[]),
        (
            "a pole on a narrow median",
            pole("-0.4").replace("<lane id=\"-1\"", &format!("{MEDIAN}<lane id=\"-2\"")),
            &[],
        ),
        (
            "a pole on a traffic island",
            objects(&[
                object("1", "pole", "50", "0.2", r#"radius="0.1" height="4"/>"#),
                object(
                    "2",
                    "trafficIsland",
                    "50",
                    "0",
                    r#"length="4" width="1.5" height="0.15"/>"#,
                ),
            ]),
            &[],
        ),
        ("a house over the whole road", house("0"), blocked),
        ("a house beside the road", house("8"), &[]),
        ("bays that touch", bays("52.5", "0"), &[]),
        (
            "bays that overlap",
            bays("51", "0"),
            &["warning road_object_parking_apart"],
        ),
        ("a bay on the next floor", bays("51", "3"), &[]),
        (
            "an outline at one place",
            outline("barrier", "80 6, 80 6, 80 6"),
            &["warning road_object_outline_has_area"],
        ),
        (
            "a wall as a line",
            outline("barrier", "70 6, 80 6, 90 6"),
            &[],
        ),
        (
            "a parking space as a line",
            outline("parkingSpace", "70 6, 80 6, 90 6"),
            &["warning road_object_outline_has_area"],
        ),
        (
            "an outline that reaches over the end",
            outline("barrier", "80 6, 100.9 6, 100.9 8"),
            &[],
        ),
        (
            "an outline that ends far behind the road",
            outline("barrier", "80 6, 108 6, 108 8"),
            &["warning road_records_within_extent"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn signals_of_catalogs_give_expected_findings() {
    let signal = |country: &str, kind: &str, subtype: &str, dynamic: &str| {
        with(&format!(
            r#"<signals><signal id="1" name="" s="50" t="-8" zOffset="4" orientation="+" dynamic="{dynamic}" country="{country}" type="{kind}" subtype="{subtype}" height="1" width="1" hOffset="0"/></signals>"#
        ))
    };
    let odd: &[&str] = &["warning road_signal_catalog_entry"];
    let rows: Vec<Row> = vec![
        (
            "a part of a sign's number",
            signal("DE", "274.1", "20", "no"),
            &[],
        ),
        (
            "a number that looks like 1e3",
            signal("DE", "1e3", "-1", "no"),
            &[],
        ),
        (
            "a code that users may assign",
            signal("XK", "206", "-1", "no"),
            &[],
        ),
        (
            "a word as type",
            signal("OpenDRIVE", "staticBoard", "-1", "no"),
            &[],
        ),
        (
            "a sign in the catalog",
            signal("OpenDRIVE", "206", "-1", "no"),
            &[],
        ),
        ("a language", signal("JA", "206", "-1", "no"), odd),
        ("a float", signal("DE", "274.0", "-1", "no"), odd),
        ("a subtype as float", signal("DE", "274", "-1.0", "no"), odd),
        (
            "a number with too many digits",
            signal("OpenDRIVE", "10000010", "-1", "yes"),
            odd,
        ),
        (
            "a light that never changes",
            signal("opendrive", "1000002", "-1", "no"),
            &["warning road_signal_light_is_dynamic"],
        ),
        (
            "the same number in another catalog",
            signal("US", "1000002", "-1", "no"),
            &[],
        ),
    ];
    super::run(&rows);
}
