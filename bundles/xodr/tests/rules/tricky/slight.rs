//! Tests of differences without a meaning, and of faults that look as small.

use super::Row;
use super::build::{CENTER, LINE, Road, WIDTH, geometry, lane, lane_with, link, section};

fn profiles(profiles: &str) -> String {
    Road {
        profiles,
        ..Road::default()
    }
    .text()
}

fn lanes(lanes: &str) -> String {
    Road {
        lanes,
        ..Road::default()
    }
    .text()
}

/// Returns a road with these records on its right lane, besides the width.
fn marks(width: &str, marks: &str) -> String {
    let records = format!("{width}{marks}");
    lanes(&section("\"0\"", "", &lane_with("-1", "", &records)))
}

fn shape(s: &str, t: &str, b: &str) -> String {
    format!(r#"<shape s="{s}" t="{t}" a="0" b="{b}" c="0" d="0"/>"#)
}

fn shapes(shapes: &[String]) -> String {
    profiles(&format!(
        "<lateralProfile>{}</lateralProfile>",
        shapes.concat()
    ))
}

/// Returns two consecutive roads. The link of the second has more attributes than it takes.
fn beside_contact_point(extra: &str) -> String {
    let first = Road {
        link: &link(&["s2 start"]),
        lanes: &section("\"0\"", "", &lane("-1", "s-1")),
        ..Road::default()
    };
    let back = format!(
        r#"<link><predecessor elementType="road" elementId="1" contactPoint="end" {extra}/></link>"#
    );
    let second = Road {
        id: "2",
        pose: ["100", "0", "0"],
        link: &back,
        lanes: &section("\"0\"", "", &lane("-1", "p-1")),
        ..Road::default()
    };
    first.text() + &second.text()
}

#[test]
fn slight_length_and_width_errors_give_expected_findings() {
    let two = |start: &str| {
        lanes(&format!(
            "{}{}",
            section("\"0\"", "", &lane("-1", "s-1")),
            section(&format!("\"{start}\""), "", &lane("-1", "p-1"))
        ))
    };
    let closing = |slope: &str| {
        let width = format!(r#"<width sOffset="0" a="3.5" b="{slope}" c="0" d="0"/>"#);
        lanes(&section("\"0\"", "", &lane_with("-1", "", &width)))
    };
    let rows: Vec<Row> = vec![
        (
            "a section of a ten-millionth of a metre",
            two("99.9999999"),
            &["warning road_lane_section_valid_length"],
        ),
        (
            "a section of nothing",
            two("100"),
            &["error road_lane_section_valid_length"],
        ),
        (
            "a lane that closes half a centimetre too early",
            closing("-0.03505"),
            &["warning road_lane_width_lane_width_validity"],
        ),
        (
            "a lane that closes 2 cm too early",
            closing("-0.0352"),
            &["error road_lane_width_lane_width_validity"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn shape_order_and_flat_shapes_give_expected_findings() {
    let rows: Vec<Row> = vec![
        (
            "zeros in any order",
            shapes(&[
                shape("0", "-4", "0"),
                shape("0", "2", "0"),
                shape("0", "0", "0"),
            ]),
            &["warning road_shape_elem_asc_order"],
        ),
        (
            "a step ahead of less than the tolerance begins a cross section",
            shapes(&[
                shape("0", "-4", "0.02"),
                shape("0", "0", "-0.02"),
                shape("0.0000005", "-4", "0.02"),
                shape("0.0000005", "0", "-0.02"),
            ]),
            &[],
        ),
        (
            "back within one",
            shapes(&[
                shape("0", "-4", "0.02"),
                shape("0", "2", "0"),
                shape("0", "0", "0"),
            ]),
            &["error road_shape_elem_asc_order"],
        ),
        (
            "zeros that begin beside the edge",
            shapes(&[shape("0", "0", "0")]),
            &[],
        ),
        (
            "of two that begin there one is none",
            shapes(&[shape("0", "0", "0"), shape("50", "0", "0.02")]),
            &["error road_shape_t_definition_coverage"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn road_marks_at_same_place_give_expected_findings() {
    let mark = |kind: &str, lines: &str| {
        format!(
            r#"<roadMark sOffset="0" type="{kind}" color="standard" width="0.12">{lines}</roadMark>"#
        )
    };
    let drawn = |t: &str| {
        format!(
            r#"<type name="x" width="0.12"><line length="1" space="1" tOffset="{t}" sOffset="0" width="0.12"/></type>"#
        )
    };
    let rows: Vec<Row> = vec![
        (
            "solid or broken",
            marks(WIDTH, &(mark("solid", "") + &mark("broken", ""))),
            &["warning road_lane_road_mark_elem_asc_order"],
        ),
        (
            "the same twice",
            marks(WIDTH, &(mark("solid", "") + &mark("solid", ""))),
            &["warning road_lane_road_mark_elem_asc_order"],
        ),
        (
            "none and one",
            marks(WIDTH, &(mark("none", "") + &mark("broken", ""))),
            &[],
        ),
        (
            "each with its line",
            marks(
                WIDTH,
                &(mark("solid", &drawn("0.1")) + &mark("broken", &drawn("-0.1"))),
            ),
            &[],
        ),
    ];
    super::run(&rows);
}

#[test]
fn superfluous_link_attributes_give_expected_findings() {
    let rows: Vec<Row> = vec![
        (
            "a direction beside the contact point",
            beside_contact_point(r#"elementDir="+""#),
            &[],
        ),
        (
            "a place beside the contact point",
            beside_contact_point(r#"elementS="0""#),
            &[],
        ),
    ];
    super::run(&rows);
}

#[test]
fn late_profile_records_give_expected_findings() {
    let late = |records: &str| profiles(&format!("<elevationProfile>{records}</elevationProfile>"));
    let offset = |s: &str| {
        format!(
            "<laneOffset s=\"{s}\" a=\"0\" b=\"0.001\" c=\"0\" d=\"0\"/>{}",
            section("\"0\"", "", &lane("-1", ""))
        )
    };
    let one_sided = |right: &str| {
        format!(
            r#"<laneSection s="0" singleSide="true"><left>{}</left><center>{CENTER}</center>{right}</laneSection>"#,
            lane("1", "")
        )
    };
    let rows: Vec<Row> = vec![
        ("nothing at all", profiles(""), &[]),
        (
            "zeros, wherever they start",
            late(r#"<elevation s="40" a="0" b="0" c="0" d="0"/>"#),
            &[],
        ),
        (
            "a slope",
            late(r#"<elevation s="40" a="0" b="0.01" c="0" d="0"/>"#),
            &["warning profiles_begin_with_road"],
        ),
        (
            "listed in the wrong order, but from 0 on",
            late(
                r#"<elevation s="40" a="0" b="0.01" c="0" d="0"/><elevation s="0" a="0" b="0" c="0" d="0"/>"#,
            ),
            &["error road_elevation_elem_asc_order"],
        ),
        ("an offset at 0", lanes(&offset("0")), &[]),
        ("an offset later, from 0 on", lanes(&offset("30")), &[]),
        (
            "an offset later, with a step",
            lanes(&offset("30").replacen("a=\"0\"", "a=\"0.005\"", 1)),
            &["warning profiles_begin_with_road"],
        ),
        (
            "lanes on both sides of one",
            lanes(&one_sided(&format!("<right>{}</right>", lane("-1", "")))),
            &["warning lane_section_single_side"],
        ),
        ("lanes on one side", lanes(&one_sided("")), &[]),
    ];
    super::run(&rows);
}

#[test]
fn geometry_lengths_give_expected_findings() {
    let road = |length: &str, geometries: &str| {
        Road {
            length,
            ..Road::default()
        }
        .with_plan_view(geometries)
    };
    let plain = geometry("0", "0", "0", "0", "100", LINE);
    let rows: Vec<Row> = vec![
        (
            "half a metre without a place",
            road("100.5", &plain),
            &["warning road_length_sum_geometries"],
        ),
        (
            "20 m without a place",
            road("120", &plain),
            &["error road_length_sum_geometries"],
        ),
        (
            "a road that ends before its geometries do",
            road("80", &plain),
            &["error road_length_sum_geometries"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn lane_offset_rounding_steps_give_expected_findings() {
    let offsets = |second: &str| {
        lanes(&format!(
            "<laneOffset s=\"0\" a=\"0\" b=\"0\" c=\"0\" d=\"0\"/>\
             <laneOffset s=\"20.0000000001\" a=\"0\" b=\"0.01\" c=\"0\" d=\"0\"/>\
             <laneOffset s=\"{second}\" a=\"0\" b=\"0.02\" c=\"0\" d=\"0\"/>\
             <laneOffset s=\"70\" a=\"1\" b=\"0\" c=\"0\" d=\"0\"/>{}",
            section("\"0\"", "", &lane("-1", ""))
        ))
    };
    let equal: &[&str] = &["warning road_lanes_lane_offset_elem_asc_order"];
    let rows: Vec<Row> = vec![("the one listed later counts", offsets("20"), equal)];
    super::run(&rows);
}
