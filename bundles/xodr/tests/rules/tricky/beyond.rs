//! Tests of two layers of lanes, separate sides, loops, places within roads, and data of other
//! vendors.

use super::Row;
use super::build::{CENTER, Road, WIDTH, lane, link, section};

/// Returns a lane of one of the layers, with `links` of the form `<predecessor id layer>`:
/// `p-1 permanent`.
fn layered(id: &str, links: &[&str]) -> String {
    let one = |link: &&str| {
        let (name, rest) = match link.split_at(1) {
            ("p", rest) => ("predecessor", rest),
            (_, rest) => ("successor", rest),
        };
        let (to, layer) = rest.split_once(' ').unwrap();
        format!(r#"<{name} id="{to}" layer="{layer}"/>"#)
    };
    let links: String = links.iter().map(one).collect();
    format!(r#"<lane id="{id}" type="driving" level="false"><link>{links}</link>{WIDTH}</lane>"#)
}

fn lanes(layer: &str, sections: &str) -> String {
    format!("</lanes><lanes layer=\"{layer}\">{sections}")
}

/// Returns a road of 100 m and the road after it. The temporary lane of the first begins at 40 m
/// and ends at its end.
fn works(temporary: &[&str], behind: &[&str]) -> String {
    let permanent = format!(
        "{}{}",
        section(
            "\"0\"",
            "",
            &layered("-1", &["s-1 permanent", "s-1 temporary"])
        ),
        section(
            "\"40\"",
            "",
            &layered("-1", &["p-1 permanent", "s-1 permanent"])
        )
    );
    let over = section("\"40\" length=\"60\"", "", &layered("-1", temporary));
    let first = Road {
        link: &link(&["s2 start"]),
        lanes: &format!("{permanent}{}", lanes("temporary", &over)),
        ..Road::default()
    };
    let second = Road {
        id: "2",
        pose: ["100", "0", "0"],
        link: &link(&["p1 end"]),
        lanes: &section("\"0\"", "", &layered("-1", behind)),
        ..Road::default()
    };
    let text = format!("{}{}", first.text(), second.text());
    text.replacen("<lanes>", "<lanes layer=\"permanent\">", 1)
}

#[test]
fn temporary_lanes_give_expected_findings() {
    let both = ["p-1 permanent", "p-1 temporary"];
    let rows: Vec<Row> = vec![
        (
            "they end with the road and go on as permanent ones",
            works(&["p-1 permanent", "s-1 permanent"], &both),
            &[],
        ),
        (
            "they end with the road and lead nowhere",
            works(&["p-1 permanent"], &["p-1 permanent"]),
            &["error road_lane_link_temporary_layer_section_link_permanent"],
        ),
        (
            "they come from a lane that does not exist",
            works(&["p-2 permanent", "s-1 permanent"], &both),
            &[
                "error ids_only_ref_defined_ids",
                "warning road_lane_link_lanes_across_lane_sections",
            ],
        ),
        (
            "they go on as a lane that does not exist",
            works(&["p-1 permanent", "s-9 permanent"], &both),
            &[
                "error ids_only_ref_defined_ids",
                "error road_lane_link_lanes_across_lane_sections",
            ],
        ),
    ];
    super::run(&rows);
}

#[test]
fn section_sides_loops_and_inner_links_give_expected_findings() {
    let one_side = |links: &str| {
        let right = format!(
            "<laneSection s=\"50\" singleSide=\"true\"><center>{CENTER}</center><right>{}</right></laneSection>",
            lane("-1", if links == "s-1" { "p-1" } else { "" })
        );
        let lanes = format!(
            "{}{right}",
            section("\"0\"", &lane("1", ""), &lane("-1", links))
        );
        Road {
            lanes: &lanes,
            ..Road::default()
        }
        .text()
    };
    let within = |junction: &str| {
        let first = Road {
            junction,
            link: r#"<link><successor elementType="road" elementId="2" elementS="5" elementDir="+"/></link>"#,
            ..Road::default()
        };
        let second = Road {
            id: "2",
            pose: ["0", "50", "0"],
            ..Road::default()
        };
        format!("{}{}", first.text(), second.text())
    };
    let itself = Road {
        link: &link(&["p1 start"]),
        ..Road::default()
    };
    let rows: Vec<Row> = vec![
        ("a section for one side", one_side("s-1"), &[]),
        (
            "a section for one side without the lane",
            one_side("s-7"),
            &["error ids_only_ref_defined_ids"],
        ),
        (
            "a place within a road outside of junctions",
            within("-1"),
            &["error road_linkage_road_link_attribute_usage"],
        ),
        (
            "an end that is its own predecessor",
            itself.text(),
            &["error road_linkage_both_sides_consistency"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn foreign_user_data_gives_expected_findings() {
    let with = |tail: &str| {
        Road {
            tail,
            ..Road::default()
        }
        .text()
    };
    let inside = |data: &str| with(&format!("<userData code=\"v\">{data}</userData>"));
    let rows: Vec<Row> = vec![
        (
            "objects",
            inside("<objects><object id=\"7\"/></objects>"),
            &[],
        ),
        (
            "signals",
            inside("<signals><signal id=\"7\"/><signalReference id=\"8\"/></signals>"),
            &[],
        ),
        (
            "links",
            inside(
                "<link><predecessor elementType=\"road\" elementId=\"88\" contactPoint=\"end\"/></link>",
            ),
            &[],
        ),
        (
            "groups and switches",
            inside(
                "<vmsGroup id=\"1\"/><railroad><switch id=\"1\"><mainTrack id=\"3\"/></switch></railroad>",
            ),
            &[],
        ),
        (
            "a map",
            format!(
                "{}<userData code=\"v\"><OpenDRIVE><road id=\"1\"/></OpenDRIVE></userData>",
                with("")
            ),
            &[],
        ),
    ];
    super::run(&rows);
}

#[test]
fn outline_and_corner_ids_give_expected_findings() {
    let object = |reference: &str, outline: &str| {
        let corner = |id: &str, u: &str, v: &str| {
            format!(r#"<cornerLocal id="{id}" u="{u}" v="{v}" z="0" height="0"/>"#)
        };
        let tail = format!(
            "<objects><object id=\"1\" type=\"trafficIsland\" name=\"\" s=\"50\" t=\"-9\" zOffset=\"0\" hdg=\"0\" pitch=\"0\" \
             roll=\"0\" orientation=\"none\" length=\"9\" width=\"9\" height=\"1\"><outlines>\
             <outline id=\"00\" closed=\"true\" outer=\"true\">{}{}{}</outline>\
             <outline id=\"1\" closed=\"true\" outer=\"false\">{}{}{}{}</outline></outlines>\
             <borders><border outlineId=\"{outline}\" type=\"concrete\" width=\"0.1\" useCompleteOutline=\"false\">\
             <cornerReference id=\"{reference}\"/><cornerReference id=\"1\"/></border></borders></object></objects>",
            corner("00", "-4", "-4"),
            corner("1", "4", "-4"),
            corner("2", "0", "4"),
            corner("0", "-1", "-1"),
            corner("1", "1", "-1"),
            corner("2", "1", "1"),
            corner("3", "-1", "1")
        );
        Road {
            tail: &tail,
            ..Road::default()
        }
        .text()
    };
    let rows: Vec<Row> = vec![
        ("00 is 0", object("0", "0"), &[]),
        (
            "a corner of the other outline",
            object("3", "0"),
            &["error ids_only_ref_defined_ids"],
        ),
        ("a corner of this outline", object("3", "1"), &[]),
    ];
    super::run(&rows);
}
