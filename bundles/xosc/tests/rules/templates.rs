//! Templates for the short examples of the pages: minimal scenarios into which an example is
//! inserted. The rest of each template is valid. Two cars, `Ego` and `Other`, start 50 m apart, and
//! the run ends after a minute.
//!
//! | `in=` | the example is |
//! |---|---|
//! | (nothing) | what follows the file header |
//! | `parameters` | the content of the scenario's `<ParameterDeclarations>` |
//! | `variables` | the content of `<VariableDeclarations>` (1.2 and later) |
//! | `monitors` | the content of `<MonitorDeclarations>` (1.3 and later) |
//! | `network` | the content of `<RoadNetwork>` |
//! | `entities` | the content of `<Entities>` |
//! | `object` | the content of the scenario object `Ego` |
//! | `vehicle` | what follows `<Axles>` in the vehicle of `Ego` |
//! | `init` | the content of `<Init><Actions>` |
//! | `position` | the content of a `<Position>` to which `Ego` is teleported in `<Init>` |
//! | `environment` | the content of an `<Environment>` in `<Init>` |
//! | `storyboard` | what follows `<Init>` in the storyboard: stories and the stop trigger |
//! | `act` | the content of the only act |
//! | `group` | the content of a maneuver group: actors, references to catalogs, maneuvers |
//! | `event` | the content of an event: actions and the start trigger |
//! | `action` | the content of a `<PrivateAction>` of `Ego` |
//! | `global` | the content of a `<GlobalAction>` |
//! | `conditions` | the content of the `<ConditionGroup>` that starts an event of `Ego` |
//! | `condition` | the content of the only condition there |
//! | `entityCondition` | the content of an `<EntityCondition>` about `Ego` |
//! | `shape` | the content of a `<Shape>`: of a trajectory that `Ego` follows without timing |
//! | `route` | the content of a `<Route>` that is assigned to `Ego` |
//! | `mapPosition` | like `position`, in a scenario on the map `map.xodr` |
//! | `mapRoute` | like `route`, on the map `map.xodr` |
//! | `mapSignals` | the content of `<TrafficSignals>`, on the map `map.xodr` |
//! | `mapEvent` | like `event`, on the map `map.xodr`, with the traffic signal controller `crossing` and its phases `go` and `stop` |
//! | `catalog` | the entries of a catalog |
//! | `distribution` | the content of a `<ParameterValueDistribution>` |

use qcbus_rule_tests::pages::Template;

macro_rules! document {
    ($($text:expr),* $(,)?) => {
        concat!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenSCENARIO>\n",
            "<FileHeader revMajor=\"{major}\" revMinor=\"{minor}\" date=\"2026-01-01T00:00:00\" ",
            "description=\"example\" author=\"qcbus\"/>\n",
            $($text,)*
            "</OpenSCENARIO>\n"
        )
    };
}

macro_rules! axles {
    () => {
        concat!(
            "<BoundingBox><Center x=\"1.4\" y=\"0\" z=\"0.75\"/>",
            "<Dimensions width=\"1.8\" length=\"4.5\" height=\"1.5\"/></BoundingBox>\n",
            "<Performance maxSpeed=\"70\" maxAcceleration=\"8\" maxDeceleration=\"10\"/>\n",
            "<Axles><FrontAxle maxSteering=\"0.5\" wheelDiameter=\"0.6\" trackWidth=\"1.6\" ",
            "positionX=\"2.8\" positionZ=\"0.3\"/>",
            "<RearAxle maxSteering=\"0\" wheelDiameter=\"0.6\" trackWidth=\"1.6\" ",
            "positionX=\"0\" positionZ=\"0.3\"/></Axles>\n",
        )
    };
}

macro_rules! vehicle {
    ($name:expr, $rest:expr) => {
        concat!(
            "<Vehicle name=\"",
            $name,
            "\" vehicleCategory=\"car\">\n",
            axles!(),
            $rest,
            "</Vehicle>\n"
        )
    };
}

macro_rules! car {
    ($name:expr) => {
        concat!(
            "<ScenarioObject name=\"",
            $name,
            "\">\n",
            vehicle!("car", "<Properties/>\n"),
            "</ScenarioObject>\n"
        )
    };
}

macro_rules! cars {
    () => {
        concat!("<Entities>\n", car!("Ego"), car!("Other"), "</Entities>\n")
    };
}

macro_rules! place {
    ($name:expr, $x:expr) => {
        concat!(
            "<Private entityRef=\"",
            $name,
            "\"><PrivateAction><TeleportAction><Position>",
            "<WorldPosition x=\"",
            $x,
            "\" y=\"0\"/></Position></TeleportAction></PrivateAction></Private>\n"
        )
    };
}

macro_rules! init {
    () => {
        concat!(
            "<Init><Actions>\n",
            place!("Ego", "0"),
            place!("Other", "50"),
            "</Actions></Init>\n"
        )
    };
}

macro_rules! after {
    ($name:expr, $seconds:expr) => {
        concat!(
            "<ConditionGroup><Condition name=\"",
            $name,
            "\" delay=\"0\" conditionEdge=\"none\">",
            "<ByValueCondition><SimulationTimeCondition value=\"",
            $seconds,
            "\" rule=\"greaterThan\"/>",
            "</ByValueCondition></Condition></ConditionGroup>"
        )
    };
}

macro_rules! stop {
    () => {
        concat!("<StopTrigger>", after!("end", "60"), "</StopTrigger>\n")
    };
}

macro_rules! start {
    () => {
        concat!("<StartTrigger>", after!("begin", "1"), "</StartTrigger>\n")
    };
}

macro_rules! on_map {
    ($($text:expr),* $(,)?) => {
        concat!("<RoadNetwork>\n<LogicFile filepath=\"map.xodr\"/>\n", $($text,)* "</RoadNetwork>\n")
    };
}

/// Builds a scenario with custom content between the cars and the end.
macro_rules! scenario {
    ($($storyboard:expr),* $(,)?) => {
        document!(
            "<CatalogLocations/>\n<RoadNetwork/>\n", cars!(), "<Storyboard>\n", $($storyboard,)* "</Storyboard>\n"
        )
    };
}

macro_rules! act {
    ($($text:expr),* $(,)?) => {
        scenario!(init!(), "<Story name=\"Main\">\n<Act name=\"Drive\">\n", $($text,)* "</Act>\n</Story>\n", stop!())
    };
}

macro_rules! group {
    ($($text:expr),* $(,)?) => {
        act!(
            "<ManeuverGroup name=\"Cars\" maximumExecutionCount=\"1\">\n", $($text,)* "</ManeuverGroup>\n", start!()
        )
    };
}

macro_rules! event {
    ($($text:expr),* $(,)?) => {
        group!(
            "<Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"Ego\"/></Actors>\n",
            "<Maneuver name=\"Move\">\n<Event name=\"Now\" priority=\"parallel\">\n", $($text,)*
            "</Event>\n</Maneuver>\n"
        )
    };
}

macro_rules! action {
    ($($text:expr),* $(,)?) => {
        event!("<Action name=\"Do\"><PrivateAction>\n", $($text,)* "</PrivateAction></Action>\n", start!())
    };
}

macro_rules! conditions {
    ($($text:expr),* $(,)?) => {
        event!(
            "<Action name=\"Do\"><PrivateAction><VisibilityAction graphics=\"true\" sensors=\"true\" ",
            "traffic=\"true\"/></PrivateAction></Action>\n",
            "<StartTrigger><ConditionGroup>\n", $($text,)* "</ConditionGroup></StartTrigger>\n"
        )
    };
}

macro_rules! condition {
    ($($text:expr),* $(,)?) => {
        conditions!(
            "<Condition name=\"When\" delay=\"0\" conditionEdge=\"none\">\n", $($text,)* "</Condition>\n"
        )
    };
}

macro_rules! by_name {
    ($($name:literal: $text:expr,)*) => {
        &[$(Template { name: $name, text: $text },)*]
    };
}

/// The templates. The first one is the default for an example that names none.
pub const TEMPLATES: &[Template] = by_name![
    "scenario": document!("{example}\n"),
    "parameters": document!(
        "<ParameterDeclarations>\n{example}\n</ParameterDeclarations>\n<CatalogLocations/>\n<RoadNetwork/>\n",
        cars!(), "<Storyboard>\n", init!(), stop!(), "</Storyboard>\n"
    ),
    "variables": document!(
        "<VariableDeclarations>\n{example}\n</VariableDeclarations>\n<CatalogLocations/>\n<RoadNetwork/>\n",
        cars!(), "<Storyboard>\n", init!(), stop!(), "</Storyboard>\n"
    ),
    "monitors": document!(
        "<MonitorDeclarations>\n{example}\n</MonitorDeclarations>\n<CatalogLocations/>\n<RoadNetwork/>\n",
        cars!(), "<Storyboard>\n", init!(), stop!(), "</Storyboard>\n"
    ),
    "network": document!(
        "<CatalogLocations/>\n<RoadNetwork>\n{example}\n</RoadNetwork>\n",
        cars!(), "<Storyboard>\n", init!(), stop!(), "</Storyboard>\n"
    ),
    "entities": document!(
        "<CatalogLocations/>\n<RoadNetwork/>\n<Entities>\n{example}\n</Entities>\n",
        "<Storyboard>\n<Init><Actions/></Init>\n", stop!(), "</Storyboard>\n"
    ),
    "object": document!(
        "<CatalogLocations/>\n<RoadNetwork/>\n<Entities>\n<ScenarioObject name=\"Ego\">\n{example}\n",
        "</ScenarioObject>\n", car!("Other"), "</Entities>\n<Storyboard>\n", init!(), stop!(), "</Storyboard>\n"
    ),
    "vehicle": document!(
        "<CatalogLocations/>\n<RoadNetwork/>\n<Entities>\n<ScenarioObject name=\"Ego\">\n",
        vehicle!("car", "{example}\n"), "</ScenarioObject>\n", car!("Other"), "</Entities>\n<Storyboard>\n",
        init!(), stop!(), "</Storyboard>\n"
    ),
    "init": scenario!("<Init><Actions>\n{example}\n</Actions></Init>\n", stop!()),
    "position": scenario!(
        "<Init><Actions>\n", place!("Other", "50"),
        "<Private entityRef=\"Ego\"><PrivateAction><TeleportAction><Position>\n{example}\n",
        "</Position></TeleportAction></PrivateAction></Private>\n</Actions></Init>\n", stop!()
    ),
    "environment": scenario!(
        "<Init><Actions>\n<GlobalAction><EnvironmentAction><Environment name=\"Day\">\n{example}\n",
        "</Environment></EnvironmentAction></GlobalAction>\n", place!("Ego", "0"), place!("Other", "50"),
        "</Actions></Init>\n", stop!()
    ),
    "storyboard": document!(
        "<CatalogLocations/>\n<RoadNetwork/>\n", cars!(), "<Storyboard>\n", init!(), "{example}\n</Storyboard>\n"
    ),
    "act": act!("{example}\n"),
    "group": group!("{example}\n"),
    "event": event!("{example}\n"),
    "action": action!("{example}\n"),
    "global": event!("<Action name=\"Do\"><GlobalAction>\n{example}\n</GlobalAction></Action>\n", start!()),
    "conditions": conditions!("{example}\n"),
    "condition": condition!("{example}\n"),
    "entityCondition": condition!(
        "<ByEntityCondition><TriggeringEntities triggeringEntitiesRule=\"any\"><EntityRef entityRef=\"Ego\"/>",
        "</TriggeringEntities><EntityCondition>\n{example}\n</EntityCondition></ByEntityCondition>\n"
    ),
    "shape": action!(
        "<RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name=\"Path\" closed=\"false\">\n",
        "<Shape>\n{example}\n</Shape>\n</Trajectory></TrajectoryRef><TimeReference><None/></TimeReference>",
        "<TrajectoryFollowingMode followingMode=\"position\"/></FollowTrajectoryAction></RoutingAction>\n"
    ),
    "route": action!(
        "<RoutingAction><AssignRouteAction><Route name=\"Way\" closed=\"false\">\n{example}\n",
        "</Route></AssignRouteAction></RoutingAction>\n"
    ),
    "mapPosition": document!(
        "<CatalogLocations/>\n", on_map!(), cars!(), "<Storyboard>\n<Init><Actions>\n", place!("Other", "50"),
        "<Private entityRef=\"Ego\"><PrivateAction><TeleportAction><Position>\n{example}\n",
        "</Position></TeleportAction></PrivateAction></Private>\n</Actions></Init>\n", stop!(), "</Storyboard>\n"
    ),
    "mapRoute": document!(
        "<CatalogLocations/>\n", on_map!(), cars!(), "<Storyboard>\n<Init><Actions>\n", place!("Other", "50"),
        "<Private entityRef=\"Ego\"><PrivateAction><RoutingAction><AssignRouteAction>",
        "<Route name=\"Way\" closed=\"false\">\n{example}\n</Route></AssignRouteAction></RoutingAction>",
        "</PrivateAction></Private>\n</Actions></Init>\n", stop!(), "</Storyboard>\n"
    ),
    "mapSignals": document!(
        "<CatalogLocations/>\n", on_map!("<TrafficSignals>\n{example}\n</TrafficSignals>\n"), cars!(),
        "<Storyboard>\n", init!(), stop!(), "</Storyboard>\n"
    ),
    "mapEvent": document!(
        "<CatalogLocations/>\n",
        on_map!(
            "<TrafficSignals><TrafficSignalController name=\"crossing\">",
            "<Phase name=\"go\" duration=\"20\"/><Phase name=\"stop\" duration=\"10\"/>",
            "</TrafficSignalController></TrafficSignals>\n"
        ),
        cars!(), "<Storyboard>\n", init!(), "<Story name=\"Main\">\n<Act name=\"Drive\">\n",
        "<ManeuverGroup name=\"Cars\" maximumExecutionCount=\"1\">\n",
        "<Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"Ego\"/></Actors>\n",
        "<Maneuver name=\"Move\">\n<Event name=\"Now\" priority=\"parallel\">\n{example}\n</Event>\n",
        "</Maneuver>\n</ManeuverGroup>\n", start!(), "</Act>\n</Story>\n", stop!(), "</Storyboard>\n"
    ),
    "catalog": document!("<Catalog name=\"examples\">\n{example}\n</Catalog>\n"),
    "distribution": document!("<ParameterValueDistribution>\n{example}\n</ParameterValueDistribution>\n"),
];
