//! Tests of lane links within a road.

use super::Row;
use super::build::{Road, lane, lane_with, section};

fn split(first: &str, second: &str) -> String {
    let lanes = format!(
        "{}{}",
        section("\"0\"", "", first),
        section("\"50\"", "", second)
    );
    Road {
        lanes: &lanes,
        ..Road::default()
    }
    .text()
}

fn width(a: &str, b: &str) -> String {
    format!(r#"<width sOffset="0" a="{a}" b="{b}" c="0" d="0"/>"#)
}

#[test]
fn lane_links_between_sections_give_expected_findings() {
    let two = |one: &str, other: &str| format!("{}{}", lane("-1", one), lane("-2", other));
    let rows: Vec<Row> = vec![
        (
            "both sides",
            split(&lane("-1", "s-1"), &lane("-1", "p-1")),
            &[],
        ),
        (
            "the first one only",
            split(&lane("-1", "s-1"), &lane("-1", "")),
            &["warning road_lane_link_lanes_across_lane_sections"],
        ),
        (
            "the second one only",
            split(&lane("-1", ""), &lane("-1", "p-1")),
            &["error road_lane_link_lanes_across_lane_sections"],
        ),
        (
            "neither",
            split(&lane("-1", ""), &lane("-1", "")),
            &["warning road_lane_link_lanes_across_lane_sections"],
        ),
        (
            "no such lane",
            split(&lane("-1", "s-2"), &lane("-1", "p-1")),
            &[
                "error ids_only_ref_defined_ids",
                "error road_lane_link_lanes_across_lane_sections",
            ],
        ),
        (
            "no number",
            split(&lane("-1", "sa"), &lane("-1", "pa")),
            &["error ids_only_ref_defined_ids"],
        ),
        (
            "crosswise",
            split(&two("s-2", "s-1"), &two("p-2", "p-1")),
            &["error lane_smoothness_contact_point_no_horizontal_gaps"],
        ),
        (
            "a wide lane becomes two",
            split(
                &lane_with("-1", "s-1 s-2", &width("7", "0")),
                &two("p-1", "p-1"),
            ),
            &[],
        ),
        (
            "a wide lane becomes two and names one",
            split(
                &lane_with("-1", "s-1", &width("7", "0")),
                &two("p-1", "p-1"),
            ),
            &["error road_lane_link_lanes_across_lane_sections"],
        ),
        (
            "a lane opens beside another one",
            split(
                &lane("-1", "s-1"),
                &format!(
                    "{}{}",
                    lane("-1", "p-1"),
                    lane_with("-2", "", &width("0", "0.07"))
                ),
            ),
            &[],
        ),
        (
            "and is linked to it",
            split(
                &lane("-1", "s-1 s-2"),
                &format!(
                    "{}{}",
                    lane("-1", "p-1"),
                    lane_with("-2", "p-1", &width("0", "0.07"))
                ),
            ),
            &[
                "error road_lane_link_multiple_connections",
                "error road_lane_link_new_lane_appear",
                "error road_lane_link_zero_width_at_start",
            ],
        ),
        (
            "a predecessor where the road has none",
            split(&lane("-1", "p-1 s-1"), &lane("-1", "p-1")),
            &["warning road_lane_link_no_link"],
        ),
    ];
    super::run(&rows);
}
