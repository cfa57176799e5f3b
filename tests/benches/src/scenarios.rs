//! Scenarios of any size, as dense as exported ones, without faults.

use std::fmt::Write;

/// Creates an OpenSCENARIO 1.3 scenario of about `bytes` bytes: one vehicle that follows long
/// trajectories.
pub fn scenario(bytes: usize) -> String {
    let mut text = String::with_capacity(bytes + 8192);
    text.push_str(HEAD);
    let mut number = 0;
    while text.len() + TAIL.len() < bytes || number == 0 {
        event(&mut text, number);
        number += 1;
    }
    text.push_str(TAIL);
    text
}

const HEAD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<OpenSCENARIO>
  <FileHeader revMajor="1" revMinor="3" date="2026-03-02T08:00:00" description="generated" author="qcbus"/>
  <CatalogLocations/>
  <RoadNetwork>
    <LogicFile filepath="town.xodr"/>
  </RoadNetwork>
  <Entities>
    <ScenarioObject name="Ego">
      <Vehicle name="car" vehicleCategory="car">
        <BoundingBox>
          <Center x="1.4" y="0.0" z="0.9"/>
          <Dimensions width="2.0" length="5.0" height="1.8"/>
        </BoundingBox>
        <Performance maxSpeed="69.4" maxAcceleration="10.0" maxDeceleration="10.0"/>
        <Axles>
          <FrontAxle maxSteering="0.5" wheelDiameter="0.6" trackWidth="1.8" positionX="3.1" positionZ="0.3"/>
          <RearAxle maxSteering="0.0" wheelDiameter="0.6" trackWidth="1.8" positionX="0.0" positionZ="0.3"/>
        </Axles>
        <Properties/>
      </Vehicle>
    </ScenarioObject>
  </Entities>
  <Storyboard>
    <Init><Actions/></Init>
    <Story name="story">
      <Act name="act">
        <ManeuverGroup name="group" maximumExecutionCount="1">
          <Actors selectTriggeringEntities="false"><EntityRef entityRef="Ego"/></Actors>
          <Maneuver name="maneuver">
"#;

const TAIL: &str = "          </Maneuver>
        </ManeuverGroup>
      </Act>
    </Story>
    <StopTrigger/>
  </Storyboard>
</OpenSCENARIO>
";

/// Number of points of one trajectory.
const POINTS: u32 = 40;

fn event(text: &mut String, number: u32) {
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "            <Event name=\"Event {number}\" priority=\"override\">\n              <Action name=\"Action {number}\">\n                \
         <PrivateAction><RoutingAction><FollowTrajectoryAction>\n                  <TrajectoryRef><Trajectory name=\"Trajectory {number}\" closed=\"false\">\n                    <Shape><Polyline>"
    );
    for point in 0..POINTS {
        let time = f64::from(point) / 10.0;
        let x = f64::from(number) + time * 13.888_888_9;
        let _ = writeln!(
            text,
            "                      <Vertex time=\"{time:.1}\"><Position><WorldPosition x=\"{x:.12}\" y=\"{:.12}\" z=\"0.0\" h=\"{:.12e}\"/></Position></Vertex>",
            x * 0.031_4,
            time / 7.0
        );
    }
    let _ = writeln!(
        text,
        "                    </Polyline></Shape>\n                  </Trajectory></TrajectoryRef>\n                  \
         <TimeReference><None/></TimeReference>\n                  <TrajectoryFollowingMode followingMode=\"position\"/>\n                \
         </FollowTrajectoryAction></RoutingAction></PrivateAction>\n              </Action>\n              <StartTrigger>\n                \
         <ConditionGroup><Condition name=\"c\" delay=\"0\" conditionEdge=\"none\"><ByValueCondition><SimulationTimeCondition value=\"{number}.5\" rule=\"greaterThan\"/></ByValueCondition></Condition></ConditionGroup>\n              \
         </StartTrigger>\n            </Event>"
    );
}
