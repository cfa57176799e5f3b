//! The rules, one per file, in the order of the result.
//!
//! A new rule takes one line in each of the two lists below.

use qcbus_sdk::AnyRule;

mod action_add_delete_order;
mod action_controller_override_range;
mod action_custom_command_portable;
mod action_distance_exclusive;
mod action_negative_lane_change;
mod action_relative_speed_continuous;
mod action_speed_not_negative;
mod action_step_dynamics_zero;
mod action_synchronize;
mod action_transition_not_zero;
mod catalogs_duplicate_across_files;
mod catalogs_entry_schema;
mod catalogs_file_valid;
mod catalogs_kind_mismatch;
mod catalogs_location_missing;
mod catalogs_mixed_document;
mod catalogs_path_escape;
mod catalogs_unused_location;
mod catalogs_version_mismatch;
mod data_type_allowed_operators;
mod data_type_condition_delay_not_negative;
mod data_type_distances_are_not_negative;
mod data_type_non_negative_transition_time_in_light_state_action;
mod data_type_time_format;
mod data_type_variable_correctly_typed;
mod data_type_variable_modification_or_comparison_possible;
mod deprecated_element_used;
mod deprecated_old_and_new_together;
mod dialect_ros_substitution;
mod distribution_parameter_known;
mod distribution_range_valid;
mod distribution_scenario_file;
mod distribution_values_at_use;
mod distribution_values_satisfy_constraints;
mod distribution_weights;
mod entities_axle_geometry;
mod entities_bounding_box_positive;
mod entities_dimensions_plausible;
mod entities_none;
mod entities_not_positioned;
mod entities_overlapping_spawn;
mod entities_performance_plausible;
mod entities_selection_members;
mod entities_selection_not_allowed;
mod entities_trailer_reference;
mod entities_unused;
mod environment_friction_zero;
mod environment_ranges;
mod expressions_arguments_of_operators;
mod expressions_before_1_1;
mod expressions_evaluation_of_expressions_possible;
mod expressions_in_string_attribute;
mod expressions_precision_loss;
mod expressions_suspicious_units;
mod expressions_type_casting;
mod expressions_type_of_boolean;
mod expressions_unused_constant;
mod general_animation_constraint_pedestrian;
mod general_file_ending;
mod general_references_to_scenario_object;
mod header_date_plausible;
mod header_license_present;
mod header_metadata_filled;
mod header_unsupported_version;
mod minsubset_additional_axles_not_allowed;
mod minsubset_allowed_conditions;
mod minsubset_allowed_init_actions;
mod minsubset_allowed_position_types;
mod minsubset_allowed_scenario_objects;
mod minsubset_allowed_story_actions;
mod minsubset_allowed_vehicle_attributes;
mod minsubset_allowed_vehicle_elements;
mod minsubset_allowed_vehicle_performance_attributes;
mod minsubset_catalog_references_not_allowed;
mod minsubset_entity_selection_not_allowed;
mod minsubset_follow_trajectory_action_constraints;
mod minsubset_max_one_action_per_act;
mod minsubset_maximum_execution_count_is_one;
mod minsubset_monitors_not_allowed;
mod minsubset_not_more_than_one_story_allowed;
mod minsubset_object_controller_not_allowed;
mod minsubset_parameters_not_allowed;
mod minsubset_stop_triggers_not_allowed_except_in_storyboard;
mod minsubset_variables_not_allowed;
mod minsubset_vehicle_must_contain_front_axle;
mod modular_not_plain_scenario;
mod monitors_no_change;
mod monitors_reference;
mod monitors_unused;
mod naming_duplicate_property;
mod naming_empty_name;
mod naming_entity_selection_clash;
mod naming_no_double_colon_prefix_in_names;
mod naming_non_ascii_or_control;
mod naming_parameter_declaration_name_prefix_reserved;
mod naming_parameter_declaration_parameter_name;
mod naming_unique_element_names_on_same_level;
mod number_finite;
mod parameters_assignment_duplicate;
mod parameters_assignment_type;
mod parameters_assignment_unknown;
mod parameters_condition_constant;
mod parameters_condition_reference;
mod parameters_constraint_contradiction;
mod parameters_constraint_satisfied;
mod parameters_constraint_type;
mod parameters_enum_after_resolution;
mod parameters_forward_or_cyclic;
mod parameters_parameter_declaration_parameter_scope;
mod parameters_parameter_declaration_parameter_type_inference;
mod parameters_partial_substitution;
mod parameters_shadowing;
mod parameters_type_literal_version;
mod parameters_unused;
mod parameters_valid_parameter_declaration_in_catalogs;
mod position_finite;
mod position_geo_range;
mod position_orientation_range;
mod position_relative_lane_exclusive;
mod position_route_reference;
mod positioning_geodetic_datum_defined;
mod positioning_road_lane_offset_in_bounds;
mod positive_duration_in_phase;
mod profile_carla_supported;
mod profile_esmini_supported;
mod range_actions;
mod range_appearance;
mod range_conditions;
mod range_entities;
mod range_positions;
mod range_traffic;
mod range_trajectories;
mod reference_control_catalog_reference_resolvability;
mod reference_control_catalogs_referenced_by_directory;
mod reference_control_resolvable_entity_references;
mod reference_control_resolvable_signal_id_in_traffic_signal_state_action;
mod reference_control_resolvable_storyboard_element_reference;
mod reference_control_resolvable_traffic_signal_controller_by_traffic_signal_controller_ref;
mod reference_control_resolvable_variable_reference;
mod reference_control_road_lane_exists;
mod reference_control_road_network_availability;
mod reference_control_road_network_reference;
mod reference_control_traffic_signal_controller_action_references;
mod reference_control_traffic_signal_controller_condition_references;
mod reference_control_traffic_signal_controller_references;
mod reference_control_traffic_signal_state_references;
mod reference_control_unique_element_names_on_same_level;
mod reference_control_uniquely_resolvable_entity_references;
mod reference_control_valid_actor_reference_in_private_actions;
mod references_init_order;
mod references_self_reference;
mod references_traffic_name;
mod road_lane_id_zero;
mod road_lane_type_drivable;
mod road_signal_condition;
mod road_world_position_on_road;
mod road_xodr_parses;
mod route_connected;
mod route_duplicate_waypoints;
mod route_min_waypoints;
mod routing_ambiguous_route_waypoints;
mod routing_cardinality_of_control_points_in_nurbs;
mod routing_offset_should_be_less_than_trajectory_length;
mod routing_route_waypoints_locations;
mod routing_trajectory_timing_exists_if_requested;
mod scenario_logic_controller_activation;
mod scenario_logic_invalid_elements_if_no_road_network;
mod scenario_logic_targetspeed_maxspeed_general;
mod scenario_logic_targetspeed_maxspeed_speedprofileaction;
mod schema_cardinality;
mod schema_choice_single_alternative;
mod signal_condition_never;
mod signal_delay_without_reference;
mod signal_phase_duplicate;
mod signal_reference_cycle;
mod signal_state_unknown;
mod signal_zero_cycle;
mod storyboard_act_never_starts;
mod storyboard_action_conflict;
mod storyboard_empty;
mod storyboard_ends_at_once;
mod storyboard_event_never_starts;
mod storyboard_init_private_unknown;
mod storyboard_maximum_execution_count;
mod storyboard_priority_conflict;
mod storyboard_private_action_global_actor;
mod storyboard_reference_to_self_or_parent_end;
mod storyboard_select_triggering_entities;
mod storyboard_stop_trigger;
mod storyboard_unreachable_by_reference;
mod trajectory_clothoid_time_order;
mod trajectory_duplicate_vertices;
mod trajectory_knots_non_decreasing;
mod trajectory_speed_plausible;
mod trajectory_times_increasing;
mod trajectory_timing_scale;
mod trigger_contradiction;
mod trigger_edge_on_state;
mod trigger_float_equal;
mod trigger_never_true;
mod trigger_simulation_time_equal;
mod trigger_time_unordered;
mod trigger_traveled_distance_stopped;
mod variables_dollar_reference;
mod variables_name_syntax;
mod variables_never_written_condition;
mod variables_unused;
mod xml_fileheader_is_present;
mod xml_root_tag_is_openscenario;
mod xml_valid_schema;
mod xml_valid_xml_document;
mod xml_version_is_defined;

/// Precondition of rules that only need a readable file: see `after`.
pub(crate) const READABLE: &[&str] = &["check_asam_xosc_xml_root_tag_is_openscenario"];

/// All rules. A rule that depends on another comes after it.
pub static RULES: &[&dyn AnyRule] = &[
    &xml_valid_xml_document::RULE,
    &xml_root_tag_is_openscenario::RULE,
    &xml_fileheader_is_present::RULE,
    &xml_version_is_defined::RULE,
    &xml_valid_schema::RULE,
    &reference_control_unique_element_names_on_same_level::RULE,
    &naming_unique_element_names_on_same_level::RULE,
    &reference_control_resolvable_entity_references::RULE,
    &parameters_parameter_declaration_parameter_scope::RULE,
    &data_type_allowed_operators::RULE,
    &expressions_before_1_1::RULE,
    &expressions_arguments_of_operators::RULE,
    &expressions_type_of_boolean::RULE,
    &expressions_type_casting::RULE,
    &expressions_evaluation_of_expressions_possible::RULE,
    &expressions_in_string_attribute::RULE,
    &expressions_precision_loss::RULE,
    &expressions_suspicious_units::RULE,
    &expressions_unused_constant::RULE,
    &naming_parameter_declaration_parameter_name::RULE,
    &naming_parameter_declaration_name_prefix_reserved::RULE,
    &parameters_valid_parameter_declaration_in_catalogs::RULE,
    &parameters_parameter_declaration_parameter_type_inference::RULE,
    &parameters_forward_or_cyclic::RULE,
    &parameters_enum_after_resolution::RULE,
    &parameters_condition_reference::RULE,
    &parameters_constraint_type::RULE,
    &parameters_constraint_contradiction::RULE,
    &parameters_constraint_satisfied::RULE,
    &parameters_partial_substitution::RULE,
    &dialect_ros_substitution::RULE,
    &parameters_type_literal_version::RULE,
    &parameters_shadowing::RULE,
    &parameters_unused::RULE,
    &parameters_condition_constant::RULE,
    &reference_control_resolvable_variable_reference::RULE,
    &data_type_variable_correctly_typed::RULE,
    &data_type_variable_modification_or_comparison_possible::RULE,
    &variables_dollar_reference::RULE,
    &variables_name_syntax::RULE,
    &variables_unused::RULE,
    &variables_never_written_condition::RULE,
    &monitors_reference::RULE,
    &monitors_unused::RULE,
    &monitors_no_change::RULE,
    &data_type_time_format::RULE,
    &data_type_condition_delay_not_negative::RULE,
    &data_type_distances_are_not_negative::RULE,
    &positive_duration_in_phase::RULE,
    &data_type_non_negative_transition_time_in_light_state_action::RULE,
    &storyboard_maximum_execution_count::RULE,
    &action_controller_override_range::RULE,
    &environment_ranges::RULE,
    &position_geo_range::RULE,
    &trajectory_timing_scale::RULE,
    &range_actions::RULE,
    &range_appearance::RULE,
    &range_conditions::RULE,
    &range_entities::RULE,
    &range_positions::RULE,
    &range_traffic::RULE,
    &range_trajectories::RULE,
    &general_file_ending::RULE,
    &header_unsupported_version::RULE,
    &header_metadata_filled::RULE,
    &header_date_plausible::RULE,
    &header_license_present::RULE,
    &modular_not_plain_scenario::RULE,
    &environment_friction_zero::RULE,
    &deprecated_old_and_new_together::RULE,
    &deprecated_element_used::RULE,
    &minsubset_additional_axles_not_allowed::RULE,
    &minsubset_allowed_conditions::RULE,
    &minsubset_allowed_init_actions::RULE,
    &minsubset_allowed_position_types::RULE,
    &minsubset_allowed_scenario_objects::RULE,
    &minsubset_allowed_story_actions::RULE,
    &minsubset_allowed_vehicle_attributes::RULE,
    &minsubset_allowed_vehicle_elements::RULE,
    &minsubset_allowed_vehicle_performance_attributes::RULE,
    &minsubset_catalog_references_not_allowed::RULE,
    &minsubset_entity_selection_not_allowed::RULE,
    &minsubset_follow_trajectory_action_constraints::RULE,
    &minsubset_max_one_action_per_act::RULE,
    &minsubset_maximum_execution_count_is_one::RULE,
    &minsubset_monitors_not_allowed::RULE,
    &minsubset_not_more_than_one_story_allowed::RULE,
    &minsubset_object_controller_not_allowed::RULE,
    &minsubset_parameters_not_allowed::RULE,
    &minsubset_stop_triggers_not_allowed_except_in_storyboard::RULE,
    &minsubset_variables_not_allowed::RULE,
    &minsubset_vehicle_must_contain_front_axle::RULE,
    &profile_carla_supported::RULE,
    &profile_esmini_supported::RULE,
    &reference_control_valid_actor_reference_in_private_actions::RULE,
    &reference_control_resolvable_storyboard_element_reference::RULE,
    &storyboard_stop_trigger::RULE,
    &storyboard_ends_at_once::RULE,
    &storyboard_act_never_starts::RULE,
    &storyboard_event_never_starts::RULE,
    &storyboard_empty::RULE,
    &storyboard_unreachable_by_reference::RULE,
    &storyboard_reference_to_self_or_parent_end::RULE,
    &storyboard_select_triggering_entities::RULE,
    &storyboard_priority_conflict::RULE,
    &storyboard_action_conflict::RULE,
    &storyboard_private_action_global_actor::RULE,
    &storyboard_init_private_unknown::RULE,
    &general_animation_constraint_pedestrian::RULE,
    &scenario_logic_targetspeed_maxspeed_general::RULE,
    &scenario_logic_targetspeed_maxspeed_speedprofileaction::RULE,
    &action_distance_exclusive::RULE,
    &action_relative_speed_continuous::RULE,
    &action_step_dynamics_zero::RULE,
    &action_transition_not_zero::RULE,
    &action_synchronize::RULE,
    &action_add_delete_order::RULE,
    &action_speed_not_negative::RULE,
    &action_negative_lane_change::RULE,
    &action_custom_command_portable::RULE,
    &trigger_contradiction::RULE,
    &trigger_never_true::RULE,
    &trigger_time_unordered::RULE,
    &trigger_simulation_time_equal::RULE,
    &trigger_float_equal::RULE,
    &trigger_edge_on_state::RULE,
    &trigger_traveled_distance_stopped::RULE,
    &schema_choice_single_alternative::RULE,
    &schema_cardinality::RULE,
    &reference_control_uniquely_resolvable_entity_references::RULE,
    &reference_control_catalog_reference_resolvability::RULE,
    &reference_control_catalogs_referenced_by_directory::RULE,
    &parameters_assignment_unknown::RULE,
    &parameters_assignment_type::RULE,
    &parameters_assignment_duplicate::RULE,
    &catalogs_location_missing::RULE,
    &catalogs_kind_mismatch::RULE,
    &catalogs_entry_schema::RULE,
    &catalogs_file_valid::RULE,
    &catalogs_duplicate_across_files::RULE,
    &catalogs_mixed_document::RULE,
    &catalogs_unused_location::RULE,
    &catalogs_version_mismatch::RULE,
    &catalogs_path_escape::RULE,
    &naming_no_double_colon_prefix_in_names::RULE,
    &naming_empty_name::RULE,
    &naming_entity_selection_clash::RULE,
    &naming_duplicate_property::RULE,
    &naming_non_ascii_or_control::RULE,
    &distribution_scenario_file::RULE,
    &distribution_parameter_known::RULE,
    &distribution_range_valid::RULE,
    &distribution_values_at_use::RULE,
    &distribution_weights::RULE,
    &distribution_values_satisfy_constraints::RULE,
    &entities_none::RULE,
    &entities_not_positioned::RULE,
    &entities_unused::RULE,
    &entities_selection_members::RULE,
    &entities_selection_not_allowed::RULE,
    &entities_bounding_box_positive::RULE,
    &entities_axle_geometry::RULE,
    &entities_performance_plausible::RULE,
    &entities_dimensions_plausible::RULE,
    &entities_trailer_reference::RULE,
    &entities_overlapping_spawn::RULE,
    &general_references_to_scenario_object::RULE,
    &references_self_reference::RULE,
    &references_traffic_name::RULE,
    &references_init_order::RULE,
    &scenario_logic_controller_activation::RULE,
    &reference_control_road_network_reference::RULE,
    &reference_control_road_network_availability::RULE,
    &scenario_logic_invalid_elements_if_no_road_network::RULE,
    &road_xodr_parses::RULE,
    &reference_control_resolvable_signal_id_in_traffic_signal_state_action::RULE,
    &reference_control_traffic_signal_state_references::RULE,
    &road_signal_condition::RULE,
    &reference_control_resolvable_traffic_signal_controller_by_traffic_signal_controller_ref::RULE,
    &reference_control_traffic_signal_controller_references::RULE,
    &reference_control_traffic_signal_controller_action_references::RULE,
    &reference_control_traffic_signal_controller_condition_references::RULE,
    &signal_delay_without_reference::RULE,
    &signal_phase_duplicate::RULE,
    &signal_reference_cycle::RULE,
    &signal_zero_cycle::RULE,
    &signal_state_unknown::RULE,
    &signal_condition_never::RULE,
    &reference_control_road_lane_exists::RULE,
    &positioning_road_lane_offset_in_bounds::RULE,
    &positioning_geodetic_datum_defined::RULE,
    &road_lane_type_drivable::RULE,
    &road_lane_id_zero::RULE,
    &road_world_position_on_road::RULE,
    &position_orientation_range::RULE,
    &position_finite::RULE,
    &number_finite::RULE,
    &position_relative_lane_exclusive::RULE,
    &position_route_reference::RULE,
    &routing_route_waypoints_locations::RULE,
    &routing_ambiguous_route_waypoints::RULE,
    &route_connected::RULE,
    &route_min_waypoints::RULE,
    &route_duplicate_waypoints::RULE,
    &routing_trajectory_timing_exists_if_requested::RULE,
    &routing_cardinality_of_control_points_in_nurbs::RULE,
    &routing_offset_should_be_less_than_trajectory_length::RULE,
    &trajectory_times_increasing::RULE,
    &trajectory_duplicate_vertices::RULE,
    &trajectory_speed_plausible::RULE,
    &trajectory_clothoid_time_order::RULE,
    &trajectory_knots_non_decreasing::RULE,
];
