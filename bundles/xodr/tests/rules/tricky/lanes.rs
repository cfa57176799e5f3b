//! Tests of lane sections, lane numbers, widths and borders.

use super::Row;
use super::build::{CENTER, Road, WIDTH, lane, lane_with, section};

fn lanes(lanes: &str) -> String {
    Road {
        lanes,
        ..Road::default()
    }
    .text()
}

fn right(lanes_: &str) -> String {
    lanes(&section("\"0\"", "", lanes_))
}

fn record(name: &str, values: &[[&str; 3]]) -> String {
    let one = |[start, a, b]: &[&str; 3]| {
        format!(r#"<{name} sOffset="{start}" a="{a}" b="{b}" c="0" d="0"/>"#)
    };
    values.iter().map(one).collect()
}

#[test]
fn lane_numbers_give_expected_findings() {
    let rows: Vec<Row> = vec![
        ("spaces around a number", right(&lane(" -1 ", "")), &[]),
        ("a sign", lanes(&section("\"0\"", &lane("+1", ""), "")), &[]),
        ("leading zeros", right(&lane("-01", "")), &[]),
        (
            "no number is the schema's business",
            right(&lane("x", "")),
            &[],
        ),
        (
            "nor is one without end",
            right(&lane("-99999999999999999999", "")),
            &[],
        ),
        (
            "twice",
            right(&format!("{}{}", lane("-1", ""), lane("-01", ""))),
            &["error ids_id_unique_in_lane_section"],
        ),
        (
            "a hole",
            right(&format!("{}{}", lane("-1", ""), lane("-3", ""))),
            &["error road_lane_lane_order_no_gaps"],
        ),
        (
            "right lanes that are left ones",
            right(&lane("1", "")),
            &[
                "error road_lane_lanes_numbered_correctly",
                "warning road_lane_lane_listing",
            ],
        ),
        (
            "listed from the outside in",
            right(&format!("{}{}", lane("-2", ""), lane("-1", ""))),
            &["warning road_lane_lane_listing"],
        ),
        (
            "two center lanes",
            lanes(
                &section("\"0\"", "", &lane("-1", ""))
                    .replace(CENTER, &format!("{CENTER}{CENTER}")),
            ),
            &[
                "error ids_id_unique_in_lane_section",
                "error road_lane_center_elem_definition",
            ],
        ),
    ];
    super::run(&rows);
}

#[test]
fn lane_sections_give_expected_findings() {
    let (one, two) = (lane("-1", "s-1"), lane("-1", "p-1"));
    let both =
        |links: &str, s: &str| section(s, &lane("1", &links.replace('-', "")), &lane("-1", links));
    let rows: Vec<Row> = vec![
        (
            "one side goes on over a section of the other",
            lanes(&format!(
                "{}{}{}",
                both("s-1", "\"0\""),
                section("\"30\" singleSide=\"true\"", "", &lane("-1", "p-1 s-1")),
                section("\"60\"", &lane("1", "p1"), &two)
            )),
            &[],
        ),
        (
            "out of order, the links follow s",
            lanes(&format!(
                "{}{}{}",
                section("\"0\"", "", &one),
                section("\"60\"", "", &two),
                section("\"30\"", "", &lane("-1", "p-1 s-1"))
            )),
            &["error road_lane_section_elem_asc_order"],
        ),
        (
            "no length",
            lanes(&format!(
                "{}{}",
                section("\"0\"", "", &one),
                section("\"100\"", "", &two)
            )),
            &["error road_lane_section_valid_length"],
        ),
        (
            "before the road",
            lanes(&section("\"-10\"", "", &lane("-1", ""))),
            &[
                "error road_lane_s_attr_value",
                "error road_lane_lane_sect_first",
            ],
        ),
        (
            "a second section without center",
            lanes(&format!(
                "{}<laneSection s=\"50\"><right>{two}</right></laneSection>",
                section("\"0\"", "", &one)
            )),
            &["error road_lane_center_elem_definition"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn lane_widths_and_borders_give_expected_findings() {
    let with = |records: &str| right(&lane_with("-1", "", records));
    let offset = |a: &str| {
        let offset = format!(
            r#"<laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="50" a="{a}" b="0" c="0" d="0"/>"#
        );
        lanes(&format!(
            "{offset}{}",
            section("\"0\"", "", &lane("-1", ""))
        ))
    };
    let rows: Vec<Row> = vec![
        (
            "negative between its ends",
            with(r#"<width sOffset="0" a="3" b="-0.14" c="0.0014" d="0"/>"#),
            &["error road_lane_width_lane_width_validity"],
        ),
        (
            "late",
            with(&record("width", &[["10", "3", "0"]])),
            &[
                "error road_lane_width_width_defined_whole_section",
                "warning road_lane_lane_section_drivable",
            ],
        ),
        (
            "a step",
            with(&record("width", &[["0", "3.5", "0"], ["50", "2.5", "0"]])),
            &["warning lane_smoothness_profile_no_horizontal_gaps"],
        ),
        (
            "a slope that ends where the next record begins",
            with(&record(
                "width",
                &[["0", "3.5", "-0.02"], ["50", "2.5", "0"]],
            )),
            &[],
        ),
        (
            "the lane offset steps",
            offset("1"),
            &["error lane_smoothness_profile_no_horizontal_gaps"],
        ),
        (
            "the lane offset steps where lanes are renumbered",
            lanes(&format!(
                "{}{}{}",
                r#"<laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="50" a="3.5" b="0" c="0" d="0"/>"#,
                section("\"0\"", "", &lane("-1", "s-2")),
                section(
                    "\"50\"",
                    "",
                    &format!("{}{}", lane("-1", ""), lane("-2", "p-1"))
                )
            )),
            &[],
        ),
        (
            "an offset and a width that cancel each other out",
            lanes(&format!(
                "{}{}",
                r#"<laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="50" a="1" b="0" c="0" d="0"/>"#,
                section(
                    "\"0\"",
                    "",
                    &format!(
                        "{}{}",
                        lane_with(
                            "-1",
                            "",
                            &record("width", &[["0", "2", "0"], ["50", "3", "0"]])
                        )
                        .replace("driving", "median"),
                        lane("-2", "")
                    )
                )
            )),
            &[],
        ),
        (
            "a border on the wrong side",
            with(&record("border", &[["0", "3.5", "0"]])),
            &["error road_lane_lanes_numbered_correctly"],
        ),
        (
            "a border that gets there",
            with(&record("border", &[["0", "-3.5", "0.05"]])),
            &["error road_lane_lanes_numbered_correctly"],
        ),
        (
            "a border",
            with(&record("border", &[["0", "-3.5", "0"]])),
            &[],
        ),
        (
            "a border that crosses an inner one",
            right(&format!(
                "{}{}",
                lane_with("-1", "", &record("border", &[["0", "-3.5", "0"]])),
                lane_with("-2", "", &record("border", &[["0", "-7", "0.05"]]))
            )),
            &["error road_lane_border_overlap_with_inner_lanes"],
        ),
        (
            "one lane by width, the next one by border",
            right(&format!(
                "{}{}",
                lane_with("-1", "", &record("border", &[["0", "-3.5", "0"]])),
                lane_with("-2", "", WIDTH)
            )),
            &["error road_lane_border_exclusive_width_border"],
        ),
    ];
    super::run(&rows);
}
