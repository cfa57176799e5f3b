use crate::families::casts::{Cast, Casts};
use crate::families::references::quoted;
use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Scene> = Rule {
    uids: &[
        "asam.net:xosc:1.1.0:general.references_to_scenario_object",
        "asam.net:xosc:1.2.0:reference_control.references_to_scenario_object",
    ],
    level: Level::Warning,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

/// Actions of vehicles and pedestrians, by the standard's table of entity type constraints.
const OF_THE_LIVING: &[&str] = &[
    "ActivateControllerAction",
    "AssignControllerAction",
    "AssignRouteAction",
    "LateralDistanceAction",
    "LaneChangeAction",
    "LaneOffsetAction",
    "LongitudinalDistanceAction",
    "SpeedAction",
    "SpeedProfileAction",
    "SynchronizeAction",
];
/// Actions of vehicles only.
const OF_VEHICLES: &[&str] = &["OverrideControllerValueAction"];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut casts = Casts::default();
    let mut verdicts = Verdicts::default();
    let kinds = [EntityKind::Vehicle, EntityKind::Pedestrian];
    for action in OF_THE_LIVING {
        for action in scenario.elements_everywhere(action) {
            if let Some(cast) = casts.of(action) {
                let verdict = verdicts.of(scenario, &cast, &kinds);
                say(action, verdict, "vehicles and pedestrians", found);
            }
        }
    }
    for action in OF_VEHICLES {
        for action in scenario.elements_everywhere(action) {
            if let Some(cast) = casts.of(action) {
                let verdict = verdicts.of(scenario, &cast, &[EntityKind::Vehicle]);
                say(action, verdict, "vehicles", found);
            }
        }
    }
    for action in scenario.elements_everywhere("SynchronizeAction") {
        master(action, found);
    }
}

/// Fault of the actors of a group, for actions of some kinds of entities.
#[derive(Clone)]
enum Verdict<'m, 'd> {
    Fine,
    /// An actor of a wrong kind. It is named itself or is a member of the named selection.
    Wrong {
        actor: Element<'m, 'd>,
        named: String,
        wrong: &'m Entity<'d>,
    },
    /// A selection acts as one and must not mix vehicles and pedestrians.
    Mixed {
        actor: Element<'m, 'd>,
        named: String,
    },
}

/// The verdicts by group and number of allowed kinds. All actions of a group have the same verdict.
#[derive(Default)]
struct Verdicts<'m, 'd> {
    known: HashMap<(u32, usize), Verdict<'m, 'd>>,
}

impl<'m, 'd> Verdicts<'m, 'd> {
    fn of(
        &mut self,
        scenario: &'m Scenario<'d>,
        cast: &Cast<'m, 'd>,
        allowed: &[EntityKind],
    ) -> &Verdict<'m, 'd> {
        let known = self.known.entry((cast.at, allowed.len()));
        known.or_insert_with(|| judge(scenario, cast, allowed))
    }
}

fn judge<'m, 'd>(
    scenario: &'m Scenario<'d>,
    cast: &Cast<'m, 'd>,
    allowed: &[EntityKind],
) -> Verdict<'m, 'd> {
    let mut named: Vec<_> = cast
        .by_name
        .iter()
        .map(|(name, actor)| (name, *actor))
        .collect();
    named.sort_by_key(|(_, actor)| actor.node().offset());
    let mut verdict = Verdict::Fine;
    for (name, actor) in named {
        let Some(objects) = scenario.entities().expand(name) else {
            continue;
        };
        if let Some(wrong) = objects.iter().find(|one| is_wrong(one, allowed)) {
            return Verdict::Wrong {
                actor,
                named: name.clone(),
                wrong,
            };
        }
        let has = |kind| objects.iter().any(|one| one.kind() == kind);
        if has(EntityKind::Vehicle) && has(EntityKind::Pedestrian) {
            verdict = Verdict::Mixed {
                actor,
                named: name.clone(),
            };
        }
    }
    verdict
}

fn say(action: Element<'_, '_>, verdict: &Verdict<'_, '_>, who: &str, found: &mut Sink<'_>) {
    let what = action.name();
    match verdict {
        Verdict::Fine => {}
        Verdict::Wrong {
            actor,
            named,
            wrong,
        } => {
            let (name, kind) = (wrong.name(), wrong.kind().element());
            let of = if named == name { "the actor " } else { "" };
            let selection = match named == name {
                true => String::new(),
                false => format!(" of the selection `{named}`"),
            };
            let text = format!("{of}`{name}`{selection} is a `{kind}`, but `{what}` is for {who}");
            let node = wrong.element(actor.scenario()).node();
            found
                .about(action, "", text)
                .at(actor.node(), "the actor")
                .at(node, "the entity");
        }
        Verdict::Mixed { actor, named } => {
            let text = format!(
                "the selection `{named}` has vehicles and pedestrians, but for a `{what}` it may have only one \
                 of the two"
            );
            found
                .about(action, "", text)
                .level(Level::Information)
                .at(actor.node(), "the actor");
        }
    }
}

/// Checks whether the kind is not allowed. Only the simulator knows an external object.
fn is_wrong(entity: &Entity<'_>, allowed: &[EntityKind]) -> bool {
    let known = !matches!(entity.kind(), EntityKind::External | EntityKind::Unknown);
    known && !allowed.contains(&entity.kind())
}

fn master(action: Element<'_, '_>, found: &mut Sink<'_>) {
    let Some(name) = action.text("masterEntityRef") else {
        return;
    };
    let entities = action.scenario().entities();
    let Some(master) = entities.object(&name) else {
        return;
    };
    if master.kind() == EntityKind::MiscObject {
        let text = format!(
            "the master {} is a `MiscObject`, but only vehicles and pedestrians can move to a position",
            quoted(action, "masterEntityRef", &name)
        );
        let node = master.element(action.scenario()).node();
        found
            .about(action, "masterEntityRef", text)
            .at(node, "the entity");
    }
}
