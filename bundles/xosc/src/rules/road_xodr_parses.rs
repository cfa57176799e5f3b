use crate::prelude::*;
use qcbus_messages::DocumentRole;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let subject = found.subject();
    let network = scenario.root().child("RoadNetwork");
    let files = || network.into_iter().flat_map(Element::children);
    let (file, root) = match scenario.network() {
        Network::Foreign => {
            let Some(linked) = subject.with_role(DocumentRole::Map).next() else {
                return;
            };
            let file = files().find(|file| file.node().offset() == linked.referred_at);
            (file, linked.document.root())
        }
        // A file that is already read as a catalog, and the scenario itself, are not read again.
        Network::Unnamed => {
            let file = files().find(|file| file.is("LogicFile"));
            let path = file.and_then(|file| file.text("filepath"));
            let read = path.and_then(|path| {
                let own = scenario.root().node();
                let mut linked = subject.linked().iter();
                let other = linked.find(|linked| is_path_of(&linked.path, &path));
                let itself = || is_path_of(own.document().path(), &path).then_some(own);
                other.map_or_else(itself, |linked| linked.document.root())
            });
            (file, read)
        }
        Network::Simulator | Network::NotHad | Network::Map(_) => return,
    };
    let (Some(file), Some(root)) = (file, root) else {
        return;
    };
    // Maps of other formats, such as Lanelet2, are also XML. Their file names show this.
    let path = root.document().path().to_ascii_lowercase();
    let is_called_map = [".xodr", ".xodrz"]
        .iter()
        .any(|ending| path.ends_with(ending));
    if !is_called_map && !root.is("OpenSCENARIO") {
        return;
    }
    let text = format!(
        "the file of the road network is not an OpenDRIVE map: its root element is `{}` instead of `OpenDRIVE`; \
         checks that need roads were skipped",
        root.name()
    );
    found
        .about(file, "filepath", text)
        .at(root, "the root element of that file");
}

/// Checks by its text whether a reference from the scenario's directory leads to a file.
fn is_path_of(absolute: &str, reference: &str) -> bool {
    let reference = reference.trim().replace('\\', "/");
    let mut rest = &*reference;
    while let Some(inner) = rest.strip_prefix("./").or_else(|| rest.strip_prefix("../")) {
        rest = inner;
    }
    let before = absolute.replace('\\', "/");
    let before = before.strip_suffix(rest);
    !rest.is_empty() && before.is_some_and(|before| before.is_empty() || before.ends_with('/'))
}
