//! Tests of the plan of a map, decoded from its bytes.

use std::f64::consts::FRAC_PI_2;

use crate::support::{Border, Decoded, TWO_LANES, decode, line, plan, road, with_map};

fn places(border: &Border) -> Vec<[i64; 2]> {
    border.places()
}

#[test]
fn straight_road_borders_are_exact_to_the_centimetre() {
    let plan = plan(&road(
        "5",
        "name='Main'",
        100.0,
        &line(0.0, 10.0, 20.0, 0.0, 100.0),
        TWO_LANES,
    ));
    assert_eq!(plan.origin, [10.0, 20.0]);
    let [road] = &plan.roads[..] else {
        panic!("{:?}", plan.roads);
    };
    assert_eq!((road.id.as_str(), road.name.as_str()), ("5", "Main"));
    assert_eq!((road.junction, road.flags, road.length), (0, 0, 10_000));
    let line: Vec<_> = road.line.iter().map(|(at, s)| (at.x, at.y, *s)).collect();
    assert_eq!(line, [(0, 0, 0), (10_000, 0, 10_000)]);
    let [section] = &road.sections[..] else {
        panic!("{:?}", road.sections);
    };
    assert_eq!(section.s, [0, 10_000]);
    assert_eq!(places(&section.center), [[0, 0], [10_000, 0]]);
    assert_eq!(section.left[0].id, 1);
    assert_eq!(section.right[0].id, -1);
    assert_eq!(section.left[0].kind, "driving");
    assert_eq!(places(&section.left[0].border), [[0, 350], [10_000, 350]]);
    assert_eq!(
        places(&section.right[0].border),
        [[0, -300], [10_000, -300]]
    );
    assert_eq!(section.left[0].widths, [[0, 350], [10_000, 350]]);
    assert_eq!(section.right[0].widths, [[0, 300], [10_000, 300]]);
    assert!(
        section.left[0]
            .border
            .points
            .iter()
            .all(|point| point.level == 2)
    );
    assert_eq!(plan.cuts, Vec::<String>::new());
}

/// Returns the largest distance in centimetres between a border and points on a circle around
/// `center`.
fn off_circle(
    plan: &Decoded,
    border: &[[i64; 2]],
    center: [f64; 2],
    radius: f64,
    turn: f64,
) -> f64 {
    let border: Vec<[f64; 2]> = border.iter().map(|at| at.map(|cm| cm as f64)).collect();
    let center = [0, 1].map(|axis| 100.0 * (center[axis] - plan.origin[axis]));
    let mut farthest: f64 = 0.0;
    for step in 0..=2000 {
        let angle = turn * f64::from(step) / 2000.0 - FRAC_PI_2;
        let at = [
            center[0] + 100.0 * radius * angle.cos(),
            center[1] + 100.0 * radius * angle.sin(),
        ];
        let near = border.windows(2).map(|pair| distance(at, pair[0], pair[1]));
        farthest = farthest.max(near.fold(f64::INFINITY, f64::min));
    }
    farthest
}

fn distance([x, y]: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let share = ((x - from[0]) * dx + (y - from[1]) * dy) / (dx * dx + dy * dy);
    let share = share.clamp(0.0, 1.0);
    (x - from[0] - share * dx).hypot(y - from[1] - share * dy)
}

const ARC: &str =
    "<geometry s='0' x='3' y='4' hdg='0' length='150'><arc curvature='0.02'/></geometry>";

#[test]
fn arc_stays_within_tolerance_on_every_level() {
    let plan = plan(&road("1", "", 150.0, ARC, TWO_LANES));
    let section = &plan.roads[0].sections[0];
    let lanes = [
        (&section.left[0].border, 46.5),
        (&section.right[0].border, 53.0),
    ];
    for (border, radius) in lanes.into_iter().chain([(&section.center, 50.0)]) {
        for (level, allowed) in [(0, 2.0), (1, 26.5), (2, 201.5)] {
            let kept = border.points.iter().filter(|point| point.level >= level);
            let kept: Vec<[i64; 2]> = kept.map(|point| [point.x, point.y]).collect();
            let off = off_circle(&plan, &kept, [3.0, 54.0], radius, 3.0);
            assert!(off <= allowed, "level {level}, radius {radius}: {off} cm");
        }
        // A chord of 2.8 m has a distance of 2 cm from a circle of 50 m.
        assert!(border.points.len() < 90, "{} points", border.points.len());
    }
}

#[test]
fn coarser_levels_are_subsets_with_fewer_points() {
    let plan = plan(&road("1", "", 150.0, ARC, TWO_LANES));
    let points = &plan.roads[0].sections[0].left[0].border.points;
    let count = |level| points.iter().filter(|point| point.level >= level).count();
    assert!(count(0) > count(1) && count(1) > count(2) && count(2) >= 2);
    assert!(points.iter().all(|point| point.level <= 2));
    assert_eq!((points[0].level, points[points.len() - 1].level), (2, 2));
}

#[test]
fn spirals_and_cubics_stay_within_two_centimetres() {
    let shapes = [
        "<spiral curvStart='-0.03' curvEnd='0.05'/>",
        "<poly3 a='0' b='0.1' c='-0.004' d='0.00005'/>",
        "<paramPoly3 aU='0' bU='80' cU='10' dU='-20' aV='0' bV='0' cV='40' dV='-60' pRange='normalized'/>",
    ];
    for shape in shapes {
        let geometry =
            format!("<geometry s='0' x='0' y='0' hdg='0.3' length='80'>{shape}</geometry>");
        let wide = "<laneOffset s='0' a='0.5' b='0' c='0.002' d='-0.00002'/>\
            <laneSection s='0'><center><lane id='0'/></center><right><lane id='-1'>\
            <width sOffset='0' a='2' b='0' c='0.004' d='-0.00003'/></lane></right></laneSection>";
        with_map(&road("1", "", 80.0, &geometry, wide), |map| {
            let plan = decode(&qcbus_plan::Plan::of(map).bytes());
            let section = map.sections().next().unwrap();
            let lane = section.lane(-1).unwrap();
            let drawn = places(&plan.roads[0].sections[0].right[0].border);
            let drawn: Vec<[f64; 2]> = drawn.iter().map(|at| at.map(|cm| cm as f64)).collect();
            for step in 0..=1600 {
                let s = f64::from(step) * 0.05;
                let t = lane.outer_t(s).unwrap();
                let point = map.roads()[0].point(s, t, 0.0).unwrap();
                let at = [
                    100.0 * (point.x - plan.origin[0]),
                    100.0 * (point.y - plan.origin[1]),
                ];
                let near = drawn.windows(2).map(|pair| distance(at, pair[0], pair[1]));
                let near = near.fold(f64::INFINITY, f64::min);
                assert!(near <= 2.0, "{shape} at {s}: {near} cm off");
            }
        });
    }
}

#[test]
fn road_mark_begins_at_a_point() {
    let lanes = "<laneSection s='20'><center><lane id='0'>\
        <roadMark sOffset='0' type='solid' color='white' width='0.12'/>\
        <roadMark sOffset='33.3' type='none' color='white'/>\
        <roadMark sOffset='50' type='broken' color='yellow' width='0.15'/></lane></center>\
        <right><lane id='-1'><width sOffset='0' a='3' b='0' c='0' d='0'/>\
        <roadMark sOffset='0' type='solid' color='white'/></lane></right></laneSection>";
    let plan = plan(&road(
        "1",
        "",
        100.0,
        &line(0.0, 0.0, 0.0, 0.0, 100.0),
        lanes,
    ));
    let section = &plan.roads[0].sections[0];
    let center = &section.center;
    assert_eq!(
        places(center),
        [[2_000, 0], [5_330, 0], [7_000, 0], [10_000, 0]]
    );
    let marks: Vec<_> = center.marks.iter().collect();
    let told: Vec<_> = marks
        .iter()
        .map(|mark| {
            (
                mark.first,
                mark.points,
                mark.kind.as_str(),
                mark.color.as_str(),
                mark.width,
            )
        })
        .collect();
    assert_eq!(
        told,
        [(0, 2, "solid", "white", 12), (2, 2, "broken", "yellow", 15)]
    );
    let outer = &section.right[0].border;
    assert_eq!(places(outer), [[2_000, -300], [10_000, -300]]);
    assert_eq!(
        (
            outer.marks[0].first,
            outer.marks[0].points,
            outer.marks[0].width
        ),
        (0, 2, 0)
    );
}

#[test]
fn step_in_width_becomes_step_of_border() {
    let lanes = "<laneSection s='0'><center><lane id='0'/></center><right><lane id='-1'>\
        <width sOffset='0' a='3' b='0' c='0' d='0'/><width sOffset='40' a='4' b='0' c='0' d='0'/>\
        </lane></right></laneSection>";
    let plan = plan(&road(
        "1",
        "",
        100.0,
        &line(0.0, 0.0, 0.0, 0.0, 100.0),
        lanes,
    ));
    let lane = &plan.roads[0].sections[0].right[0];
    assert_eq!(
        places(&lane.border),
        [[0, -300], [4_000, -300], [4_000, -400], [10_000, -400]]
    );
    assert_eq!(
        lane.widths,
        [[0, 300], [4_000, 300], [4_000, 400], [10_000, 400]]
    );
}

#[test]
fn sections_follow_order_of_the_file() {
    let section = |s: u32, id: i64| {
        format!(
            "<laneSection s='{s}'><center><lane id='0'/></center><right>\
             <lane id='{id}' type='shoulder'><width sOffset='0' a='2' b='0' c='0' d='0'/></lane></right></laneSection>"
        )
    };
    let lanes = section(0, -1) + &section(30, -2);
    let plan = plan(&road(
        "1",
        "",
        100.0,
        &line(0.0, 0.0, 0.0, 0.0, 100.0),
        &lanes,
    ));
    let told: Vec<_> = plan.roads[0]
        .sections
        .iter()
        .map(|section| (section.s, section.right[0].id))
        .collect();
    assert_eq!(told, [([0, 3_000], -1), ([3_000, 10_000], -2)]);
}

#[test]
fn left_hand_traffic_links_and_elevation_are_included() {
    let more = "<link><predecessor elementType='road' elementId='x'/>\
        <successor elementType='junction' elementId='j'/></link>\
        <elevationProfile><elevation s='0' a='10' b='0.1' c='0' d='0'/>\
        <elevation s='50' a='15' b='0' c='0.002' d='0'/></elevationProfile>";
    let xml = road(
        "1",
        "rule='LHT'",
        100.0,
        &line(0.0, 0.0, 0.0, 0.0, 100.0),
        TWO_LANES,
    )
    .replace("<planView>", &format!("{more}<planView>"));
    let plan = plan(&xml);
    let road = &plan.roads[0];
    assert_eq!(road.flags, 1);
    assert_eq!(road.links, [(1, "x".to_owned()), (2, "j".to_owned())]);
    assert_eq!(road.elevation[..2], [(0, 1_000), (5_000, 1_500)]);
    assert_eq!(road.elevation.last(), Some(&(10_000, 2_000)));
    for pair in road.elevation[1..].windows(2) {
        let middle = (pair[0].0 + pair[1].0) as f64 / 2.0;
        let drawn = (pair[0].1 + pair[1].1) as f64 / 2.0;
        let ds = middle / 100.0 - 50.0;
        let off = drawn - 100.0 * (15.0 + 0.002 * ds * ds);
        assert!(off.abs() <= 2.0, "{off} cm at {middle}");
    }
}

#[test]
fn large_coordinates_are_shifted_before_rounding() {
    let geometry = line(0.0, 690_123.456, 5_334_567.891, 0.0, 100.0);
    let plan = plan(&road("1", "", 100.0, &geometry, TWO_LANES));
    assert_eq!(plan.origin, [690_123.0, 5_334_567.0]);
    let center = &plan.roads[0].sections[0].center;
    assert_eq!(places(center), [[46, 89], [10_046, 89]]);
}

#[test]
fn junction_outline_surrounds_connecting_roads() {
    let member = |id: &str, x: f64, y: f64, hdg: f64| {
        road(
            id,
            "junction='j'",
            20.0,
            &line(0.0, x, y, hdg, 20.0),
            TWO_LANES,
        )
    };
    let roads = member("a", 0.0, 0.0, 0.0) + &member("b", 10.0, -10.0, FRAC_PI_2);
    let junction = "<junction id='j' name='Cross' type='default'>\
        <connection id='0' incomingRoad='b' connectingRoad='a' contactPoint='start'/>\
        <connection id='1' incomingRoad='nowhere' connectingRoad='b' contactPoint='start'/></junction>";
    let plan = plan(&(roads + junction));
    let [junction] = &plan.junctions[..] else {
        panic!("{:?}", plan.junctions);
    };
    assert_eq!(
        (
            junction.id.as_str(),
            junction.name.as_str(),
            junction.kind.as_str()
        ),
        ("j", "Cross", "default")
    );
    assert_eq!(junction.connections, [(2, 1), (0, 2)]);
    assert_eq!(plan.roads[0].junction, 1);
    let absolute = junction.outline.iter().map(|at| {
        [
            at[0] + 100 * plan.origin[0] as i64,
            at[1] + 100 * plan.origin[1] as i64,
        ]
    });
    let mut outline: Vec<[i64; 2]> = absolute.collect();
    outline.sort_unstable();
    let expected = [
        [0, -300],
        [0, 350],
        [650, -1_000],
        [650, 1_000],
        [1_300, -1_000],
        [1_300, 1_000],
        [2_000, -300],
        [2_000, 350],
    ];
    assert_eq!(outline, expected);
}

#[test]
fn junction_outline_follows_given_boundary() {
    let road = road(
        "a",
        "junction='j'",
        20.0,
        &line(0.0, 0.0, 0.0, 0.0, 20.0),
        TWO_LANES,
    );
    let junction = "<junction id='j'><boundary>\
        <segment type='lane' roadId='a' boundaryLane='-1' sStart='begin' sEnd='15'/>\
        <segment type='lane' roadId='a' boundaryLane='1' sStart='15' sEnd='begin'/>\
        <segment type='joint' roadId='a' contactPoint='start' jointLaneStart='1' jointLaneEnd='-1'/>\
        </boundary></junction>";
    let plan = plan(&(road + junction));
    assert_eq!(
        plan.junctions[0].outline,
        [[0, -300], [1_500, -300], [1_500, 350], [0, 350], [0, -300]]
    );
}

#[test]
fn signals_and_objects_stand_where_model_places_them() {
    let more = "<objects><object id='box' type='building' s='10' t='5' hdg='0' length='4' width='2'/>\
        <object id='tree' type='tree' s='20' t='-5' radius='1'/>\
        <object id='spot' s='30' t='0'/>\
        <object id='lost' s='30'/>\
        <object id='area' s='40' t='0' hdg='1.5707963267948966'><outlines><outline>\
        <cornerLocal u='0' v='0'/><cornerLocal u='3' v='0'/><cornerRoad s='50' t='2'/></outline></outlines></object>\
        </objects><signals><signal id='s1' name='stop' type='206' subtype='-1' s='12.5' t='-4' orientation='-' hOffset='0.1' dynamic='yes'/>\
        <signal id='s2' s='NaN' t='0'/></signals>";
    let xml = road("1", "", 100.0, &line(0.0, 0.0, 0.0, 0.0, 100.0), TWO_LANES)
        .replace("</road>", &format!("{more}</road>"));
    let plan = plan(&xml);
    let outlines: Vec<_> = plan
        .objects
        .iter()
        .map(|object| object.outline.clone())
        .collect();
    assert_eq!(
        outlines[0],
        [[800, 400], [1_200, 400], [1_200, 600], [800, 600]]
    );
    assert_eq!(outlines[1].len(), 8);
    assert_eq!(
        (outlines[1][0], outlines[1][2]),
        ([2_100, -500], [2_000, -400])
    );
    assert_eq!(outlines[2], [[3_000, 0]]);
    assert_eq!(outlines[3], Vec::<[i64; 2]>::new());
    assert_eq!(outlines[4], [[4_000, 0], [4_000, 300], [5_000, 200]]);
    let object = &plan.objects[0];
    assert_eq!(object.names, ["box", "", "building"]);
    assert_eq!((object.road, object.s, object.t), (0, 1_000, 500));
    let signal = &plan.signals[0];
    assert_eq!(signal.names, ["s1", "stop", "206", "-1"]);
    assert_eq!(
        (signal.s, signal.t, signal.at),
        (1_250, -400, [1_250, -400])
    );
    assert_eq!((signal.heading, signal.flags), (-3_042, 1));
    assert_eq!((plan.signals[1].at, plan.signals[1].flags), ([0, 0], 2));
    assert_eq!(plan.cuts.len(), 2, "{:?}", plan.cuts);
    assert!(plan.cuts[0].contains("'s2'") && plan.cuts[1].contains("'lost'"));
}
