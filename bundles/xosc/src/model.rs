//! The model for rules about scenarios: `Rule<Scene>` gets a `&Scenario<'_>`.

use std::sync::Arc;

use qcbus_document::Image;
use qcbus_openscenario::{Element, Inputs, Linked, RoadNetwork, Scenario};
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
        let version = subject.version();
        let linked = subject.linked().iter().map(|it| Linked {
            document: it.document,
            role: it.role,
            referred_at: it.referred_at,
        });
        let roads = |place: usize| {
            let kept = subject.linked().get(place)?.cached::<KeptRoads>()?;
            Some(kept.0.clone())
        };
        let inputs = Inputs::of(
            subject.root(),
            subject.kind(),
            version.map(|it| (it.major, it.minor)),
            &linked.collect::<Vec<_>>(),
            subject.missing(),
            roads,
        );
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
