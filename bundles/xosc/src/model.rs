//! What rules about scenarios look at: `Rule<Scene>` gets a `&Scenario<'_>`.

use std::sync::Arc;

use qcbus_document::Image;
use qcbus_messages::{Absence, DocumentRole};
use qcbus_openscenario::{Element, Inputs, LinkedCatalog, LinkedMap, RoadNetwork, Scenario};
use qcbus_sdk::{Finding, LinkedModel, Model, Place, Sink, Subject, Unbuilt};

/// A scenario, catalog or distribution with all that it refers to, read once per document and shared
/// by all rules about it.
pub enum Scene {}

impl Model for Scene {
    type Of<'d> = Scenario<'d>;
    type Part = ();

    fn build<'d>(subject: &'d Subject<'d>) -> Result<Scenario<'d>, Unbuilt> {
        if let Some(version) = subject.version().filter(|version| version.major != 1) {
            // What has the same name in another language may mean something else.
            let why = format!("OpenSCENARIO {version} is not known, only 1.0 to 1.4 are");
            return Err(Unbuilt::Broken(why));
        }
        let inputs = Inputs {
            document: subject.root(),
            kind: subject.kind(),
            version: subject
                .version()
                .map(|version| (version.major, version.minor)),
            map: map(subject),
            catalogs: catalogs(subject),
            incomplete: incomplete(subject),
        };
        Scenario::new(&inputs).ok_or_else(|| Unbuilt::Broken("there is no root element".to_owned()))
    }

    fn parts(_: &Scenario<'_>) -> Vec<()> {
        vec![()]
    }
}

/// The roads of a scenario's map, kept for the next scenario on the same one.
struct KeptRoads(Arc<RoadNetwork>);

impl LinkedModel for KeptRoads {
    fn build(image: Image) -> Option<KeptRoads> {
        RoadNetwork::of(image)
            .ok()
            .map(|roads| KeptRoads(Arc::new(roads)))
    }
}

fn map(subject: &Subject<'_>) -> LinkedMap {
    if let Some(linked) = subject.with_role(DocumentRole::Map).next() {
        let broken = subject.missing().iter().any(|missing| {
            missing.role == DocumentRole::Map && matches!(missing.why, Absence::Broken { .. })
        });
        // Of a map that breaks off, nobody knows what would have followed.
        let is_map = linked
            .document
            .root()
            .is_some_and(|root| root.is("OpenDRIVE"));
        return match is_map {
            _ if broken => LinkedMap::NotHad,
            false => LinkedMap::Foreign,
            true => linked
                .cached::<KeptRoads>()
                .map_or(LinkedMap::NotHad, |kept| LinkedMap::Roads(kept.0.clone())),
        };
    }
    let mut missing = subject
        .missing()
        .iter()
        .filter(|missing| missing.role == DocumentRole::Map);
    match missing.next().map(|missing| &missing.why) {
        None => LinkedMap::Unnamed,
        Some(Absence::EmptyPath) => LinkedMap::Unnamed,
        Some(Absence::SimulatorMap) => LinkedMap::Simulator,
        Some(_) => LinkedMap::NotHad,
    }
}

fn catalogs<'d>(subject: &'d Subject<'d>) -> Vec<LinkedCatalog<'d>> {
    let linked = subject.with_role(DocumentRole::Catalog);
    linked
        .map(|linked| LinkedCatalog {
            document: linked.document,
            referred_at: linked.referred_at,
        })
        .collect()
}

/// The directories of which something could not be read. One that is not there at all is no doubt:
/// nothing can be in it.
fn incomplete(subject: &Subject<'_>) -> Vec<u32> {
    let doubtful = subject.missing().iter().filter(|missing| {
        missing.role == DocumentRole::Catalog
            && !matches!(missing.why, Absence::NotThere | Absence::EmptyPath)
    });
    doubtful.map(|missing| missing.referred_at).collect()
}

/// Says things about elements that may be written in a catalog.
pub trait About<'d> {
    /// Says something about an attribute of an element, or about the element when the attribute is
    /// not there. What is written in the entry of a catalog is said at the reference to it, with the
    /// place in the catalog as second: whoever mends it must know both. Where several references lead to
    /// the same fault, it is said at the first, with the others as further places.
    fn about(
        &mut self,
        element: Element<'_, '_>,
        attribute: &str,
        text: impl Into<String>,
    ) -> Finding<'_, 'd>;
}

impl<'d> About<'d> for Sink<'d> {
    fn about(
        &mut self,
        element: Element<'_, '_>,
        attribute: &str,
        text: impl Into<String>,
    ) -> Finding<'_, 'd> {
        let place = Place::attribute_or_node(element.node(), attribute);
        let (Some(reference), Some(entry)) = (element.reference(), element.entry()) else {
            return self.issue(place, text);
        };
        let entry = entry.attr("name").unwrap_or("");
        let text = format!("in the catalog's entry `{entry}`: {}", text.into());
        self.issue_behind(reference, place, text)
    }
}
