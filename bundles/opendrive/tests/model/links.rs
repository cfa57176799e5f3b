//! Tests of connected road ends and lane ends, in a junction with a road that enters it twice.

use crate::common::with_map;
use qcbus_opendrive::{ContactPoint, RoadEnd, RoadMap};

/// Road `in` meets junction `j` at its end, road `out` at its start. Road `c` connects them. Road
/// `loop` begins and ends at the junction, and connection 2 names it through `d`.
const MAP: &str = r#"
<road id="in" length="10"><link><successor elementType="junction" elementId="j"/></link>
  <planView><geometry s="0" x="0" y="0" hdg="0" length="10"><line/></geometry></planView>LANES</road>
<road id="c" length="10" junction="j"><link>
    <predecessor elementType="road" elementId="in" contactPoint="end"/>
    <successor elementType="road" elementId="out" contactPoint="start"/></link>
  <planView><geometry s="0" x="10" y="0" hdg="0" length="10"><line/></geometry></planView>LINKED</road>
<road id="out" length="10"><link><predecessor elementType="junction" elementId="j"/></link>
  <planView><geometry s="0" x="20" y="0" hdg="0" length="10"><line/></geometry></planView>LANES</road>
<road id="loop" length="100"><link><predecessor elementType="junction" elementId="j"/>
    <successor elementType="junction" elementId="j"/></link>
  <planView><geometry s="0" x="20" y="0" hdg="0" length="30"><line/></geometry></planView>LANES</road>
<road id="d" length="10" junction="j">
  <planView><geometry s="0" x="50.2" y="0" hdg="0" length="10"><line/></geometry></planView>LANES</road>
<junction id="j">
  <connection id="1" incomingRoad="in" connectingRoad="c" contactPoint="start"><laneLink from="-1" to="-1"/></connection>
  <connection id="2" incomingRoad="loop" connectingRoad="d" contactPoint="start"><laneLink from="-1" to="-1"/></connection>
  <connection id="3" incomingRoad="nowhere" connectingRoad="d" contactPoint="start"/>
</junction>"#;

fn map<T>(test: impl FnOnce(&RoadMap<'_>) -> T) -> T {
    let lane = |link: &str| {
        format!(
            r#"<lanes><laneSection s="0"><center><lane id="0"/></center><right><lane id="-1">{link}
            <width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right></laneSection></lanes>"#
        )
    };
    let linked = lane(r#"<link><predecessor id="-1"/><successor id="-1"/></link>"#);
    with_map(
        &MAP.replace("LANES", &lane("")).replace("LINKED", &linked),
        test,
    )
}

fn neighbours(map: &RoadMap<'_>, id: &str, end: ContactPoint) -> Vec<(String, ContactPoint)> {
    let ends = map.neighbours(map.road(id).unwrap(), end);
    let name = |end: &RoadEnd| (map.roads()[end.road].id().to_owned(), end.end);
    ends.iter().map(name).collect()
}

#[test]
fn neighbours_come_from_links_and_connections_of_both_sides() {
    use ContactPoint::{End, Start};
    map(|map| {
        assert_eq!(neighbours(map, "in", End), [("c".to_owned(), Start)]);
        assert_eq!(neighbours(map, "in", Start), []);
        assert_eq!(neighbours(map, "c", Start), [("in".to_owned(), End)]);
        assert_eq!(neighbours(map, "c", End), [("out".to_owned(), Start)]);
        assert_eq!(neighbours(map, "out", Start), [("c".to_owned(), End)]);
        // Both ends of the loop meet the junction, and the nearer one is used.
        assert_eq!(neighbours(map, "d", Start), [("loop".to_owned(), End)]);
    });
}

#[test]
fn lane_joints_cross_roads_and_junctions() {
    map(|map| {
        let name = |end: &qcbus_opendrive::LaneEnd| {
            let lane = map.lane(end.lane).unwrap();
            format!("{}/{}/{}", lane.at.road.id(), lane.id().unwrap(), end.end)
        };
        let joints: Vec<String> = map
            .lane_joints()
            .map(|joint| {
                format!(
                    "{} -> {} <{}>",
                    name(&joint.from),
                    name(&joint.to),
                    joint.node.name()
                )
            })
            .collect();
        assert_eq!(
            joints,
            [
                "c/-1/start -> in/-1/end <predecessor>",
                "c/-1/end -> out/-1/start <successor>",
                "in/-1/end -> c/-1/start <laneLink>",
                "loop/-1/end -> d/-1/start <laneLink>",
            ]
        );
    });
}

#[test]
fn ids_are_strings_and_duplicates_are_kept() {
    let roads = r#"<road id="007"/><road id="7"/><road id="007" length="5"/><road/>
        <junction id="7"/><junction id="-1"/>"#;
    with_map(roads, |map| {
        assert_eq!(
            map.roads_with_id("007")
                .map(|road| road.index())
                .collect::<Vec<_>>(),
            [0, 2]
        );
        assert_eq!(map.road("7").unwrap().index(), 1);
        assert!(map.road("8").is_none());
        assert_eq!(map.junction("7").unwrap().index(), 0);
    });
}

#[test]
fn node_leads_back_to_its_road() {
    map(|map| {
        let width = map
            .road("out")
            .unwrap()
            .node()
            .descendants_named("width")
            .next()
            .unwrap();
        assert_eq!(map.road_of(width).unwrap().id(), "out");
        let lane_link = map.junctions()[0]
            .node()
            .descendants_named("laneLink")
            .next()
            .unwrap();
        assert!(map.road_of(lane_link).is_none());
    });
}

#[test]
fn map_is_shareable_and_survives_rule_panic() {
    fn shareable<T: Send + Sync + std::panic::RefUnwindSafe>(_: &T) {}
    map(|map| {
        shareable(map);
        let caught = std::panic::catch_unwind(|| {
            assert_eq!(map.lane_joints().count(), 4);
            panic!("a rule's fault");
        });
        assert!(caught.is_err());
        assert_eq!(map.lane_joints().count(), 4);
    });
}
