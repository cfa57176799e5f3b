use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (_, connection) in map.connections() {
        let mut first: HashMap<_, Node<'_>> = HashMap::default();
        for link in connection.lane_links() {
            let (Some(from), Some(to)) = (link.from(), link.to()) else {
                continue;
            };
            let key = (from, to, link.from_layer(), link.to_layer());
            let Some(before) = first.get(&key) else {
                first.insert(key, link.node());
                continue;
            };
            let text = format!(
                "connection `{}` links lane `{from}` to lane `{to}` a second time; one lane link is enough, and \
                 the second one is probably meant for other lanes",
                connection.id().unwrap_or_default()
            );
            found.issue(link.node(), text).at(*before, "the first one");
        }
    }
}
