//! The rules, one per file, in the order of the result.
//!
//! A new rule needs one line in each of the two lists below.

use qcbus_sdk::AnyRule;

mod actor_entity_ref;
mod archive_limits;
mod archive_main_present;
mod archive_member_collision;
mod archive_path_safety;
mod archive_unused_member;
mod group_content_dropped;
mod group_reference_duplicate;
mod key_ambiguous;
mod key_crashes_reference_tool;
mod key_duplicate;
mod key_matches;
mod key_path_exact;
mod library_context_mismatch;
mod library_default_kept;
mod library_name_with_dot;
mod library_parameter_attributes_missing;
mod parameter_reference_attributes;
mod reference_cycle;
mod reference_depth;
mod reference_extension;
mod reference_file_found;
mod reference_form;
mod reference_maneuver_group_known;
mod reference_order_dependence;
mod reference_unexpanded;
mod result_catalogs_resolve;
mod result_entities_declared;
mod result_names_unique;
mod result_parameters_resolved;
mod result_valid_schema;
mod scenario_reference_placement;
mod scenario_reference_single;
mod text_lt_in_values;
mod value_range;
mod value_type;
mod xml_encoding;
mod xml_no_doctype;

/// The rules of the bundle: archives, files, references, keys, libraries and results.
pub static RULES: &[&dyn AnyRule] = &[
    &archive_limits::RULE,
    &archive_main_present::RULE,
    &archive_member_collision::RULE,
    &archive_path_safety::RULE,
    &archive_unused_member::RULE,
    &xml_encoding::RULE,
    &xml_no_doctype::RULE,
    &scenario_reference_placement::RULE,
    &scenario_reference_single::RULE,
    &reference_cycle::RULE,
    &reference_depth::RULE,
    &reference_extension::RULE,
    &reference_file_found::RULE,
    &reference_form::RULE,
    &reference_maneuver_group_known::RULE,
    &reference_order_dependence::RULE,
    &reference_unexpanded::RULE,
    &group_reference_duplicate::RULE,
    &parameter_reference_attributes::RULE,
    &actor_entity_ref::RULE,
    &key_ambiguous::RULE,
    &key_crashes_reference_tool::RULE,
    &key_duplicate::RULE,
    &key_matches::RULE,
    &key_path_exact::RULE,
    &value_range::RULE,
    &value_type::RULE,
    &library_context_mismatch::RULE,
    &library_default_kept::RULE,
    &library_name_with_dot::RULE,
    &library_parameter_attributes_missing::RULE,
    &text_lt_in_values::RULE,
    &group_content_dropped::RULE,
    &result_catalogs_resolve::RULE,
    &result_entities_declared::RULE,
    &result_names_unique::RULE,
    &result_parameters_resolved::RULE,
    &result_valid_schema::RULE,
];
