//! Values that the constraint groups of a declaration allow.

use super::constraints::{self, Constraint, Operand};
use crate::prelude::*;

/// Returns the constraints of a `ParameterDeclaration` if a value violates them. Returns `None` if
/// the value is allowed, or if this is unknown. A value must meet every constraint of at least one
/// group.
pub(crate) fn violated(declaration: Element<'_, '_>, value: &Value<'_>) -> Option<String> {
    let data_type = DataType::of_declaration(&declaration.word("parameterType")?)?;
    let operand = Operand::new(value, data_type)?;
    let mut groups = Vec::new();
    for group in constraints::groups(declaration, data_type) {
        // An unknown constraint may allow the value.
        group.violated(&operand).ok()??;
        let texts: Vec<String> = group.constraints.iter().map(Constraint::shown).collect();
        groups.push(texts.join(" and "));
    }
    (!groups.is_empty()).then(|| groups.join(", or "))
}
