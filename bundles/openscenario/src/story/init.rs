//! The actions of `Init`, by entity.

use qcbus_opendrive::RoadMap;
use qcbus_opendrive::geometry::wrap_angle;

use super::inner;
use crate::places::Origins;
use crate::queries::element::Element;
use crate::queries::init::{InitAction, init_actions};
use crate::queries::scenario::Scenario;
use crate::wording::short;

/// Start of an entity.
#[derive(Debug)]
pub struct Opening {
    /// Name of the entity.
    pub entity: String,
    /// Its position. `None` if `Init` gives none.
    pub position: Option<StartPosition>,
    /// Its speed in m/s, if it is an absolute one.
    pub speed: Option<f64>,
    /// Kinds of its other actions.
    pub actions: Vec<String>,
}

/// Position of an entity at the start.
#[derive(Debug)]
pub struct StartPosition {
    /// The position as it is written, such as "road `1`, lane `-1`, s 50 m".
    pub written: String,
    /// `x` and `y` in m and the heading in rad in (-π, π], if they are known.
    pub world: Option<[f64; 3]>,
}

/// Returns the starts of all entities, and the global actions.
pub(super) fn read(scenario: &Scenario<'_>) -> (Vec<Opening>, Vec<String>) {
    let openings = scenario
        .on_map(|map| openings(scenario, Some(map)))
        .unwrap_or_else(|| openings(scenario, None));
    let actions = scenario.root().path(&["Storyboard", "Init", "Actions"]);
    let globals = actions.into_iter().flat_map(|it| it.children());
    let globals = globals.filter(|it| !it.is("Private"));
    (openings, globals.filter_map(inner).collect())
}

fn openings(scenario: &Scenario<'_>, map: Option<&RoadMap<'_>>) -> Vec<Opening> {
    let origins = Origins::of(scenario, map);
    let actions = init_actions(scenario);
    let entities = scenario.entities().objects().iter();
    let openings = entities.map(|entity| {
        let own = actions.iter();
        let own = own.filter(|it| it.entities.iter().any(|name| name == entity.name()));
        opening(entity.name(), &own.collect::<Vec<_>>(), &origins)
    });
    openings.collect()
}

fn opening(
    entity: &str,
    actions: &[&InitAction<'_, '_>],
    origins: &Origins<'_, '_, '_, '_>,
) -> Opening {
    let mut starts = origins.starts.iter().enumerate();
    let last = starts.rfind(|(_, start)| start.name == entity);
    let speed = |one: &&InitAction<'_, '_>| {
        let path = ["SpeedActionTarget", "AbsoluteTargetSpeed"];
        one.action.path(&path)?.number("value")
    };
    let others = actions
        .iter()
        .filter(|it| speed(it).is_none() && !it.action.is("TeleportAction"));
    Opening {
        entity: entity.to_owned(),
        position: last.map(|(at, start)| StartPosition {
            written: written(start.position),
            world: origins
                .place(at)
                .and_then(|it| Some([it.x, it.y, wrap_angle(it.heading)?])),
        }),
        speed: actions.iter().filter_map(speed).next_back(),
        actions: others.map(|it| it.action.name().to_owned()).collect(),
    }
}

/// Describes a position as it is written.
fn written(position: Element<'_, '_>) -> String {
    let text = |name: &str| Some(format!("`{}`", position.text(name)?));
    let number = |name: &str| Some(format!("{name} {} m", short(position.number(name)?)));
    let parts = match position.name() {
        "WorldPosition" => vec![number("x"), number("y"), number("z")],
        "LanePosition" => vec![
            text("roadId").map(|it| format!("road {it}")),
            text("laneId").map(|it| format!("lane {it}")),
            number("s"),
            number("offset"),
        ],
        "RoadPosition" => vec![
            text("roadId").map(|it| format!("road {it}")),
            number("s"),
            number("t"),
        ],
        other => {
            let lanes = position.integer("dLane");
            let from = text("entityRef").map_or_else(String::new, |it| format!(" from {it}"));
            let mut parts = vec![
                Some(format!("`{other}`{from}")),
                lanes.map(|by| format!("dLane {by}")),
            ];
            parts.extend(["ds", "dt", "dx", "dy", "dz", "offset"].map(number));
            parts
        }
    };
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    match parts.is_empty() {
        true => format!("`{}` with unknown values", position.name()),
        false => parts.join(", "),
    }
}
