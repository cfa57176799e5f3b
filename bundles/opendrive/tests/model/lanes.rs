//! Tests of sections, borders and surfaces of hand-written roads with known numbers.

use crate::common::with_map;
use qcbus_opendrive::{ContactPoint, Edge, LayerKind, RoadMap, Side, Station};

const ROAD: &str = r#"
<road id="a-1" length="100" junction="-1">
  <planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
  <elevationProfile><elevation s="0" a="2" b="0.01" c="0" d="0"/></elevationProfile>
  <lanes>
    <laneOffset s="0" a="0.5" b="0" c="0" d="0"/>
    <laneOffset s="50" a="1" b="0.02" c="0" d="0"/>
    <laneSection s="0">
      <left>
        <lane id="2" type="sidewalk"><width sOffset="0" a="1" b="0" c="0" d="0"/>
          <height sOffset="0" inner="0.1" outer="0.2"/></lane>
        <lane id="1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>
      </left>
      <center><lane id="0" type="none"/></center>
      <right>
        <lane id="-1" type="driving"><link><successor id="-2"/></link>
          <width sOffset="0" a="3" b="0" c="0" d="0"/>
          <width sOffset="20" a="3" b="0.1" c="0" d="0"/></lane>
        <lane id="-2" type="border"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane>
      </right>
    </laneSection>
    <laneSection s="60">
      <center><lane id="0" type="none"/></center>
      <right>
        <lane id="-1" type="driving"><border sOffset="0" a="-2" b="0" c="0" d="0"/></lane>
        <lane id="-2" type="driving"><link><predecessor id="-1"/></link>
          <border sOffset="0" a="-5.5" b="0" c="0" d="0"/></lane>
      </right>
    </laneSection>
  </lanes>
</road>"#;

fn lane_t(
    map: &RoadMap<'_>,
    section: usize,
    id: i64,
    edge: Edge,
    ds: impl Into<Station>,
) -> Option<f64> {
    map.sections().nth(section)?.lane(id)?.t(edge, ds)
}

#[track_caller]
fn near(got: Option<f64>, want: f64) {
    let got = got.expect("the value can be evaluated");
    assert!((got - want).abs() < 1e-12, "expected {want}, found {got}");
}

#[test]
fn borders_add_up_from_the_lane_offset() {
    with_map(ROAD, |map| {
        near(lane_t(map, 0, 0, Edge::Outer, 10.0), 0.5);
        near(lane_t(map, 0, 1, Edge::Inner, 10.0), 0.5);
        near(lane_t(map, 0, 1, Edge::Outer, 10.0), 3.5);
        near(lane_t(map, 0, 2, Edge::Outer, 10.0), 4.5);
        near(lane_t(map, 0, -1, Edge::Outer, 30.0), 0.5 - 4.0);
        near(lane_t(map, 0, -2, Edge::Inner, 30.0), 0.5 - 4.0);
        near(lane_t(map, 0, -2, Edge::Outer, 30.0), 0.5 - 6.0);
        near(lane_t(map, 0, -1, Edge::Outer, 55.0), 1.0 + 0.1 - 6.5);
    });
}

#[test]
fn step_in_lane_offset_is_seen_from_either_side() {
    with_map(ROAD, |map| {
        near(lane_t(map, 0, 1, Edge::Inner, Station::before(50.0)), 0.5);
        near(lane_t(map, 0, 1, Edge::Inner, 50.0), 1.0);
        near(lane_t(map, 0, 1, Edge::Inner, 49.999_999_999_9), 1.0);
    });
}

#[test]
fn border_records_count_on_side_without_widths() {
    with_map(ROAD, |map| {
        near(lane_t(map, 1, -2, Edge::Inner, 5.0), -2.0);
        near(lane_t(map, 1, -2, Edge::Outer, 5.0), -5.5);
        let section = map.sections().nth(1).unwrap();
        near(section.lane(-2).unwrap().width(5.0), 3.5);
        assert!(!section.has_widths(Side::Right));
        near(section.edge_t(Side::Right, 5.0), -5.5);
    });
}

#[test]
fn spans_agree_with_single_borders() {
    with_map(ROAD, |map| {
        for section in map.sections() {
            for side in Side::BOTH {
                let spans = section.spans(side, 7.5);
                assert_eq!(spans.len(), section.side(side).count());
                for span in spans {
                    near(span.lane.inner_t(7.5), span.inner);
                    near(span.lane.outer_t(7.5), span.outer);
                }
            }
        }
    });
}

#[test]
fn section_lengths_end_at_next_section() {
    with_map(ROAD, |map| {
        let road = map.road("a-1").unwrap();
        let layer = road.permanent().unwrap();
        let lengths: Vec<_> = layer
            .sections(road)
            .map(|section| section.length(Side::Left))
            .collect();
        assert_eq!(lengths, [Some(60.0), Some(40.0)]);
        let at = |s: Station| {
            layer
                .section_at(road, Side::Right, s)
                .map(|section| section.index())
        };
        assert_eq!(at(Station::at(60.0)), Some(1));
        assert_eq!(at(Station::before(60.0)), Some(0));
        assert_eq!(at(Station::at(100.0)), Some(1));
        assert_eq!(at(Station::at(100.1)), None);
        assert_eq!(at(Station::at(-0.1)), None);
    });
}

#[test]
fn single_side_section_leaves_other_side_unchanged() {
    let lane =
        |id: i64| format!(r#"<lane id="{id}"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>"#);
    let road = format!(
        r#"<road id="1" length="90"><lanes>
        <laneSection s="0"><left>{one}</left><center><lane id="0"/></center><right>{minus}</right></laneSection>
        <laneSection s="30" singleSide="true"><left>{one}</left><center><lane id="0"/></center></laneSection>
        <laneSection s="70"><left>{one}</left><center><lane id="0"/></center><right>{minus}</right></laneSection>
        </lanes></road>"#,
        one = lane(1),
        minus = lane(-1),
    );
    with_map(&road, |map| {
        let sections: Vec<_> = map.sections().collect();
        assert_eq!(sections[0].length(Side::Left), Some(30.0));
        assert_eq!(sections[0].length(Side::Right), Some(70.0));
        assert_eq!(sections[0].next(Side::Right).unwrap().index(), 2);
        assert_eq!(sections[2].previous(Side::Left).unwrap().index(), 1);
        assert!(!sections[1].covers(Side::Right));
        let layer = sections[0].layer;
        let at = layer
            .section_at(sections[0].road, Side::Right, 40.0)
            .unwrap();
        assert_eq!(at.index(), 0);
    });
}

#[test]
fn temporary_section_ends_after_its_length() {
    let road = r#"<road id="1" length="90">
        <lanes><laneSection s="0"/></lanes>
        <lanes layer="temporary"><laneSection s="10" length="20"/><laneSection s="50"/></lanes></road>"#;
    with_map(road, |map| {
        let road = map.road("1").unwrap();
        let temporary = road.layer(LayerKind::Temporary).unwrap();
        let ends: Vec<_> = temporary
            .sections(road)
            .map(|section| section.end(Side::Left))
            .collect();
        assert_eq!(ends, [Some(30.0), Some(90.0)]);
        assert!(temporary.section_at(road, Side::Left, 40.0).is_none());
        assert!(temporary.section_at(road, Side::Left, 20.0).is_some());
    });
}

#[test]
fn lane_borders_include_elevation_and_lane_height() {
    with_map(ROAD, |map| {
        let lane = map.sections().next().unwrap().lane(2).unwrap();
        let inner = lane.border(Edge::Inner, 10.0).unwrap();
        assert_eq!((inner.point.x, inner.point.y), (10.0, 3.5));
        near(Some(inner.point.z), 2.0 + 0.1 + 0.1);
        near(Some(inner.slope), 0.01);
        let outer = lane.border(Edge::Outer, 10.0).unwrap();
        near(Some(outer.point.z), 2.0 + 0.1 + 0.2);
        let middle = lane.surface_point(10.0, 0.5).unwrap();
        near(Some(middle.z), 2.0 + 0.1 + 0.15);
    });
}

#[test]
fn lane_links_become_joints_in_both_directions() {
    with_map(ROAD, |map| {
        let joints: Vec<_> = map.lane_joints().collect();
        assert_eq!(joints.len(), 2);
        assert_eq!(joints[0].from, joints[1].to);
        assert_eq!(joints[0].to, joints[1].from);
        assert_eq!(joints[0].from.end, ContactPoint::End);
        assert!(joints[0].is_within_road() && !joints[0].is_reversed());
        assert_eq!(map.lane(joints[0].to.lane).unwrap().id(), Some(-2));
    });
}

#[test]
fn unordered_lane_ids_give_no_borders() {
    let road = |ids: [&str; 2]| {
        let lane = |id: &str| {
            format!(r#"<lane id="{id}"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>"#)
        };
        format!(
            r#"<road id="1" length="9"><lanes><laneSection s="0"><center><lane id="0"/></center>
            <right>{}{}</right></laneSection></lanes></road>"#,
            lane(ids[0]),
            lane(ids[1])
        )
    };
    for ids in [["-1", "-1"], ["-1", "x"], ["-1", "2"]] {
        with_map(&road(ids), |map| {
            let section = map.sections().next().unwrap();
            assert!(!section.is_numbered(Side::Right));
            assert!(
                section
                    .lanes()
                    .filter(|lane| lane.id() != Some(0))
                    .all(|lane| lane.outer_t(1.0).is_none())
            );
        });
    }
    with_map(&road(["-3", "-1"]), |map| {
        near(
            map.sections()
                .next()
                .unwrap()
                .lane(-3)
                .unwrap()
                .outer_t(1.0),
            -6.0,
        );
    });
}

#[test]
fn superelevation_tilts_lanes_except_level_ones() {
    let road = r#"<road id="1" length="50">
      <planView><geometry s="0" x="0" y="0" hdg="0" length="50"><line/></geometry></planView>
      <lateralProfile><superelevation s="0" a="0.1" b="0" c="0" d="0"/></lateralProfile>
      <lanes><laneSection s="0"><center><lane id="0"/></center><right>
        <lane id="-1"><width sOffset="0" a="4" b="0" c="0" d="0"/></lane>
        <lane id="-2" level="true"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane>
        <lane id="-3" level="true"><width sOffset="0" a="1" b="0" c="0" d="0"/></lane>
      </right></laneSection></lanes></road>"#;
    with_map(road, |map| {
        let section = map.sections().next().unwrap();
        let (sin, cos) = 0.1_f64.sin_cos();
        let tilted = section
            .lane(-1)
            .unwrap()
            .border(Edge::Outer, 20.0)
            .unwrap()
            .point;
        near(Some(tilted.y), -4.0 * cos);
        near(Some(tilted.z), -4.0 * sin);
        let level = section
            .lane(-3)
            .unwrap()
            .border(Edge::Outer, 20.0)
            .unwrap()
            .point;
        near(Some(level.y), -4.0 * cos - 3.0);
        near(Some(level.z), -4.0 * sin);
    });
}

#[test]
fn shapes_blend_linearly_along_s() {
    let road = r#"<road id="1" length="50">
      <planView><geometry s="0" x="0" y="0" hdg="0" length="50"><line/></geometry></planView>
      <lateralProfile>
        <shape s="0" t="-5" a="1" b="0" c="0" d="0"/>
        <shape s="0" t="0" a="1" b="0.1" c="0" d="0"/>
        <shape s="20" t="-5" a="3" b="0" c="0" d="0"/>
      </lateralProfile></road>"#;
    with_map(road, |map| {
        let road = map.road("1").unwrap();
        let z = |s: f64, t: f64| road.surface_point(s, t).map(|point| point.z);
        near(z(0.0, -2.0), 1.0);
        near(z(0.0, 2.0), 1.2);
        near(z(10.0, -2.0), 2.0);
        near(z(10.0, 2.0), 2.1);
        near(z(40.0, 2.0), 3.0);
        assert_eq!(z(10.0, -6.0), None);
    });
}

#[test]
fn outer_strips_start_at_edge_of_inner_strip() {
    let road = |mode: &str| {
        format!(
            r#"<road id="1" length="50">
      <planView><geometry s="0" x="0" y="0" hdg="0" length="50"><line/></geometry></planView>
      <lateralProfile><crossSectionSurface>
        <tOffset><coefficients s="0" a="1"/></tOffset>
        <surfaceStrips>
          <strip id="1"><width><coefficients s="0" a="4"/></width><linear><coefficients s="0" a="0.1"/></linear></strip>
          <strip id="2" mode="{mode}"><linear><coefficients s="0" a="0.5"/></linear></strip>
          <strip id="-1"><quadratic><coefficients s="0" a="0.01"/></quadratic></strip>
        </surfaceStrips></crossSectionSurface></lateralProfile></road>"#
        )
    };
    let height = |mode: &str, t: f64| {
        with_map(&road(mode), |map| {
            map.road("1").unwrap().lateral().height(10.0, t)
        })
    };
    near(height("relative", 3.0), 0.2);
    near(height("relative", 7.0), 0.4 + 1.0);
    near(height("independent", 7.0), 1.0);
    assert_eq!(height("sideways", 7.0), None);
    near(height("relative", -9.0), 1.0);
}

#[test]
fn border_on_curve_has_its_own_heading() {
    let road = r#"<road id="1" length="10">
      <planView><geometry s="0" x="0" y="0" hdg="0" length="10"><arc curvature="0.1"/></geometry></planView>
      <lanes><laneSection s="0"><left>
        <lane id="1"><width sOffset="0" a="2" b="0.4" c="0" d="0"/></lane></left>
        <center><lane id="0"/></center></laneSection></lanes></road>"#;
    with_map(road, |map| {
        let lane = map.sections().next().unwrap().lane(1).unwrap();
        let step = 1e-6;
        let at = |ds: f64| lane.border(Edge::Outer, ds).unwrap();
        let (before, after) = (at(5.0 - step).point, at(5.0 + step).point);
        let numeric = (after.y - before.y).atan2(after.x - before.x);
        assert!((at(5.0).hdg.unwrap() - numeric).abs() < 1e-6);
    });
    let folded = road.replace("a=\"2\"", "a=\"12\"");
    with_map(&folded, |map| {
        // The border is beyond the centre of the curve, so it runs backwards.
        let lane = map.sections().next().unwrap().lane(1).unwrap();
        assert_eq!(lane.border(Edge::Outer, 5.0).unwrap().hdg, None);
    });
}
