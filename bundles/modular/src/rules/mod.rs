//! The rules, one per file, in the order of the result.
//!
//! A new rule needs one line in each of the two lists below. A line of the second list has the prefix of
//! the id, the name and the UID; see [`qcbus_sdk::rules!`].

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
pub static RULES: &[&dyn AnyRule] = qcbus_sdk::rules! {
    qcbus_mosc archive_limits "qcbus.dev:mosc:1.0.0:archive.limits",
    qcbus_mosc archive_main_present "qcbus.dev:mosc:1.0.0:archive.main_present",
    qcbus_mosc archive_member_collision "qcbus.dev:mosc:1.0.0:archive.member_collision",
    qcbus_mosc archive_path_safety "qcbus.dev:mosc:1.0.0:archive.path_safety",
    qcbus_mosc archive_unused_member "qcbus.dev:mosc:1.0.0:archive.unused_member",
    qcbus_mosc xml_encoding "qcbus.dev:mosc:1.0.0:xml.encoding",
    qcbus_mosc xml_no_doctype "qcbus.dev:mosc:1.0.0:xml.no_doctype",
    qcbus_mosc scenario_reference_placement "qcbus.dev:mosc:1.0.0:scenario_reference.placement",
    qcbus_mosc scenario_reference_single "qcbus.dev:mosc:1.0.0:scenario_reference.single",
    qcbus_mosc reference_cycle "qcbus.dev:mosc:1.0.0:reference.cycle",
    qcbus_mosc reference_depth "qcbus.dev:mosc:1.0.0:reference.depth",
    qcbus_mosc reference_extension "qcbus.dev:mosc:1.0.0:reference.extension",
    qcbus_mosc reference_file_found "qcbus.dev:mosc:1.0.0:reference.file_found",
    qcbus_mosc reference_form "qcbus.dev:mosc:1.0.0:reference.form",
    qcbus_mosc reference_maneuver_group_known "qcbus.dev:mosc:1.0.0:reference.maneuver_group_known",
    qcbus_mosc reference_order_dependence "qcbus.dev:mosc:1.0.0:reference.order_dependence",
    qcbus_mosc reference_unexpanded "qcbus.dev:mosc:1.0.0:reference.unexpanded",
    qcbus_mosc group_reference_duplicate "qcbus.dev:mosc:1.0.0:group_reference.duplicate",
    qcbus_mosc parameter_reference_attributes "qcbus.dev:mosc:1.0.0:parameter_reference.attributes",
    qcbus_mosc actor_entity_ref "qcbus.dev:mosc:1.0.0:actor.entity_ref",
    qcbus_mosc key_ambiguous "qcbus.dev:mosc:1.0.0:key.ambiguous",
    qcbus_mosc key_crashes_reference_tool "qcbus.dev:mosc:1.0.0:key.crashes_reference_tool",
    qcbus_mosc key_duplicate "qcbus.dev:mosc:1.0.0:key.duplicate",
    qcbus_mosc key_matches "qcbus.dev:mosc:1.0.0:key.matches",
    qcbus_mosc key_path_exact "qcbus.dev:mosc:1.0.0:key.path_exact",
    qcbus_mosc value_range "qcbus.dev:mosc:1.0.0:value.range",
    qcbus_mosc value_type "qcbus.dev:mosc:1.0.0:value.type",
    qcbus_mosc library_context_mismatch "qcbus.dev:mosc:1.0.0:library.context_mismatch",
    qcbus_mosc library_default_kept "qcbus.dev:mosc:1.0.0:library.default_kept",
    qcbus_mosc library_name_with_dot "qcbus.dev:mosc:1.0.0:library.name_with_dot",
    qcbus_mosc library_parameter_attributes_missing "qcbus.dev:mosc:1.0.0:library.parameter_attributes_missing",
    qcbus_mosc text_lt_in_values "qcbus.dev:mosc:1.0.0:text.lt_in_values",
    qcbus_mosc group_content_dropped "qcbus.dev:mosc:1.0.0:group.content_dropped",
    qcbus_mosc result_catalogs_resolve "qcbus.dev:mosc:1.0.0:result.catalogs_resolve",
    qcbus_mosc result_entities_declared "qcbus.dev:mosc:1.0.0:result.entities_declared",
    qcbus_mosc result_names_unique "qcbus.dev:mosc:1.0.0:result.names_unique",
    qcbus_mosc result_parameters_resolved "qcbus.dev:mosc:1.0.0:result.parameters_resolved",
    qcbus_mosc result_valid_schema "qcbus.dev:mosc:1.0.0:result.valid_schema",
};
