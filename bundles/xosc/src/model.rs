//! The model for rules about scenarios: `Rule<Scene>` gets a `&Scenario<'_>`.

use std::sync::Arc;

use qcbus_document::Image;
use qcbus_messages::{Absence, DocumentRole};
use qcbus_openscenario::{Element, Inputs, LinkedCatalog, LinkedMap, RoadNetwork, Scenario};
use qcbus_sdk::{Finding, LinkedModel, Model, Place, Sink, Subject, Unbuilt};

/// A scenario, catalog or distribution with everything that it refers to. It is read once per
/// document and shared by all rules about it.
pub enum Scene {}

impl Model for Scene {
    type Of<'d> = Scenario<'d>;
    type Part = ();

    fn build<'d>(subject: &'d Subject<'d>) -> Result<Scenario<'d>, Unbuilt> {
        if let Some(version) = subject.version().filter(|version| version.major != 1) {
            // The same name may mean something else in another version of the language.
            let why = format!("OpenSCENARIO {version} is not supported, only 1.0 to 1.4 are");
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

/// The roads of a scenario's map, cached for the next scenario on the same map.
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
        // The missing part of a truncated map is unknown, so a broken map is not used.
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

/// Returns the directories with a file that could not be read. A missing directory is left out
/// because it cannot contain anything.
fn incomplete(subject: &Subject<'_>) -> Vec<u32> {
    let doubtful = subject.missing().iter().filter(|missing| {
        missing.role == DocumentRole::Catalog
            && !matches!(missing.why, Absence::NotThere | Absence::EmptyPath)
    });
    doubtful.map(|missing| missing.referred_at).collect()
}

/// Reports findings about elements that may be in a catalog.
pub trait About<'d> {
    /// Reports a finding about an attribute of an element, or about the element if the attribute is
    /// missing. A finding in a catalog entry is reported at the reference, with the place in the
    /// catalog as second place. The author needs both to fix it. If several references lead to the
    /// same fault, it is reported at the first one. The others are further places.
    fn about(
        &mut self,
        element: Element<'_, '_>,
        attribute: &str,
        text: impl Into<String>,
    ) -> Finding<'_, 'd>;
}

/// Adds the name of a fault to a finding, if the fault is known.
pub(crate) trait OfFault {
    /// The finding is about this fault.
    fn maybe_fault(self, fault: Option<String>) -> Self;
    /// The finding is a consequence of this fault.
    fn maybe_follows(self, fault: Option<String>) -> Self;
}

impl OfFault for Finding<'_, '_> {
    fn maybe_fault(self, fault: Option<String>) -> Self {
        match fault {
            Some(fault) => self.fault(fault),
            None => self,
        }
    }

    fn maybe_follows(self, fault: Option<String>) -> Self {
        match fault {
            Some(fault) => self.follows(fault),
            None => self,
        }
    }
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
        let text = format!("in the catalog entry `{entry}`: {}", text.into());
        self.issue_behind(reference, place, text)
    }
}
