use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;
use qcbus_opendrive::LaneRecord;

const SAME_PLACE: Param = Param::number(
    "same_place",
    1e-6,
    "m",
    "records whose starts differ by less than this start at the same place",
);

/// Maximum number of previous records for comparisons. It limits the work on hostile files.
const LOOK_BACK: usize = 64;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    params: &[SAME_PLACE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes() {
        let records: Vec<LaneRecord<'_>> = lane.records_named("access").collect();
        for (index, record) in records.iter().enumerate() {
            for before in &records[index.saturating_sub(LOOK_BACK)..index] {
                compare(lane, before, record, found);
            }
        }
    }
}

fn compare(
    lane: LaneRef<'_, '_>,
    before: &LaneRecord<'_>,
    record: &LaneRecord<'_>,
    found: &mut Sink<'_>,
) {
    let rules = before.node().attr("rule").zip(record.node().attr("rule"));
    let starts = before.s_offset().zip(record.s_offset());
    let (Some((earlier, later)), Some((start, own))) = (rules, starts) else {
        return;
    };
    if earlier == later || (start - own).abs() > found.number(&SAME_PLACE) {
        return;
    }
    let text = format!(
        "the rule is `{later}` at s = {own} m of the lane section on {}, but another record there has the rule \
         `{earlier}`; at one place either only `allow` or only `deny` may be used",
        lane_name(lane)
    );
    found
        .issue(Place::attribute_or_node(record.node(), "rule"), text)
        .in_lane(lane, own)
        .at(before.node(), "the other record");
}
