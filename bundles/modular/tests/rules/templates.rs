//! Templates around the short examples of the rule pages.
//!
//! | `in=` | the example is |
//! |---|---|
//! | (nothing) | everything after the file header |
//! | `act` | the maneuver groups of the only act; `Ego` and `Other` are declared |
//! | `group` | everything after the actors (`Ego`) of the only maneuver group, `Cars` |
//! | `library` | the content of `<SpeedActionTarget>` in a library file, in the group `Drive` for `Veh` |
//! | `libraryAct` | the maneuver groups of a library file |
//! | `libraryAction` | the content of the only `<PrivateAction>` of a library file |

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

macro_rules! vehicle {
    ($name:literal) => {
        concat!(
            "<ScenarioObject name=\"",
            $name,
            "\"><Vehicle name=\"car\" vehicleCategory=\"car\">\n",
            "<BoundingBox><Center x=\"1.4\" y=\"0\" z=\"0.75\"/>",
            "<Dimensions width=\"1.8\" length=\"4.5\" height=\"1.5\"/></BoundingBox>\n",
            "<Performance maxSpeed=\"70\" maxAcceleration=\"8\" maxDeceleration=\"10\"/>\n",
            "<Axles><FrontAxle maxSteering=\"0.5\" wheelDiameter=\"0.6\" trackWidth=\"1.6\" ",
            "positionX=\"2.8\" positionZ=\"0.3\"/>",
            "<RearAxle maxSteering=\"0\" wheelDiameter=\"0.6\" trackWidth=\"1.6\" ",
            "positionX=\"0\" positionZ=\"0.3\"/></Axles></Vehicle></ScenarioObject>\n",
        )
    };
}

macro_rules! at {
    ($name:literal, $x:literal) => {
        concat!(
            "<Private entityRef=\"",
            $name,
            "\"><PrivateAction><TeleportAction><Position>",
            "<WorldPosition x=\"",
            $x,
            "\" y=\"0\"/></Position></TeleportAction></PrivateAction></Private>\n",
        )
    };
}

macro_rules! stop {
    () => {
        concat!(
            "<StopTrigger><ConditionGroup><Condition name=\"End\" delay=\"0\" conditionEdge=\"none\">",
            "<ByValueCondition><SimulationTimeCondition value=\"60\" rule=\"greaterThan\"/></ByValueCondition>",
            "</Condition></ConditionGroup></StopTrigger>\n",
        )
    };
}

macro_rules! now {
    ($name:literal) => {
        concat!(
            "<StartTrigger><ConditionGroup><Condition name=\"", $name, "\" delay=\"0\" conditionEdge=\"none\">",
            "<ByValueCondition><SimulationTimeCondition value=\"1\" rule=\"greaterThan\"/></ByValueCondition>",
            "</Condition></ConditionGroup></StartTrigger>\n",
        )
    };
}

/// A scenario with these groups in its only act.
macro_rules! main {
    ($($groups:expr),* $(,)?) => {
        document!(
            "<RoadNetwork/>\n<Entities>\n", vehicle!("Ego"), vehicle!("Other"), "</Entities>\n",
            "<Storyboard><Init><Actions>\n", at!("Ego", "0"), at!("Other", "50"), "</Actions></Init>\n",
            "<Story name=\"Main\"><Act name=\"Drive\">\n",
            $($groups,)*
            now!("Begin"), "</Act></Story>\n", stop!(), "</Storyboard>\n",
        )
    };
}

/// A library file with these groups in its only act.
macro_rules! library {
    ($($groups:expr),* $(,)?) => {
        document!(
            "<RoadNetwork/>\n<Entities>\n", vehicle!("Veh"), "</Entities>\n",
            "<Storyboard><Init><Actions>\n", at!("Veh", "0"), "</Actions></Init>\n",
            "<Story name=\"Main\"><Act name=\"Library\">\n",
            $($groups,)*
            now!("Begin"), "</Act></Story>\n", stop!(), "</Storyboard>\n",
        )
    };
}

macro_rules! drive {
    ($($action:expr),* $(,)?) => {
        library!(
            "<ManeuverGroup name=\"Drive\" maximumExecutionCount=\"1\">\n",
            "<Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"Veh\"/></Actors>\n",
            "<Maneuver name=\"Move\"><Event name=\"Go\" priority=\"overwrite\"><Action name=\"Do\"><PrivateAction>\n",
            $($action,)*
            "</PrivateAction></Action>\n", now!("Start"), "</Event></Maneuver>\n</ManeuverGroup>\n",
        )
    };
}

/// The templates. The first one is for examples without `in=`.
pub const TEMPLATES: &[Template] = &[
    Template {
        name: "file",
        text: document!("{example}\n"),
    },
    Template {
        name: "act",
        text: main!("{example}\n"),
    },
    Template {
        name: "group",
        text: main!(
            "<ManeuverGroup name=\"Cars\" maximumExecutionCount=\"1\">\n",
            "<Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"Ego\"/></Actors>\n",
            "{example}\n",
            "</ManeuverGroup>\n",
        ),
    },
    Template {
        name: "library",
        text: drive!(
            "<LongitudinalAction><SpeedAction>",
            "<SpeedActionDynamics dynamicsShape=\"step\" value=\"0\" dynamicsDimension=\"time\"/>\n",
            "<SpeedActionTarget>\n",
            "{example}\n",
            "</SpeedActionTarget></SpeedAction></LongitudinalAction>\n",
        ),
    },
    Template {
        name: "libraryAct",
        text: library!("{example}\n"),
    },
    Template {
        name: "libraryAction",
        text: drive!("{example}\n"),
    },
];
