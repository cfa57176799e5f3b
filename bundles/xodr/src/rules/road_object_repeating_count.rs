use crate::families::object_parts::named;
use crate::families::on_road::OnRoad;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[MOST],
    each: Some(each),
    ..Rule::after(READABLE)
};

const MOST: Param = Param::number(
    "most",
    10_000.0,
    "",
    "largest number of copies that is accepted for a repetition",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let most = found.number(&MOST);
    for (road, object) in map.part(part).objects() {
        for repeat in object.repeats() {
            let values = repeat.length().zip(repeat.distance());
            let Some((length, distance)) =
                values.filter(|(length, distance)| *length > 0.0 && *distance > 0.0)
            else {
                continue;
            };
            let count = length / distance;
            if count <= most {
                continue;
            }
            let text = format!(
                "{} is repeated every {distance} m over {length} m, which makes {count:.0} copies; at most \
                 {most} are accepted; for one long object, use a `distance` of 0",
                named(object.node())
            );
            found
                .issue(Place::attribute_or_node(repeat.node(), "distance"), text)
                .on(
                    road,
                    repeat.s().unwrap_or(0.0),
                    repeat.t_start().unwrap_or(0.0),
                );
        }
    }
}
