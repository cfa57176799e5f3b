//! The recorded results of ASAM's own OpenDRIVE bundle, where they are at hand.

#![expect(
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may fail and say why it did not run"
)]

mod common;

use std::fmt::Write;
use std::path::Path;

use common::{CASES, Deviation, agrees_or_says};
use qcbus_sdk::Bundle;
use qcbus_sdk::corpus::{self, Comparison, compare_asam_cases, compare_real_files, settle};

/// The page that shows where we agree and where we do not.
const PARITY: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../docs/evidence/parity-opendrive.md"
);

const CONTACT: &str = "check_asam_xodr_road_geometry_contact_point";
const GAPS: &str = "check_asam_xodr_lane_smoothness_contact_point_no_horizontal_gaps";
const REDUNDANT: &str = "check_asam_xodr_performance_avoid_redundant_info";
const ACROSS: &str = "check_asam_xodr_road_lane_link_lanes_across_lane_sections";

const SCHEMA: &str = "check_asam_xodr_xml_valid_schema";

const NO_LINK: &str =
    "ASAM's checker crashes on roads without `<link>`; nothing is wrong with them";
const UNLINKED: &str = "lanes of one type that go on in the next lane section, in the same place, without a link in \
     either direction; ASAM's checker asks for the link back only where there is one";
const NOT_NUMBERS: &str =
    "the junction's id is no number, so ASAM's checker takes connecting roads for ordinary ones";
const CONNECTING: &str = "the roads belong to a junction, which the rule excludes; ASAM's checker means \
     to leave them out, but compares `junction` with 1";
const CROSSED: &str = "the connections name the wrong contact points, so that the lanes that they link are 10 m \
     apart; ASAM's checker looks only where the roads' own links agree";
const NO_WIDTH: &str = "the lane has no width where it is linked, so it has no edges that could miss any; \
     its link is reported by `new_lane_appear` and `zero_width_at_…`";

/// Where we differ, and why ours is right.
const DEVIATIONS: &[Deviation] = &[
    Deviation {
        checker: CONTACT,
        inputs: &[
            "road_geometry_param_poly3_length_match_invalid.xodr",
            "road_geometry_param_poly3_length_match_valid.xodr",
            "road_geometry_parampoly3_arclength_range_invalid.xodr",
            "road_geometry_parampoly3_arclength_range_valid.xodr",
            "road_geometry_parampoly3_valid_parameters/aV_invalid.xodr",
            "road_geometry_parampoly3_valid_parameters/bU_invalid.xodr",
            "road_geometry_parampoly3_valid_parameters/bV_invalid.xodr",
            "road_geometry_parampoly3_valid_parameters/valid.xodr",
            "performance_avoid_redundant_info_lane_width_invalid.xodr",
            "junctions_connection_one_connection_element_invalid.xodr",
            "close_match_multiple_issue.xodr",
            "road_lane_access_no_mix_of_deny_or_allow_17_invalid.xodr",
            "road_lane_access_no_mix_of_deny_or_allow_18_invalid.xodr",
            "road_lane_access_no_mix_of_deny_or_allow_18_valid.xodr",
            "lane_gap_example_issue_119.xodr",
        ],
        reason: NO_LINK,
    },
    Deviation {
        checker: CONTACT,
        inputs: &[
            "junction_connection_linkage_invalid.xodr",
            "junction_connection_linkage_valid.xodr",
            "junctions_connection_one_link_to_incoming_invalid.xodr",
            "junctions_connection_one_link_to_incoming_invalid_LHT.xodr",
            "road_lane_link_new_lane_appear_end_contact_point_invalid.xodr",
            "road_lane_link_new_lane_appear_end_contact_point_valid.xodr",
            "road_lane_link_new_lane_appear_inside_junction_invalid.xodr",
            "road_lane_link_new_lane_appear_junction_valid.xodr",
            "junction_valid_conn_smoothness.xodr",
            "valid_schema/positive18.xodr",
        ],
        reason: CONNECTING,
    },
    Deviation {
        checker: ACROSS,
        inputs: &["road_lane_link_new_lane_appear_both_start_contact_point_invalid.xodr"],
        reason: "one link is missing; ASAM's checker reports it twice, once from either road",
    },
    Deviation {
        checker: ACROSS,
        inputs: &["valid_schema/positive18.xodr", "many_invalid.xodr"],
        reason: UNLINKED,
    },
    Deviation {
        checker: GAPS,
        inputs: &["road_geometry_elem_asc_order/invalid.xodr"],
        reason: "the geometries are listed in the wrong order, which is reported; taken by their s, each \
             starts where the one before it ends",
    },
    Deviation {
        checker: GAPS,
        inputs: &["aV_invalid.xodr", "bV_invalid.xodr"],
        reason: "the curve really starts or ends elsewhere than its neighbour; ASAM's checker compares with \
             x and y of the geometry instead, and only where a road has three geometries",
    },
    Deviation {
        checker: GAPS,
        inputs: &["performance_avoid_redundant_info_lane_width_invalid.xodr"],
        reason: "the third is a biking lane that is not advisory; annex D.1 does not count it as drivable",
    },
    Deviation {
        checker: GAPS,
        inputs: &["junction_connection_linkage_invalid.xodr"],
        reason: CROSSED,
    },
    Deviation {
        checker: GAPS,
        inputs: &["junctions_connection_one_connection_element_invalid.xodr"],
        reason: "the linked lanes are 58 mm and 20 mm apart; ASAM's checker passes over them",
    },
    Deviation {
        checker: GAPS,
        inputs: &["Ex_Entry_Exit.xodr"],
        reason: "the lanes are 20 mm apart at a direct junction, which ASAM's checker does not look at",
    },
    Deviation {
        checker: GAPS,
        inputs: &[
            "road_lane_link_new_lane_appear_end_contact_point_invalid.xodr",
            "road_lane_link_new_lane_appear_inside_junction_invalid.xodr",
        ],
        reason: NO_WIDTH,
    },
    Deviation {
        checker: REDUNDANT,
        inputs: &["valid_schema/positive18.xodr"],
        reason: "one more: two lines in one direction whose headings are written a full turn apart",
    },
    Deviation {
        checker: REDUNDANT,
        inputs: &["lane_gap_example_issue_119.xodr"],
        reason: "the records change the width by less than a micrometre over the metre for which they hold; \
             ASAM's checker compares coefficients shifted to s = 0, 134 m away",
    },
];

#[test]
fn agrees_with_what_is_recorded() {
    let cases = recorded(compare_asam_cases, DEVIATIONS);
    let maps = recorded(compare_real_files, ON_REAL_MAPS);
    if let Some((cases, maps)) = cases.zip(maps) {
        agrees_or_says(Path::new(PARITY), &page(&cases, &maps));
    }
}

type Compare = fn(&'static Bundle, &Path) -> Result<Option<Vec<Comparison>>, String>;

/// The recorded results with ours, of which only declared ones differ; `None` when they are not at
/// hand.
fn recorded(compare: Compare, deviations: &[Deviation]) -> Option<Vec<Comparison>> {
    let comparisons = match compare(&qcbus_xodr::BUNDLE, Path::new(CASES)) {
        Ok(comparisons) => comparisons,
        Err(error) => panic!("{error}"),
    };
    let Some(comparisons) = comparisons else {
        println!("skipped: {CASES} is not there");
        return None;
    };
    let each: Vec<corpus::Deviation> = deviations.iter().flat_map(Deviation::each).collect();
    settle(&qcbus_xodr::BUNDLE, &comparisons, &each);
    Some(comparisons)
}

/// Where we differ on the maps of other projects, and why ours is right.
const ON_REAL_MAPS: &[Deviation] = &[
    Deviation {
        checker: ACROSS,
        inputs: &[
            "linux-files/UC_Motorway-Exit-Entry.xodr",
            "windows-files/UC_Motorway-Exit-Entry.xodr",
        ],
        reason: UNLINKED,
    },
    Deviation {
        checker: SCHEMA,
        inputs: &["straight_500m_signs_lht.xodr"],
        reason: "the objects have a radius, a width and a length at once, which the schema of 1.8.1 \
             forbids; the recorded bundle validates against 1.8.0",
    },
    Deviation {
        checker: "check_asam_xodr_road_linkage_is_junction_needed",
        inputs: &["fabriksgatan_mixed_id_types.xodr"],
        reason: NOT_NUMBERS,
    },
    Deviation {
        checker: ACROSS,
        inputs: &["fabriksgatan_mixed_id_types.xodr"],
        reason: NOT_NUMBERS,
    },
    Deviation {
        checker: ACROSS,
        inputs: &[
            "Unittest/xodr/multi_intersections.xodr",
            "multi_intersections_changed_speeds.xodr",
            "resources/xodr/multi_intersections.xodr",
            "straight_2x100m_opposite.xodr",
        ],
        reason: "each missing link once; ASAM's checker reports it twice, once from either road",
    },
    Deviation {
        checker: "check_asam_xodr_road_lane_link_new_lane_appear",
        inputs: &["highway_merge.xodr"],
        reason: "ASAM's checker crashes on a lane link to a lane that does not exist, which \
             `ids_only_ref_defined_ids` reports",
    },
    Deviation {
        checker: "check_asam_xodr_road_lane_link_new_lane_appear",
        inputs: &["parking_demo.xodr"],
        reason: "one of the two lanes has no width all along, so it does not appear; that it is linked is \
             reported by `zero_width_at_…`",
    },
    Deviation {
        checker: REDUNDANT,
        inputs: &[
            "linux-files/UC_Motorway-Exit-Entry.xodr",
            "windows-files/UC_Motorway-Exit-Entry.xodr",
        ],
        reason: "one more: two lines in one direction whose headings are written a full turn apart",
    },
];

/// The parity page: per collection a table of checkers, and every deviation with its reason.
fn page(cases: &[Comparison], maps: &[Comparison]) -> String {
    let mut page = String::from(
        "# Parity with ASAM's OpenDRIVE bundle\n\n\
         Generated by `QCBUS_BLESS=1 cargo test -p qcbus-xodr --test corpus` from recorded results of\n\
         ASAM's bundle (qc-opendrive 1.0.0), checked by the same test wherever those are at hand. A\n\
         deviation is a result in which ours differs on purpose; in each of them ours is right, for the\n\
         reason given. Where ASAM's checkers were silenced by a finding about the schema, ours may run.\n",
    );
    page.push_str(
        "\n## ASAM's own test files\n\n\
         A result agrees when status, number and levels of the issues are the same and the XPaths select\n\
         the same elements; ours may name further places.\n",
    );
    collection(&mut page, cases, DEVIATIONS);
    page.push_str(
        "\n## Maps of other projects\n\n\
         A result agrees when the status and the number of issues are the same. The recorded bundle is the\n\
         published one, which lacks three of the checkers.\n",
    );
    collection(&mut page, maps, ON_REAL_MAPS);
    page
}

fn collection(page: &mut String, comparisons: &[Comparison], deviations: &[Deviation]) {
    page.push_str("\n| checker | results | agree | deviations |\n|---|---:|---:|---:|\n");
    let mut checkers: Vec<&str> = comparisons.iter().map(|one| one.checker.as_str()).collect();
    checkers.sort_unstable();
    checkers.dedup();
    for checker in &checkers {
        let of_checker = comparisons.iter().filter(|one| one.checker == *checker);
        let (all, differ) = of_checker.fold((0, 0), |(all, differ), one| {
            (all + 1, differ + u32::from(one.difference.is_some()))
        });
        _ = writeln!(
            page,
            "| `{checker}` | {all} | {} | {differ} |",
            all - differ
        );
    }
    let differ = comparisons.iter().filter(|one| one.difference.is_some());
    let differ = differ.count();
    _ = writeln!(
        page,
        "\n{} results, {differ} deviations:",
        comparisons.len()
    );
    for deviation in deviations {
        _ = writeln!(page, "\n`{}`: {}.\n", deviation.checker, deviation.reason);
        for input in deviation.inputs {
            let hit = comparisons.iter().find(|one| {
                one.checker == deviation.checker
                    && one.input.ends_with(input)
                    && one.difference.is_some()
            });
            if let Some((path, difference)) =
                hit.and_then(|one| Some((&one.input, one.difference.as_ref()?)))
            {
                _ = writeln!(page, "- `{path}`: {}", difference.trim_end_matches(" ()"));
            }
        }
    }
}
