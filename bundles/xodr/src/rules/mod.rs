//! The rules, one per file, in the order of the result.
//!
//! A new rule needs one line in each of the two lists below. A line of the second list has the prefix of
//! the id, the name and the UID; see [`qcbus_sdk::rules!`].

use qcbus_sdk::AnyRule;

mod attributes_are_given;
mod default_regulations_only_speed_priority;
mod geometry_length_not_negative;
mod header_attributes;
mod header_bounds_contain_roads;
mod header_geo_reference;
mod header_offset_centered_coords;
mod header_offset_plausible;
mod header_proj_max_one_proj;
mod header_version_published;
mod ids_id_unique_in_class;
mod ids_id_unique_in_lane_section;
mod ids_only_ref_defined_ids;
mod junctions_boundary_close_gap_with_new_roads;
mod junctions_boundary_only_for_common_junctions;
mod junctions_boundary_segments_close_boundry;
mod junctions_boundary_segments_counter_clockwise_order;
mod junctions_boundary_segments_for_each_conn_road;
mod junctions_common_direct_junction_attributes;
mod junctions_common_junctions_no_pred_succ;
mod junctions_common_virtual_junction_attributes;
mod junctions_common_when_to_use;
mod junctions_connecting_lane_linked;
mod junctions_connecting_road_linked;
mod junctions_connecting_road_used;
mod junctions_connection_connect_road_no_incoming_road;
mod junctions_connection_end_opposite_linkage;
mod junctions_connection_lane_link_once;
mod junctions_connection_lane_links_agree;
mod junctions_connection_one_connection_element;
mod junctions_connection_one_link_to_incoming;
mod junctions_connection_required_attributes;
mod junctions_connection_smooth_fit;
mod junctions_connection_start_along_linkage;
mod junctions_cross_path_correct_junction_id;
mod junctions_cross_path_lane_linkage;
mod junctions_cross_path_only_connect_correct_type;
mod junctions_cross_path_start_end_contained;
mod junctions_cross_path_within_junction_area;
mod junctions_crossing_only_one_high_prio;
mod junctions_crossing_only_road_sections;
mod junctions_crossing_s_start_end_coverage;
mod junctions_direct_flat_exits_entries;
mod junctions_direct_linked_lane_smoothness;
mod junctions_direct_overlap_zone_coverage;
mod junctions_direct_overlap_zone_exclusivity;
mod junctions_direct_road_connectivity;
mod junctions_direct_road_ramp_heading;
mod junctions_direct_split_or_merge;
mod junctions_elevation_grid_entry_exit_smoothness;
mod junctions_elevation_grid_only_one_elev_grid;
mod junctions_elevation_grid_placed;
mod junctions_elevation_grid_readable;
mod junctions_elevation_grid_valid_for_entire_boundry;
mod junctions_geometry_correct_junction_boundry;
mod junctions_geometry_only_one_line_element;
mod junctions_geometry_ref_line_definition;
mod junctions_incoming_lane_used;
mod junctions_incoming_road_linked;
mod junctions_no_overlap;
mod junctions_outgoing_lane_reached;
mod junctions_priority_acyclic;
mod junctions_priority_high_and_low_attr;
mod junctions_priority_no_signals;
mod junctions_type_default_no_linked_road;
mod junctions_type_direct_no_conn_road;
mod junctions_virtual_connecting_roads_start_end;
mod junctions_virtual_connections_only_virtual_junctions;
mod junctions_virtual_cross_path_cross_road_check_s_t;
mod junctions_virtual_heading_equal_mainroad;
mod junctions_virtual_linked_lanes_smooth_fit;
mod junctions_virtual_main_road_only;
mod junctions_virtual_no_controllers;
mod junctions_virtual_only_one_start_end;
mod lane_section_single_side;
mod lane_smoothness_contact_point_no_horizontal_gaps;
mod lane_smoothness_contact_point_no_horizontal_kinks;
mod lane_smoothness_contact_point_no_vertical_gaps;
mod lane_smoothness_contact_point_no_vertical_kinks;
mod lane_smoothness_no_vertical_jumps_t;
mod lane_smoothness_profile_no_horizontal_gaps;
mod lane_smoothness_profile_no_vertical_gaps;
mod numbers_computable;
mod performance_avoid_redundant_info;
mod profile_carla_ids;
mod profile_carla_supported;
mod profile_esmini_supported;
mod profiles_begin_with_road;
mod records_are_complete;
mod road_corner_local_first_id_zero;
mod road_corner_local_mandatory_id_with_markings;
mod road_corner_local_sequential_id_values;
mod road_corner_road_corner_road_local_exclusivity;
mod road_corner_road_first_id_zero;
mod road_corner_road_mandatory_id_with_markings;
mod road_corner_road_sequential_id_values;
mod road_crg_attach_vs_friction;
mod road_crg_file_named;
mod road_crg_friction_no_z_offset_scale;
mod road_crg_h_offset_only_genuine_global;
mod road_crg_junction;
mod road_crg_no_opposite;
mod road_crg_only_on_per_s;
mod road_crg_s_t_offset_no_global;
mod road_cross_section_surface_no_shape_superelevation;
mod road_cross_section_surface_start_end_match_with_refline;
mod road_cross_section_surface_use_strip;
mod road_cross_section_surface_use_width;
mod road_curve_local_continuous_curve_local;
mod road_curve_local_length_match;
mod road_curve_local_parampoly3_arclength_range;
mod road_curve_local_parampoly3_normalized_range;
mod road_elevation_elem_asc_order;
mod road_geometry_arc_no_zero_curvature;
mod road_geometry_contact_point;
mod road_geometry_elem_asc_order;
mod road_geometry_hdg_in_radians;
mod road_geometry_lanes_no_fold;
mod road_geometry_one_geom_elem_per_spec;
mod road_geometry_only_one_refline;
mod road_geometry_parampoly3_arclength_range;
mod road_geometry_parampoly3_length_match;
mod road_geometry_parampoly3_normalized_range;
mod road_geometry_parampoly3_valid_parameters;
mod road_geometry_refline_exists;
mod road_geometry_refline_no_gaps;
mod road_geometry_refline_no_kinks;
mod road_geometry_s_value_sum;
mod road_geometry_spiral_curvature_change;
mod road_height_among_others;
mod road_lane_access_center_lane_no_acc_rule;
mod road_lane_access_elem_asc_order;
mod road_lane_access_no_mix_of_deny_or_allow;
mod road_lane_border_exclusive_offset_border;
mod road_lane_border_exclusive_width_border;
mod road_lane_border_overlap_with_inner_lanes;
mod road_lane_center_elem_definition;
mod road_lane_center_lane_id;
mod road_lane_center_lane_no_width;
mod road_lane_height_center_lane_no_height;
mod road_lane_lane_listing;
mod road_lane_lane_order;
mod road_lane_lane_order_no_gaps;
mod road_lane_lane_properties_elem_asc_order;
mod road_lane_lane_reverse_left_right;
mod road_lane_lane_sect_first;
mod road_lane_lane_sect_min_amount;
mod road_lane_lane_section_drivable;
mod road_lane_lanes_numbered_correctly;
mod road_lane_layer_lane_group_width_temporary;
mod road_lane_layer_lane_phys_attr_temporary;
mod road_lane_layer_layer_limits;
mod road_lane_layer_layer_mandatory_permanent;
mod road_lane_layer_length_only_temporary;
mod road_lane_level_true_one_side;
mod road_lane_link_center_lane;
mod road_lane_link_direction;
mod road_lane_link_lanes_across_lane_sections;
mod road_lane_link_lanes_across_roads;
mod road_lane_link_multiple_connections;
mod road_lane_link_new_lane_appear;
mod road_lane_link_no_link;
mod road_lane_link_temporary_layer_section_link_permanent;
mod road_lane_link_types;
mod road_lane_link_use_junctions;
mod road_lane_link_zero_width_at_end;
mod road_lane_link_zero_width_at_start;
mod road_lane_material_center_lane_no_material;
mod road_lane_material_elem_asc_order;
mod road_lane_offset_plausible;
mod road_lane_road_mark_elem_asc_order;
mod road_lane_road_mark_only_outer;
mod road_lane_rule_elem_asc_order;
mod road_lane_s_attr_value;
mod road_lane_section_elem_asc_order;
mod road_lane_section_lane_long_zero_width;
mod road_lane_section_lanesec_length_limit_road;
mod road_lane_section_lanesec_usage_lane_num;
mod road_lane_section_new_lanesec_link_temp_to_perm;
mod road_lane_section_valid_length;
mod road_lane_sizes_plausible;
mod road_lane_speed_center_lane_no_spd_lmt;
mod road_lane_speed_elem_asc_order;
mod road_lane_width_lane_width_validity;
mod road_lane_width_plausible;
mod road_lane_width_width_defined_whole_section;
mod road_lanes_lane_offset_elem_asc_order;
mod road_length_sum_geometries;
mod road_linkage_both_sides_consistency;
mod road_linkage_ends_meet;
mod road_linkage_is_junction_needed;
mod road_linkage_junc_link_attribute_usage;
mod road_linkage_road_link_attribute_usage;
mod road_linkage_touching_ends;
mod road_linkage_virtjunc_link_attribute_usage;
mod road_network_connected;
mod road_network_drivable;
mod road_no_overlap_outside_junction;
mod road_object_borders_different_outlineids;
mod road_object_borders_use_complete_outline_true;
mod road_object_bridges_from_lower_equal_to;
mod road_object_bridges_type_definition;
mod road_object_circular_vs_angular;
mod road_object_crosswalk_crosses_lanes;
mod road_object_marking_colour;
mod road_object_marking_complete_or_partial_on_outline;
mod road_object_marking_markings_with_outline;
mod road_object_marking_markings_without_outline;
mod road_object_marking_no_cornerreference_if_no_outline;
mod road_object_marking_no_outline_side_attr;
mod road_object_object_marking_enclosed_outline_marking;
mod road_object_object_marking_include_points_between_corner_references;
mod road_object_object_marking_keep_id_ordered;
mod road_object_object_marking_outline_corner_reference_count;
mod road_object_orientation;
mod road_object_outline_exactly_one_outer;
mod road_object_outline_has_area;
mod road_object_outline_inner_outline_touches_outer;
mod road_object_outline_not_crossed;
mod road_object_outline_outline_followed_by_corner;
mod road_object_outline_points_inside_box;
mod road_object_parking_apart;
mod road_object_positive_size;
mod road_object_reference_from_lower_equal_to;
mod road_object_repeating_attributes_with_outline_skeleton;
mod road_object_repeating_count;
mod road_object_repeating_no_widthstart_end_with_radius;
mod road_object_repeating_outline_use_cornerlocal;
mod road_object_repeating_valid_s_length;
mod road_object_s_t_coords;
mod road_object_sizes_plausible;
mod road_object_skeleton_points_boundary_inside_box;
mod road_object_skeleton_points_inside_box;
mod road_object_skeleton_polyline_followed_by_vertex;
mod road_object_skeleton_use_radius_or_width_length;
mod road_object_skeleton_vertex_local_no_mixing_road_local;
mod road_object_surface_avoid_skewed_crg_surfacees;
mod road_object_surface_crg_hidden_on_object_overlap;
mod road_object_surface_no_bounding_box_overlap;
mod road_object_surface_object_reference_on_overlap;
mod road_object_surface_only_for_angular_boxes;
mod road_object_surface_only_one_crg_file;
mod road_object_surface_repeat_discretely_not_continously;
mod road_object_tunnels_from_lower_equal_to;
mod road_object_tunnels_type_definition;
mod road_object_type_attr;
mod road_object_validty_check_parent_orientation;
mod road_object_validty_from_lower_equal_to;
mod road_railroad_one_rail_per_road;
mod road_railroad_platforms_min_amount;
mod road_railroad_platforms_min_segments;
mod road_railroad_rail_lane_width_validity;
mod road_railroad_rail_refline_centered;
mod road_railroad_switch_check_switch_conn;
mod road_railroad_switch_single_switch_no_partner;
mod road_railroad_tracks_meet;
mod road_ranges_not_reversed;
mod road_records_within_extent;
mod road_roadside_angles_in_radians;
mod road_roadside_clear_of_lanes;
mod road_roadside_near_road;
mod road_roadside_no_twins;
mod road_shape_elem_asc_order;
mod road_shape_no_step;
mod road_shape_t_definition_coverage;
mod road_signal_boards_multi_board_have_sub_boards;
mod road_signal_boards_multi_board_use_correct_type;
mod road_signal_boards_multi_board_use_dynamic_true;
mod road_signal_boards_static_board_use_correct_type;
mod road_signal_boards_static_boards_no_single_signal;
mod road_signal_catalog_entry;
mod road_signal_controller_dynamic_only;
mod road_signal_controller_in_junction;
mod road_signal_controller_one_per_light;
mod road_signal_controller_valid_for_signals;
mod road_signal_gantry_all_variable_boards_same_gantry;
mod road_signal_gantry_vmsgroup_at_least_one_reference;
mod road_signal_light_is_dynamic;
mod road_signal_no_self_reference;
mod road_signal_reference_from_lower_equal_to;
mod road_signal_reference_left_hand_traffic_lane_ids;
mod road_signal_reference_right_hand_traffic_lane_ids;
mod road_signal_reference_specify_direction;
mod road_signal_reference_used_for_signals_only;
mod road_signal_signal_type;
mod road_signal_speed_value;
mod road_signal_use_country_code;
mod road_signal_validity_left_hand_traffic_lane_ids;
mod road_signal_validity_right_hand_traffic_lane_ids;
mod road_slope_plausible;
mod road_speed_plausible;
mod road_superelevation_elem_asc_order;
mod road_type_elem_asc_order;
mod road_type_only_alpha_2_country_codes;
mod road_validity_lanes_exist;
mod words_are_known;
mod xml_fileheader_is_present;
mod xml_no_prefixes;
mod xml_root_tag_is_opendrive;
mod xml_valid_schema;
mod xml_valid_xml_document;
mod xml_version_is_defined;

/// Precondition of rules that only need a readable file, for `..Rule::after(READABLE)`.
pub(crate) const READABLE: &[&str] = &["check_asam_xodr_xml_root_tag_is_opendrive"];

/// All rules. A rule comes after the rules on which it depends.
pub static RULES: &[&dyn AnyRule] = qcbus_sdk::rules! {
    asam_xodr xml_valid_xml_document "asam.net:xodr:1.0.0:xml.valid_xml_document",
    asam_xodr xml_root_tag_is_opendrive "asam.net:xodr:1.0.0:xml.root_tag_is_opendrive",
    asam_xodr xml_fileheader_is_present "asam.net:xodr:1.0.0:xml.fileheader_is_present",
    asam_xodr xml_version_is_defined "asam.net:xodr:1.0.0:xml.version_is_defined",
    asam_xodr road_lane_level_true_one_side "asam.net:xodr:1.7.0:road.lane.level_true_one_side",
    asam_xodr road_lane_access_no_mix_of_deny_or_allow "asam.net:xodr:1.7.0:road.lane.access.no_mix_of_deny_or_allow",
    asam_xodr road_lane_link_lanes_across_lane_sections,
    asam_xodr road_linkage_is_junction_needed "asam.net:xodr:1.4.0:road.linkage.is_junction_needed",
    asam_xodr road_lane_link_zero_width_at_start "asam.net:xodr:1.7.0:road.lane.link.zero_width_at_start",
    asam_xodr road_lane_link_zero_width_at_end "asam.net:xodr:1.7.0:road.lane.link.zero_width_at_end",
    asam_xodr road_lane_link_new_lane_appear "asam.net:xodr:1.4.0:road.lane.link.new_lane_appear",
    asam_xodr junctions_connection_connect_road_no_incoming_road "asam.net:xodr:1.4.0:junctions.connection.connect_road_no_incoming_road",
    asam_xodr junctions_connection_one_connection_element "asam.net:xodr:1.7.0:junctions.connection.one_connection_element",
    asam_xodr junctions_connection_one_link_to_incoming "asam.net:xodr:1.8.0:junctions.connection.one_link_to_incoming",
    asam_xodr junctions_connection_start_along_linkage "asam.net:xodr:1.7.0:junctions.connection.start_along_linkage",
    asam_xodr junctions_connection_end_opposite_linkage "asam.net:xodr:1.7.0:junctions.connection.end_opposite_linkage",
    asam_xodr road_geometry_parampoly3_length_match,
    asam_xodr road_lane_border_overlap_with_inner_lanes "asam.net:xodr:1.4.0:road.lane.border.overlap_with_inner_lanes",
    asam_xodr road_geometry_parampoly3_arclength_range,
    asam_xodr road_geometry_parampoly3_normalized_range,
    asam_xodr road_geometry_contact_point "asam.net:xodr:1.7.0:road.geometry.contact_point",
    asam_xodr road_geometry_elem_asc_order "asam.net:xodr:1.4.0:road.geometry.elem_asc_order",
    asam_xodr road_geometry_parampoly3_valid_parameters "asam.net:xodr:1.7.0:road.geometry.paramPoly3.valid_parameters",
    asam_xodr performance_avoid_redundant_info,
    asam_xodr lane_smoothness_contact_point_no_horizontal_gaps "asam.net:xodr:1.7.0:lane_smoothness.contact_point_no_horizontal_gaps",
    asam_xodr xml_valid_schema "asam.net:xodr:1.0.0:xml.valid_schema",
    qcbus_xodr header_attributes "qcbus.dev:xodr:1.0.0:header.attributes",
    asam_xodr ids_id_unique_in_class "asam.net:xodr:1.4.0:ids.id_unique_in_class",
    asam_xodr ids_only_ref_defined_ids "asam.net:xodr:1.4.0:ids.only_ref_defined_ids",
    asam_xodr road_geometry_only_one_refline "asam.net:xodr:1.4.0:road.geometry.only_one_refline",
    asam_xodr road_geometry_refline_no_gaps "asam.net:xodr:1.4.0:road.geometry.refline_no_gaps",
    asam_xodr road_geometry_refline_no_kinks,
    asam_xodr road_lane_width_lane_width_validity "asam.net:xodr:1.4.0:road.lane.width.lane_width_validity",
    qcbus_xodr lane_smoothness_profile_no_vertical_gaps "qcbus.dev:xodr:1.8.0:lane_smoothness.profile_no_vertical_gaps",
    qcbus_xodr lane_smoothness_contact_point_no_horizontal_kinks "qcbus.dev:xodr:1.8.0:lane_smoothness.contact_point_no_horizontal_kinks",
    qcbus_xodr lane_smoothness_contact_point_no_vertical_gaps "qcbus.dev:xodr:1.8.0:lane_smoothness.contact_point_no_vertical_gaps",
    qcbus_xodr lane_smoothness_contact_point_no_vertical_kinks "qcbus.dev:xodr:1.8.0:lane_smoothness.contact_point_no_vertical_kinks",
    asam_xodr junctions_connection_smooth_fit "asam.net:xodr:1.9.0:junctions.connection.smooth_fit",
    asam_xodr junctions_direct_linked_lane_smoothness "asam.net:xodr:1.7.0:junctions.direct.linked_lane_smoothness",
    asam_xodr junctions_direct_road_ramp_heading "asam.net:xodr:1.7.0:junctions.direct.road_ramp_heading",
    asam_xodr junctions_virtual_connecting_roads_start_end "asam.net:xodr:1.9.0:junctions.virtual.connecting_roads_start_end",
    asam_xodr junctions_virtual_heading_equal_mainroad "asam.net:xodr:1.9.0:junctions.virtual.heading_equal_mainroad",
    asam_xodr junctions_virtual_linked_lanes_smooth_fit "asam.net:xodr:1.9.0:junctions.virtual.linked_lanes_smooth_fit",
    asam_xodr road_shape_t_definition_coverage,
    asam_xodr road_lane_layer_lane_group_width_temporary "asam.net:xodr:1.9.0:road.lane.layer.lane_group_width_temporary",
    asam_xodr road_lane_link_temporary_layer_section_link_permanent "asam.net:xodr:1.9.0:road.lane.link.temporary_layer_section_link_permanent",
    asam_xodr road_lane_link_multiple_connections "asam.net:xodr:1.4.0:road.lane.link.multiple_connections",
    asam_xodr road_lane_link_use_junctions "asam.net:xodr:1.4.0:road.lane.link.use_junctions",
    asam_xodr road_lane_lane_reverse_left_right "asam.net:xodr:1.4.0:road.lane.lane_reverse_left_right",
    asam_xodr road_lane_lane_section_drivable "asam.net:xodr:1.9.0:road.lane.lane_section_drivable",
    asam_xodr road_lane_section_lane_long_zero_width "asam.net:xodr:1.9.0:road.lane_section.lane_long_zero_width",
    asam_xodr road_lane_section_lanesec_usage_lane_num "asam.net:xodr:1.4.0:road.lane_section.lanesec_usage_lane_num",
    asam_xodr road_lane_road_mark_only_outer "asam.net:xodr:1.9.0:road.lane.road_mark.only_outer",
    asam_xodr road_railroad_rail_lane_width_validity "asam.net:xodr:1.7.0:road.railroad.rail_lane_width_validity",
    asam_xodr road_railroad_rail_refline_centered "asam.net:xodr:1.7.0:road.railroad.rail_refline_centered",
    asam_xodr road_corner_local_first_id_zero "asam.net:xodr:1.9.0:road.corner_local.first_id_zero",
    asam_xodr road_corner_local_sequential_id_values "asam.net:xodr:1.9.0:road.corner_local.sequential_id_values",
    asam_xodr road_corner_local_mandatory_id_with_markings "asam.net:xodr:1.9.0:road.corner_local.mandatory_id_with_markings",
    asam_xodr road_corner_road_first_id_zero "asam.net:xodr:1.9.0:road.corner_road.first_id_zero",
    asam_xodr road_corner_road_sequential_id_values "asam.net:xodr:1.9.0:road.corner_road.sequential_id_values",
    asam_xodr road_corner_road_mandatory_id_with_markings "asam.net:xodr:1.9.0:road.corner_road.mandatory_id_with_markings",
    asam_xodr road_corner_road_corner_road_local_exclusivity,
    asam_xodr road_object_outline_outline_followed_by_corner,
    asam_xodr road_object_outline_exactly_one_outer "asam.net:xodr:1.9.0:road.object.outline.exactly_one_outer",
    asam_xodr road_object_borders_different_outlineids "asam.net:xodr:1.9.0:road.object.borders.different_outlineids",
    asam_xodr road_object_borders_use_complete_outline_true,
    asam_xodr road_object_marking_colour,
    asam_xodr road_object_marking_complete_or_partial_on_outline "asam.net:xodr:1.9.0:road.object.marking.complete_or_partial_on_outline",
    asam_xodr road_object_marking_markings_with_outline "asam.net:xodr:1.9.0:road.object.marking.markings_with_outline",
    asam_xodr road_object_marking_markings_without_outline "asam.net:xodr:1.9.0:road.object.marking.markings_without_outline",
    asam_xodr road_object_marking_no_cornerreference_if_no_outline "asam.net:xodr:1.7.0:road.object.marking.no_cornerreference_if_no_outline",
    asam_xodr road_object_marking_no_outline_side_attr "asam.net:xodr:1.7.0:road.object.marking.no_outline_side_attr",
    asam_xodr road_object_object_marking_outline_corner_reference_count,
    asam_xodr road_object_object_marking_enclosed_outline_marking "asam.net:xodr:1.9.0:road.object.object_marking.enclosed_outline_marking",
    asam_xodr road_object_object_marking_include_points_between_corner_references "asam.net:xodr:1.9.0:road.object.object_marking.include_points_between_cornerReferences",
    asam_xodr road_object_object_marking_keep_id_ordered "asam.net:xodr:1.9.0:road.object.object_marking.keep_id_ordered",
    asam_xodr road_object_circular_vs_angular "asam.net:xodr:1.7.0:road.object.circular_vs_angular",
    asam_xodr road_object_orientation "asam.net:xodr:1.7.0:road.object.orientation",
    asam_xodr road_object_s_t_coords "asam.net:xodr:1.7.0:road.object.s_t_coords",
    asam_xodr road_object_type_attr "asam.net:xodr:1.7.0:road.object.type_attr",
    asam_xodr road_object_bridges_type_definition "asam.net:xodr:1.7.0:road.object.bridges.type_definition",
    asam_xodr road_object_tunnels_type_definition "asam.net:xodr:1.7.0:road.object.tunnels.type_definition",
    asam_xodr road_object_validty_from_lower_equal_to "asam.net:xodr:1.7.0:road.object.validty.from_lower_equal_to",
    asam_xodr road_object_reference_from_lower_equal_to "asam.net:xodr:1.7.0:road.object.reference.from_lower_equal_to",
    asam_xodr road_object_tunnels_from_lower_equal_to "asam.net:xodr:1.7.0:road.object.tunnels.from_lower_equal_to",
    asam_xodr road_signal_reference_from_lower_equal_to "asam.net:xodr:1.7.0:road.signal.reference.from_lower_equal_to",
    asam_xodr road_object_bridges_from_lower_equal_to "asam.net:xodr:1.7.0:road.object.bridges.from_lower_equal_to",
    asam_xodr road_object_validty_check_parent_orientation,
    asam_xodr road_signal_validity_right_hand_traffic_lane_ids "asam.net:xodr:1.7.0:road.signal.validity.right_hand_traffic_lane_ids",
    asam_xodr road_signal_validity_left_hand_traffic_lane_ids "asam.net:xodr:1.7.0:road.signal.validity.left_hand_traffic_lane_ids",
    asam_xodr road_signal_reference_right_hand_traffic_lane_ids "asam.net:xodr:1.7.0:road.signal.reference.right_hand_traffic_lane_ids",
    asam_xodr road_signal_reference_left_hand_traffic_lane_ids "asam.net:xodr:1.7.0:road.signal.reference.left_hand_traffic_lane_ids",
    asam_xodr road_object_repeating_attributes_with_outline_skeleton "asam.net:xodr:1.9.0:road.object.repeating.attributes_with_outline_skeleton",
    asam_xodr road_object_repeating_no_widthstart_end_with_radius "asam.net:xodr:1.9.0:road.object.repeating.no_widthstart_end_with_radius",
    asam_xodr road_object_repeating_outline_use_cornerlocal "asam.net:xodr:1.9.0:road.object.repeating.outline_use_cornerlocal",
    asam_xodr road_object_repeating_valid_s_length,
    asam_xodr road_object_skeleton_polyline_followed_by_vertex,
    asam_xodr road_object_skeleton_use_radius_or_width_length,
    asam_xodr road_object_skeleton_vertex_local_no_mixing_road_local,
    asam_xodr road_object_surface_only_for_angular_boxes "asam.net:xodr:1.7.0:road.object.surface.only_for_angular_boxes",
    asam_xodr road_object_surface_only_one_crg_file "asam.net:xodr:1.7.0:road.object.surface.only_one_crg_file",
    asam_xodr road_object_surface_repeat_discretely_not_continously "asam.net:xodr:1.7.0:road.object.surface.repeat_discretely_not_continously",
    asam_xodr road_crg_attach_vs_friction "asam.net:xodr:1.7.0:road.crg.attach_vs_friction",
    asam_xodr road_crg_friction_no_z_offset_scale "asam.net:xodr:1.7.0:road.crg.friction_no_z_offset_scale",
    asam_xodr road_crg_h_offset_only_genuine_global "asam.net:xodr:1.9.0:road.crg.h_offset_only_genuine_global",
    asam_xodr road_crg_no_opposite "asam.net:xodr:1.7.0:road.crg.no_opposite",
    asam_xodr road_crg_s_t_offset_no_global,
    asam_xodr road_crg_junction "asam.net:xodr:1.7.0:road.crg.junction",
    asam_xodr road_crg_only_on_per_s "asam.net:xodr:1.7.0:road.crg.only_on_per_s",
    asam_xodr road_railroad_one_rail_per_road "asam.net:xodr:1.7.0:road.railroad.one_rail_per_road",
    asam_xodr road_railroad_platforms_min_amount,
    asam_xodr road_railroad_platforms_min_segments,
    asam_xodr road_railroad_switch_check_switch_conn,
    asam_xodr road_railroad_switch_single_switch_no_partner "asam.net:xodr:1.7.0:road.railroad.switch.single_switch_no_partner",
    asam_xodr road_signal_signal_type "asam.net:xodr:1.7.0:road.signal.signal_type",
    asam_xodr road_signal_use_country_code "asam.net:xodr:1.7.0:road.signal.use_country_code",
    asam_xodr road_signal_boards_multi_board_have_sub_boards "asam.net:xodr:1.8.0:road.signal.boards.multi_board_have_sub_boards",
    asam_xodr road_signal_boards_multi_board_use_correct_type "asam.net:xodr:1.8.0:road.signal.boards.multi_board_use_correct_type",
    asam_xodr road_signal_boards_multi_board_use_dynamic_true "asam.net:xodr:1.8.0:road.signal.boards.multi_board_use_dynamic_true",
    asam_xodr road_signal_boards_static_boards_no_single_signal "asam.net:xodr:1.9.0:road.signal.boards.static_boards_no_single_signal",
    asam_xodr road_signal_boards_static_board_use_correct_type,
    asam_xodr road_signal_controller_valid_for_signals "asam.net:xodr:1.7.0:road.signal.controller.valid_for_signals",
    asam_xodr road_signal_reference_specify_direction "asam.net:xodr:1.7.0:road.signal.reference.specify_direction",
    asam_xodr road_signal_reference_used_for_signals_only "asam.net:xodr:1.7.0:road.signal.reference.used_for_signals_only",
    asam_xodr road_elevation_elem_asc_order "asam.net:xodr:1.4.0:road.elevation.elem_asc_order",
    asam_xodr road_superelevation_elem_asc_order "asam.net:xodr:1.4.0:road.superelevation.elem_asc_order",
    asam_xodr road_type_elem_asc_order "asam.net:xodr:1.4.0:road.type.elem_asc_order",
    asam_xodr road_lanes_lane_offset_elem_asc_order "asam.net:xodr:1.4.0:road.lanes.lane_offset.elem_asc_order",
    asam_xodr road_lane_section_elem_asc_order "asam.net:xodr:1.4.0:road.lane_section.elem_asc_order",
    asam_xodr road_shape_elem_asc_order "asam.net:xodr:1.4.0:road.shape.elem_asc_order",
    asam_xodr road_lane_material_elem_asc_order "asam.net:xodr:1.4.0:road.lane.material.elem_asc_order",
    asam_xodr road_lane_speed_elem_asc_order "asam.net:xodr:1.4.0:road.lane.speed.elem_asc_order",
    asam_xodr road_lane_road_mark_elem_asc_order "asam.net:xodr:1.4.0:road.lane.road_mark.elem_asc_order",
    asam_xodr road_lane_rule_elem_asc_order "asam.net:xodr:1.4.0:road.lane.rule.elem_asc_order",
    asam_xodr road_lane_access_elem_asc_order "asam.net:xodr:1.4.0:road.lane.access.elem_asc_order",
    asam_xodr road_lane_lane_properties_elem_asc_order,
    asam_xodr road_lane_center_lane_no_width "asam.net:xodr:1.4.0:road.lane.center_lane_no_width",
    asam_xodr road_lane_access_center_lane_no_acc_rule "asam.net:xodr:1.4.0:road.lane.access.center_lane_no_acc_rule",
    asam_xodr road_lane_height_center_lane_no_height "asam.net:xodr:1.4.0:road.lane.height.center_lane_no_height",
    asam_xodr road_lane_material_center_lane_no_material "asam.net:xodr:1.4.0:road.lane.material.center_lane_no_material",
    asam_xodr road_lane_speed_center_lane_no_spd_lmt "asam.net:xodr:1.4.0:road.lane.speed.center_lane_no_spd_lmt",
    asam_xodr ids_id_unique_in_lane_section,
    asam_xodr road_lane_center_lane_id "asam.net:xodr:1.4.0:road.lane.center_lane_id",
    asam_xodr road_lane_lanes_numbered_correctly "asam.net:xodr:1.4.0:road.lane.lanes_numbered_correctly",
    asam_xodr road_lane_lane_listing "asam.net:xodr:1.4.0:road.lane.lane_listing",
    asam_xodr road_lane_lane_order "asam.net:xodr:1.4.0:road.lane.lane_order",
    asam_xodr road_lane_lane_order_no_gaps "asam.net:xodr:1.4.0:road.lane.lane_order_no_gaps",
    asam_xodr road_lane_border_exclusive_width_border,
    asam_xodr road_lane_border_exclusive_offset_border,
    asam_xodr road_lane_center_elem_definition,
    asam_xodr road_lane_lane_sect_first "asam.net:xodr:1.9.0:road.lane.lane_sect_first",
    asam_xodr road_lane_lane_sect_min_amount,
    asam_xodr road_lane_s_attr_value "asam.net:xodr:1.4.0:road.lane.s_attr_value",
    asam_xodr road_lane_section_valid_length "asam.net:xodr:1.4.0:road.lane_section.valid_length",
    asam_xodr road_lane_section_lanesec_length_limit_road "asam.net:xodr:1.9.0:road.lane_section.lanesec_length_limit_road",
    asam_xodr road_lane_width_width_defined_whole_section "asam.net:xodr:1.7.0:road.lane.width.width_defined_whole_section",
    asam_xodr road_lane_layer_layer_limits "asam.net:xodr:1.9.0:road.lane.layer.layer_limits",
    asam_xodr road_lane_layer_layer_mandatory_permanent "asam.net:xodr:1.9.0:road.lane.layer.layer_mandatory_permanent",
    asam_xodr road_lane_layer_length_only_temporary "asam.net:xodr:1.9.0:road.lane.layer.length_only_temporary",
    asam_xodr road_lane_layer_lane_phys_attr_temporary "asam.net:xodr:1.9.0:road.lane.layer.lane_phys_attr_temporary",
    asam_xodr road_lane_section_new_lanesec_link_temp_to_perm "asam.net:xodr:1.9.0:road.lane_section.new_lanesec_link_temp_to_perm",
    asam_xodr road_geometry_refline_exists "asam.net:xodr:1.4.0:road.geometry.refline_exists",
    asam_xodr road_geometry_one_geom_elem_per_spec "asam.net:xodr:1.4.0:road.geometry.one_geom_elem_per_spec",
    asam_xodr road_geometry_s_value_sum "asam.net:xodr:1.9.0:road.geometry.s-value_sum",
    asam_xodr road_length_sum_geometries "asam.net:xodr:1.9.0:road.length_sum_geometries",
    asam_xodr road_geometry_arc_no_zero_curvature "asam.net:xodr:1.9.0:road.geometry.arc.no_zero_curvature",
    asam_xodr road_geometry_spiral_curvature_change "asam.net:xodr:1.9.0:road.geometry.spiral.curvature_change",
    asam_xodr default_regulations_only_speed_priority "asam.net:xodr:1.8.0:defaultRegulations.only_speed_priority",
    asam_xodr header_offset_centered_coords "asam.net:xodr:1.7.0:header.offset.centered_coords",
    asam_xodr header_proj_max_one_proj "asam.net:xodr:1.9.0:header.proj.max_one_proj",
    asam_xodr road_type_only_alpha_2_country_codes "asam.net:xodr:1.7.0:road.type.only_alpha_2_country_codes",
    asam_xodr road_cross_section_surface_no_shape_superelevation "asam.net:xodr:1.8.0:road.cross_section_surface.no_shape_superelevation",
    asam_xodr road_cross_section_surface_start_end_match_with_refline "asam.net:xodr:1.8.0:road.cross_section_surface.start_end_match_with_refline",
    asam_xodr road_cross_section_surface_use_strip "asam.net:xodr:1.8.0:road.cross_section_surface.use_strip",
    asam_xodr road_cross_section_surface_use_width "asam.net:xodr:1.8.0:road.cross_section_surface.use_width",
    asam_xodr junctions_type_default_no_linked_road,
    asam_xodr junctions_type_direct_no_conn_road,
    asam_xodr junctions_boundary_only_for_common_junctions "asam.net:xodr:1.8.0:junctions.boundary.only_for_common_junctions",
    asam_xodr junctions_common_direct_junction_attributes "asam.net:xodr:1.8.0:junctions.common.direct_junction_attributes",
    asam_xodr junctions_common_junctions_no_pred_succ "asam.net:xodr:1.4.0:junctions.common.junctions_no_pred_succ",
    asam_xodr junctions_common_virtual_junction_attributes "asam.net:xodr:1.5.0:junctions.common.virtual_junction_attributes",
    asam_xodr junctions_virtual_connections_only_virtual_junctions "asam.net:xodr:1.9.0:junctions.virtual.connections.only_virtual_junctions",
    asam_xodr junctions_common_when_to_use,
    asam_xodr junctions_crossing_only_one_high_prio "asam.net:xodr:1.8.0:junctions.crossing.only_one_high_prio",
    asam_xodr junctions_crossing_only_road_sections "asam.net:xodr:1.8.0:junctions.crossing.only_road_sections",
    asam_xodr junctions_direct_overlap_zone_exclusivity "asam.net:xodr:1.8.0:junctions.direct.overlap_zone_exclusivity",
    asam_xodr junctions_direct_road_connectivity "asam.net:xodr:1.8.0:junctions.direct.road_connectivity",
    asam_xodr junctions_elevation_grid_only_one_elev_grid "asam.net:xodr:1.8.0:junctions.elevation_grid.only_one_elev_grid",
    asam_xodr junctions_geometry_only_one_line_element "asam.net:xodr:1.8.0:junctions.geometry.only_one_line_element",
    asam_xodr junctions_priority_high_and_low_attr "asam.net:xodr:1.8.0:junctions.priority.high_and_low_attr",
    asam_xodr junctions_virtual_no_controllers "asam.net:xodr:1.9.0:junctions.virtual.no_controllers",
    asam_xodr junctions_virtual_only_one_start_end "asam.net:xodr:1.9.0:junctions.virtual.only_one_start_end",
    asam_xodr junctions_virtual_main_road_only "asam.net:xodr:1.9.0:junctions.virtual.main_road_only",
    asam_xodr junctions_boundary_segments_for_each_conn_road "asam.net:xodr:1.8.0:junctions.boundary.segments_for_each_conn_road",
    asam_xodr junctions_cross_path_correct_junction_id,
    asam_xodr junctions_cross_path_only_connect_correct_type "asam.net:xodr:1.8.0:junctions.cross_path.only_connect_correct_type",
    asam_xodr road_linkage_junc_link_attribute_usage "asam.net:xodr:1.7.0:road.linkage.junc_link_attribute_usage",
    asam_xodr road_linkage_road_link_attribute_usage "asam.net:xodr:1.4.0:road.linkage.road_link_attribute_usage",
    asam_xodr road_linkage_virtjunc_link_attribute_usage "asam.net:xodr:1.7.0:road.linkage.virtjunc_link_attribute_usage",
    asam_xodr road_linkage_both_sides_consistency "asam.net:xodr:1.9.0:road.linkage.both_sides_consistency",
    asam_xodr road_lane_link_no_link "asam.net:xodr:1.4.0:road.lane.link.no_link",
    qcbus_xodr road_records_within_extent "qcbus.dev:xodr:1.0.0:road.records_within_extent",
    asam_xodr road_object_outline_points_inside_box "asam.net:xodr:1.7.0:road.object.outline.points_inside_box",
    asam_xodr road_object_skeleton_points_inside_box "asam.net:xodr:1.8.0:road.object.skeleton.points_inside_box",
    asam_xodr road_object_skeleton_points_boundary_inside_box "asam.net:xodr:1.9.0:road.object.skeleton.points_boundary_inside_box",
    asam_xodr road_object_outline_inner_outline_touches_outer "asam.net:xodr:1.9.0:road.object.outline.inner_outline_touches_outer",
    asam_xodr road_curve_local_continuous_curve_local "asam.net:xodr:1.9.0:road.curve_local.continuous_curve_local",
    asam_xodr road_curve_local_length_match "asam.net:xodr:1.9.0:road.curve_local.length_match",
    asam_xodr road_curve_local_parampoly3_arclength_range "asam.net:xodr:1.9.0:road.curve_local.paramPoly3.arcLength_range",
    asam_xodr road_curve_local_parampoly3_normalized_range "asam.net:xodr:1.9.0:road.curve_local.paramPoly3.normalized_range",
    asam_xodr road_object_surface_avoid_skewed_crg_surfacees "asam.net:xodr:1.9.0:road.object.surface.avoid_skewed_crg_surfacees",
    asam_xodr road_object_surface_crg_hidden_on_object_overlap "asam.net:xodr:1.7.0:road.object.surface.crg_hidden_on_object_overlap",
    asam_xodr junctions_boundary_segments_close_boundry "asam.net:xodr:1.8.0:junctions.boundary.segments_close_boundry",
    asam_xodr junctions_boundary_segments_counter_clockwise_order "asam.net:xodr:1.8.0:junctions.boundary.segments_counter_clockwise_order",
    asam_xodr junctions_boundary_close_gap_with_new_roads "asam.net:xodr:1.8.0:junctions.boundary.close_gap_with_new_roads",
    asam_xodr junctions_geometry_correct_junction_boundry "asam.net:xodr:1.8.0:junctions.geometry.correct_junction_boundry",
    asam_xodr junctions_geometry_ref_line_definition "asam.net:xodr:1.8.0:junctions.geometry.ref_line_definition",
    asam_xodr junctions_elevation_grid_valid_for_entire_boundry "asam.net:xodr:1.8.0:junctions.elevation_grid.valid_for_entire_boundry",
    asam_xodr junctions_direct_split_or_merge "asam.net:xodr:1.8.0:junctions.direct.split_or_merge",
    asam_xodr junctions_cross_path_lane_linkage "asam.net:xodr:1.8.0:junctions.cross_path.lane_linkage",
    asam_xodr junctions_cross_path_start_end_contained "asam.net:xodr:1.8.0:junctions.cross_path.start_end_contained",
    asam_xodr junctions_virtual_cross_path_cross_road_check_s_t "asam.net:xodr:1.8.0:junctions.virtual.crossPath.cross_road_check_s_t",
    asam_xodr junctions_cross_path_within_junction_area "asam.net:xodr:1.8.0:junctions.cross_path.within_junction_area",
    asam_xodr junctions_priority_no_signals "asam.net:xodr:1.7.0:junctions.priority.no_signals",
    asam_xodr road_signal_gantry_all_variable_boards_same_gantry "asam.net:xodr:1.9.0:road.signal.gantry.all_variable_boards_same_gantry",
    asam_xodr road_signal_gantry_vmsgroup_at_least_one_reference "asam.net:xodr:1.9.0:road.signal.gantry.vmsgroup_at_least_one_reference",
    asam_xodr road_no_overlap_outside_junction,
    asam_xodr junctions_crossing_s_start_end_coverage "asam.net:xodr:1.8.0:junctions.crossing.s_start_end_coverage",
    asam_xodr junctions_direct_flat_exits_entries "asam.net:xodr:1.8.0:junctions.direct.flat_exits_entries",
    asam_xodr junctions_direct_overlap_zone_coverage "asam.net:xodr:1.8.0:junctions.direct.overlap_zone_coverage",
    asam_xodr junctions_elevation_grid_entry_exit_smoothness "asam.net:xodr:1.8.0:junctions.elevation_grid.entry_exit_smoothness",
    asam_xodr junctions_no_overlap "asam.net:xodr:1.4.0:junctions.no_overlap",
    qcbus_xodr lane_smoothness_no_vertical_jumps_t "qcbus.dev:xodr:1.8.0:lane_smoothness.no_vertical_jumps_t",
    asam_xodr road_object_surface_no_bounding_box_overlap "asam.net:xodr:1.7.0:road.object.surface.no_bounding_box_overlap",
    asam_xodr road_object_surface_object_reference_on_overlap "asam.net:xodr:1.7.0:road.object.surface.object_reference_on_overlap",
    qcbus_xodr junctions_connection_required_attributes "qcbus.dev:xodr:1.4.0:junctions.connection.required_attributes",
    qcbus_xodr lane_smoothness_profile_no_horizontal_gaps "qcbus.dev:xodr:1.4.0:lane_smoothness.profile_no_horizontal_gaps",
    qcbus_xodr road_lane_link_lanes_across_roads "qcbus.dev:xodr:1.4.0:road.lane.link.lanes_across_roads",
    qcbus_xodr road_roadside_near_road "qcbus.dev:xodr:1.0.0:road.roadside.near_road",
    qcbus_xodr road_roadside_angles_in_radians "qcbus.dev:xodr:1.0.0:road.roadside.angles_in_radians",
    qcbus_xodr road_roadside_no_twins "qcbus.dev:xodr:1.0.0:road.roadside.no_twins",
    qcbus_xodr road_roadside_clear_of_lanes "qcbus.dev:xodr:1.0.0:road.roadside.clear_of_lanes",
    qcbus_xodr road_signal_controller_dynamic_only "qcbus.dev:xodr:1.1.0:road.signal.controller.dynamic_only",
    qcbus_xodr road_signal_controller_one_per_light "qcbus.dev:xodr:1.1.0:road.signal.controller.one_per_light",
    qcbus_xodr road_signal_controller_in_junction "qcbus.dev:xodr:1.1.0:road.signal.controller.in_junction",
    qcbus_xodr road_signal_speed_value,
    qcbus_xodr road_object_crosswalk_crosses_lanes "qcbus.dev:xodr:1.4.0:road.object.crosswalk_crosses_lanes",
    qcbus_xodr road_object_positive_size "qcbus.dev:xodr:1.0.0:road.object.positive_size",
    qcbus_xodr road_object_outline_not_crossed "qcbus.dev:xodr:1.4.0:road.object.outline.not_crossed",
    qcbus_xodr road_object_repeating_count "qcbus.dev:xodr:1.4.0:road.object.repeating.count",
    qcbus_xodr road_ranges_not_reversed "qcbus.dev:xodr:1.1.0:road.ranges_not_reversed",
    qcbus_xodr road_crg_file_named "qcbus.dev:xodr:1.1.0:road.crg.file_named",
    qcbus_xodr road_validity_lanes_exist "qcbus.dev:xodr:1.4.0:road.validity_lanes_exist",
    qcbus_xodr geometry_length_not_negative "qcbus.dev:xodr:1.0.0:geometry.length_not_negative",
    qcbus_xodr lane_section_single_side "qcbus.dev:xodr:1.4.0:lane_section.single_side",
    qcbus_xodr profiles_begin_with_road "qcbus.dev:xodr:1.0.0:profiles.begin_with_road",
    qcbus_xodr records_are_complete "qcbus.dev:xodr:1.0.0:records.are_complete",
    qcbus_xodr header_version_published "qcbus.dev:xodr:1.4.0:header.version_published",
    qcbus_xodr header_geo_reference "qcbus.dev:xodr:1.4.0:header.geo_reference",
    qcbus_xodr header_bounds_contain_roads "qcbus.dev:xodr:1.4.0:header.bounds_contain_roads",
    qcbus_xodr header_offset_plausible "qcbus.dev:xodr:1.4.0:header.offset_plausible",
    qcbus_xodr profile_carla_ids "qcbus.dev:xodr:1.4.0:profile.carla_ids",
    qcbus_xodr profile_carla_supported "qcbus.dev:xodr:1.4.0:profile.carla_supported",
    qcbus_xodr profile_esmini_supported "qcbus.dev:xodr:1.4.0:profile.esmini_supported",
    qcbus_xodr road_linkage_ends_meet "qcbus.dev:xodr:1.4.0:road.linkage.ends_meet",
    qcbus_xodr junctions_elevation_grid_placed "qcbus.dev:xodr:1.4.0:junctions.elevation_grid_placed",
    qcbus_xodr junctions_connecting_lane_linked "qcbus.dev:xodr:1.4.0:junctions.connecting_lane_linked",
    qcbus_xodr junctions_connecting_road_linked "qcbus.dev:xodr:1.4.0:junctions.connecting_road_linked",
    qcbus_xodr junctions_connecting_road_used "qcbus.dev:xodr:1.4.0:junctions.connecting_road_used",
    qcbus_xodr junctions_connection_lane_link_once "qcbus.dev:xodr:1.4.0:junctions.connection.lane_link_once",
    qcbus_xodr junctions_connection_lane_links_agree "qcbus.dev:xodr:1.4.0:junctions.connection.lane_links_agree",
    qcbus_xodr junctions_incoming_lane_used "qcbus.dev:xodr:1.4.0:junctions.incoming_lane_used",
    qcbus_xodr junctions_outgoing_lane_reached "qcbus.dev:xodr:1.4.0:junctions.outgoing_lane_reached",
    qcbus_xodr junctions_incoming_road_linked "qcbus.dev:xodr:1.4.0:junctions.incoming_road_linked",
    qcbus_xodr junctions_priority_acyclic "qcbus.dev:xodr:1.4.0:junctions.priority.acyclic",
    qcbus_xodr road_lane_link_center_lane "qcbus.dev:xodr:1.4.0:road.lane.link.center_lane",
    qcbus_xodr road_lane_link_direction "qcbus.dev:xodr:1.4.0:road.lane.link.direction",
    qcbus_xodr road_lane_link_types "qcbus.dev:xodr:1.4.0:road.lane.link.types",
    qcbus_xodr road_linkage_touching_ends "qcbus.dev:xodr:1.4.0:road.linkage.touching_ends",
    qcbus_xodr road_network_connected "qcbus.dev:xodr:1.4.0:road.network.connected",
    qcbus_xodr road_height_among_others "qcbus.dev:xodr:1.4.0:road.height_among_others",
    qcbus_xodr road_network_drivable "qcbus.dev:xodr:1.4.0:road.network.drivable",
    qcbus_xodr numbers_computable "qcbus.dev:xodr:1.4.0:numbers.computable",
    qcbus_xodr road_geometry_hdg_in_radians "qcbus.dev:xodr:1.4.0:road.geometry.hdg_in_radians",
    qcbus_xodr road_geometry_lanes_no_fold "qcbus.dev:xodr:1.4.0:road.geometry.lanes_no_fold",
    qcbus_xodr road_lane_sizes_plausible "qcbus.dev:xodr:1.4.0:road.lane.sizes_plausible",
    qcbus_xodr road_lane_width_plausible "qcbus.dev:xodr:1.4.0:road.lane.width_plausible",
    qcbus_xodr road_shape_no_step "qcbus.dev:xodr:1.4.0:road.shape.no_step",
    qcbus_xodr road_slope_plausible "qcbus.dev:xodr:1.4.0:road.slope_plausible",
    qcbus_xodr road_speed_plausible "qcbus.dev:xodr:1.4.0:road.speed_plausible",
    qcbus_xodr attributes_are_given "qcbus.dev:xodr:1.0.0:attributes.are_given",
    qcbus_xodr road_object_sizes_plausible "qcbus.dev:xodr:1.1.0:road.object.sizes_plausible",
    qcbus_xodr road_signal_no_self_reference "qcbus.dev:xodr:1.2.0:road.signal.no_self_reference",
    qcbus_xodr words_are_known "qcbus.dev:xodr:1.0.0:words.are_known",
    qcbus_xodr road_lane_offset_plausible "qcbus.dev:xodr:1.4.0:road.lane.offset_plausible",
    qcbus_xodr junctions_elevation_grid_readable "qcbus.dev:xodr:1.8.0:junctions.elevation_grid.readable",
    qcbus_xodr road_object_outline_has_area "qcbus.dev:xodr:1.4.0:road.object.outline_has_area",
    qcbus_xodr road_object_parking_apart "qcbus.dev:xodr:1.4.0:road.object.parking_apart",
    qcbus_xodr road_railroad_tracks_meet "qcbus.dev:xodr:1.4.0:road.railroad.tracks_meet",
    qcbus_xodr road_signal_catalog_entry "qcbus.dev:xodr:1.4.0:road.signal.catalog_entry",
    qcbus_xodr road_signal_light_is_dynamic "qcbus.dev:xodr:1.4.0:road.signal.light_is_dynamic",
    qcbus_xodr xml_no_prefixes "qcbus.dev:xodr:1.0.0:xml.no_prefixes",
};
