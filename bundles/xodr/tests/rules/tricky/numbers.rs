//! Tests of values, sizes and shapes that are not numbers or not intended.

use super::Row;
use super::build::{LINE, Road, geometry, lane, lane_with, section};

fn width(a: &str, b: &str) -> String {
    format!(r#"<width sOffset="0" a="{a}" b="{b}" c="0" d="0"/>"#)
}

fn right(records: &str) -> String {
    let lanes = section("\"0\"", "", &lane_with("-1", "", records));
    Road {
        lanes: &lanes,
        ..Road::default()
    }
    .text()
}

fn profiles(profiles: &str) -> String {
    Road {
        profiles,
        ..Road::default()
    }
    .text()
}

fn tail(tail: &str) -> String {
    Road {
        tail,
        ..Road::default()
    }
    .text()
}

#[test]
fn non_finite_numbers_give_expected_findings() {
    let rows: Vec<Row> = vec![
        (
            "a name is no number",
            Road::default().text().replace("name=\"\"", "name=\"NaN\""),
            &[],
        ),
        (
            "an id is none",
            Road {
                id: "INF",
                ..Road::default()
            }
            .text(),
            &[],
        ),
        (
            "user data means what it likes",
            tail(r#"<userData code="NaN" value="INF"><width a="NaN"/></userData>"#),
            &[],
        ),
        (
            "a street that begins with it",
            Road::default()
                .text()
                .replace("name=\"\"", "name=\"Infinity Road\""),
            &[],
        ),
        (
            "a spelling that the schema refuses",
            profiles(
                r#"<elevationProfile><elevation s="0" a="-1.#IND" b="0" c="0" d="0"/></elevationProfile>"#,
            ),
            &[],
        ),
        (
            "four hundred digits",
            profiles(&format!(
                r#"<elevationProfile><elevation s="0" a="0" b="0" c="{}" d="0"/></elevationProfile>"#,
                "9".repeat(400)
            )),
            &["error numbers_computable"],
        ),
        (
            "an overflow below zero is as good as zero",
            profiles(
                r#"<elevationProfile><elevation s="0" a="1e-999" b="0" c="0" d="0"/></elevationProfile>"#,
            ),
            &[],
        ),
        (
            "a coefficient that holds for a millionth of a metre",
            right(&format!(
                "{}{}",
                r#"<width sOffset="0" a="3.5" b="0" c="1e+10" d="-1e+16"/>"#,
                r#"<width sOffset="0.000001" a="3.5" b="0" c="0" d="0"/>"#
            )),
            &["warning road_lane_lane_properties_elem_asc_order"],
        ),
        (
            "once around the Earth, and more",
            profiles(
                r#"<elevationProfile><elevation s="0" a="160000000" b="0" c="0" d="0"/></elevationProfile>"#,
            ),
            &["warning numbers_computable"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn implausible_sizes_give_expected_findings() {
    let rows: Vec<Row> = vec![
        ("a lane that opens slowly", right(&width("0", "0.014")), &[]),
        ("narrow as none", right(&width("0.04", "0")), &[]),
        (
            "narrow all along",
            right(&width("1.2", "0")),
            &["warning road_lane_width_plausible"],
        ),
        (
            "wide for some metres only",
            right(&format!(
                "{}{}",
                width("14", "0"),
                r#"<width sOffset="5" a="14" b="-2" c="0" d="0"/><width sOffset="10" a="4" b="0" c="0" d="0"/>"#
            )),
            &[],
        ),
        (
            "a mouth",
            right(&format!(
                "{}{}",
                width("3.5", "0"),
                r#"<width sOffset="85" a="3.5" b="0" c="0" d="0.0044"/>"#
            )),
            &[],
        ),
        (
            "a steep end is no slope",
            profiles(
                r#"<elevationProfile><elevation s="0" a="0" b="0" c="0.0025" d="0"/></elevationProfile>"#,
            ),
            &["warning road_slope_plausible"],
        ),
        (
            "a ramp of half a metre",
            profiles(
                r#"<elevationProfile><elevation s="0" a="0" b="0.5" c="0" d="0"/><elevation s="0.5" a="0.25" b="0.5" c="-0.5" d="0"/><elevation s="1" a="0.375" b="0" c="0" d="0"/></elevationProfile>"#,
            ),
            &[],
        ),
        (
            "a full turn and a half",
            Road {
                pose: ["0", "0", "-9.42"],
                ..Road::default()
            }
            .text(),
            &[],
        ),
        (
            "twenty turns that fit what comes before",
            Road::default().with_plan_view(&format!(
                "{}{}",
                geometry("0", "0", "0", "0", "50", LINE),
                geometry("50", "50", "0", "125.66370614359172", "50", LINE)
            )),
            &["warning performance_avoid_redundant_info"],
        ),
        (
            "degrees, even below zero",
            Road {
                pose: ["0", "0", "-90"],
                ..Road::default()
            }
            .text(),
            &["warning road_geometry_hdg_in_radians"],
        ),
    ];
    super::run(&rows);
}

fn curve(shape: &str, length: &str, left: &str, right: &str) -> String {
    let lanes = section("\"0\"", left, right);
    Road {
        length,
        lanes: &lanes,
        ..Road::default()
    }
    .with_plan_view(&geometry("0", "0", "0", "0", length, shape))
}

#[test]
fn folded_lanes_give_expected_findings() {
    let wide = |id: &str| lane_with(id, "", &width("6", "0"));
    let rows: Vec<Row> = vec![
        ("straight", curve(LINE, "7", &wide("1"), &wide("-1")), &[]),
        (
            "the lane lies outside",
            curve(r#"<arc curvature="0.25"/>"#, "6", "", &wide("-1")),
            &[],
        ),
        (
            "the lane lies inside of a right curve",
            curve(r#"<arc curvature="-0.25"/>"#, "6", "", &wide("-1")),
            &["warning road_geometry_lanes_no_fold"],
        ),
        (
            "it fits by a hand",
            curve(r#"<arc curvature="0.28"/>"#, "5", &lane("1", ""), ""),
            &[],
        ),
        (
            "sharp for a centimetre",
            curve(
                r#"<spiral curvStart="0" curvEnd="0.172"/>"#,
                "10",
                &wide("1"),
                "",
            ),
            &[],
        ),
    ];
    super::run(&rows);
}
