use crate::families::references::quoted;
use crate::prelude::*;
use foldhash::{HashMap, HashSet};

pub const RULE: Rule<Scene> = Rule {
    versions: "1.3.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // Entities that are already reported, because actions may name the same pair again.
    let mut told = Told::default();
    // The vehicle that tows each trailer from the start, with the element that states it.
    let mut drawn: HashMap<&str, (&str, Element<'_, '_>)> = HashMap::default();
    for towing in scenario.entities().objects() {
        let Some(vehicle) = towing.object(scenario) else {
            continue;
        };
        let Some((trailer, at, attribute)) = vehicle.child("Trailer").and_then(trailer_of) else {
            continue;
        };
        told.kind(trailer, at, attribute, found);
        told.coupling(towing, trailer, at, attribute, found);
        if let Some((other, first)) = drawn.get(trailer.name()) {
            let text = format!(
                "`{}` tows the trailer `{}`, but `{other}` already tows it",
                towing.name(),
                trailer.name()
            );
            found
                .about(at, attribute, text)
                .at(first.node(), "the other vehicle's trailer");
        } else {
            drawn.insert(trailer.name(), (towing.name(), at));
        }
    }
    for towing in scenario.entities().objects() {
        circle(towing, &mut drawn, found);
    }
    for action in scenario.elements_everywhere("ConnectTrailerAction") {
        connect(action, &mut told, found);
    }
    disconnect(scenario, found);
}

/// Reports vehicles that disconnect a trailer but never tow one.
fn disconnect(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(towing) = towing(scenario) else {
        return;
    };
    for action in scenario.elements_everywhere("DisconnectTrailerAction") {
        for name in Actors::of(action)
            .and_then(|actors| actors.names())
            .into_iter()
            .flatten()
        {
            let entity = scenario.entities().object(&name);
            let is_known = entity.is_some_and(|entity| {
                !matches!(entity.kind(), EntityKind::External | EntityKind::Unknown)
            });
            if is_known && !towing.contains(&*name) {
                let text = format!(
                    "`{name}` is to disconnect its trailer, but has none: its `Vehicle` has no trailer, and no \
                     `ConnectTrailerAction` connects one"
                );
                found.about(action, "", text).level(Level::Warning);
            }
        }
    }
}

/// Returns the names of all vehicles that tow a trailer at some time. Returns `None` if this is
/// unknown.
fn towing(scenario: &Scenario<'_>) -> Option<HashSet<String>> {
    if !scenario.storyboard().is_complete() {
        return None;
    }
    let mut towing: HashSet<String> = HashSet::default();
    for entity in scenario.entities().objects() {
        let vehicle = entity.object(scenario);
        if vehicle.is_some_and(|vehicle| vehicle.child("Trailer").is_some()) {
            towing.insert(entity.name().to_owned());
        }
    }
    for action in scenario.elements_everywhere("ConnectTrailerAction") {
        for name in Actors::of(action)?.names()? {
            for entity in scenario.entities().expand(&name)? {
                towing.insert(entity.name().to_owned());
            }
        }
    }
    Some(towing)
}

/// Returns the trailer that a vehicle's `Trailer` names or contains, and the attribute that states
/// it.
fn trailer_of<'m, 'd>(
    block: Element<'m, 'd>,
) -> Option<(&'m Entity<'d>, Element<'m, 'd>, &'static str)> {
    let (at, attribute) = match block.child("TrailerRef") {
        Some(reference) => (reference, "entityRef"),
        None => (block.child("Trailer")?, "name"),
    };
    let name = at.text(attribute)?;
    let scenario = block.scenario();
    let entity = scenario.entities().object(&name)?;
    // A name that is already taken leads to another entity. This is a separate fault.
    let is_it = at.is("TrailerRef") || entity.element(scenario).node() == at.node();
    is_it.then_some((entity, at, attribute))
}

/// Reported pairs of a vehicle and its trailer. Entities that are no trailers have an empty second
/// name.
#[derive(Default)]
struct Told<'m>(HashSet<(&'m str, &'m str)>);

impl<'m> Told<'m> {
    fn kind<'d>(
        &mut self,
        trailer: &'m Entity<'d>,
        at: Element<'m, 'd>,
        attribute: &str,
        found: &mut Sink<'_>,
    ) {
        let is_other = matches!(
            trailer.kind(),
            EntityKind::Pedestrian | EntityKind::MiscObject
        );
        if is_other && self.0.insert((trailer.name(), "")) {
            let text = format!(
                "the trailer {} is a `{}`, but must be a `Vehicle`",
                quoted(at, attribute, trailer.name()),
                trailer.kind().element()
            );
            let node = trailer.element(at.scenario()).node();
            found.about(at, attribute, text).at(node, "the entity");
        }
    }

    /// Reports a missing hitch or coupler. The two parts define where vehicle and trailer are
    /// joined.
    fn coupling<'d>(
        &mut self,
        towing: &'m Entity<'d>,
        trailer: &'m Entity<'d>,
        at: Element<'m, 'd>,
        attribute: &str,
        found: &mut Sink<'_>,
    ) {
        let scenario = at.scenario();
        let lacks = |entity: &Entity<'d>, part: &str| {
            let vehicle = entity
                .object(scenario)
                .filter(|object| object.is("Vehicle"));
            vehicle.is_some_and(|vehicle| vehicle.child(part).is_none())
        };
        let mut missing = Vec::new();
        if lacks(towing, "TrailerHitch") {
            missing.push(format!("`{}` has no `TrailerHitch`", towing.name()));
        }
        if lacks(trailer, "TrailerCoupler") {
            missing.push(format!(
                "the trailer `{}` has no `TrailerCoupler`",
                trailer.name()
            ));
        }
        if !missing.is_empty() && self.0.insert((towing.name(), trailer.name())) {
            let text = format!(
                "{}; where the two are joined depends on the simulator",
                missing.join(" and ")
            );
            found.about(at, attribute, text).level(Level::Warning);
        }
    }
}

/// Reports a vehicle that tows itself, directly or through others.
fn circle(
    towing: &Entity<'_>,
    drawn: &mut HashMap<&str, (&str, Element<'_, '_>)>,
    found: &mut Sink<'_>,
) {
    let mut name = towing.name();
    let mut steps = 0;
    while let Some((by, _)) = drawn.get(name) {
        name = by;
        steps += 1;
        if name == towing.name() {
            break;
        }
        if steps > drawn.len() {
            return;
        }
    }
    if steps == 0 || name != towing.name() {
        return;
    }
    if let Some((_, at)) = drawn.remove(towing.name()) {
        let text = format!(
            "`{}` is its own trailer, directly or through others",
            towing.name()
        );
        found.about(
            at,
            if at.is("TrailerRef") {
                "entityRef"
            } else {
                "name"
            },
            text,
        );
    }
}

fn connect<'m, 'd>(action: Element<'m, 'd>, told: &mut Told<'m>, found: &mut Sink<'_>) {
    let scenario = action.scenario();
    let Some(name) = action.text("trailerRef") else {
        return;
    };
    let Some(trailer) = scenario.entities().object(&name) else {
        return;
    };
    told.kind(trailer, action, "trailerRef", found);
    let actors = Actors::of(action).and_then(|actors| actors.names());
    for actor in actors.into_iter().flatten() {
        if actor == name {
            let text = format!("the action connects `{name}` to itself as its trailer");
            found.about(action, "trailerRef", text);
        } else if let Some(towing) = scenario.entities().object(&actor) {
            told.coupling(towing, trailer, action, "trailerRef", found);
        }
    }
}
