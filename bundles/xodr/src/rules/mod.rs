//! The rules, one per file, in the order of the result.
//!
//! A new rule needs one line in each of the two lists below.

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
mod road_object_outline_inner_outline_touches_outer;
mod road_object_outline_not_crossed;
mod road_object_outline_outline_followed_by_corner;
mod road_object_outline_points_inside_box;
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
mod road_signal_controller_dynamic_only;
mod road_signal_controller_in_junction;
mod road_signal_controller_one_per_light;
mod road_signal_controller_valid_for_signals;
mod road_signal_gantry_all_variable_boards_same_gantry;
mod road_signal_gantry_vmsgroup_at_least_one_reference;
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
mod xml_root_tag_is_opendrive;
mod xml_valid_schema;
mod xml_valid_xml_document;
mod xml_version_is_defined;

/// Precondition of rules that only need a readable file; see `after`.
pub(crate) const READABLE: &[&str] = &["check_asam_xodr_xml_root_tag_is_opendrive"];

/// All rules. A rule comes after the rules on which it depends.
pub static RULES: &[&dyn AnyRule] = &[
    &xml_valid_xml_document::RULE,
    &xml_root_tag_is_opendrive::RULE,
    &xml_fileheader_is_present::RULE,
    &xml_version_is_defined::RULE,
    &road_lane_level_true_one_side::RULE,
    &road_lane_access_no_mix_of_deny_or_allow::RULE,
    &road_lane_link_lanes_across_lane_sections::RULE,
    &road_linkage_is_junction_needed::RULE,
    &road_lane_link_zero_width_at_start::RULE,
    &road_lane_link_zero_width_at_end::RULE,
    &road_lane_link_new_lane_appear::RULE,
    &junctions_connection_connect_road_no_incoming_road::RULE,
    &junctions_connection_one_connection_element::RULE,
    &junctions_connection_one_link_to_incoming::RULE,
    &junctions_connection_start_along_linkage::RULE,
    &junctions_connection_end_opposite_linkage::RULE,
    &road_geometry_parampoly3_length_match::RULE,
    &road_lane_border_overlap_with_inner_lanes::RULE,
    &road_geometry_parampoly3_arclength_range::RULE,
    &road_geometry_parampoly3_normalized_range::RULE,
    &road_geometry_contact_point::RULE,
    &road_geometry_elem_asc_order::RULE,
    &road_geometry_parampoly3_valid_parameters::RULE,
    &performance_avoid_redundant_info::RULE,
    &lane_smoothness_contact_point_no_horizontal_gaps::RULE,
    &xml_valid_schema::RULE,
    &header_attributes::RULE,
    &ids_id_unique_in_class::RULE,
    &ids_only_ref_defined_ids::RULE,
    &road_geometry_only_one_refline::RULE,
    &road_geometry_refline_no_gaps::RULE,
    &road_geometry_refline_no_kinks::RULE,
    &road_lane_width_lane_width_validity::RULE,
    &lane_smoothness_profile_no_vertical_gaps::RULE,
    &lane_smoothness_contact_point_no_horizontal_kinks::RULE,
    &lane_smoothness_contact_point_no_vertical_gaps::RULE,
    &lane_smoothness_contact_point_no_vertical_kinks::RULE,
    &junctions_connection_smooth_fit::RULE,
    &junctions_direct_linked_lane_smoothness::RULE,
    &junctions_direct_road_ramp_heading::RULE,
    &junctions_virtual_connecting_roads_start_end::RULE,
    &junctions_virtual_heading_equal_mainroad::RULE,
    &junctions_virtual_linked_lanes_smooth_fit::RULE,
    &road_shape_t_definition_coverage::RULE,
    &road_lane_layer_lane_group_width_temporary::RULE,
    &road_lane_link_temporary_layer_section_link_permanent::RULE,
    &road_lane_link_multiple_connections::RULE,
    &road_lane_link_use_junctions::RULE,
    &road_lane_lane_reverse_left_right::RULE,
    &road_lane_lane_section_drivable::RULE,
    &road_lane_section_lane_long_zero_width::RULE,
    &road_lane_section_lanesec_usage_lane_num::RULE,
    &road_lane_road_mark_only_outer::RULE,
    &road_railroad_rail_lane_width_validity::RULE,
    &road_railroad_rail_refline_centered::RULE,
    &road_corner_local_first_id_zero::RULE,
    &road_corner_local_sequential_id_values::RULE,
    &road_corner_local_mandatory_id_with_markings::RULE,
    &road_corner_road_first_id_zero::RULE,
    &road_corner_road_sequential_id_values::RULE,
    &road_corner_road_mandatory_id_with_markings::RULE,
    &road_corner_road_corner_road_local_exclusivity::RULE,
    &road_object_outline_outline_followed_by_corner::RULE,
    &road_object_outline_exactly_one_outer::RULE,
    &road_object_borders_different_outlineids::RULE,
    &road_object_borders_use_complete_outline_true::RULE,
    &road_object_marking_colour::RULE,
    &road_object_marking_complete_or_partial_on_outline::RULE,
    &road_object_marking_markings_with_outline::RULE,
    &road_object_marking_markings_without_outline::RULE,
    &road_object_marking_no_cornerreference_if_no_outline::RULE,
    &road_object_marking_no_outline_side_attr::RULE,
    &road_object_object_marking_outline_corner_reference_count::RULE,
    &road_object_object_marking_enclosed_outline_marking::RULE,
    &road_object_object_marking_include_points_between_corner_references::RULE,
    &road_object_object_marking_keep_id_ordered::RULE,
    &road_object_circular_vs_angular::RULE,
    &road_object_orientation::RULE,
    &road_object_s_t_coords::RULE,
    &road_object_type_attr::RULE,
    &road_object_bridges_type_definition::RULE,
    &road_object_tunnels_type_definition::RULE,
    &road_object_validty_from_lower_equal_to::RULE,
    &road_object_reference_from_lower_equal_to::RULE,
    &road_object_tunnels_from_lower_equal_to::RULE,
    &road_signal_reference_from_lower_equal_to::RULE,
    &road_object_bridges_from_lower_equal_to::RULE,
    &road_object_validty_check_parent_orientation::RULE,
    &road_signal_validity_right_hand_traffic_lane_ids::RULE,
    &road_signal_validity_left_hand_traffic_lane_ids::RULE,
    &road_signal_reference_right_hand_traffic_lane_ids::RULE,
    &road_signal_reference_left_hand_traffic_lane_ids::RULE,
    &road_object_repeating_attributes_with_outline_skeleton::RULE,
    &road_object_repeating_no_widthstart_end_with_radius::RULE,
    &road_object_repeating_outline_use_cornerlocal::RULE,
    &road_object_repeating_valid_s_length::RULE,
    &road_object_skeleton_polyline_followed_by_vertex::RULE,
    &road_object_skeleton_use_radius_or_width_length::RULE,
    &road_object_skeleton_vertex_local_no_mixing_road_local::RULE,
    &road_object_surface_only_for_angular_boxes::RULE,
    &road_object_surface_only_one_crg_file::RULE,
    &road_object_surface_repeat_discretely_not_continously::RULE,
    &road_crg_attach_vs_friction::RULE,
    &road_crg_friction_no_z_offset_scale::RULE,
    &road_crg_h_offset_only_genuine_global::RULE,
    &road_crg_no_opposite::RULE,
    &road_crg_s_t_offset_no_global::RULE,
    &road_crg_junction::RULE,
    &road_crg_only_on_per_s::RULE,
    &road_railroad_one_rail_per_road::RULE,
    &road_railroad_platforms_min_amount::RULE,
    &road_railroad_platforms_min_segments::RULE,
    &road_railroad_switch_check_switch_conn::RULE,
    &road_railroad_switch_single_switch_no_partner::RULE,
    &road_signal_signal_type::RULE,
    &road_signal_use_country_code::RULE,
    &road_signal_boards_multi_board_have_sub_boards::RULE,
    &road_signal_boards_multi_board_use_correct_type::RULE,
    &road_signal_boards_multi_board_use_dynamic_true::RULE,
    &road_signal_boards_static_boards_no_single_signal::RULE,
    &road_signal_boards_static_board_use_correct_type::RULE,
    &road_signal_controller_valid_for_signals::RULE,
    &road_signal_reference_specify_direction::RULE,
    &road_signal_reference_used_for_signals_only::RULE,
    &road_elevation_elem_asc_order::RULE,
    &road_superelevation_elem_asc_order::RULE,
    &road_type_elem_asc_order::RULE,
    &road_lanes_lane_offset_elem_asc_order::RULE,
    &road_lane_section_elem_asc_order::RULE,
    &road_shape_elem_asc_order::RULE,
    &road_lane_material_elem_asc_order::RULE,
    &road_lane_speed_elem_asc_order::RULE,
    &road_lane_road_mark_elem_asc_order::RULE,
    &road_lane_rule_elem_asc_order::RULE,
    &road_lane_access_elem_asc_order::RULE,
    &road_lane_lane_properties_elem_asc_order::RULE,
    &road_lane_center_lane_no_width::RULE,
    &road_lane_access_center_lane_no_acc_rule::RULE,
    &road_lane_height_center_lane_no_height::RULE,
    &road_lane_material_center_lane_no_material::RULE,
    &road_lane_speed_center_lane_no_spd_lmt::RULE,
    &ids_id_unique_in_lane_section::RULE,
    &road_lane_center_lane_id::RULE,
    &road_lane_lanes_numbered_correctly::RULE,
    &road_lane_lane_listing::RULE,
    &road_lane_lane_order::RULE,
    &road_lane_lane_order_no_gaps::RULE,
    &road_lane_border_exclusive_width_border::RULE,
    &road_lane_border_exclusive_offset_border::RULE,
    &road_lane_center_elem_definition::RULE,
    &road_lane_lane_sect_first::RULE,
    &road_lane_lane_sect_min_amount::RULE,
    &road_lane_s_attr_value::RULE,
    &road_lane_section_valid_length::RULE,
    &road_lane_section_lanesec_length_limit_road::RULE,
    &road_lane_width_width_defined_whole_section::RULE,
    &road_lane_layer_layer_limits::RULE,
    &road_lane_layer_layer_mandatory_permanent::RULE,
    &road_lane_layer_length_only_temporary::RULE,
    &road_lane_layer_lane_phys_attr_temporary::RULE,
    &road_lane_section_new_lanesec_link_temp_to_perm::RULE,
    &road_geometry_refline_exists::RULE,
    &road_geometry_one_geom_elem_per_spec::RULE,
    &road_geometry_s_value_sum::RULE,
    &road_length_sum_geometries::RULE,
    &road_geometry_arc_no_zero_curvature::RULE,
    &road_geometry_spiral_curvature_change::RULE,
    &default_regulations_only_speed_priority::RULE,
    &header_offset_centered_coords::RULE,
    &header_proj_max_one_proj::RULE,
    &road_type_only_alpha_2_country_codes::RULE,
    &road_cross_section_surface_no_shape_superelevation::RULE,
    &road_cross_section_surface_start_end_match_with_refline::RULE,
    &road_cross_section_surface_use_strip::RULE,
    &road_cross_section_surface_use_width::RULE,
    &junctions_type_default_no_linked_road::RULE,
    &junctions_type_direct_no_conn_road::RULE,
    &junctions_boundary_only_for_common_junctions::RULE,
    &junctions_common_direct_junction_attributes::RULE,
    &junctions_common_junctions_no_pred_succ::RULE,
    &junctions_common_virtual_junction_attributes::RULE,
    &junctions_virtual_connections_only_virtual_junctions::RULE,
    &junctions_common_when_to_use::RULE,
    &junctions_crossing_only_one_high_prio::RULE,
    &junctions_crossing_only_road_sections::RULE,
    &junctions_direct_overlap_zone_exclusivity::RULE,
    &junctions_direct_road_connectivity::RULE,
    &junctions_elevation_grid_only_one_elev_grid::RULE,
    &junctions_geometry_only_one_line_element::RULE,
    &junctions_priority_high_and_low_attr::RULE,
    &junctions_virtual_no_controllers::RULE,
    &junctions_virtual_only_one_start_end::RULE,
    &junctions_virtual_main_road_only::RULE,
    &junctions_boundary_segments_for_each_conn_road::RULE,
    &junctions_cross_path_correct_junction_id::RULE,
    &junctions_cross_path_only_connect_correct_type::RULE,
    &road_linkage_junc_link_attribute_usage::RULE,
    &road_linkage_road_link_attribute_usage::RULE,
    &road_linkage_virtjunc_link_attribute_usage::RULE,
    &road_linkage_both_sides_consistency::RULE,
    &road_lane_link_no_link::RULE,
    &road_records_within_extent::RULE,
    &road_object_outline_points_inside_box::RULE,
    &road_object_skeleton_points_inside_box::RULE,
    &road_object_skeleton_points_boundary_inside_box::RULE,
    &road_object_outline_inner_outline_touches_outer::RULE,
    &road_curve_local_continuous_curve_local::RULE,
    &road_curve_local_length_match::RULE,
    &road_curve_local_parampoly3_arclength_range::RULE,
    &road_curve_local_parampoly3_normalized_range::RULE,
    &road_object_surface_avoid_skewed_crg_surfacees::RULE,
    &road_object_surface_crg_hidden_on_object_overlap::RULE,
    &junctions_boundary_segments_close_boundry::RULE,
    &junctions_boundary_segments_counter_clockwise_order::RULE,
    &junctions_boundary_close_gap_with_new_roads::RULE,
    &junctions_geometry_correct_junction_boundry::RULE,
    &junctions_geometry_ref_line_definition::RULE,
    &junctions_elevation_grid_valid_for_entire_boundry::RULE,
    &junctions_direct_split_or_merge::RULE,
    &junctions_cross_path_lane_linkage::RULE,
    &junctions_cross_path_start_end_contained::RULE,
    &junctions_virtual_cross_path_cross_road_check_s_t::RULE,
    &junctions_cross_path_within_junction_area::RULE,
    &junctions_priority_no_signals::RULE,
    &road_signal_gantry_all_variable_boards_same_gantry::RULE,
    &road_signal_gantry_vmsgroup_at_least_one_reference::RULE,
    &road_no_overlap_outside_junction::RULE,
    &junctions_crossing_s_start_end_coverage::RULE,
    &junctions_direct_flat_exits_entries::RULE,
    &junctions_direct_overlap_zone_coverage::RULE,
    &junctions_elevation_grid_entry_exit_smoothness::RULE,
    &junctions_no_overlap::RULE,
    &lane_smoothness_no_vertical_jumps_t::RULE,
    &road_object_surface_no_bounding_box_overlap::RULE,
    &road_object_surface_object_reference_on_overlap::RULE,
    &junctions_connection_required_attributes::RULE,
    &lane_smoothness_profile_no_horizontal_gaps::RULE,
    &road_lane_link_lanes_across_roads::RULE,
    &road_roadside_near_road::RULE,
    &road_roadside_angles_in_radians::RULE,
    &road_roadside_no_twins::RULE,
    &road_roadside_clear_of_lanes::RULE,
    &road_signal_controller_dynamic_only::RULE,
    &road_signal_controller_one_per_light::RULE,
    &road_signal_controller_in_junction::RULE,
    &road_signal_speed_value::RULE,
    &road_object_crosswalk_crosses_lanes::RULE,
    &road_object_positive_size::RULE,
    &road_object_outline_not_crossed::RULE,
    &road_object_repeating_count::RULE,
    &road_ranges_not_reversed::RULE,
    &road_crg_file_named::RULE,
    &road_validity_lanes_exist::RULE,
    &geometry_length_not_negative::RULE,
    &lane_section_single_side::RULE,
    &profiles_begin_with_road::RULE,
    &records_are_complete::RULE,
    &header_version_published::RULE,
    &header_geo_reference::RULE,
    &header_bounds_contain_roads::RULE,
    &header_offset_plausible::RULE,
    &profile_carla_ids::RULE,
    &profile_carla_supported::RULE,
    &profile_esmini_supported::RULE,
    &road_linkage_ends_meet::RULE,
    &junctions_elevation_grid_placed::RULE,
    &junctions_connecting_lane_linked::RULE,
    &junctions_connecting_road_linked::RULE,
    &junctions_connecting_road_used::RULE,
    &junctions_connection_lane_link_once::RULE,
    &junctions_connection_lane_links_agree::RULE,
    &junctions_incoming_lane_used::RULE,
    &junctions_outgoing_lane_reached::RULE,
    &junctions_incoming_road_linked::RULE,
    &junctions_priority_acyclic::RULE,
    &road_lane_link_center_lane::RULE,
    &road_lane_link_direction::RULE,
    &road_lane_link_types::RULE,
    &road_linkage_touching_ends::RULE,
    &road_network_connected::RULE,
    &road_height_among_others::RULE,
    &road_network_drivable::RULE,
    &numbers_computable::RULE,
    &road_geometry_hdg_in_radians::RULE,
    &road_geometry_lanes_no_fold::RULE,
    &road_lane_sizes_plausible::RULE,
    &road_lane_width_plausible::RULE,
    &road_shape_no_step::RULE,
    &road_slope_plausible::RULE,
    &road_speed_plausible::RULE,
    &attributes_are_given::RULE,
    &road_object_sizes_plausible::RULE,
    &road_signal_no_self_reference::RULE,
    &words_are_known::RULE,
    &road_lane_offset_plausible::RULE,
];
