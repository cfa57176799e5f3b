//! The rules, one per file, in the order of the result.
//!
//! A new rule needs one line in each of the two lists below. A line of the second list has the prefix of
//! the id, the name and the UID; see [`qcbus_sdk::rules!`].

use qcbus_sdk::AnyRule;

mod action_add_delete_order;
mod action_controller_override_range;
mod action_custom_command_portable;
mod action_distance_exclusive;
mod action_limit_zero;
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
mod distribution_range_reached;
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
mod entities_used_after_deletion;
mod environment_dry_precipitation;
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
mod parameters_integer_id;
mod parameters_parameter_declaration_parameter_scope;
mod parameters_parameter_declaration_parameter_type_inference;
mod parameters_partial_substitution;
mod parameters_set_at_run_time;
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
mod references_init_speed_order;
mod references_self_reference;
mod references_traffic_name;
mod road_ends_before_run;
mod road_lane_change_possible;
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
mod storyboard_event_always_skipped;
mod storyboard_event_never_starts;
mod storyboard_init_conflict;
mod storyboard_init_private_unknown;
mod storyboard_maximum_execution_count;
mod storyboard_priority_conflict;
mod storyboard_private_action_global_actor;
mod storyboard_reference_to_self_or_parent_end;
mod storyboard_run_never_ends;
mod storyboard_select_triggering_entities;
mod storyboard_starts_at_the_end;
mod storyboard_stop_trigger;
mod storyboard_unreachable_by_reference;
mod trajectory_clothoid_time_order;
mod trajectory_duplicate_vertices;
mod trajectory_knots_non_decreasing;
mod trajectory_speed_plausible;
mod trajectory_times_ignored;
mod trajectory_times_increasing;
mod trajectory_times_past;
mod trajectory_timing_scale;
mod trigger_conditions_apart;
mod trigger_contradiction;
mod trigger_edge_on_state;
mod trigger_edge_over;
mod trigger_float_equal;
mod trigger_never_true;
mod trigger_simulation_time_equal;
mod trigger_state_never_comes;
mod trigger_time_unordered;
mod trigger_traveled_distance_stopped;
mod variables_dollar_reference;
mod variables_name_syntax;
mod variables_never_written_condition;
mod variables_unused;
mod xml_fileheader_is_present;
mod xml_no_namespace;
mod xml_root_tag_is_openscenario;
mod xml_valid_schema;
mod xml_valid_xml_document;
mod xml_version_is_defined;

/// Precondition of rules that only need a readable file, for `..Rule::after(READABLE)`.
pub(crate) const READABLE: &[&str] = &["check_asam_xosc_xml_root_tag_is_openscenario"];

/// All rules. A rule that depends on another comes after it.
pub static RULES: &[&dyn AnyRule] = qcbus_sdk::rules! {
    asam_xosc xml_valid_xml_document "asam.net:xosc:1.0.0:xml.valid_xml_document",
    asam_xosc xml_root_tag_is_openscenario "asam.net:xosc:1.0.0:xml.root_tag_is_openscenario",
    asam_xosc xml_fileheader_is_present "asam.net:xosc:1.0.0:xml.fileheader_is_present",
    asam_xosc xml_version_is_defined "asam.net:xosc:1.0.0:xml.version_is_defined",
    asam_xosc xml_valid_schema,
    asam_xosc reference_control_unique_element_names_on_same_level,
    asam_xosc naming_unique_element_names_on_same_level,
    asam_xosc reference_control_resolvable_entity_references "asam.net:xosc:1.2.0:reference_control.resolvable_entity_references",
    asam_xosc parameters_parameter_declaration_parameter_scope "asam.net:xosc:1.1.0:parameters.parameter_declaration_parameter_scope",
    asam_xosc data_type_allowed_operators,
    qcbus_xosc expressions_before_1_1 "qcbus.dev:xosc:1.0.0:expressions.before_1_1",
    asam_xosc expressions_arguments_of_operators "asam.net:xosc:1.1.0:expressions.arguments_of_operators",
    asam_xosc expressions_type_of_boolean "asam.net:xosc:1.1.0:expressions.type_of_boolean",
    asam_xosc expressions_type_casting "asam.net:xosc:1.1.0:expressions.type_casting",
    asam_xosc expressions_evaluation_of_expressions_possible "asam.net:xosc:1.1.0:expressions.evaluation_of_expressions_possible",
    qcbus_xosc expressions_in_string_attribute "qcbus.dev:xosc:1.0.0:expressions.in_string_attribute",
    qcbus_xosc expressions_precision_loss "qcbus.dev:xosc:1.0.0:expressions.precision_loss",
    qcbus_xosc expressions_suspicious_units "qcbus.dev:xosc:1.0.0:expressions.suspicious_units",
    qcbus_xosc expressions_unused_constant "qcbus.dev:xosc:1.0.0:expressions.unused_constant",
    asam_xosc naming_parameter_declaration_parameter_name "asam.net:xosc:1.1.0:naming.parameter_declaration_parameter_name",
    asam_xosc naming_parameter_declaration_name_prefix_reserved "asam.net:xosc:1.0.0:naming.parameter_declaration_name_prefix_reserved",
    asam_xosc parameters_valid_parameter_declaration_in_catalogs "asam.net:xosc:1.2.0:parameters.valid_parameter_declaration_in_catalogs",
    asam_xosc parameters_parameter_declaration_parameter_type_inference "asam.net:xosc:1.0.0:parameters.parameter_declaration_parameter_type_inference",
    qcbus_xosc parameters_forward_or_cyclic "qcbus.dev:xosc:1.0.0:parameters.forward_or_cyclic",
    qcbus_xosc parameters_enum_after_resolution "qcbus.dev:xosc:1.0.0:parameters.enum_after_resolution",
    qcbus_xosc parameters_condition_reference "qcbus.dev:xosc:1.0.0:parameters.condition_reference",
    qcbus_xosc parameters_constraint_type "qcbus.dev:xosc:1.0.0:parameters.constraint_type",
    qcbus_xosc parameters_constraint_contradiction "qcbus.dev:xosc:1.0.0:parameters.constraint_contradiction",
    qcbus_xosc parameters_constraint_satisfied "qcbus.dev:xosc:1.0.0:parameters.constraint_satisfied",
    qcbus_xosc parameters_partial_substitution "qcbus.dev:xosc:1.0.0:parameters.partial_substitution",
    qcbus_xosc dialect_ros_substitution "qcbus.dev:xosc:1.0.0:dialect.ros_substitution",
    qcbus_xosc parameters_type_literal_version "qcbus.dev:xosc:1.0.0:parameters.type_literal_version",
    qcbus_xosc parameters_shadowing "qcbus.dev:xosc:1.0.0:parameters.shadowing",
    qcbus_xosc xml_no_namespace "qcbus.dev:xosc:1.0.0:xml.no_namespace",
    qcbus_xosc parameters_integer_id "qcbus.dev:xosc:1.0.0:parameters.integer_id",
    qcbus_xosc parameters_set_at_run_time "qcbus.dev:xosc:1.0.0:parameters.set_at_run_time",
    qcbus_xosc parameters_unused "qcbus.dev:xosc:1.0.0:parameters.unused",
    qcbus_xosc parameters_condition_constant "qcbus.dev:xosc:1.0.0:parameters.condition_constant",
    asam_xosc reference_control_resolvable_variable_reference "asam.net:xosc:1.2.0:reference_control.resolvable_variable_reference",
    asam_xosc data_type_variable_correctly_typed "asam.net:xosc:1.2.0:data_type.variable_correctly_typed",
    asam_xosc data_type_variable_modification_or_comparison_possible "asam.net:xosc:1.2.0:data_type.variable_modification_or_comparison_possible",
    qcbus_xosc variables_dollar_reference "qcbus.dev:xosc:1.0.0:variables.dollar_reference",
    qcbus_xosc variables_name_syntax "qcbus.dev:xosc:1.0.0:variables.name_syntax",
    qcbus_xosc variables_unused "qcbus.dev:xosc:1.0.0:variables.unused",
    qcbus_xosc variables_never_written_condition "qcbus.dev:xosc:1.0.0:variables.never_written_condition",
    qcbus_xosc monitors_reference "qcbus.dev:xosc:1.0.0:monitors.reference",
    qcbus_xosc monitors_unused "qcbus.dev:xosc:1.0.0:monitors.unused",
    qcbus_xosc monitors_no_change "qcbus.dev:xosc:1.0.0:monitors.no_change",
    asam_xosc data_type_time_format "asam.net:xosc:1.0.0:data_type.time_format",
    asam_xosc data_type_condition_delay_not_negative,
    asam_xosc data_type_distances_are_not_negative,
    asam_xosc positive_duration_in_phase,
    asam_xosc data_type_non_negative_transition_time_in_light_state_action,
    qcbus_xosc storyboard_maximum_execution_count,
    qcbus_xosc action_controller_override_range,
    qcbus_xosc environment_ranges,
    qcbus_xosc position_geo_range,
    qcbus_xosc trajectory_timing_scale,
    qcbus_xosc range_actions,
    qcbus_xosc range_appearance,
    qcbus_xosc range_conditions,
    qcbus_xosc range_entities,
    qcbus_xosc range_positions,
    qcbus_xosc range_traffic,
    qcbus_xosc range_trajectories,
    asam_xosc general_file_ending "asam.net:xosc:1.0.0:general.file_ending",
    qcbus_xosc header_unsupported_version "qcbus.dev:xosc:1.0.0:header.unsupported_version",
    qcbus_xosc header_metadata_filled "qcbus.dev:xosc:1.0.0:header.metadata_filled",
    qcbus_xosc header_date_plausible "qcbus.dev:xosc:1.0.0:header.date_plausible",
    qcbus_xosc header_license_present "qcbus.dev:xosc:1.0.0:header.license_present",
    qcbus_xosc modular_not_plain_scenario "qcbus.dev:xosc:1.0.0:modular.not_plain_scenario",
    qcbus_xosc environment_friction_zero "qcbus.dev:xosc:1.0.0:environment.friction_zero",
    qcbus_xosc environment_dry_precipitation "qcbus.dev:xosc:1.0.0:environment.dry_precipitation",
    qcbus_xosc deprecated_old_and_new_together "qcbus.dev:xosc:1.0.0:deprecated.old_and_new_together",
    qcbus_xosc deprecated_element_used "qcbus.dev:xosc:1.0.0:deprecated.element_used",
    asam_xosc minsubset_additional_axles_not_allowed "asam.net:xosc:1.3.0:minsubset.additional_axles_not_allowed",
    asam_xosc minsubset_allowed_conditions "asam.net:xosc:1.3.0:minsubset.allowed_conditions",
    asam_xosc minsubset_allowed_init_actions "asam.net:xosc:1.3.0:minsubset.allowed_init_actions",
    asam_xosc minsubset_allowed_position_types "asam.net:xosc:1.3.0:minsubset.allowed_position_types",
    asam_xosc minsubset_allowed_scenario_objects "asam.net:xosc:1.3.0:minsubset.allowed_scenario_objects",
    asam_xosc minsubset_allowed_story_actions "asam.net:xosc:1.3.0:minsubset.allowed_story_actions",
    asam_xosc minsubset_allowed_vehicle_attributes "asam.net:xosc:1.3.0:minsubset.allowed_vehicle_attributes",
    asam_xosc minsubset_allowed_vehicle_elements "asam.net:xosc:1.3.0:minsubset.allowed_vehicle_elements",
    asam_xosc minsubset_allowed_vehicle_performance_attributes "asam.net:xosc:1.3.0:minsubset.allowed_vehicle_performance_attributes",
    asam_xosc minsubset_catalog_references_not_allowed "asam.net:xosc:1.3.0:minsubset.catalog_references_not_allowed",
    asam_xosc minsubset_entity_selection_not_allowed "asam.net:xosc:1.3.0:minsubset.entity_selection_not_allowed",
    asam_xosc minsubset_follow_trajectory_action_constraints "asam.net:xosc:1.3.0:minsubset.follow_trajectory_action_constraints",
    asam_xosc minsubset_max_one_action_per_act "asam.net:xosc:1.3.0:minsubset.max_one_action_per_act",
    asam_xosc minsubset_maximum_execution_count_is_one "asam.net:xosc:1.3.0:minsubset.maximum_execution_count_is_one",
    asam_xosc minsubset_monitors_not_allowed "asam.net:xosc:1.3.0:minsubset.monitors_not_allowed",
    asam_xosc minsubset_not_more_than_one_story_allowed "asam.net:xosc:1.3.0:minsubset.not_more_than_one_story_allowed",
    asam_xosc minsubset_object_controller_not_allowed "asam.net:xosc:1.3.0:minsubset.object_controller_not_allowed",
    asam_xosc minsubset_parameters_not_allowed "asam.net:xosc:1.3.0:minsubset.parameters_not_allowed",
    asam_xosc minsubset_stop_triggers_not_allowed_except_in_storyboard "asam.net:xosc:1.3.0:minsubset.stop_triggers_not_allowed_except_in_storyboard",
    asam_xosc minsubset_variables_not_allowed "asam.net:xosc:1.3.0:minsubset.variables_not_allowed",
    asam_xosc minsubset_vehicle_must_contain_front_axle "asam.net:xosc:1.3.0:minsubset.vehicle_must_contain_front_axle",
    qcbus_xosc profile_carla_supported "qcbus.dev:xosc:1.0.0:profile.carla_supported",
    qcbus_xosc profile_esmini_supported "qcbus.dev:xosc:1.0.0:profile.esmini_supported",
    asam_xosc reference_control_valid_actor_reference_in_private_actions "asam.net:xosc:1.2.0:reference_control.valid_actor_reference_in_private_actions",
    asam_xosc reference_control_resolvable_storyboard_element_reference,
    qcbus_xosc storyboard_stop_trigger "qcbus.dev:xosc:1.0.0:storyboard.stop_trigger",
    qcbus_xosc storyboard_ends_at_once "qcbus.dev:xosc:1.0.0:storyboard.ends_at_once",
    qcbus_xosc storyboard_act_never_starts "qcbus.dev:xosc:1.0.0:storyboard.act_never_starts",
    qcbus_xosc storyboard_event_never_starts "qcbus.dev:xosc:1.0.0:storyboard.event_never_starts",
    qcbus_xosc storyboard_empty "qcbus.dev:xosc:1.0.0:storyboard.empty",
    qcbus_xosc storyboard_unreachable_by_reference "qcbus.dev:xosc:1.0.0:storyboard.unreachable_by_reference",
    qcbus_xosc storyboard_reference_to_self_or_parent_end "qcbus.dev:xosc:1.0.0:storyboard.reference_to_self_or_parent_end",
    qcbus_xosc storyboard_select_triggering_entities "qcbus.dev:xosc:1.0.0:storyboard.select_triggering_entities",
    qcbus_xosc storyboard_priority_conflict "qcbus.dev:xosc:1.0.0:storyboard.priority_conflict",
    qcbus_xosc storyboard_action_conflict "qcbus.dev:xosc:1.0.0:storyboard.action_conflict",
    qcbus_xosc storyboard_init_conflict "qcbus.dev:xosc:1.0.0:storyboard.init_conflict",
    qcbus_xosc storyboard_starts_at_the_end "qcbus.dev:xosc:1.0.0:storyboard.starts_at_the_end",
    qcbus_xosc storyboard_private_action_global_actor "qcbus.dev:xosc:1.0.0:storyboard.private_action_global_actor",
    qcbus_xosc storyboard_init_private_unknown "qcbus.dev:xosc:1.0.0:storyboard.init_private_unknown",
    asam_xosc general_animation_constraint_pedestrian "asam.net:xosc:1.2.0:general.animation_constraint_pedestrian",
    asam_xosc scenario_logic_targetspeed_maxspeed_general "asam.net:xosc:1.2.0:scenario_logic.targetspeed_maxspeed_general",
    asam_xosc scenario_logic_targetspeed_maxspeed_speedprofileaction "asam.net:xosc:1.2.0:scenario_logic.targetspeed_maxspeed_speedprofileaction",
    qcbus_xosc action_distance_exclusive "qcbus.dev:xosc:1.0.0:action.distance_exclusive",
    qcbus_xosc action_relative_speed_continuous "qcbus.dev:xosc:1.0.0:action.relative_speed_continuous",
    qcbus_xosc action_step_dynamics_zero "qcbus.dev:xosc:1.0.0:action.step_dynamics_zero",
    qcbus_xosc action_transition_not_zero "qcbus.dev:xosc:1.0.0:action.transition_not_zero",
    qcbus_xosc action_limit_zero "qcbus.dev:xosc:1.0.0:action.limit_zero",
    qcbus_xosc action_synchronize "qcbus.dev:xosc:1.0.0:action.synchronize",
    qcbus_xosc action_add_delete_order "qcbus.dev:xosc:1.0.0:action.add_delete_order",
    qcbus_xosc action_speed_not_negative "qcbus.dev:xosc:1.0.0:action.speed_not_negative",
    qcbus_xosc action_negative_lane_change "qcbus.dev:xosc:1.0.0:action.negative_lane_change",
    qcbus_xosc action_custom_command_portable "qcbus.dev:xosc:1.0.0:action.custom_command_portable",
    qcbus_xosc trigger_contradiction "qcbus.dev:xosc:1.0.0:trigger.contradiction",
    qcbus_xosc trigger_never_true "qcbus.dev:xosc:1.0.0:trigger.never_true",
    qcbus_xosc trigger_time_unordered "qcbus.dev:xosc:1.0.0:trigger.time_unordered",
    qcbus_xosc trigger_simulation_time_equal "qcbus.dev:xosc:1.0.0:trigger.simulation_time_equal",
    qcbus_xosc trigger_float_equal "qcbus.dev:xosc:1.0.0:trigger.float_equal",
    qcbus_xosc trigger_edge_on_state "qcbus.dev:xosc:1.0.0:trigger.edge_on_state",
    qcbus_xosc trigger_traveled_distance_stopped "qcbus.dev:xosc:1.0.0:trigger.traveled_distance_stopped",
    qcbus_xosc schema_choice_single_alternative "qcbus.dev:xosc:1.0.0:schema.choice_single_alternative",
    qcbus_xosc schema_cardinality "qcbus.dev:xosc:1.0.0:schema.cardinality",
    asam_xosc reference_control_uniquely_resolvable_entity_references "asam.net:xosc:1.2.0:reference_control.uniquely_resolvable_entity_references",
    asam_xosc reference_control_catalog_reference_resolvability "asam.net:xosc:1.0.0:reference_control.catalog_reference_resolvability",
    asam_xosc reference_control_catalogs_referenced_by_directory "asam.net:xosc:1.0.0:reference_control.catalogs_referenced_by_directory",
    qcbus_xosc parameters_assignment_unknown "qcbus.dev:xosc:1.0.0:parameters.assignment_unknown",
    qcbus_xosc parameters_assignment_type "qcbus.dev:xosc:1.0.0:parameters.assignment_type",
    qcbus_xosc parameters_assignment_duplicate "qcbus.dev:xosc:1.0.0:parameters.assignment_duplicate",
    qcbus_xosc catalogs_location_missing "qcbus.dev:xosc:1.0.0:catalogs.location_missing",
    qcbus_xosc catalogs_kind_mismatch "qcbus.dev:xosc:1.0.0:catalogs.kind_mismatch",
    qcbus_xosc catalogs_entry_schema "qcbus.dev:xosc:1.0.0:catalogs.entry_schema",
    qcbus_xosc catalogs_file_valid "qcbus.dev:xosc:1.0.0:catalogs.file_valid",
    qcbus_xosc catalogs_duplicate_across_files "qcbus.dev:xosc:1.0.0:catalogs.duplicate_across_files",
    qcbus_xosc catalogs_mixed_document "qcbus.dev:xosc:1.0.0:catalogs.mixed_document",
    qcbus_xosc catalogs_unused_location "qcbus.dev:xosc:1.0.0:catalogs.unused_location",
    qcbus_xosc catalogs_version_mismatch "qcbus.dev:xosc:1.0.0:catalogs.version_mismatch",
    qcbus_xosc catalogs_path_escape "qcbus.dev:xosc:1.0.0:catalogs.path_escape",
    asam_xosc naming_no_double_colon_prefix_in_names "asam.net:xosc:1.0.0:naming.no_double_colon_prefix_in_names",
    qcbus_xosc naming_empty_name "qcbus.dev:xosc:1.0.0:naming.empty_name",
    qcbus_xosc naming_entity_selection_clash "qcbus.dev:xosc:1.0.0:naming.entity_selection_clash",
    qcbus_xosc naming_duplicate_property "qcbus.dev:xosc:1.0.0:naming.duplicate_property",
    qcbus_xosc naming_non_ascii_or_control "qcbus.dev:xosc:1.0.0:naming.non_ascii_or_control",
    qcbus_xosc distribution_scenario_file "qcbus.dev:xosc:1.0.0:distribution.scenario_file",
    qcbus_xosc distribution_parameter_known "qcbus.dev:xosc:1.0.0:distribution.parameter_known",
    qcbus_xosc distribution_range_valid "qcbus.dev:xosc:1.0.0:distribution.range_valid",
    qcbus_xosc distribution_range_reached "qcbus.dev:xosc:1.0.0:distribution.range_reached",
    qcbus_xosc distribution_values_at_use "qcbus.dev:xosc:1.0.0:distribution.values_at_use",
    qcbus_xosc distribution_weights "qcbus.dev:xosc:1.0.0:distribution.weights",
    qcbus_xosc distribution_values_satisfy_constraints "qcbus.dev:xosc:1.0.0:distribution.values_satisfy_constraints",
    qcbus_xosc entities_none "qcbus.dev:xosc:1.0.0:entities.none",
    qcbus_xosc entities_not_positioned "qcbus.dev:xosc:1.0.0:entities.not_positioned",
    qcbus_xosc entities_unused "qcbus.dev:xosc:1.0.0:entities.unused",
    qcbus_xosc entities_used_after_deletion "qcbus.dev:xosc:1.0.0:entities.used_after_deletion",
    qcbus_xosc entities_selection_members "qcbus.dev:xosc:1.0.0:entities.selection_members",
    qcbus_xosc entities_selection_not_allowed "qcbus.dev:xosc:1.0.0:entities.selection_not_allowed",
    qcbus_xosc entities_bounding_box_positive "qcbus.dev:xosc:1.0.0:entities.bounding_box_positive",
    qcbus_xosc entities_axle_geometry "qcbus.dev:xosc:1.0.0:entities.axle_geometry",
    qcbus_xosc entities_performance_plausible "qcbus.dev:xosc:1.0.0:entities.performance_plausible",
    qcbus_xosc entities_dimensions_plausible "qcbus.dev:xosc:1.0.0:entities.dimensions_plausible",
    qcbus_xosc entities_trailer_reference "qcbus.dev:xosc:1.0.0:entities.trailer_reference",
    qcbus_xosc entities_overlapping_spawn "qcbus.dev:xosc:1.0.0:entities.overlapping_spawn",
    asam_xosc general_references_to_scenario_object,
    qcbus_xosc references_self_reference "qcbus.dev:xosc:1.0.0:references.self_reference",
    qcbus_xosc references_traffic_name "qcbus.dev:xosc:1.0.0:references.traffic_name",
    qcbus_xosc references_init_order "qcbus.dev:xosc:1.0.0:references.init_order",
    qcbus_xosc references_init_speed_order "qcbus.dev:xosc:1.0.0:references.init_speed_order",
    asam_xosc scenario_logic_controller_activation "asam.net:xosc:1.2.0:scenario_logic.controller_activation",
    asam_xosc reference_control_road_network_reference "asam.net:xosc:1.0.0:reference_control.road_network_reference",
    asam_xosc reference_control_road_network_availability "asam.net:xosc:1.0.0:reference_control.road_network_availability",
    asam_xosc scenario_logic_invalid_elements_if_no_road_network "asam.net:xosc:1.0.0:scenario_logic.invalid_elements_if_no_road_network",
    qcbus_xosc road_xodr_parses "qcbus.dev:xosc:1.0.0:road.xodr_parses",
    asam_xosc reference_control_resolvable_signal_id_in_traffic_signal_state_action "asam.net:xosc:1.2.0:reference_control.resolvable_signal_id_in_traffic_signal_state_action",
    asam_xosc reference_control_traffic_signal_state_references "asam.net:xosc:1.0.0:reference_control.traffic_signal_state_references",
    qcbus_xosc road_signal_condition "qcbus.dev:xosc:1.0.0:road.signal_condition",
    asam_xosc reference_control_resolvable_traffic_signal_controller_by_traffic_signal_controller_ref "asam.net:xosc:1.2.0:reference_control.resolvable_traffic_signal_controller_by_traffic_signal_controller_ref",
    asam_xosc reference_control_traffic_signal_controller_references "asam.net:xosc:1.0.0:reference_control.traffic_signal_controller_references",
    asam_xosc reference_control_traffic_signal_controller_action_references "asam.net:xosc:1.0.0:reference_control.traffic_signal_controller_action_references",
    asam_xosc reference_control_traffic_signal_controller_condition_references "asam.net:xosc:1.0.0:reference_control.traffic_signal_controller_condition_references",
    qcbus_xosc signal_delay_without_reference "qcbus.dev:xosc:1.0.0:signal.delay_without_reference",
    qcbus_xosc signal_phase_duplicate "qcbus.dev:xosc:1.0.0:signal.phase_duplicate",
    qcbus_xosc signal_reference_cycle "qcbus.dev:xosc:1.0.0:signal.reference_cycle",
    qcbus_xosc signal_zero_cycle "qcbus.dev:xosc:1.0.0:signal.zero_cycle",
    qcbus_xosc signal_state_unknown "qcbus.dev:xosc:1.0.0:signal.state_unknown",
    qcbus_xosc signal_condition_never "qcbus.dev:xosc:1.0.0:signal.condition_never",
    asam_xosc reference_control_road_lane_exists "asam.net:xosc:1.0.0:reference_control.road_lane_exists",
    asam_xosc positioning_road_lane_offset_in_bounds,
    asam_xosc positioning_geodetic_datum_defined "asam.net:xosc:1.1.0:positioning.geodetic_datum_defined",
    qcbus_xosc road_lane_type_drivable "qcbus.dev:xosc:1.0.0:road.lane_type_drivable",
    qcbus_xosc road_lane_change_possible "qcbus.dev:xosc:1.0.0:road.lane_change_possible",
    qcbus_xosc road_ends_before_run "qcbus.dev:xosc:1.0.0:road.ends_before_run",
    qcbus_xosc road_lane_id_zero "qcbus.dev:xosc:1.0.0:road.lane_id_zero",
    qcbus_xosc road_world_position_on_road "qcbus.dev:xosc:1.0.0:road.world_position_on_road",
    qcbus_xosc position_orientation_range "qcbus.dev:xosc:1.0.0:position.orientation_range",
    qcbus_xosc position_finite "qcbus.dev:xosc:1.0.0:position.finite",
    qcbus_xosc number_finite "qcbus.dev:xosc:1.0.0:number.finite",
    qcbus_xosc position_relative_lane_exclusive "qcbus.dev:xosc:1.0.0:position.relative_lane_exclusive",
    qcbus_xosc position_route_reference "qcbus.dev:xosc:1.0.0:position.route_reference",
    asam_xosc routing_route_waypoints_locations "asam.net:xosc:1.0.0:routing.route_waypoints_locations",
    asam_xosc routing_ambiguous_route_waypoints "asam.net:xosc:1.0.0:routing.ambiguous_route_waypoints",
    qcbus_xosc route_connected "qcbus.dev:xosc:1.0.0:route.connected",
    qcbus_xosc route_min_waypoints "qcbus.dev:xosc:1.0.0:route.min_waypoints",
    qcbus_xosc route_duplicate_waypoints "qcbus.dev:xosc:1.0.0:route.duplicate_waypoints",
    asam_xosc routing_trajectory_timing_exists_if_requested "asam.net:xosc:1.0.0:routing.trajectory_timing_exists_if_requested",
    asam_xosc routing_cardinality_of_control_points_in_nurbs "asam.net:xosc:1.0.0:routing.cardinality_of_control_points_in_nurbs",
    asam_xosc routing_offset_should_be_less_than_trajectory_length "asam.net:xosc:1.1.0:routing.offset_should_be_less_than_trajectory_length",
    qcbus_xosc trajectory_times_increasing "qcbus.dev:xosc:1.0.0:trajectory.times_increasing",
    qcbus_xosc trajectory_duplicate_vertices "qcbus.dev:xosc:1.0.0:trajectory.duplicate_vertices",
    qcbus_xosc trajectory_speed_plausible "qcbus.dev:xosc:1.0.0:trajectory.speed_plausible",
    qcbus_xosc trajectory_clothoid_time_order "qcbus.dev:xosc:1.0.0:trajectory.clothoid_time_order",
    qcbus_xosc trajectory_knots_non_decreasing "qcbus.dev:xosc:1.0.0:trajectory.knots_non_decreasing",
    qcbus_xosc trajectory_times_ignored "qcbus.dev:xosc:1.0.0:trajectory.times_ignored",
    qcbus_xosc trajectory_times_past "qcbus.dev:xosc:1.0.0:trajectory.times_past",
    qcbus_xosc storyboard_event_always_skipped "qcbus.dev:xosc:1.0.0:storyboard.event_always_skipped",
    qcbus_xosc storyboard_run_never_ends "qcbus.dev:xosc:1.0.0:storyboard.run_never_ends",
    qcbus_xosc trigger_conditions_apart "qcbus.dev:xosc:1.0.0:trigger.conditions_apart",
    qcbus_xosc trigger_edge_over "qcbus.dev:xosc:1.0.0:trigger.edge_over",
    qcbus_xosc trigger_state_never_comes "qcbus.dev:xosc:1.0.0:trigger.state_never_comes",
};
