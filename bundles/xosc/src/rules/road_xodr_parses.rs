use qcbus_messages::DocumentRole;
use qcbus_openscenario::{Network, Scenario};
use qcbus_sdk::{Rule, Sink};

use crate::model::{About as _, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_road_xodr_parses",
    uids: &["qcbus.dev:xosc:1.0.0:road.xodr_parses"],
    after: super::READABLE,
    page: include_str!("road_xodr_parses.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if !matches!(scenario.network(), Network::Foreign) {
        return;
    }
    let subject = found.subject();
    let Some(linked) = subject.with_role(DocumentRole::Map).next() else {
        return;
    };
    let Some(root) = linked.document.root() else {
        return;
    };
    let network = scenario.root().child("RoadNetwork");
    let file = network.and_then(|network| {
        let mut files = network.children();
        files.find(|file| file.node().offset() == linked.referred_at)
    });
    let Some(file) = file else { return };
    // Maps of other formats, such as Lanelet2, are XML too; their names say so.
    let path = linked.document.path().to_ascii_lowercase();
    let is_called_map = [".xodr", ".xodrz"]
        .iter()
        .any(|ending| path.ends_with(ending));
    if !is_called_map && !root.is("OpenSCENARIO") {
        return;
    }
    let text = format!(
        "the file of the road network is no OpenDRIVE map: its root element is `{}` instead of `OpenDRIVE`; \
         nothing that needs roads was checked",
        root.name()
    );
    found
        .about(file, "filepath", text)
        .at(root, "the root element of the map");
}
