//! Tests of signals, controllers and objects.

use super::Row;
use super::build::{Road, lane, section};

fn with(tail: &str, rule: &str) -> String {
    let lanes = section(
        "\"0\"",
        &lane("1", ""),
        &format!("{}{}", lane("-1", ""), lane("-2", "")),
    );
    Road {
        lanes: &lanes,
        tail,
        rule,
        ..Road::default()
    }
    .text()
}

fn signal(id: &str, s: &str, children: &str) -> String {
    format!(
        r#"<signal id="{id}" name="" s="{s}" t="-8" zOffset="2" orientation="+" dynamic="no" country="DE" type="274" subtype="-1" height="1" width="1" hOffset="0" value="50" unit="km/h">{children}</signal>"#
    )
}

fn signals(list: &[String]) -> String {
    format!("<signals>{}</signals>\n", list.concat())
}

#[test]
fn signals_and_controllers_give_expected_findings() {
    let valid = |range: [&str; 2]| {
        let [from, to] = range;
        signals(&[signal(
            "1",
            "50",
            &format!(r#"<validity fromLane="{from}" toLane="{to}"/>"#),
        )])
    };
    let controller = |signal: &str| {
        format!(
            r#"<controller id="3" name="c"><control signalId="{signal}" type="0"/></controller>"#
        )
    };
    let one = signals(&[signal("1", "50", "").replace(r#"dynamic="no""#, r#"dynamic="yes""#)]);
    let rows: Vec<Row> = vec![
        ("right lanes", with(&valid(["-2", "-1"]), "RHT"), &[]),
        (
            "right lanes in left-hand traffic",
            with(&valid(["-2", "-1"]), "LHT"),
            &["error road_signal_validity_left_hand_traffic_lane_ids"],
        ),
        (
            "left lanes in left-hand traffic",
            with(&valid(["1", "1"]), "LHT"),
            &[],
        ),
        (
            "from high to low",
            with(&valid(["-1", "-2"]), "RHT"),
            &["warning road_object_bridges_from_lower_equal_to"],
        ),
        (
            "behind the end of the road",
            with(&signals(&[signal("1", "101", "")]), "RHT"),
            &["warning road_records_within_extent"],
        ),
        (
            "at the end of the road",
            with(&signals(&[signal("1", "100", "")]), "RHT"),
            &[],
        ),
        (
            "twice",
            with(
                &signals(&[signal("1", "50", ""), signal("1", "60", "")]),
                "RHT",
            ),
            &["warning ids_id_unique_in_class"],
        ),
        (
            "controlled",
            format!("{}{}", with(&one, "RHT"), controller("1")),
            &[],
        ),
        (
            "controlled, but missing",
            format!("{}{}", with(&one, "RHT"), controller("8")),
            &[
                "error ids_only_ref_defined_ids",
                "error road_signal_controller_valid_for_signals",
            ],
        ),
    ];
    super::run(&rows);
}

#[test]
fn objects_give_expected_findings() {
    let object = |s: &str, size: &str, children: &str| {
        let object = format!(
            r#"<object type="obstacle" id="1" s="{s}" t="-10" zOffset="0" orientation="none" hdg="0" pitch="0" roll="0" height="1" {size}>{children}</object>"#
        );
        with(&format!("<objects>{object}</objects>\n"), "RHT")
    };
    let outline = |corners: &[[&str; 2]]| {
        let corner = |(id, [u, v]): (usize, &[&str; 2])| {
            format!(r#"<cornerLocal id="{id}" u="{u}" v="{v}" z="0" height="1"/>"#)
        };
        let corners: String = corners.iter().enumerate().map(corner).collect();
        format!(
            r#"<outlines><outline id="0" outer="true" closed="true">{corners}</outline></outlines>"#
        )
    };
    let tunnel = |s: &str| {
        let tunnel = format!(r#"<tunnel id="4" name="" s="{s}" length="50" type="standard"/>"#);
        with(&format!("<objects>{tunnel}</objects>\n"), "RHT")
    };
    let size = r#"length="4" width="2""#;
    let rows: Vec<Row> = vec![
        (
            "an outline as large as its box",
            object(
                "50",
                size,
                &outline(&[["-2", "-1"], ["2", "-1"], ["2", "1"], ["-2", "1"]]),
            ),
            &[],
        ),
        (
            "an outline larger than its box",
            object(
                "50",
                size,
                &outline(&[["-3", "-1"], ["2", "-1"], ["2", "1"]]),
            ),
            &["warning road_object_outline_points_inside_box"],
        ),
        (
            "a closed outline of two corners",
            object("50", size, &outline(&[["-2", "-1"], ["2", "-1"]])),
            &["warning road_object_outline_outline_followed_by_corner"],
        ),
        (
            "a cylinder and a box",
            object("50", r#"length="4" width="2" radius="1""#, ""),
            &["warning road_object_circular_vs_angular"],
        ),
        (
            "behind the end of the road",
            object("100.5", size, ""),
            &["error road_object_s_t_coords"],
        ),
        ("a tunnel to the end of the road", tunnel("50"), &[]),
        (
            "a tunnel that goes on",
            tunnel("60"),
            &["error road_records_within_extent"],
        ),
    ];
    super::run(&rows);
}
