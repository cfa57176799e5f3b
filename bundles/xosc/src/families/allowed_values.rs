//! What a declaration allows its parameter to be: its constraint groups.

use qcbus_openscenario::{DataType, Element, Value};

use super::constraints::{self, Constraint, Operand};

/// What a `ParameterDeclaration` allows, when a value is none of it; `None` when it is allowed, or when
/// that is not known. A value must meet every constraint of one group.
pub(crate) fn violated(declaration: Element<'_, '_>, value: &Value<'_>) -> Option<String> {
    let data_type = DataType::of_declaration(&declaration.word("parameterType")?)?;
    let operand = Operand::new(value, data_type)?;
    let mut groups = Vec::new();
    for group in constraints::groups(declaration, data_type) {
        // What is not known of a constraint may be what allows the value.
        group.violated(&operand).ok()??;
        let texts: Vec<String> = group.constraints.iter().map(Constraint::shown).collect();
        groups.push(texts.join(" and "));
    }
    (!groups.is_empty()).then(|| groups.join(", or "))
}
