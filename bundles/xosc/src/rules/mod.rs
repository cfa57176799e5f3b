//! The rules, one per file, in the order of the result.
//!
//! A new rule takes one line in each of the two lists below.

use qcbus_sdk::AnyRule;

mod naming_unique_element_names_on_same_level;
mod parameters_parameter_declaration_parameter_scope;
mod reference_control_resolvable_entity_references;
mod reference_control_unique_element_names_on_same_level;
mod xml_fileheader_is_present;
mod xml_root_tag_is_openscenario;
mod xml_valid_schema;
mod xml_valid_xml_document;
mod xml_version_is_defined;

/// The precondition of rules that need no more than a file that could be read: see `after`.
pub(crate) const READABLE: &[&str] = &["check_asam_xosc_xml_root_tag_is_openscenario"];

/// Every rule; one that depends on another comes after it.
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
];
