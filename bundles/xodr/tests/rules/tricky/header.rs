//! Tests of the content of the header.

use super::Row;
use super::build::{LINE, Road, geometry};

/// Returns a whole file with this header.
fn with_header(attributes: &str, content: &str, roads: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenDRIVE>\n\
         <header revMajor=\"1\" revMinor=\"9\" {attributes}>{content}</header>\n{roads}</OpenDRIVE>\n"
    )
}

fn reference(text: &str) -> String {
    with_header("", &format!("<geoReference>{text}</geoReference>"), "")
}

const FLAWED: &[&str] = &["warning header_geo_reference"];

#[test]
fn geographic_references_give_expected_findings() {
    let rows: Vec<Row> = vec![
        (
            "blanks and lines around the string",
            reference("\n  <![CDATA[\n+proj=utm\n+zone=32\n]]>\n"),
            &[],
        ),
        (
            "a pipeline has several projections and parameters of its own",
            reference("+proj=pipeline +step +proj=utm +zone=32 +step +inv +proj=merc +lat_ts=0"),
            &[],
        ),
        (
            "UTM finds its zone by the longitude",
            reference("+proj=utm +lon_0=9 +datum=WGS84"),
            &[],
        ),
        (
            "but not without either",
            reference("+proj=utm +datum=WGS84"),
            FLAWED,
        ),
        (
            "web Mercator on a sphere, by grids that are none",
            reference(
                "+proj=merc +a=6378137 +b=6378137 +lat_ts=0.0 +nadgrids=@null +wktext +no_defs",
            ),
            &[],
        ),
        (
            "negative false easting",
            reference("+proj=tmerc +lat_0=0 +lon_0=9 +k=0.9996 +x_0=-174000 +y_0=-5405000"),
            &[],
        ),
        (
            "a code of two systems, one for the height",
            reference("EPSG:25832+7837"),
            &[],
        ),
        ("a code of one in degrees", reference("EPSG:4326"), FLAWED),
        ("half a code", reference("EPSG:"), FLAWED),
        (
            "a code to begin with",
            reference("+init=epsg:25832 +units=m"),
            &[],
        ),
        (
            "one that cannot be",
            reference("+init=epsg:2583200"),
            FLAWED,
        ),
        (
            "JSON, but not as PROJ writes it",
            reference("{\"lat\": 57.7}"),
            FLAWED,
        ),
        (
            "brackets in quotes are text",
            reference("PROJCS[\"a ] b\",UNIT[\"metre\",1]]"),
            &[],
        ),
        (
            "a system in degrees within one on a plane",
            reference("PROJCRS[\"x\",BASEGEOGCRS[\"y\"]]"),
            &[],
        ),
        ("one in degrees", reference("GEOGCS[\"y\"]"), FLAWED),
        (
            "names are compared with their case, as PROJ does it",
            reference("+proj=UTM +zone=32"),
            FLAWED,
        ),
        (
            "no sign of equality",
            reference("+proj=utm +zone32"),
            FLAWED,
        ),
        (
            "no value",
            reference("+proj=tmerc +lat_0= +lon_0=9"),
            FLAWED,
        ),
        (
            "a cone without its latitudes",
            reference("+proj=lcc +lat_0=48 +lon_0=11"),
            FLAWED,
        ),
        (
            "two values for one parameter",
            reference("+proj=tmerc +lat_0=48 +lat_0=49"),
            FLAWED,
        ),
        ("only white space", reference(" \n "), FLAWED),
        (
            "user data is no projection",
            reference("<userData code=\"a\" value=\"b\"/>"),
            FLAWED,
        ),
    ];
    super::run_files(&rows);
}

#[test]
fn header_bounds_give_expected_findings() {
    let road = |x: &str, shape: &str| {
        Road::default().with_plan_view(&geometry("0", x, "0", "0", "100", shape))
    };
    let bounds = |north, south, east, west| {
        format!("north=\"{north}\" south=\"{south}\" east=\"{east}\" west=\"{west}\"")
    };
    let beyond: &[&str] = &["warning header_bounds_contain_roads"];
    let rows: Vec<Row> = vec![
        (
            "zeros say nothing",
            with_header(&bounds("0", "0.0", "-0", "0e0"), "", &road("7", LINE)),
            &[],
        ),
        (
            "a pair of zeros says nothing, the other does",
            with_header(&bounds("0", "0", "50", "0"), "", &road("0", LINE)),
            beyond,
        ),
        (
            "some metres are as good as within",
            with_header(&bounds("4", "-4", "95", "0"), "", &road("0", LINE)),
            &[],
        ),
        (
            "one bound alone",
            with_header("east=\"50\"", "", &road("0", LINE)),
            beyond,
        ),
        (
            "reversed bounds contain nothing and are said once",
            with_header(&bounds("-4", "4", "100", "0"), "", &road("0", LINE)),
            &["error header_attributes"],
        ),
        (
            "an offset does not move the bounds",
            with_header(
                &bounds("4", "-4", "100", "0"),
                "<offset x=\"5000\" y=\"0\" z=\"0\" hdg=\"0\"/>",
                &road("0", LINE),
            ),
            &[],
        ),
        (
            "a circle bulges beyond its ends",
            with_header(
                &bounds("100", "-4", "20", "-20"),
                "",
                &road("0", "<arc curvature=\"0.0314159\"/>"),
            ),
            beyond,
        ),
        (
            "no roads, nothing beyond",
            with_header(&bounds("4", "-4", "100", "0"), "", ""),
            &[],
        ),
    ];
    super::run_files(&rows);
}

#[test]
fn header_offsets_give_expected_findings() {
    let offset = |x: &str, hdg: &str| {
        let offset = format!("<offset x=\"{x}\" y=\"0\" z=\"0\" hdg=\"{hdg}\"/>");
        with_header("", &offset, "")
    };
    let far: &[&str] = &["warning header_offset_plausible"];
    let rows: Vec<Row> = vec![
        ("the sixtieth zone in front", offset("60500000", "0"), &[]),
        ("a quarter turn is information", offset("0", "-1.5708"), &[]),
        ("a full turn is none too many", offset("0", "6.283185"), &[]),
        ("a quarter turn in degrees", offset("0", "-90"), far),
        ("beside the Earth", offset("6.05e11", "0"), far),
    ];
    super::run_files(&rows);
}
