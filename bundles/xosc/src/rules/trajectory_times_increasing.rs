use crate::families::positions::shown;
use crate::families::trajectories::{TimedPoint, Timing, named, shape, timed_points, timing_of};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for trajectory in scenario.elements_everywhere("Trajectory") {
        let is_asked = match timing_of(trajectory) {
            Timing::Asked(_) => true,
            Timing::Unknown => false,
            // Older exporters write `0` for every vertex, and these times are not used.
            Timing::Ignored => continue,
        };
        let Some(shape) = shape(trajectory).filter(|shape| !shape.is("Clothoid")) else {
            continue;
        };
        look_at(trajectory, shape, is_asked, found);
    }
}

/// A time that is not after the previous one.
#[derive(Clone, Copy)]
struct Step<'m, 'd> {
    from: (TimedPoint<'m, 'd>, f64),
    to: (TimedPoint<'m, 'd>, f64),
}

impl Step<'_, '_> {
    /// Returns the level of the fault, or `None` if the time increases. Equal times are no fault if
    /// the times are unused.
    fn level(&self, is_asked: bool) -> Option<Level> {
        let ((from, before), (to, after)) = (self.from, self.to);
        if after > before {
            return None;
        }
        if after < before {
            return Some(if is_asked {
                Level::Error
            } else {
                Level::Warning
            });
        }
        if !is_asked {
            return None;
        }
        // Two places at the same time are impossible. The same place may be listed twice.
        let distance = from.spot().zip(to.spot());
        let distance = distance.and_then(|(from, to)| from.distance(&to));
        let is_jump = distance.is_some_and(|distance| distance > 1e-3) && from.element.is("Vertex");
        Some(if is_jump {
            Level::Error
        } else {
            Level::Warning
        })
    }
}

fn look_at(
    trajectory: Element<'_, '_>,
    shape: Element<'_, '_>,
    is_asked: bool,
    found: &mut Sink<'_>,
) {
    let stamps = timed_points(shape);
    let known: Vec<_> = stamps
        .into_iter()
        .filter_map(|stamp| Some((stamp, stamp.time()?)))
        .collect();
    if let Some((stamp, time)) = known.first().filter(|(_, time)| is_asked && *time < 0.0)
        && stamp.element.is("Vertex")
    {
        let text = format!(
            "the {} starts at {time} s, but times start at 0",
            named(trajectory)
        );
        found.about(stamp.element, stamp.attribute, text);
    }
    let steps = known.windows(2).filter_map(|pair| match pair {
        [from, to] => {
            let step = Step {
                from: *from,
                to: *to,
            };
            Some((step.level(is_asked)?, step))
        }
        _ => None,
    });
    let steps: Vec<_> = steps.collect();
    let worst = steps.iter().find(|(level, _)| *level == Level::Error);
    if let Some((level, step)) = worst.or_else(|| steps.first()) {
        say(trajectory, *step, steps.len(), *level, found);
    }
}

fn say(
    trajectory: Element<'_, '_>,
    step: Step<'_, '_>,
    count: usize,
    level: Level,
    found: &mut Sink<'_>,
) {
    let ((from, before), (to, after)) = (step.from, step.to);
    let more = match count {
        1 => String::new(),
        count => format!(
            "; this occurs at {count} places of the {}",
            named(trajectory)
        ),
    };
    let text = format!(
        "`{}` of `{}` is {} s, but the time before it is {before} s; the times of a trajectory must increase{more}",
        to.attribute,
        to.element.name(),
        shown(to.element, to.attribute, &after.to_string()),
    );
    let place = Place::attribute_or_node(from.element.node(), from.attribute);
    found
        .about(to.element, to.attribute, text)
        .level(level)
        .at(place, "the time before it");
}
