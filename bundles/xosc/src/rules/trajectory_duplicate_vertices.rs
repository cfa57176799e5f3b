use crate::families::positions::Spot;
use crate::families::trajectories::{TimedPoint, Timing, named, shape, timed_points, timing_of};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for trajectory in scenario.elements_everywhere("Trajectory") {
        let Some(shape) = shape(trajectory).filter(|shape| shape.is("Polyline")) else {
            continue;
        };
        // An entity that keeps to times may stand still. Another rule reports times that do not
        // increase.
        let may_wait = match timing_of(trajectory) {
            Timing::Asked(_) => continue,
            Timing::Ignored => false,
            Timing::Unknown => true,
        };
        let vertices = places(shape);
        let same: Vec<_> = vertices
            .windows(2)
            .filter_map(|pair| match pair {
                [one, two] if is_same(one, two, may_wait) => Some((one.0, two.0)),
                _ => None,
            })
            .collect();
        let Some((before, vertex)) = same.first() else {
            continue;
        };
        let more = match same.len() {
            1 => String::new(),
            count => format!("; the {} has {count} such pairs", named(trajectory)),
        };
        let text = format!(
            "the vertex is at the same position as the one before it, so the line between them has no \
             direction{more}"
        );
        found
            .about(vertex.element, "", text)
            .at(before.element.node(), "the vertex before it");
    }
}

type Vertex<'m, 'd> = (TimedPoint<'m, 'd>, Option<Spot<'d>>);

fn places<'m, 'd>(shape: Element<'m, 'd>) -> Vec<Vertex<'m, 'd>> {
    timed_points(shape)
        .into_iter()
        .map(|stamp| (stamp, stamp.spot()))
        .collect()
}

fn is_same(one: &Vertex<'_, '_>, two: &Vertex<'_, '_>, may_wait: bool) -> bool {
    let spots = one.1.as_ref().zip(two.1.as_ref());
    let distance = spots.and_then(|(one, two)| one.distance(two));
    if distance.is_none_or(|distance| distance >= 1e-6) {
        return false;
    }
    !may_wait || one.0.time() == two.0.time()
}
