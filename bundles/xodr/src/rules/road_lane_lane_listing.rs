use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        let numbered = section.lanes().filter_map(|lane| Some((lane.id()?, lane)));
        let lanes: Vec<_> = numbered.collect();
        let rising = lanes.windows(2).find(|pair| pair[1].0 > pair[0].0);
        let Some([(left, before), (right, lane)]) = rising else {
            continue;
        };
        let text = format!(
            "lane {right} is listed after lane {left}; lanes should be listed from left to right, \
             with descending ids"
        );
        found
            .issue(lane.node(), text)
            .at(before.node(), "the lane listed before it");
    }
}
