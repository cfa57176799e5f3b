use crate::assembly::{Assembly, Modular};
use crate::families::copies::WrittenIn;
use crate::families::finds::Finds;
use crate::families::typings::Typings;
use crate::prelude::*;
use qcbus_openscenario::DataType;
use qcbus_schema::ValueType;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let origins = WrittenIn::of(assembly);
    let mut typings = Typings::default();
    let mut finds = Finds::default();
    for taken in assembly.taken() {
        for (attribute, value) in taken
            .edited()
            .filter(|(_, value)| !value.text.contains('$'))
        {
            let typing = typings.of(assembly, taken.copy.piece);
            let Some(value_type) = typing.and_then(|typing| typing.value(attribute)) else {
                continue;
            };
            let (Some(wrong), Some(origin)) = (wrong(&value.text, value_type), origins.get(value))
            else {
                continue;
            };
            let text = format!(
                "{} gives `{}` of `{}` {wrong}",
                origin.what(),
                attribute.name(),
                attribute.node().name()
            );
            finds.value(origin, attribute, text);
        }
    }
    finds.say(found);
}

/// Describes the fault of a value of a type, if any.
fn wrong(value: &str, value_type: ValueType) -> Option<String> {
    const MOST: usize = 12;
    let shown = match value {
        "" => "an empty value".to_owned(),
        value => format!("the value `{value}`"),
    };
    if let Some(words) = value_type.words() {
        if words.iter().any(|word| **word == *value.trim()) {
            return None;
        }
        if let Some(near) = closest(value, words.iter().map(|word| &**word)) {
            return Some(format!(
                "{shown}, which is not an allowed word; perhaps `{near}` is meant"
            ));
        }
        let all: Vec<String> = words
            .iter()
            .take(MOST)
            .map(|word| format!("`{word}`"))
            .collect();
        let more = if words.len() > MOST { ", …" } else { "" };
        return Some(format!(
            "{shown}, but expected one of {}{more}",
            all.join(", ")
        ));
    }
    let data_type = DataType::of_schema(value_type.name()?)?;
    let is_one = data_type.parse(value).is_some();
    (!is_one).then(|| format!("{shown}, but expected {}", data_type.allowed()))
}
