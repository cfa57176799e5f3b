use crate::families::ascending;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::warning(
        "no known reader uses the material of lanes by its order",
    )),
    versions: "1.1.0..",
    params: &[ascending::TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    ascending::lane_records(map.part(part), "material", ascending::VOID, found);
}
