//! Tests of the positions of signals and objects, of their content and of their controllers.

use super::Row;
use super::build::{CENTER, Road, lane, section};

/// Returns a road with two lanes on each side.
fn with(tail: &str) -> String {
    let lanes = section(
        "\"0\"",
        &format!("{}{}", lane("2", ""), lane("1", "")),
        &format!("{}{}", lane("-1", ""), lane("-2", "")),
    );
    Road {
        lanes: &lanes,
        tail,
        ..Road::default()
    }
    .text()
}

fn objects(list: &[&str]) -> String {
    with(&format!("<objects>{}</objects>\n", list.concat()))
}

fn signals(list: &[String]) -> String {
    with(&format!("<signals>{}</signals>\n", list.concat()))
}

fn object(kind: &str, id: &str, place: &str, children: &str) -> String {
    format!(
        r#"<object type="{kind}" id="{id}" {place} orientation="none" pitch="0" roll="0" radius="0.2" height="4">{children}</object>"#
    )
}

fn sign(id: &str, place: &str, more: &str, children: &str) -> String {
    format!(
        r#"<signal id="{id}" name="" {place} dynamic="no" country="DE" type="274" height="1" width="1" {more}>{children}</signal>"#
    )
}

fn light(id: &str, s: &str, children: &str) -> String {
    format!(
        r#"<signal id="{id}" name="" s="{s}" t="-8" zOffset="3" orientation="+" dynamic="yes" country="OpenDRIVE" type="1000001" subtype="-1" hOffset="0" height="1" width="0.3">{children}</signal>"#
    )
}

const FIFTY: &str = r#"orientation="+" subtype="-1" hOffset="0" value="50" unit="km/h""#;

#[test]
fn object_and_signal_positions_give_expected_findings() {
    let building = |place: &str| objects(&[&object("building", "1", place, "")]);
    let pole = |place: &str| objects(&[&object("pole", "1", place, "")]);
    let at = |place: &str| signals(&[sign("1", place, FIFTY, "")]);
    let turned = |angle: &str| {
        let more =
            format!(r#"orientation="+" subtype="-1" hOffset="{angle}" value="50" unit="km/h""#);
        signals(&[sign("1", r#"s="50" t="-8" zOffset="2""#, &more, "")])
    };
    let other = Road {
        id: "2",
        pose: ["0", "1000", "0"],
        lanes: &section("\"0\"", "", &lane("-1", "")),
        ..Road::default()
    }
    .text();
    let far = building(r#"s="50" t="900" zOffset="0" hdg="0""#);
    let near: &[&str] = &["warning road_roadside_near_road"];
    let rows: Vec<Row> = vec![
        (
            "far from its road, near another",
            format!("{far}{other}"),
            &[],
        ),
        ("far from all roads", far, near),
        (
            "a building next to the lanes",
            building(r#"s="50" t="12" zOffset="0" hdg="0" length="20" width="9""#)
                .replace(r#" radius="0.2""#, ""),
            &[],
        ),
        (
            "a building turned into the lanes",
            building(r#"s="50" t="12" zOffset="0" hdg="0.7" length="20" width="9""#)
                .replace(r#" radius="0.2""#, ""),
            &["warning road_roadside_clear_of_lanes"],
        ),
        (
            "on a hill",
            building(r#"s="50" t="100" zOffset="60" hdg="0""#),
            &[],
        ),
        (
            "in the air",
            building(r#"s="50" t="20" zOffset="60" hdg="0""#),
            near,
        ),
        (
            "below a viaduct",
            building(r#"s="50" t="40" zOffset="-30" hdg="0""#),
            &[],
        ),
        (
            "a sign below the road",
            at(r#"s="50" t="-8" zOffset="-6""#),
            near,
        ),
        (
            "a repetition counts, not the object itself",
            objects(&[&object(
                "pole",
                "1",
                r#"s="0" t="9000" zOffset="400" hdg="0""#,
                r#"<repeat s="0" length="50" distance="10" tStart="9" tEnd="9" zOffsetStart="0" zOffsetEnd="0"/>"#,
            )]),
            &[],
        ),
        ("three half turns", turned("9.42477796076938"), &[]),
        (
            "half a turn in degrees",
            turned("-180"),
            &["warning road_roadside_angles_in_radians"],
        ),
        (
            "on the line between two lanes",
            pole(r#"s="50" t="-3.5" zOffset="0" hdg="0""#),
            &["warning road_roadside_clear_of_lanes"],
        ),
        (
            "in the middle of a lane",
            pole(r#"s="50" t="5" zOffset="0" hdg="0""#),
            &["warning road_roadside_clear_of_lanes"],
        ),
        (
            "above a lane",
            pole(r#"s="50" t="5" zOffset="5" hdg="0""#),
            &[],
        ),
        (
            "a sign above a lane",
            at(r#"s="50" t="-2" zOffset="5.5""#),
            &[],
        ),
        (
            "a sign painted on a lane",
            at(r#"s="50" t="-2" zOffset="0""#),
            &[],
        ),
        (
            "a sign on a post in a lane",
            at(r#"s="50" t="-2" zOffset="2""#),
            &["warning road_roadside_clear_of_lanes"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn duplicate_signs_give_expected_findings() {
    let place = r#"s="50" t="-8" zOffset="2""#;
    let valid = |lane: &str| format!(r#"<validity fromLane="{lane}" toLane="{lane}"/>"#);
    let back = FIFTY.replace(r#"orientation="+""#, r#"orientation="-""#);
    let rows: Vec<Row> = vec![
        (
            "the same sign twice",
            signals(&[sign("1", place, FIFTY, ""), sign("2", place, FIFTY, "")]),
            &["warning road_roadside_no_twins"],
        ),
        (
            "back to back",
            signals(&[sign("1", place, FIFTY, ""), sign("2", place, &back, "")]),
            &[],
        ),
        (
            "each for a lane of its own",
            signals(&[
                sign("1", place, FIFTY, &valid("-1")),
                sign("2", place, FIFTY, &valid("-2")),
            ]),
            &[],
        ),
        (
            "twice with one id",
            signals(&[sign("1", place, FIFTY, ""), sign("1", place, FIFTY, "")]),
            &["warning ids_id_unique_in_class"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn speed_signs_give_expected_findings() {
    let limit = |more: &str| {
        let more = format!(r#"orientation="+" hOffset="0" {more}"#);
        signals(&[sign("1", r#"s="50" t="-8" zOffset="2""#, &more, "")])
    };
    let wrong: &[&str] = &["warning road_signal_speed_value"];
    let rows: Vec<Row> = vec![
        ("by its subtype", limit(r#"subtype="56""#), &[]),
        ("by nothing", limit(r#"subtype="-1""#), wrong),
        (
            "in metres per second",
            limit(r#"subtype="-1" value="13.888888" unit="m/s""#),
            &[],
        ),
        (
            "under a wrong unit",
            limit(r#"subtype="-1" value="13.888888" unit="km/h""#),
            wrong,
        ),
        (
            "an odd speed",
            limit(r#"subtype="-1" value="37.5" unit="km/h""#),
            &[],
        ),
        (
            "in miles",
            limit(r#"subtype="-1" value="35" unit="mph""#),
            &[],
        ),
        (
            "too fast",
            limit(r#"subtype="-1" value="300" unit="mph""#),
            wrong,
        ),
        (
            "without a unit",
            limit(r#"subtype="-1" value="50""#),
            &["error road_signal_speed_value"],
        ),
        (
            "no value under a unit",
            limit(r#"subtype="56" value="-1" unit="km/h""#),
            &[],
        ),
    ];
    super::run(&rows);
}

#[test]
fn signal_controllers_give_expected_findings() {
    let lights = |last: &str| {
        signals(&[
            light("11", "10", ""),
            light("12", "20", ""),
            light("13", "30", last),
            light("14", "40", ""),
        ])
    };
    let controller = |id: &str, ids: &[&str]| {
        let control = |id: &&str| format!(r#"<control signalId="{id}" type="0"/>"#);
        let controls: String = ids.iter().map(control).collect();
        format!(r#"<controller id="{id}" name="c">{controls}</controller>"#)
    };
    let one: &[&str] = &["warning road_signal_controller_one_per_light"];
    let rows: Vec<Row> = vec![
        (
            "one is forgotten",
            format!("{}{}", lights(""), controller("1", &["11", "12", "13"])),
            one,
        ),
        (
            "another light switches it",
            format!(
                "{}{}",
                lights(r#"<dependency id="14" type="x"/>"#),
                controller("1", &["11", "12", "13"])
            ),
            &[],
        ),
        (
            "most have no controller",
            format!("{}{}", lights(""), controller("1", &["11"])),
            &[],
        ),
        (
            "twice by the same",
            format!(
                "{}{}",
                lights(""),
                controller("1", &["11", "12", "13", "14", "12"])
            ),
            one,
        ),
    ];
    super::run(&rows);
}

#[test]
fn outline_shapes_give_expected_findings() {
    let outline = |attributes: &str, corners: &[[&str; 2]]| {
        let corner =
            |[u, v]: &[&str; 2]| format!(r#"<cornerLocal u="{u}" v="{v}" z="0" height="1"/>"#);
        let corners: String = corners.iter().map(corner).collect();
        let outlines = format!("<outlines><outline {attributes}>{corners}</outline></outlines>");
        objects(&[&format!(
            r#"<object type="obstacle" id="1" s="50" t="12" zOffset="0" orientation="none" hdg="0" pitch="0" roll="0" length="4" width="4" height="1">{outlines}</object>"#
        )])
    };
    let crossed: &[&str] = &["warning road_object_outline_not_crossed"];
    let bow = [["-2", "-2"], ["2", "2"], ["2", "-2"], ["-2", "2"]];
    let walk = |t: [&str; 2]| {
        let corner =
            |(s, t): &(&str, &str)| format!(r#"<cornerRoad s="{s}" t="{t}" dz="0" height="0"/>"#);
        let [low, high] = t;
        let corners: String = [("48", low), ("48", high), ("52", high), ("52", low)]
            .iter()
            .map(corner)
            .collect();
        objects(&[&format!(
            r#"<object type="crosswalk" id="1" s="50" t="{low}" zOffset="0" orientation="none" hdg="0" pitch="0" roll="0"><outlines><outline id="0" outer="true">{corners}</outline></outlines></object>"#
        )])
    };
    let rows: Vec<Row> = vec![
        (
            "a bow tie",
            outline(r#"id="0" outer="true""#, &bow),
            crossed,
        ),
        (
            "only the side crosses that closes it, which is open",
            outline(
                r#"id="0" outer="true" closed="false""#,
                &[["-2", "0"], ["0", "2"], ["0", "-2"], ["2", "0"]],
            ),
            &[],
        ),
        (
            "the same closed",
            outline(
                r#"id="0" outer="true" closed="true""#,
                &[["-2", "0"], ["0", "2"], ["0", "-2"], ["2", "0"]],
            ),
            crossed,
        ),
        (
            "ends where it began",
            outline(
                r#"id="0" outer="true""#,
                &[
                    ["-2", "-2"],
                    ["2", "-2"],
                    ["2", "2"],
                    ["-2", "2"],
                    ["-2", "-2"],
                ],
            ),
            &[],
        ),
        (
            "there and back on a line",
            outline(
                r#"id="0" outer="true" closed="true""#,
                &[
                    ["-2", "0"],
                    ["0", "0.0000001"],
                    ["2", "-0.0000001"],
                    ["1", "0.0000002"],
                    ["-1", "0"],
                ],
            ),
            &[],
        ),
        (
            "a notch",
            outline(
                r#"id="0" outer="true""#,
                &[
                    ["-2", "-2"],
                    ["2", "-2"],
                    ["0", "0"],
                    ["2", "2"],
                    ["-2", "2"],
                ],
            ),
            &[],
        ),
        ("a crosswalk over half of the road", walk(["-7", "0"]), &[]),
        (
            "a crosswalk between two kerbs beside it",
            walk(["8", "11"]),
            &[],
        ),
        (
            "a crosswalk far beside it",
            walk(["25", "35"]),
            &["warning road_object_crosswalk_crosses_lanes"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn validity_lanes_give_expected_findings() {
    let lanes = format!(
        "<laneSection s=\"0\"><center>{CENTER}</center><right>{}{}</right></laneSection>\n{}",
        lane("-1", "s-1"),
        lane("-2", ""),
        section("\"50\"", "", &lane("-1", "p-1"))
    );
    let road = |range: [&str; 2]| {
        let [from, to] = range;
        let valid = format!(r#"<validity fromLane="{from}" toLane="{to}"/>"#);
        let signal = sign("1", r#"s="90" t="-9" zOffset="2""#, FIFTY, &valid);
        Road {
            lanes: &lanes,
            tail: &format!("<signals>{signal}</signals>\n"),
            ..Road::default()
        }
        .text()
    };
    let rows: Vec<Row> = vec![
        ("a lane of another lane section", road(["-2", "-1"]), &[]),
        ("with the center", road(["-1", "0"]), &[]),
        (
            "a lane that is nowhere",
            road(["-3", "-1"]),
            &["warning road_validity_lanes_exist"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn repeated_objects_give_expected_findings() {
    let row = |kind: &str, more: &str| {
        objects(&[&object(
            kind,
            "1",
            r#"s="0" t="9" zOffset="0" hdg="0""#,
            &format!(r#"<repeat s="0" length="50" {more}/>"#),
        )])
    };
    let clear: &[&str] = &["warning road_roadside_clear_of_lanes"];
    let poles = |t: &str| {
        let more = format!(r#"distance="10" {t} zOffsetStart="0" zOffsetEnd="0""#);
        row("pole", &more)
    };
    let rail = |t: &str| {
        let more = format!(r#"distance="0" {t} zOffsetStart="0" zOffsetEnd="0""#);
        row("barrier", &more)
    };
    let rows: Vec<Row> = vec![
        ("beside the lanes", poles(r#"tStart="9" tEnd="10""#), &[]),
        ("into the lanes", poles(r#"tStart="9" tEnd="-5""#), clear),
        (
            "lamps above the lanes",
            poles(r#"tStart="2" tEnd="2""#).replace(
                r#"zOffsetStart="0" zOffsetEnd="0""#,
                r#"zOffsetStart="6" zOffsetEnd="6""#,
            ),
            &[],
        ),
        (
            "one copy at either end, beside the lanes",
            poles(r#"tStart="9" tEnd="-9""#).replace(r#"distance="10""#, r#"distance="50""#),
            &[],
        ),
        (
            "straight from end to end, who knows along what",
            poles(r#"tStart="9" tEnd="-9" detachFromReferenceLine="true""#),
            &[],
        ),
        (
            "a rail along the lanes",
            rail(r#"tStart="9" tEnd="8""#),
            &[],
        ),
        (
            "a rail between them",
            rail(r#"tStart="0.2" tEnd="-0.2""#),
            &[],
        ),
        (
            "a rail that closes a side",
            rail(r#"tStart="9" tEnd="0""#),
            &[],
        ),
        (
            "a rail across all of them",
            rail(r#"tStart="9" tEnd="-9""#),
            clear,
        ),
        (
            "a barrier across the road",
            rail(r#"tStart="9" tEnd="-9""#).replace(r#"length="50""#, r#"length="1""#),
            &[],
        ),
        (
            "far away at its end",
            poles(r#"tStart="9" tEnd="900""#),
            &["warning road_roadside_near_road"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn degenerate_outlines_give_expected_findings() {
    let outline = |more: &str, corners: [[&str; 3]; 4]| {
        let corners = corners
            .map(|[u, v, z]| format!(r#"<cornerLocal u="{u}" v="{v}" z="{z}" height="0"/>"#));
        let outline = format!(
            r#"<outlines><outline id="0" {more}>{}</outline></outlines>"#,
            corners.concat()
        );
        let place = r#"s="50" t="12" zOffset="0" hdg="0" name="""#;
        let object = object("none", "1", place, &outline);
        let sized = object.replace(
            r#"radius="0.2" height="4""#,
            r#"length="10" width="10" height="6""#,
        );
        objects(&[&sized])
    };
    // The closing side crosses the second one.
    let bent = [
        ["0", "0", "0"],
        ["4", "0", "0"],
        ["0", "2", "0"],
        ["4", "2", "0"],
    ];
    // The legs lean by a few centimetres.
    let frame = [
        ["0", "0", "0"],
        ["4", "0.02", "5"],
        ["0.1", "0.02", "5"],
        ["4", "0", "0"],
    ];
    let crossed: &[&str] = &["warning road_object_outline_not_crossed"];
    let rows: Vec<Row> = vec![
        ("an area", outline(r#"closed="true""#, bent), crossed),
        ("an open line", outline(r#"closed="false""#, bent), &[]),
        ("nobody says whether it is open", outline("", bent), &[]),
        (
            "a frame over the road",
            outline(r#"closed="true""#, frame),
            &[],
        ),
    ];
    super::run(&rows);
}
