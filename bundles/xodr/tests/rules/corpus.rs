//! Compares the findings with the recorded results of ASAM's own OpenDRIVE bundle, if they are
//! available.

use std::path::Path;

use qcbus_rule_tests::corpus::{Deviations, Parity};

/// Directory of the recorded results, if they are available.
const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/cases");

/// Page that lists agreements and differences.
const PAGE: &str = concat!(
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
const UNLINKED: &str = "lanes of one type continue in the next lane section, in the same place, without a link in \
     either direction; ASAM's checker requires the link back only where there is one";
const NOT_NUMBERS: &str =
    "the junction's id is not a number, so ASAM's checker treats connecting roads as ordinary ones";
const CONNECTING: &str = "the roads belong to a junction, which the rule excludes; ASAM's checker should \
     skip them, but compares `junction` with 1";
const NO_WIDTH: &str = "the lane has no width where it is linked, so it has no edges that could have a gap; \
     `new_lane_appear` and `zero_width_at_…` report its link";

/// Differences from the recorded results, with the reasons why this bundle is right.
const DEVIATIONS: &[Deviations] = &[
    Deviations {
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
    Deviations {
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
    Deviations {
        checker: ACROSS,
        inputs: &["road_lane_link_new_lane_appear_both_start_contact_point_invalid.xodr"],
        reason: "one link is missing; ASAM's checker reports it twice, once from either road",
    },
    Deviations {
        checker: ACROSS,
        inputs: &["valid_schema/positive18.xodr", "many_invalid.xodr"],
        reason: UNLINKED,
    },
    Deviations {
        checker: GAPS,
        inputs: &["road_geometry_elem_asc_order/invalid.xodr"],
        reason: "the geometries are listed in the wrong order, which is reported; ordered by their s, each \
             starts where the one before it ends",
    },
    Deviations {
        checker: GAPS,
        inputs: &["aV_invalid.xodr", "bV_invalid.xodr"],
        reason: "the curve really starts or ends elsewhere than its neighbour; ASAM's checker compares with \
             x and y of the geometry instead, and only where a road has three geometries",
    },
    Deviations {
        checker: GAPS,
        inputs: &["performance_avoid_redundant_info_lane_width_invalid.xodr"],
        reason: "the third recorded finding is at a biking lane that is not advisory; annex D.1 does not count \
             it as drivable",
    },
    Deviations {
        checker: GAPS,
        inputs: &["junctions_connection_one_connection_element_invalid.xodr"],
        reason: "the linked lanes are 58 mm and 20 mm apart; ASAM's checker does not report them",
    },
    Deviations {
        checker: GAPS,
        inputs: &["Ex_Entry_Exit.xodr"],
        reason: "the lanes are 20 mm apart at a direct junction, which ASAM's checker does not check",
    },
    Deviations {
        checker: GAPS,
        inputs: &[
            "road_lane_link_new_lane_appear_end_contact_point_invalid.xodr",
            "road_lane_link_new_lane_appear_inside_junction_invalid.xodr",
        ],
        reason: NO_WIDTH,
    },
    Deviations {
        checker: REDUNDANT,
        inputs: &["valid_schema/positive18.xodr"],
        reason: "one more finding: two lines in one direction whose headings differ by a full turn",
    },
    Deviations {
        checker: REDUNDANT,
        inputs: &["lane_gap_example_issue_119.xodr"],
        reason: "the records change the width by less than a micrometre over the metre for which they hold; \
             ASAM's checker compares coefficients shifted to s = 0, 134 m away",
    },
];

/// Differences on the maps of other projects, with the reasons why this bundle is right.
const ON_REAL_MAPS: &[Deviations] = &[
    Deviations {
        checker: ACROSS,
        inputs: &[
            "linux-files/UC_Motorway-Exit-Entry.xodr",
            "windows-files/UC_Motorway-Exit-Entry.xodr",
        ],
        reason: UNLINKED,
    },
    Deviations {
        checker: SCHEMA,
        inputs: &["straight_500m_signs_lht.xodr"],
        reason: "the objects have a radius, a width and a length at once, which the schema of 1.8.1 \
             forbids; the recorded bundle validates against 1.8.0",
    },
    Deviations {
        checker: "check_asam_xodr_road_linkage_is_junction_needed",
        inputs: &["fabriksgatan_mixed_id_types.xodr"],
        reason: NOT_NUMBERS,
    },
    Deviations {
        checker: ACROSS,
        inputs: &["fabriksgatan_mixed_id_types.xodr"],
        reason: NOT_NUMBERS,
    },
    Deviations {
        checker: ACROSS,
        inputs: &[
            "Unittest/xodr/multi_intersections.xodr",
            "multi_intersections_changed_speeds.xodr",
            "resources/xodr/multi_intersections.xodr",
            "straight_2x100m_opposite.xodr",
        ],
        reason: "each missing link is reported once; ASAM's checker reports it twice, once from either road",
    },
    Deviations {
        checker: "check_asam_xodr_road_lane_link_new_lane_appear",
        inputs: &["highway_merge.xodr"],
        reason: "ASAM's checker crashes on a lane link to a lane that does not exist, which \
             `ids_only_ref_defined_ids` reports",
    },
    Deviations {
        checker: "check_asam_xodr_road_lane_link_new_lane_appear",
        inputs: &["parking_demo.xodr"],
        reason: "one of the two lanes has no width along its whole length, so it does not appear; \
             `zero_width_at_…` reports that it is linked",
    },
    Deviations {
        checker: REDUNDANT,
        inputs: &[
            "linux-files/UC_Motorway-Exit-Entry.xodr",
            "windows-files/UC_Motorway-Exit-Entry.xodr",
        ],
        reason: "one more finding: two lines in one direction whose headings differ by a full turn",
    },
];

const PARITY: Parity = Parity {
    bundle: &qcbus_xodr::BUNDLE,
    introduction: "# Parity with ASAM's OpenDRIVE bundle\n\n\
         Generated by `QCBUS_BLESS=1 cargo test -p qcbus-xodr --test rules corpus::` from recorded results of ASAM's\n\
         bundle (qc-opendrive 1.0.0). The same test checks the page if these results are available. A\n\
         deviation is a result in which qcbus differs on purpose. In each of them qcbus is right, for the\n\
         given reason. Where a finding about the schema silenced ASAM's checkers, those of qcbus may run.\n",
    theirs_skip_nothing_to_see: false,
    on_cases: DEVIATIONS,
    about_real_files: "\n## Maps of other projects\n\n\
         A result agrees when the status and the number of issues are the same. The recorded bundle is the\n\
         published one, which lacks three of the checkers.\n",
    on_real_files: ON_REAL_MAPS,
};

#[test]
fn results_agree_with_recorded_corpus() {
    PARITY.assert(Path::new(CASES), Path::new(PAGE));
}
