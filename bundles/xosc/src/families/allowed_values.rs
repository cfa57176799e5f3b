//! What a declaration allows its parameter to be: its constraint groups.

use qcbus_openscenario::{Element, Value};

/// What a `ParameterDeclaration` allows, when a value is none of it; `None` when it is allowed, or when
/// that is not known. A value must meet every constraint of one group.
pub(crate) fn violated(declaration: Element<'_, '_>, value: &Value<'_>) -> Option<String> {
    let mut groups = Vec::new();
    for group in declaration.children_named("ConstraintGroup") {
        let mut holds = true;
        let mut texts = Vec::new();
        for constraint in group.children_named("ValueConstraint") {
            let rule = constraint.word("rule")?;
            let bound = constraint.value("value")?;
            holds &= meets(value, &rule, &bound)?;
            texts.push(format!("`{rule}` `{}`", bound.text()));
        }
        if holds {
            return None;
        }
        groups.push(texts.join(" and "));
    }
    (!groups.is_empty()).then(|| groups.join(", or "))
}

/// Whether a value stands in a relation to a bound; `None` where the two have no such relation.
fn meets(value: &Value<'_>, rule: &str, bound: &Value<'_>) -> Option<bool> {
    let numbers = match value {
        Value::Integer(_) | Value::Double(_) => value.number().zip(bound.number()),
        Value::Boolean(_) | Value::Text(_) => None,
    };
    let equal = match (numbers, value) {
        (Some((value, bound)), _) => value == bound,
        (None, Value::Boolean(value)) => bound.flag()? == *value,
        (None, Value::Text(text)) => *text == bound.text(),
        (None, Value::Integer(_) | Value::Double(_)) => return None,
    };
    match rule {
        "equalTo" => return Some(equal),
        "notEqualTo" => return Some(!equal),
        _ => {}
    }
    let (value, bound) = numbers?;
    match rule {
        "greaterThan" => Some(value > bound),
        "lessThan" => Some(value < bound),
        "greaterOrEqual" => Some(value >= bound),
        "lessOrEqual" => Some(value <= bound),
        _ => None,
    }
}
