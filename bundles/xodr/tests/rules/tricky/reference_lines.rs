//! Tests of reference lines and profiles along the road.

use super::Row;
use super::build::{LINE, PI, Road, file, geometry};

fn two(second: [&str; 4]) -> String {
    let [s, x, y, hdg] = second;
    let first = geometry("0", "0", "0", "0", "50", LINE);
    // The arc ensures that the geometry is not a continuation of the same line.
    let arc = r#"<arc curvature="0.001"/>"#;
    Road::default().with_plan_view(&format!("{first}{}", geometry(s, x, y, hdg, "50", arc)))
}

fn one(length: &str, shape: &str) -> String {
    let road = Road {
        length,
        ..Road::default()
    };
    road.with_plan_view(&geometry("0", "0", "0", "0", length, shape))
}

fn elevations(records: &[(&str, &str, &str)]) -> String {
    let record = |(s, a, b): &(&str, &str, &str)| {
        format!(r#"<elevation s="{s}" a="{a}" b="{b}" c="0" d="0"/>"#)
    };
    let records: String = records.iter().map(record).collect();
    Road {
        profiles: &format!("<elevationProfile>{records}</elevationProfile>"),
        ..Road::default()
    }
    .text()
}

#[test]
fn geometries_give_expected_findings() {
    let turned = "6.283185307179586";
    let curve = |range: &str, b: &str| {
        format!(
            r#"<paramPoly3 {range} aU="0" bU="{b}" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0"/>"#
        )
    };
    let rows: Vec<Row> = vec![
        (
            "a full turn is no kink",
            two(["50", "50", "0", turned]),
            &[],
        ),
        ("5 mm are no gap", two(["50", "50.005", "0", "0"]), &[]),
        (
            "a metre is one",
            two(["50", "51", "0", "0"]),
            &["error lane_smoothness_contact_point_no_horizontal_gaps"],
        ),
        (
            "turning back is a kink",
            two(["50", "50", "0", PI]),
            &[
                "error road_geometry_refline_no_kinks",
                "error road_no_overlap_outside_junction",
            ],
        ),
        (
            "s that repeats",
            two(["0", "50", "0", "0"]),
            &[
                "warning road_geometry_elem_asc_order",
                "error road_geometry_s_value_sum",
            ],
        ),
        (
            "a second s that is 1 m short",
            two(["49", "50", "0", "0"]),
            &["error road_geometry_s_value_sum"],
        ),
        (
            "a circle",
            {
                let circle = r#"<arc curvature="0.1"/>"#;
                one("62.83185307179586", circle)
            },
            &[],
        ),
        ("exponents and spaces", one(" 1.0E2 ", LINE), &[]),
        ("no length, as the schema says", one("NaN", LINE), &[]),
        (
            "too large a number",
            one("1e999", LINE),
            &["error numbers_computable"],
        ),
        (
            "without a range the parameter runs to 1",
            one("50", &curve("", "1")),
            &["warning road_geometry_parampoly3_length_match"],
        ),
        ("and that may fit", one("50", &curve("", "50")), &[]),
        (
            "the same by arc length",
            one("50", &curve(r#"pRange="arcLength""#, "1")),
            &[],
        ),
        (
            "backwards",
            one("50", &curve(r#"pRange="arcLength""#, "-1")),
            &["error road_geometry_parampoly3_valid_parameters"],
        ),
        (
            "no shape",
            one("50", ""),
            &["error road_geometry_one_geom_elem_per_spec"],
        ),
        (
            "two shapes",
            one("50", r#"<line/><arc curvature="0.1"/>"#),
            &["error road_geometry_one_geom_elem_per_spec"],
        ),
    ];
    super::run(&rows);
}

#[test]
fn elevation_records_give_expected_findings() {
    let rows: Vec<Row> = vec![
        (
            "one step back",
            elevations(&[
                ("0", "0", "0.01"),
                ("50", "0.5", "0"),
                ("20", "0.2", "0.01"),
            ]),
            &[
                "error road_elevation_elem_asc_order",
                "warning performance_avoid_redundant_info",
            ],
        ),
        (
            "of two records at one place the last one holds",
            elevations(&[("0", "0", "0"), ("50", "3", "0.01"), ("50", "0", "0.01")]),
            &["warning road_elevation_elem_asc_order"],
        ),
        (
            "a step",
            elevations(&[("0", "0", "0"), ("50", "0.2", "0")]),
            &["error lane_smoothness_profile_no_vertical_gaps"],
        ),
    ];
    super::run(&rows);
}

/// An alternative encoding of a file.
type Spell = Box<dyn Fn(&str) -> Vec<u8>>;

#[test]
fn equivalent_spellings_of_file_give_same_findings() {
    let plan = qcbus_sdk::Plan::by_default(&qcbus_xodr::BUNDLE);
    let good = file("9", &Road::default().text());
    let bad = good.replace("lane id=\"-1\"", "lane id=\"1\"");
    let fault = [
        "error road_lane_lanes_numbered_correctly",
        "warning road_lane_lane_listing",
    ];
    let prefixed = |text: &str| {
        let text = text.replace("</", "</o:").replace('<', "<o:");
        text.replace("<o:/o:", "</o:")
            .replace("<o:?", "<?")
            .replace("<o:OpenDRIVE>", "<o:OpenDRIVE xmlns:o=\"urn:o\">")
    };
    let spellings: [(&str, Spell); 6] = [
        (
            "byte order mark",
            Box::new(|text| [b"\xEF\xBB\xBF", text.as_bytes()].concat()),
        ),
        (
            "line ends",
            Box::new(|text| text.replace('\n', "\r\n").into_bytes()),
        ),
        (
            "quotes",
            Box::new(|text| text.replace('"', "'").into_bytes()),
        ),
        (
            "references",
            Box::new(|text| text.replace("\"-1\"", "\"&#45;1\"").into_bytes()),
        ),
        ("prefix", Box::new(move |text| prefixed(text).into_bytes())),
        (
            "UTF-16",
            Box::new(|text| {
                let text = text.replace("UTF-8", "UTF-16");
                let units = std::iter::once(0xFEFF).chain(text.encode_utf16());
                units.flat_map(u16::to_le_bytes).collect()
            }),
        ),
    ];
    for (what, spell) in spellings {
        // A prefix is a finding of its own, and nothing else changes.
        let own = match what {
            "prefix" => Some("warning xml_no_prefixes"),
            _ => None,
        };
        let judge = |file: &[u8]| {
            let mut found = super::findings(&plan, file);
            assert!(own.is_none_or(|own| found.remove(own)), "{what}: {found:?}");
            found
        };
        let nothing = judge(&spell(&good));
        assert!(nothing.is_empty(), "{what}: {nothing:?}");
        let found = judge(&spell(&bad));
        assert!(found.iter().eq(fault.iter()), "{what}: {found:?}");
    }
}
