//! Values that cannot be had as they are written: the model lists them once, each rule says its kinds.

use foldhash::{HashMap, HashMapExt as _};
use qcbus_document::Attribute;
use qcbus_openscenario::{
    DataType, Declaration, Declared, Element, Form, Reading, Scenario, Value, ValueFault,
    ValueFaultKind,
};
use qcbus_sdk::{Finding, Sink};

use crate::model::About as _;

/// Says every fault of these kinds.
pub(crate) fn report(scenario: &Scenario<'_>, kinds: &[ValueFaultKind], found: &mut Sink<'_>) {
    for fault in faults(scenario, kinds) {
        say(fault, found);
    }
    report_in_entries(scenario, kinds, found);
}

/// Says every fault of these kinds that entries of catalogs have by what is assigned to them.
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

/// Uses of a parameter that are shown beside its declaration, or beside the first of them.
const MOST_USES: usize = 3;

/// Faults that are one: a parameter has a value that its uses do not take.
struct Misfit<'m, 'd> {
    declaration: &'m Declaration<'d>,
    uses: Vec<&'m ValueFault<'d>>,
}

/// Says of the parameters in the document which values do not fit where they are used, each once: at the
/// declaration where no use of it fits, else at the first use that does not.
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

/// How often each declared parameter is used in the document.
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

    /// How many uses are neither the place itself nor shown beside it.
    fn unshown(&self, said: usize) -> String {
        match self.uses.len().saturating_sub(said + MOST_USES) {
            0 => String::new(),
            1 => "; the same holds for one more use".to_owned(),
            more => format!("; the same holds for {more} more uses"),
        }
    }
}

/// The faults of some kinds, without what the schema's checker says as well. A name that leads nowhere
/// is a fact of its own, however it is written.
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

/// Says one fault.
pub(crate) fn say<'s, 'd>(fault: &ValueFault<'_>, found: &'s mut Sink<'d>) -> Finding<'s, 'd> {
    let text = match fault.kind {
        // What is written is what is said.
        ValueFaultKind::Declared => format!("the declared value {}", fault.text),
        _ => format!("{}: {}", written(fault.attribute), fault.text),
    };
    found.issue(fault.attribute, text)
}

/// The attribute as it is written, for the beginning of a text.
pub(crate) fn written(attribute: Attribute<'_>) -> String {
    format!(
        "`{}=\"{}\"` of `{}`",
        attribute.name(),
        short(attribute.value()),
        attribute.node().name()
    )
}

/// A value, cut where nobody reads on.
pub(crate) fn short(value: &str) -> String {
    const MOST: usize = 80;
    match value.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &value[..end]),
        None => value.to_owned(),
    }
}

/// The parameter of type string that keeps an expression from having a value, although its text is a
/// number.
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

/// An attribute that the schema takes for text as a value of its true type: the value, or why it is none
/// (a sentence fragment); `None` when it is missing or unknown.
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
            "an empty text".to_owned()
        } else {
            super::references::quoted(element, name, &short(&written))
        };
        format!(
            "{shown} is no value of type `{}`, which is {}",
            data_type.word(),
            data_type.allowed()
        )
    };
    Some(value.ok_or_else(wrong))
}

/// The integer that is written as a double without a fraction, `5.0`: what reads it as a number takes it.
pub(crate) fn whole<'d>(text: &str, data_type: DataType) -> Option<Value<'d>> {
    data_type.range()?;
    fitting(
        &Value::Double(qcbus_openscenario::parse_double(text)?),
        data_type,
    )
}

/// A value of a parameter or an expression as one of the type.
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

/// Whether a fault of a declared or used value is said by another rule than that about types.
pub(crate) fn is_of_other_rule(scenario: &Scenario<'_>, fault: &ValueFault<'_>) -> bool {
    fault.attribute.node().is("VariableDeclaration")
        || is_about_time(fault)
        || is_empty_default(scenario, fault)
}

/// Whether a date-time is due.
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

/// Whether the only fault of a date-time is that its zone has no colon: `+0100`, as the standard itself
/// writes it in places.
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

/// Whether the default of a catalog's parameter is empty.
pub(crate) fn is_empty_default(scenario: &Scenario<'_>, fault: &ValueFault<'_>) -> bool {
    scenario.form() == Form::Catalog
        && fault.attribute.node().is("ParameterDeclaration")
        && fault.attribute.value().trim().is_empty()
}
