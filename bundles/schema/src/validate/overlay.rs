//! What a document may contain beyond its schema.

/// Elements and attributes that are allowed although the schema does not know them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Overlay {
    /// Nothing.
    #[default]
    None,
    /// The tags of modular scenarios: `ScenarioReference` (with what is in it) in a
    /// `ManeuverGroup`, and the attribute `parameterAttributes` on any element. What is in a
    /// reference is judged by the rules for modular scenarios, not here.
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
