//! The rules, one per file, in the order of the result.
//!
//! A new rule takes one line in each of the two lists below.

use qcbus_sdk::AnyRule;

mod actor_entity_ref;
mod group_reference_duplicate;
mod key_ambiguous;
mod key_crashes_reference_tool;
mod key_duplicate;
mod group_content_dropped;
mod archive_limits;
mod archive_main_present;
mod archive_member_collision;
mod archive_path_safety;
mod archive_unused_member;
mod key_matches;
mod key_path_exact;
mod parameter_reference_attributes;
mod reference_cycle;
mod reference_extension;
mod library_context_mismatch;
mod library_default_kept;
mod library_name_with_dot;
mod library_parameter_attributes_missing;
mod reference_depth;
mod reference_file_found;
mod reference_form;
mod reference_maneuver_group_known;
mod reference_unexpanded;
mod scenario_reference_placement;
mod scenario_reference_single;
mod result_catalogs_resolve;
mod result_entities_declared;
mod result_names_unique;
mod result_parameters_resolved;
mod result_valid_schema;
mod text_lt_in_values;
mod value_range;
mod value_type;
mod reference_order_dependence;
mod xml_encoding;
mod xml_no_doctype;

/// The rules of the bundle.
pub static RULES: &[&dyn AnyRule] = &[
    &actor_entity_ref::RULE,
    &group_reference_duplicate::RULE,
    &key_ambiguous::RULE,
    &key_crashes_reference_tool::RULE,
    &key_duplicate::RULE,
    &key_matches::RULE,
    &key_path_exact::RULE,
    &parameter_reference_attributes::RULE,
    &reference_cycle::RULE,
    &reference_extension::RULE,
    &reference_file_found::RULE,
    &reference_form::RULE,
    &reference_maneuver_group_known::RULE,
    &reference_unexpanded::RULE,
    &scenario_reference_placement::RULE,
    &scenario_reference_single::RULE,
    &group_content_dropped::RULE,
    &key_matches::RULE,
    &library_context_mismatch::RULE,
    &library_default_kept::RULE,
    &library_name_with_dot::RULE,
    &library_parameter_attributes_missing::RULE,
    &reference_file_found::RULE,
    &result_catalogs_resolve::RULE,
    &result_entities_declared::RULE,
    &result_names_unique::RULE,
    &result_parameters_resolved::RULE,
    &result_valid_schema::RULE,
    &text_lt_in_values::RULE,
    &value_range::RULE,
    &value_type::RULE,
    &archive_limits::RULE,
    &archive_main_present::RULE,
    &archive_member_collision::RULE,
    &archive_path_safety::RULE,
    &archive_unused_member::RULE,
    &key_matches::RULE,
    &reference_depth::RULE,
    &reference_file_found::RULE,
    &reference_order_dependence::RULE,
    &xml_encoding::RULE,
    &xml_no_doctype::RULE,
];
