//! Tests the content of HTML pages and its places. `reporters/html/browser` tests the pages in a
//! browser.

use std::io::Read;
use std::path::Path;

use crate::support::cli::{Cli, sample_farm};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use qcbus_document::Image;
use qcbus_ingest::Limits;
use qcbus_opendrive::{OwnedMap, RoadMap};
use serde_json::Value;

/// Returns a block of a page, unpacked.
fn block(page: &str, id: &str) -> Option<Vec<u8>> {
    let opening = format!("<script type=\"application/octet-stream\" id=\"{id}\">");
    let (_, rest) = page.split_once(&opening)?;
    let packed = STANDARD.decode(rest.split_once('<')?.0.trim()).unwrap();
    let mut bytes = Vec::new();
    let mut unpacked = flate2::read::GzDecoder::new(packed.as_slice());
    unpacked.read_to_end(&mut bytes).unwrap();
    Some(bytes)
}

fn page_of(cli: &Cli, file: &str) -> String {
    let said = cli.check_in(
        &sample_farm(),
        &[
            file,
            "--output-format",
            &format!("html={}", page(cli).display()),
        ],
        "out",
    );
    assert!(
        said.code.is_some_and(|code| code <= 1),
        "{}",
        said.whole(cli)
    );
    std::fs::read_to_string(page(cli)).unwrap()
}

fn page(cli: &Cli) -> std::path::PathBuf {
    cli.path().join("page.html")
}

fn data_of(page: &str) -> Value {
    serde_json::from_slice(&block(page, "data").expect("the page contains data")).unwrap()
}

fn map_of(path: &Path) -> OwnedMap {
    let limits = Limits::default();
    let prepared = qcbus_ingest::prepare(path, path.parent().unwrap(), &limits).unwrap();
    OwnedMap::of(Image::new(prepared.build())).unwrap()
}

/// Returns the first place of the finding of a rule.
fn place<'d>(data: &'d Value, rule: &str) -> &'d Value {
    let rules = data["rules"].as_array().unwrap();
    let is_it = |it: &Value| it["uid"].as_str().unwrap().ends_with(rule);
    let index = rules.iter().position(is_it);
    let index = index.unwrap_or_else(|| panic!("rule {rule} must be in {rules:?}"));
    let findings = data["findings"].as_array().unwrap();
    let found = findings.iter().find(|it| it["rule"] == index).unwrap();
    &found["places"][0]
}

/// Returns the index of a road and the point on it at s and t.
fn on_road(map: &RoadMap<'_>, id: &str, s: f64, t: f64) -> (usize, [f64; 2]) {
    let index = map.roads().iter().position(|road| road.id() == id);
    let index = index.unwrap_or_else(|| panic!("road {id} must be in the map"));
    let point = map.roads()[index].point(s, t, 0.0).unwrap();
    (index, [point.x, point.y])
}

#[test]
fn every_fault_is_marked_at_its_map_position() {
    let cli = Cli::new();
    let file = "faulty/seen_from_above.xodr";
    let page = page_of(&cli, file);
    let data = data_of(&page);
    assert!(block(&page, "plan").is_some_and(|plan| plan.starts_with(b"QCPL")));
    map_of(&sample_farm().join(file)).with(|map| {
        for (rule, road, s, t) in [
            ("contact_point_no_horizontal_gaps", "gap", 50.0, 0.0),
            ("refline_no_kinks", "kink", 40.0, 0.0),
            ("ids.only_ref_defined_ids", "dangling", 70.0, 0.0),
            // The signal is beyond the road. Its mark is at the end of the road that it exceeds.
            ("road.records_within_extent", "signal", 60.0, -4.5),
        ] {
            let place = place(&data, rule);
            let (index, expected) = on_road(map, road, s, t);
            let at: [f64; 2] = serde_json::from_value(place["at"].clone()).unwrap();
            let off = (at[0] - expected[0]).hypot(at[1] - expected[1]);
            assert!(
                off < 0.01,
                "{rule}: expected {expected:?}, found {at:?}: {place}"
            );
            let on = place["on"].as_array().unwrap();
            let names = on.iter().any(|it| it["road"] == index || it["signal"] == 0);
            assert!(names, "{rule}: unexpected highlights {on:?}");
        }
        // An overlap covers an area, so its mark lies on both roads.
        let place = place(&data, "road.no_overlap_outside_junction");
        let at: [f64; 2] = serde_json::from_value(place["at"].clone()).unwrap();
        let (_, corner) = on_road(map, "east", 60.0, 0.0);
        assert!(
            (0.0..=3.5).contains(&(at[0] - corner[0])),
            "{at:?} {corner:?}"
        );
        assert!(
            (0.0..=3.5).contains(&(corner[1] - at[1])),
            "{at:?} {corner:?}"
        );
    });
}

#[test]
fn every_finding_on_a_map_has_a_place() {
    let cli = Cli::new();
    let data = data_of(&page_of(&cli, "faulty/seen_from_above.xodr"));
    for finding in data["findings"].as_array().unwrap() {
        let place = &finding["places"][0];
        assert!(place["at"].is_array(), "{finding}");
        assert!(place["line"]["text"].is_string(), "{finding}");
    }
}

#[test]
fn scenario_is_shown_on_its_map() {
    let cli = Cli::new();
    let page = page_of(&cli, "faulty/beside_the_road.xosc");
    let data = data_of(&page);
    assert_eq!(data["map"]["path"], "maps/quay_straight.xodr");
    assert_eq!(data["map"]["own"], false);
    assert!(block(&page, "plan").is_some());
}

#[test]
fn file_without_a_road_still_has_a_page() {
    let cli = Cli::new();
    for file in [
        "catalogs/vehicles.xosc",
        "faulty/not_well_formed.xodr",
        "faulty/no_header.xodr",
    ] {
        let page = page_of(&cli, file);
        let data = data_of(&page);
        assert_eq!(data["file"]["path"], file);
        assert!(page.contains("default-src 'none'"), "{file}");
    }
}

#[test]
fn page_of_a_run_links_to_its_file_pages() {
    let cli = Cli::new();
    let page = page_of(&cli, ".");
    let data = data_of(&page);
    let files = data["files"].as_array().unwrap();
    assert!(files.len() > 20, "{}", files.len());
    for file in files {
        let link = file["page"].as_str().unwrap();
        let there = std::fs::read_to_string(cli.path().join(link)).unwrap();
        let own = data_of(&there);
        assert_eq!(own["file"]["path"], file["path"]);
        assert_eq!(own["file"]["verdict"], file["verdict"]);
        let findings = own["findings"].as_array().unwrap();
        let errors = findings.iter().filter(|it| it["level"] == "error").count();
        assert_eq!(file["error"], errors, "{file}");
    }
}
