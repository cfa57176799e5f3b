//! Tests of maps with hostile numbers and links. All queries must end and must not panic.

use crate::common::with_map;
use proptest::prelude::*;
use qcbus_opendrive::{ContactPoint, Edge, RoadMap, Side, Station};

const TEMPLATE: &str = r##"
<road id="1" length="#" junction="-1"><link>
    <predecessor elementType="road" elementId="1" contactPoint="end"/>
    <successor elementType="junction" elementId="1"/></link>
  <planView>
    <geometry s="#" x="#" y="#" hdg="#" length="#"><line/></geometry>
    <geometry s="#" x="#" y="#" hdg="#" length="#"><arc curvature="#"/></geometry>
    <geometry s="#" x="#" y="#" hdg="#" length="#"><spiral curvStart="#" curvEnd="#"/></geometry>
    <geometry s="#" x="#" y="#" hdg="#" length="#"><poly3 a="#" b="#" c="#" d="#"/></geometry>
    <geometry s="#" x="#" y="#" hdg="#" length="#">
      <paramPoly3 aU="#" bU="#" cU="#" dU="#" aV="#" bV="#" cV="#" dV="#" pRange="arcLength"/></geometry>
    <geometry/>
  </planView>
  <elevationProfile><elevation s="#" a="#" b="#" c="#" d="#"/><elevation s="#" a="#" b="#" c="#" d="#"/></elevationProfile>
  <lateralProfile><superelevation s="#" a="#" b="#" c="#" d="#"/>
    <shape s="#" t="#" a="#" b="#" c="#" d="#"/><shape s="#" t="#" a="#" b="#" c="#" d="#"/></lateralProfile>
  <lanes><laneOffset s="#" a="#" b="#" c="#" d="#"/>
    <laneSection s="#"><left><lane id="1" level="true"><link><predecessor id="1"/><successor id="1"/></link>
        <width sOffset="#" a="#" b="#" c="#" d="#"/><width sOffset="#" a="#" b="#" c="#" d="#"/>
        <height sOffset="#" inner="#" outer="#"/></lane></left>
      <center><lane id="0"/></center></laneSection>
    <laneSection s="#" singleSide="true" length="#"><center><lane id="0"/></center>
      <right><lane id="-1"><link><predecessor id="-1"/><successor id="-1"/></link>
        <border sOffset="#" a="#" b="#" c="#" d="#"/></lane></right></laneSection>
    <laneSection s="#"><left><lane id="1"/></left><right><lane id="-1"/></right></laneSection>
  </lanes>
</road>
<junction id="1"><connection incomingRoad="1" connectingRoad="1" contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>
"##;

fn numbers() -> impl Strategy<Value = String> {
    let nasty = vec![
        "0",
        "-0",
        "1",
        "10",
        "-1",
        "1e308",
        "-1e308",
        "1e-320",
        "NaN",
        "INF",
        "-INF",
        "",
        "x",
        " 5 ",
        "1e999",
        "0x1",
        "9007199254740993",
        "1e16",
    ];
    prop_oneof![
        prop::sample::select(nasty).prop_map(str::to_owned),
        any::<f64>().prop_map(|number| format!("{number:e}")),
        (0.0..100.0_f64).prop_map(|number| number.to_string()),
    ]
}

fn fill(template: &str, mut values: impl Iterator<Item = String>) -> String {
    let mut text = String::new();
    for part in template.split_inclusive('#') {
        match part.strip_suffix('#') {
            Some(part) => {
                text.push_str(part);
                text.push_str(&values.next().unwrap_or_default());
            }
            None => text.push_str(part),
        }
    }
    text
}

/// Calls every query that rules may call. Returns the number of answers.
fn ask_everything(map: &RoadMap<'_>) -> usize {
    let mut answers =
        map.lane_joints().count() + map.touching_lanes().count() + map.road_contacts().len();
    for road in map.roads() {
        for s in [0.0, 0.5, 1.0, 50.0, 1e308, f64::NAN, f64::INFINITY, -1.0] {
            for station in [Station::at(s), Station::before(s)] {
                let frame = road.frame(station);
                let point = road.surface_point(station, 1.0);
                assert!(point.is_none_or(|point| (point.x + point.y + point.z).is_finite()));
                answers += usize::from(frame.is_some()) + usize::from(point.is_some());
            }
        }
        for geometry in road.plan_view().geometries() {
            answers += usize::from(geometry.end().is_some())
                + usize::from(geometry.true_length().is_some());
        }
        for end in ContactPoint::BOTH {
            answers += map.neighbours(road, end).len() + usize::from(road.end_frame(end).is_some());
        }
        for stretch in road.elevation().stretches(100.0) {
            answers += usize::from(stretch.cubic.minimum(0.0, stretch.length()).is_some());
        }
    }
    for section in map.sections() {
        answers += Side::BOTH
            .map(|side| section.spans(side, 0.5).len())
            .iter()
            .sum::<usize>();
        answers += usize::from(section.shortest_length().is_some());
        for lane in section.lanes() {
            for end in ContactPoint::BOTH {
                answers += Edge::BOTH
                    .iter()
                    .filter(|edge| lane.border_at(**edge, end).is_some())
                    .count();
                answers += usize::from(lane.width_at(end).is_some_and(f64::is_finite));
            }
            answers += usize::from(lane.surface_point(1.0, 0.5).is_some());
        }
    }
    answers
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn arbitrary_numbers_make_no_query_panic(values in prop::collection::vec(numbers(), 140)) {
        let roads = fill(TEMPLATE, values.into_iter());
        with_map(&roads, ask_everything);
    }
}

#[test]
fn ordinary_numbers_are_answered() {
    let answers = with_map(
        &fill(TEMPLATE, std::iter::repeat("1".to_owned())),
        ask_everything,
    );
    assert!(answers > 20, "{answers}");
}

#[test]
fn empty_map_gives_no_answers() {
    assert_eq!(with_map("", ask_everything), 0);
    assert_eq!(
        with_map(
            "<road/><junction/><road><lanes><laneSection/></lanes></road>",
            ask_everything
        ),
        0
    );
}

#[test]
fn side_with_thousands_of_lanes_has_no_borders() {
    let lanes: String = (1..=5000)
        .map(|id| {
            format!(r#"<lane id="-{id}"><width sOffset="0" a="1" b="0" c="0" d="0"/></lane>"#)
        })
        .collect();
    let road = format!(
        r#"<road id="1" length="9"><lanes><laneSection s="0"><right>{lanes}</right></laneSection></lanes></road>"#
    );
    with_map(&road, |map| {
        let section = map.sections().next().unwrap();
        assert!(!section.is_numbered(Side::Right));
        assert_eq!(section.lane(-5000).unwrap().width(1.0), Some(1.0));
        assert_eq!(section.lane(-5000).unwrap().outer_t(1.0), None);
    });
}
