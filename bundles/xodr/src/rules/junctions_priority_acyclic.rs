use crate::prelude::*;
use foldhash::HashMap;
use qcbus_opendrive::Priority;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        check(junction, found);
    }
}

/// Reports a cycle of priorities. It repeatedly removes roads over which no road has priority. The
/// remaining roads form a cycle or give way to one.
fn check(junction: &Junction<'_>, found: &mut Sink<'_>) {
    let records: Vec<(&str, &str, Priority<'_>)> = junction
        .priorities()
        .filter_map(|one| Some((one.high()?, one.low()?, one)))
        .filter(|(high, low, _)| high != low)
        .collect();
    let mut above: HashMap<&str, usize> = HashMap::default();
    let mut over: HashMap<&str, Vec<&str>> = HashMap::default();
    for (high, low, _) in &records {
        *above.entry(low).or_default() += 1;
        above.entry(high).or_default();
        over.entry(high).or_default().push(low);
    }
    let mut free: Vec<&str> = above
        .iter()
        .filter_map(|(road, count)| (*count == 0).then_some(*road))
        .collect();
    while let Some(road) = free.pop() {
        for low in over.get(road).into_iter().flatten() {
            if let Some(count) = above.get_mut(low) {
                *count = count.saturating_sub(1);
                if *count == 0 {
                    free.push(low);
                }
            }
        }
    }
    let stuck = |road: &str| above.get(road).is_some_and(|count| *count > 0);
    let mut circle = records
        .iter()
        .filter(|(high, low, _)| stuck(high) && stuck(low));
    let Some((high, low, first)) = circle.next() else {
        return;
    };
    let text = format!(
        "road `{high}` has priority over road `{low}`, but by the other records of junction `{}` road `{high}` \
         must give way to it; priorities must not form a circle, because then no road goes first",
        junction.id()
    );
    let mut finding = found.issue(first.node(), text);
    for (_, _, other) in circle.take(crate::families::on_road::MAX_PLACES) {
        finding = finding.at(other.node(), "a further record of the circle");
    }
}
