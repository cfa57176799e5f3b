use std::borrow::Cow;

use crate::assembly::{Assembly, Modular};
use crate::families::copies::{Taken, WrittenAt, WrittenIn, is_offered, parameter_of, short_name};
use crate::families::finds::Finds;
use crate::prelude::*;
use qcbus_formats::distance::some_of;
use qcbus_openscenario::Declared;
use qcbus_openscenario::Scenario;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

/// The attributes by which the standard refers to entities, on any element.
const REFERENCES: [&str; 3] = ["entityRef", "masterEntityRef", "trailerRef"];

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let Some(scenario) = assembly.declaring() else {
        return;
    };
    let origins = WrittenIn::of(assembly);
    let mut finds = Finds::default();
    for taken in assembly.taken() {
        let refers = |attribute: &Attribute<'_>| REFERENCES.contains(&attribute.name());
        for (attribute, value) in taken.values().filter(|(attribute, _)| refers(attribute)) {
            let Some(name) = resolved(value, &taken, &scenario) else {
                continue;
            };
            if scenario.entities().contains(&name) {
                continue;
            }
            match origins.of_attribute(&taken, attribute) {
                Some(origin) => {
                    let text = given(origin, &name, &scenario);
                    let at = origin.attribute().into();
                    finds.given(
                        at,
                        attribute.into(),
                        "the reference that gets the name",
                        text,
                    );
                }
                None => {
                    let text = brought(&taken, attribute, &name, &scenario);
                    finds.brought(taken.at(), attribute.into(), "the reference", text);
                }
            }
        }
    }
    finds.say(found);
}

/// Returns the name that a value stands for, or `None` if the name is unknown.
fn resolved<'v, 'd>(
    value: &'v str,
    taken: &Taken<'_, 'd>,
    scenario: &'v Scenario<'d>,
) -> Option<Cow<'v, str>> {
    if !value.contains('$') {
        return Some(Cow::Borrowed(value));
    }
    let name = parameter_of(value)?;
    // A maneuver of the group may declare a parameter of the same name.
    let mut own = taken.copy.group.descendants_named("ParameterDeclaration");
    if own.any(|own| own.attr("name") == Some(name)) {
        return None;
    }
    let group = scenario.element(taken.reference.group);
    match &group.parameter(name)?.declared {
        Declared::Value(value) => Some(value.text()),
        Declared::Faulty => None,
    }
}

fn brought(
    taken: &Taken<'_, '_>,
    attribute: Attribute<'_>,
    name: &str,
    scenario: &Scenario<'_>,
) -> String {
    let element = attribute.node();
    let (what, around) = (attribute.name(), element.parent());
    let key = match around {
        Some(around) if around != taken.copy.group => {
            format!("{}.{}.{what}", around.name(), element.name())
        }
        _ => format!("{}.{what}", element.name()),
    };
    let advice = match is_offered(attribute) {
        true => format!("give the key `{key}` the name of an entity of this scenario"),
        false => format!(
            "declare `{name}` here, or offer `{what}` in `{}` by `parameterAttributes`, so that a key (`{key}`) \
             can name another entity",
            short_name(element.document())
        ),
    };
    format!(
        "`{what}` of `{}` in the group `{}` refers to `{name}`, but this scenario declares no entity of this \
         name{}; the entities of a library file are not taken over: {advice}",
        element.name(),
        taken.own_name(),
        known(scenario)
    )
}

fn given(origin: WrittenAt<'_>, name: &str, scenario: &Scenario<'_>) -> String {
    let who = match origin {
        WrittenAt::Key(key, _) => format!("the key `{key}` names the entity `{name}`"),
        WrittenAt::Actor(_) => format!("the actor of the referring group is `{name}`"),
    };
    let near = closest(name, scenario.entities().names());
    let hint = near.map_or_else(
        || known(scenario),
        |near| format!("; perhaps `{near}` is meant"),
    );
    format!("{who}, but the scenario declares no entity of this name{hint}")
}

/// Lists some of the declared entities.
fn known(scenario: &Scenario<'_>) -> String {
    match some_of(scenario.entities().names()) {
        None => " (it declares none)".to_owned(),
        Some(names) => format!(" (it has {names})"),
    }
}
