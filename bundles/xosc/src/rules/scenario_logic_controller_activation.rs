use crate::families::references::{hint, quoted};
use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
};

/// The domains: their name, and the attributes of `AssignControllerAction` and
/// `ActivateControllerAction` for them.
const DOMAINS: &[(&str, &str, &str)] = &[
    ("lateral", "activateLateral", "movement"),
    ("longitudinal", "activateLongitudinal", "movement"),
    ("lighting", "activateLighting", "appearance"),
    ("animation", "activateAnimation", "appearance"),
];

/// A controller that is assigned to an entity.
#[derive(Clone)]
struct Assigned<'d> {
    name: Option<String>,
    /// The name of its `ObjectController`.
    object_name: Option<String>,
    /// Domains, or `None` if they are not stated.
    domains: Option<String>,
    node: Node<'d>,
}

impl Assigned<'_> {
    /// Checks whether it controls a domain. If no domain is stated, the answer is yes.
    fn covers(&self, domain: &str, group: &str) -> bool {
        self.domains
            .as_deref()
            .is_none_or(|own| own == domain || own == group || own == "all")
    }
}

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements_everywhere("AssignControllerAction") {
        for controller in controllers(action).into_iter().flatten() {
            for (domain, attribute, group) in DOMAINS {
                if action.flag(attribute) == Some(true) && !controller.covers(domain, group) {
                    mismatch(action, attribute, domain, &controller, found);
                }
            }
        }
    }
    let Some(assigned) = assigned(scenario) else {
        return;
    };
    for action in scenario.elements_everywhere("ActivateControllerAction") {
        activate(action, &assigned, found);
    }
}

/// Returns the controllers within an action or an `ObjectController`. Returns `None` if one is
/// unknown.
fn controllers<'d>(holder: Element<'_, 'd>) -> Option<Vec<Assigned<'d>>> {
    let object = holder.child("ObjectController");
    let around = object.unwrap_or(holder);
    let has_any = around.children().next().is_some();
    let Some(controller) = around.child_or_entry(&["Controller"]) else {
        return (!has_any).then(Vec::new);
    };
    let text = |element: Element<'_, '_>, name: &str| Some(element.text(name)?.into_owned());
    let is_object = around.is("ObjectController");
    Some(vec![Assigned {
        name: text(controller, "name"),
        object_name: if is_object {
            text(around, "name")
        } else {
            None
        },
        domains: if controller.has("controllerType") {
            Some(controller.word("controllerType")?.into_owned())
        } else {
            None
        },
        node: controller.node(),
    }])
}

/// Returns the controllers of each entity at any time. Returns `None` if one of them is unknown.
fn assigned<'d>(scenario: &Scenario<'d>) -> Option<HashMap<String, Vec<Assigned<'d>>>> {
    let mut all: HashMap<String, Vec<Assigned<'d>>> = HashMap::default();
    for entity in scenario.entities().objects() {
        let own = all.entry(entity.name().to_owned()).or_default();
        for holder in entity.element(scenario).children_named("ObjectController") {
            own.extend(controllers(holder)?);
        }
    }
    if !scenario.storyboard().is_complete() {
        return None;
    }
    for action in scenario.elements_everywhere("AssignControllerAction") {
        let controllers = controllers(action)?;
        for name in Actors::of(action)?.names()? {
            for entity in scenario.entities().expand(&name)? {
                let own = all.entry(entity.name().to_owned()).or_default();
                own.extend(controllers.iter().cloned());
            }
        }
    }
    Some(all)
}

fn activate(
    action: Element<'_, '_>,
    assigned: &HashMap<String, Vec<Assigned<'_>>>,
    found: &mut Sink<'_>,
) {
    let wanted: Vec<_> = DOMAINS
        .iter()
        .filter(|(domain, _, _)| action.flag(domain) == Some(true))
        .collect();
    let names = Actors::of(action).and_then(|actors| actors.names());
    let entities = action.scenario().entities();
    let objects = names
        .into_iter()
        .flatten()
        .filter_map(|name| entities.expand(&name))
        .flatten();
    for entity in objects {
        let own = assigned.get(entity.name()).map_or(&[][..], Vec::as_slice);
        let names_one = action.has("objectControllerRef") || action.has("controllerRef");
        if wanted.is_empty() && !names_one {
            continue;
        }
        if own.is_empty() && !names_one {
            let text = format!(
                "no controller is ever assigned to `{}`, so none can be activated",
                entity.name()
            );
            found.about(action, "", text).level(Level::Warning);
            continue;
        }
        let Some(meant) = meant(action, entity.name(), own, assigned, found) else {
            continue;
        };
        for (domain, _, group) in &wanted {
            if let Some(one) = meant.first()
                && !meant.iter().any(|one| one.covers(domain, group))
            {
                mismatch(action, domain, domain, one, found);
            }
        }
    }
}

/// Returns the controllers that an activation is about.
fn meant<'c, 'd>(
    action: Element<'_, '_>,
    entity: &str,
    own: &'c [Assigned<'d>],
    assigned: &HashMap<String, Vec<Assigned<'_>>>,
    found: &mut Sink<'_>,
) -> Option<Vec<&'c Assigned<'d>>> {
    for attribute in ["objectControllerRef", "controllerRef"] {
        if !action.has(attribute) {
            continue;
        }
        let name = action.text(attribute)?;
        let own_name = |one: &'c Assigned<'d>| match attribute {
            "controllerRef" => one.name.as_deref(),
            _ => one.object_name.as_deref(),
        };
        let meant: Vec<_> = own
            .iter()
            .filter(|one| own_name(one) == Some(&*name))
            .collect();
        if meant.is_empty() {
            // Authors confuse a controller's name with that of its `ObjectController`.
            let bears = |one: &Assigned<'_>| {
                one.name.as_deref() == Some(&*name) || one.object_name.as_deref() == Some(&*name)
            };
            let exists = assigned.values().flatten().any(bears);
            let (level, whom) = if exists {
                (Level::Warning, format!("`{entity}`"))
            } else {
                (Level::Error, format!("`{entity}` or any other entity"))
            };
            let text = format!(
                "no controller {} is ever assigned to {whom}{}",
                quoted(action, attribute, &name),
                hint(&name, own.iter().filter_map(own_name))
            );
            found.about(action, attribute, text).level(level);
            return None;
        }
        return Some(meant);
    }
    Some(own.iter().collect())
}

fn mismatch(
    action: Element<'_, '_>,
    attribute: &str,
    domain: &str,
    controller: &Assigned<'_>,
    found: &mut Sink<'_>,
) {
    let text = format!(
        "the controller `{}` is to be activated in the {domain} domain, but its `controllerType` is `{}`",
        controller.name.as_deref().unwrap_or(""),
        controller.domains.as_deref().unwrap_or("")
    );
    found
        .about(action, attribute, text)
        .at(controller.node, "the controller");
}
