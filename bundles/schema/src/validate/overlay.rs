//! Content that a document may have in addition to its schema.

/// Elements and attributes that are allowed although the schema does not know them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Overlay {
    /// No additions.
    #[default]
    None,
    /// The tags of modular scenarios: `ScenarioReference` with its content in a `ManeuverGroup`,
    /// and the attribute `parameterAttributes` on any element. The rules for modular scenarios
    /// check the content of a reference.
    ModularScenario,
}

impl Overlay {
    pub(super) fn allows_element(self, parent: &str, name: &str) -> bool {
        self == Overlay::ModularScenario && parent == "ManeuverGroup" && name == "ScenarioReference"
    }

    pub(super) fn allows_attribute(self, name: &str) -> bool {
        self == Overlay::ModularScenario && name == "parameterAttributes"
    }
}
