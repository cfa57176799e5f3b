//! Declarations at the top of a scenario (parameters, variables, monitors), and the references to
//! them.

use std::borrow::Cow;

use super::references::{self, Dangling};
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _, HashSet};

/// A kind of declaration and the elements that refer to it.
pub(crate) struct Declarable {
    /// The block at the top of the scenario.
    block: &'static str,
    /// The declaration within the block.
    declaration: &'static str,
    /// Its name for messages.
    pub(crate) what: &'static str,
    /// The attribute that refers to a declaration.
    pub(crate) reference: &'static str,
    /// The elements that change the value.
    pub(crate) writers: &'static [&'static str],
    /// The elements that read the value.
    pub(crate) readers: &'static [&'static str],
}

/// Parameters. Many elements have `ParameterDeclarations`, but only those at the top can be
/// referred to by name.
pub(crate) const PARAMETERS: Declarable = Declarable {
    block: "ParameterDeclarations",
    declaration: "ParameterDeclaration",
    what: "parameter",
    reference: "parameterRef",
    writers: &["ParameterAction"],
    readers: &["ParameterCondition"],
};

/// Variables.
pub(crate) const VARIABLES: Declarable = Declarable {
    block: "VariableDeclarations",
    declaration: "VariableDeclaration",
    what: "variable",
    reference: "variableRef",
    writers: &["VariableAction"],
    readers: &["VariableCondition"],
};

/// Monitors. Only tools outside of the scenario read them.
pub(crate) const MONITORS: Declarable = Declarable {
    block: "MonitorDeclarations",
    declaration: "MonitorDeclaration",
    what: "monitor",
    reference: "monitorRef",
    writers: &["SetMonitorAction"],
    readers: &[],
};

impl Declarable {
    /// Returns the declarations at the top.
    pub(crate) fn declarations<'m, 'd>(
        &self,
        scenario: &'m Scenario<'d>,
    ) -> impl Iterator<Item = Element<'m, 'd>> + use<'m, 'd> {
        let declaration = self.declaration;
        let block = scenario.root().child(self.block);
        block
            .into_iter()
            .flat_map(move |block| block.children_named(declaration))
    }

    /// Returns the declarations at the top by name, the first of each name.
    pub(crate) fn by_name<'m, 'd>(
        &self,
        scenario: &'m Scenario<'d>,
    ) -> HashMap<&'d str, Element<'m, 'd>> {
        let mut by_name = HashMap::new();
        for declaration in self.declarations(scenario) {
            by_name
                .entry(bare(declaration.written("name").unwrap_or("")))
                .or_insert(declaration);
        }
        by_name
    }

    /// Returns the elements that refer to this kind of declaration.
    pub(crate) fn references<'m, 'd>(
        &'static self,
        scenario: &'m Scenario<'d>,
        elements: &'static [&'static str],
    ) -> impl Iterator<Item = (Element<'m, 'd>, Cow<'d, str>)> {
        let all = elements
            .iter()
            .flat_map(|element| scenario.elements_everywhere(element));
        all.filter_map(|element| {
            let name = match element.text(self.reference)? {
                Cow::Borrowed(name) => Cow::Borrowed(bare(name)),
                Cow::Owned(name) => Cow::Owned(name),
            };
            Some((element, name))
        })
    }

    /// Returns the names that the elements refer to.
    pub(crate) fn names<'d>(
        &'static self,
        scenario: &Scenario<'d>,
        elements: &'static [&'static str],
    ) -> HashSet<Cow<'d, str>> {
        self.references(scenario, elements)
            .map(|(_, name)| name)
            .collect()
    }

    /// Returns the names that elements refer to but that are not declared.
    pub(crate) fn dangling(
        &'static self,
        scenario: &Scenario<'_>,
        elements: &'static [&'static str],
    ) -> Dangling {
        let declared = self.by_name(scenario);
        let mut dangling = Dangling::default();
        for (_, name) in self.references(scenario, elements) {
            if !declared.contains_key(&*name) {
                dangling.add(&name);
            }
        }
        dangling
    }

    /// Reports references to undeclared names.
    pub(crate) fn resolve(&'static self, scenario: &Scenario<'_>, found: &mut Sink<'_>) {
        let declared = self.by_name(scenario);
        for elements in [self.writers, self.readers] {
            for (element, name) in self.references(scenario, elements) {
                if declared.contains_key(&*name) {
                    continue;
                }
                let parameter = scenario.root().parameter(&name);
                if let Some(parameter) = parameter {
                    let text = format!(
                        "`{}` refers to the {} `{name}`, but only a parameter has this name, which is a \
                         different kind of declaration; some tools accept it",
                        element.name(),
                        self.what
                    );
                    found
                        .about(element, self.reference, text)
                        .level(Level::Warning)
                        .at(parameter.node, "the parameter");
                    continue;
                }
                let names = declared.keys().copied();
                references::unresolved(element, self.reference, &name, self.what, names, found);
            }
        }
    }
}

/// Returns the type that a declaration names.
pub(crate) fn type_of(declaration: Element<'_, '_>, attribute: &str) -> Option<DataType> {
    DataType::of_declaration(declaration.written(attribute)?)
}
