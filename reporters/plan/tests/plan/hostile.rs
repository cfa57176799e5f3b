//! Tests of maps with hostile numbers. No road is lost, and drawing ends.

use crate::support::{TWO_LANES, decode, line, plan, road, with_map};
use proptest::prelude::*;
use qcbus_plan::{Locator, Plan, Said};

const CANNOT_BE_DRAWN: u64 = 2;

#[test]
fn roads_without_place_are_listed_and_reported() {
    let good = road("good", "", 50.0, &line(0.0, 7.0, 8.0, 0.0, 50.0), TWO_LANES);
    let good = good.clone() + &good + &good;
    let nan = good.replace("x='7'", "x='NaN'").replace("good", "nan");
    let far = good.replace("x='7'", "x='1e300'").replace("good", "far");
    let distant = good
        .replace("x='7'", "x='1100000'")
        .replace("good", "distant");
    let endless = road(
        "endless",
        "",
        1e9,
        &line(0.0, 0.0, 0.0, 0.0, 1e9),
        TWO_LANES,
    );
    let plan = plan(&(good + "<road id='empty'/>" + &nan + &far + &distant + &endless));
    let drawn: Vec<_> = plan
        .roads
        .iter()
        .map(|road| (road.id.as_str(), road.flags, road.line.len()))
        .collect();
    let expected = [
        ("good", 0, 2),
        ("good", 0, 2),
        ("good", 0, 2),
        ("empty", 2, 0),
        ("nan", 2, 0),
        ("nan", 2, 0),
        ("nan", 2, 0),
        ("far", 2, 0),
        ("far", 2, 0),
        ("far", 2, 0),
        ("distant", 2, 0),
        ("distant", 2, 0),
        ("distant", 2, 0),
        ("endless", 2, 0),
    ];
    assert_eq!(drawn, expected);
    assert_eq!(plan.origin, [7.0, 8.0]);
    let said = "Not drawn (no finite place within 1,000 km of the other roads): roads 'empty', 'nan', 'nan', 'nan', 'far' and 6 more.";
    assert_eq!(plan.cuts, [said]);
}

#[test]
fn road_circling_a_million_times_is_not_drawn() {
    let shapes = [
        "<arc curvature='0.1'/>",
        "<spiral curvStart='-3' curvEnd='5'/>",
        "<paramPoly3 aU='0' bU='1e9' cU='-1e9' dU='3' aV='0' bV='1e8' cV='-3e9' dV='9' pRange='normalized'/>",
        "<poly3 a='0' b='0' c='1' d='-1'/>",
    ];
    for shape in shapes {
        let geometry =
            format!("<geometry s='0' x='0' y='0' hdg='0' length='1e9'>{shape}</geometry>");
        let plan = plan(&road("1", "", 1e9, &geometry, TWO_LANES));
        assert_eq!(plan.roads[0].flags, CANNOT_BE_DRAWN, "{shape}");
        assert_eq!(plan.cuts.len(), 1, "{shape}");
    }
}

#[test]
fn ten_thousand_lanes_are_listed_without_borders() {
    let lanes: String = (1..=10_000)
        .map(|id| format!("<lane id='-{id}'><width sOffset='0' a='1' b='0' c='0' d='0'/></lane>"))
        .collect();
    let lanes = format!(
        "<laneSection s='0'><center><lane id='0'/></center><right>{lanes}</right></laneSection>"
    );
    let geometry =
        "<geometry s='0' x='0' y='0' hdg='0' length='90'><arc curvature='0.01'/></geometry>";
    let plan = plan(&road("1", "", 90.0, geometry, &lanes));
    let right = &plan.roads[0].sections[0].right;
    assert_eq!(right.len(), 10_000);
    assert!(right.iter().all(|lane| lane.border.points.is_empty()));
    assert!(plan.roads[0].sections[0].center.points.len() > 2);
}

#[test]
fn many_endless_roads_share_the_point_limit() {
    let geometry =
        "<geometry s='0' x='0' y='0' hdg='0' length='2e4'><arc curvature='0.1'/></geometry>";
    let roads: String = (0..2_000)
        .map(|id| road(&id.to_string(), "", 2e4, geometry, TWO_LANES))
        .collect();
    let plan = plan(&roads);
    assert_eq!(plan.roads.len(), 2_000);
    let drawn = plan.roads.iter().filter(|road| road.flags == 0).count();
    assert!(
        drawn > 0 && drawn < 100,
        "unexpected number of drawn roads: {drawn}"
    );
    assert!(plan.cuts[0].contains("too many points"), "{:?}", plan.cuts);
}

#[test]
fn implausible_width_is_treated_as_none() {
    let lanes = TWO_LANES
        .replace("a='3.5'", "a='1e29'")
        .replace("a='3'", "a='x'");
    let plan = plan(&road(
        "1",
        "",
        50.0,
        &line(0.0, 0.0, 0.0, 0.0, 50.0),
        &lanes,
    ));
    let section = &plan.roads[0].sections[0];
    assert_eq!(plan.roads[0].flags, 0);
    for lane in section.left.iter().chain(&section.right) {
        assert_eq!(lane.border.places(), [[0, 0], [5_000, 0]]);
    }
}

#[test]
fn names_with_markup_are_kept_and_long_ones_cut() {
    let long = "x".repeat(10_000);
    let xml = road(
        "&lt;/script&gt;&amp;",
        &format!("name='{long}'"),
        1.0,
        "",
        "",
    );
    let plan = plan(&xml);
    assert_eq!(plan.roads[0].id, "</script>&");
    assert_eq!(plan.roads[0].name.len(), 300);
    assert!(plan.cuts[0].contains("'</script>&'"));
}

const TEMPLATE: &str = r##"
<road id="1" length="#" junction="j" rule="LHT"><link><predecessor elementType="road" elementId="2"/></link>
  <planView><geometry s="#" x="#" y="#" hdg="#" length="#"><line/></geometry>
    <geometry s="#" x="#" y="#" hdg="#" length="#"><arc curvature="#"/></geometry>
    <geometry s="#" x="#" y="#" hdg="#" length="#"><spiral curvStart="#" curvEnd="#"/></geometry>
    <geometry s="#" x="#" y="#" hdg="#" length="#"><paramPoly3 aU="#" bU="#" cU="#" dU="#" aV="#" bV="#" cV="#" dV="#"/></geometry>
  </planView>
  <elevationProfile><elevation s="#" a="#" b="#" c="#" d="#"/><elevation s="#" a="#" b="#" c="#" d="#"/></elevationProfile>
  <lateralProfile><superelevation s="#" a="#" b="#" c="#" d="#"/></lateralProfile>
  <lanes><laneOffset s="#" a="#" b="#" c="#" d="#"/>
    <laneSection s="#"><left><lane id="1"><width sOffset="#" a="#" b="#" c="#" d="#"/><roadMark sOffset="#" type="solid" width="#"/></lane></left>
      <center><lane id="0"><roadMark sOffset="#" type="broken"/></lane></center></laneSection>
    <laneSection s="#" singleSide="true"><center><lane id="0"/></center>
      <right><lane id="-1"><border sOffset="#" a="#" b="#" c="#" d="#"/></lane></right></laneSection>
  </lanes>
  <objects><object id="o" s="#" t="#" hdg="#" radius="#"/></objects><signals><signal id="s" s="#" t="#" hOffset="#"/></signals>
</road>
<road id="2" length="#"><planView><geometry s="0" x="#" y="#" hdg="#" length="#"><line/></geometry></planView></road>
<junction id="j"><connection incomingRoad="2" connectingRoad="1" contactPoint="start"/></junction>
"##;

fn number() -> impl Strategy<Value = String> {
    let nasty = [
        "0", "-0", "1", "10", "100", "-1", "0.5", "1e308", "1e-320", "NaN", "INF", "", "x", "1e29",
        "-1e20", "1e9", "1e5",
    ];
    let few: Vec<String> = nasty.iter().map(|text| (*text).to_owned()).collect();
    prop_oneof![
        prop::sample::select(few),
        (-1000.0..1000.0_f64).prop_map(|value| value.to_string()),
        Just("0".to_owned()),
        (0.0..100.0_f64).prop_map(|value| value.to_string()),
    ]
}

fn filled(numbers: &[String]) -> String {
    let mut numbers = numbers.iter().cycle();
    let mut pieces = TEMPLATE.split('#');
    let mut xml = pieces.next().unwrap_or("").to_owned();
    for piece in pieces {
        xml.push_str(numbers.next().map_or("", String::as_str));
        xml.push_str(piece);
    }
    xml
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn arbitrary_numbers_lose_no_road(numbers in prop::collection::vec(number(), 97)) {
        let xml = filled(&numbers);
        with_map(&xml, |map| {
            let plan = decode(&Plan::of(map).bytes());
            let ids: Vec<&str> = plan.roads.iter().map(|road| road.id.as_str()).collect();
            prop_assert_eq!(ids, ["1", "2"]);
            prop_assert_eq!((plan.junctions.len(), plan.signals.len(), plan.objects.len()), (1, 1, 1));
            for road in &plan.roads {
                let empty = road.line.is_empty() && road.sections.is_empty() && road.elevation.is_empty();
                prop_assert_eq!(road.flags & CANNOT_BE_DRAWN != 0, empty);
                for section in &road.sections {
                    let lanes = section.left.iter().chain(&section.right);
                    for border in lanes.map(|lane| &lane.border).chain([&section.center]) {
                        for mark in &border.marks {
                            prop_assert!(mark.points >= 2);
                            prop_assert!(mark.first + mark.points <= border.points.len());
                        }
                    }
                }
            }
            let locator = Locator::new(map);
            for node in map.root().into_iter().flat_map(|root| root.descendants()) {
                let spot = locator.locate(&Said { xpath: Some(&node.xpath()), ..Said::default() });
                if let Some(at) = spot.at {
                    prop_assert!(at.iter().all(|value| value.is_finite()));
                }
            }
            Ok(())
        })?;
    }
}
