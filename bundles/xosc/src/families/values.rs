//! Reports of value faults: values that cannot be resolved as written. The model lists them once,
//! and each rule reports its kinds.

use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};
use qcbus_openscenario::Reading;
use qcbus_openscenario::ValueFault;
use qcbus_sdk::Finding;

/// Reports every fault of these kinds.
pub(crate) fn report(scenario: &Scenario<'_>, kinds: &[ValueFaultKind], found: &mut Sink<'_>) {
    for fault in faults(scenario, kinds) {
        say(fault, found);
    }
    report_in_entries(scenario, kinds, found);
}

/// Reports every fault of these kinds in catalog entries that is caused by assigned values.
pub(crate) fn report_in_entries(
    scenario: &Scenario<'_>,
    kinds: &[ValueFaultKind],
    found: &mut Sink<'_>,
) {
    for (element, fault) in scenario.entry_faults_of(kinds) {
        let text = format!("{}: {}", written(fault.attribute), fault.text);
        found.about(element, fault.attribute.name(), text);
    }
}

/// Maximum number of uses of a parameter that are shown with its declaration, or with the first
/// use.
const MOST_USES: usize = 3;

/// Faults with one cause: a parameter has a value that its uses do not accept.
struct Misfit<'m, 'd> {
    declaration: &'m Declaration<'d>,
    uses: Vec<&'m ValueFault<'d>>,
}

/// Reports parameter values in the document that do not fit their uses, each once. If no use fits,
/// the report is at the declaration. Otherwise it is at the first use that does not fit.
pub(crate) fn report_misfits(scenario: &Scenario<'_>, kind: ValueFaultKind, found: &mut Sink<'_>) {
    let mut misfits: Vec<Misfit<'_, '_>> = Vec::new();
    let mut known: HashMap<(u32, &str), usize> = HashMap::new();
    for fault in faults(scenario, &[kind]) {
        if is_of_other_rule(scenario, fault) {
            continue;
        }
        let element = scenario.element(fault.attribute.node());
        let Some(declaration) = element.parameter(&fault.name) else {
            say(fault, found);
            continue;
        };
        let key = (declaration.node.index(), fault.text.as_str());
        let at = *known.entry(key).or_insert(misfits.len());
        match misfits.get_mut(at) {
            Some(misfit) => misfit.uses.push(fault),
            None => misfits.push(Misfit {
                declaration,
                uses: vec![fault],
            }),
        }
    }
    if misfits.is_empty() {
        return;
    }
    let uses = uses_by_declaration(scenario);
    for misfit in &misfits {
        let all = uses.get(&misfit.declaration.node.index()).copied();
        misfit.say(all.unwrap_or(0) <= misfit.uses.len(), found);
    }
}

/// Counts the uses of each declared parameter in the document.
fn uses_by_declaration(scenario: &Scenario<'_>) -> HashMap<u32, usize> {
    let mut uses = HashMap::new();
    for (attribute, name) in scenario.parameter_uses() {
        if let Some(declaration) = scenario.element(attribute.node()).parameter(name) {
            *uses.entry(declaration.node.index()).or_default() += 1;
        }
    }
    uses
}

impl Misfit<'_, '_> {
    fn say(&self, is_declarations: bool, found: &mut Sink<'_>) {
        let Some(first) = self.uses.first() else {
            return;
        };
        let declared = self.declaration.node.attribute("value");
        let (mut finding, shown) = match declared.filter(|_| is_declarations) {
            Some(value) => {
                let text = format!("{}{}", first.text, self.unshown(0));
                (found.issue(value, text), self.uses.as_slice())
            }
            None => {
                let text = format!(
                    "{}: {}{}",
                    written(first.attribute),
                    first.text,
                    self.unshown(1)
                );
                let rest = self.uses.get(1..).unwrap_or(&[]);
                (found.issue(first.attribute, text), rest)
            }
        };
        for one in shown.iter().take(MOST_USES) {
            finding = finding.at(one.attribute, written(one.attribute));
        }
        if let Some(value) = declared.filter(|_| !is_declarations) {
            finding.at(value, "its declaration");
        }
    }

    /// Returns a text about the number of uses that are not shown.
    fn unshown(&self, said: usize) -> String {
        match self.uses.len().saturating_sub(said + MOST_USES) {
            0 => String::new(),
            1 => "; the same applies to one more use".to_owned(),
            more => format!("; the same applies to {more} more uses"),
        }
    }
}

/// Returns the faults of some kinds, without those that the schema checker also reports. Unresolved
/// names are always included.
pub(crate) fn faults<'m, 'd>(
    scenario: &'m Scenario<'d>,
    kinds: &[ValueFaultKind],
) -> impl Iterator<Item = &'m ValueFault<'d>> {
    let names = [
        ValueFaultKind::Undeclared,
        ValueFaultKind::Variable,
        ValueFaultKind::Order,
    ];
    let faults = scenario.faults_of(kinds);
    faults.filter(move |fault| !fault.said_by_schema || names.contains(&fault.kind))
}

/// Reports one fault.
pub(crate) fn say<'s, 'd>(fault: &ValueFault<'_>, found: &'s mut Sink<'d>) -> Finding<'s, 'd> {
    let text = match fault.kind {
        // The text already contains the written value.
        ValueFaultKind::Declared => format!("the declared value {}", fault.text),
        _ => format!("{}: {}", written(fault.attribute), fault.text),
    };
    found.issue(fault.attribute, text)
}

/// Formats the attribute as it is written, for the start of a message.
pub(crate) fn written(attribute: Attribute<'_>) -> String {
    format!(
        "`{}=\"{}\"` of `{}`",
        attribute.name(),
        short(attribute.value()),
        attribute.node().name()
    )
}

/// Cuts a long value for a message.
pub(crate) fn short(value: &str) -> String {
    const MOST: usize = 80;
    match value.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &value[..end]),
        None => value.to_owned(),
    }
}

/// Returns the parameter of type string that keeps an expression from having a value, although its
/// text is a number.
pub(crate) fn numeric_text<'d>(scenario: &Scenario<'d>, fault: &ValueFault<'d>) -> Option<&'d str> {
    let behind = fault.attribute.value().get(fault.at..)?.strip_prefix('$')?;
    let name = qcbus_openscenario::identifier(behind);
    let element = scenario.element(fault.attribute.node());
    let declaration = element.parameter(name)?;
    let Declared::Value(value @ Value::Text(_)) = &declaration.declared else {
        return None;
    };
    let is_number = declaration.data_type == Some(DataType::String) && value.number().is_some();
    is_number.then_some(name)
}

/// Returns the value in its true type of an attribute that the schema declares as text. If it is no
/// such value, returns the reason as a sentence fragment. Returns `None` if it is missing or
/// unknown.
pub(crate) fn typed<'d>(
    element: Element<'_, 'd>,
    name: &str,
    data_type: DataType,
) -> Option<Result<Value<'d>, String>> {
    let value = match element.read(name) {
        Reading::Absent | Reading::Unknown => return None,
        Reading::Literal(text) => data_type.parse(text).or_else(|| whole(text, data_type)),
        Reading::Value(value) => fitting(&value, data_type),
    };
    let wrong = || {
        let written = element.text(name).unwrap_or_default();
        let shown = if written.is_empty() {
            "an empty string".to_owned()
        } else {
            super::references::quoted(element, name, &short(&written))
        };
        format!(
            "{shown} is not a valid value of type `{}`, which is {}",
            data_type.word(),
            data_type.allowed()
        )
    };
    Some(value.ok_or_else(wrong))
}

/// Returns the integer that is written as a double without a fraction, `5.0`. Tools that read it as
/// a number accept it.
pub(crate) fn whole<'d>(text: &str, data_type: DataType) -> Option<Value<'d>> {
    data_type.range()?;
    fitting(
        &Value::Double(qcbus_openscenario::parse_double(text)?),
        data_type,
    )
}

/// Converts a value of a parameter or an expression to the type.
fn fitting<'d>(value: &Value<'d>, data_type: DataType) -> Option<Value<'d>> {
    match data_type {
        DataType::Double => value.number().map(Value::Double),
        DataType::Boolean => value.flag().map(Value::Boolean),
        DataType::String => Some(Value::Text(value.text())),
        DataType::DateTime => {
            let text = value.text();
            data_type.parse(&text)?;
            Some(Value::Text(text))
        }
        DataType::Int | DataType::UnsignedInt | DataType::UnsignedShort => {
            let range = data_type.range()?;
            let integer = value.integer().filter(|integer| range.contains(integer))?;
            Some(Value::Integer(integer))
        }
    }
}

/// Checks whether another rule than the one about types reports a fault of a declared or used
/// value.
pub(crate) fn is_of_other_rule(scenario: &Scenario<'_>, fault: &ValueFault<'_>) -> bool {
    fault.attribute.node().is("VariableDeclaration")
        || is_about_time(fault)
        || is_empty_default(scenario, fault)
}

/// Checks whether a date-time is expected.
pub(crate) fn is_about_time(fault: &ValueFault<'_>) -> bool {
    let node = fault.attribute.node();
    match fault.attribute.name() {
        "date" | "dateTime" => true,
        "value" => {
            node.is("ParameterDeclaration") && node.attr("parameterType") == Some("dateTime")
        }
        _ => false,
    }
}

/// Checks whether the only fault of a date-time is a zone without a colon: `+0100`. The standard
/// itself uses it in some places.
pub(crate) fn is_basic_zone<'d>(scenario: &Scenario<'d>, fault: &ValueFault<'d>) -> bool {
    let attribute = fault.attribute;
    let name = attribute.value().trim().strip_prefix('$');
    let element = scenario.element(attribute.node());
    let declared = name.and_then(|name| element.parameter(name));
    let text = match declared.map(|declaration| &declaration.declared) {
        Some(Declared::Value(value)) => value.text(),
        _ => attribute.value().into(),
    };
    let text = text.trim();
    let Some((clock, minutes)) = text
        .len()
        .checked_sub(2)
        .and_then(|at| text.split_at_checked(at))
    else {
        return false;
    };
    DataType::DateTime
        .parse(&format!("{clock}:{minutes}"))
        .is_some()
        && clock.contains(['+', '-'])
        && !clock.ends_with(':')
}

/// Checks whether the default of a catalog's parameter is empty.
pub(crate) fn is_empty_default(scenario: &Scenario<'_>, fault: &ValueFault<'_>) -> bool {
    scenario.form() == Form::Catalog
        && fault.attribute.node().is("ParameterDeclaration")
        && fault.attribute.value().trim().is_empty()
}
