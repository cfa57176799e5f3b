//! Entities that an action controls.

use std::borrow::Cow;

use crate::queries::element::Element;

/// The actors of an action.
#[derive(Debug, Clone)]
pub struct Actors<'m, 'd> {
    /// Elements that name the actors: `EntityRef` of the maneuver group, or the `Private` around an
    /// action of `Init`.
    pub named: Vec<Element<'m, 'd>>,
    /// Whether the entities that trigger the event act, too.
    pub triggering: bool,
}

impl<'m, 'd> Actors<'m, 'd> {
    /// Returns the actors for elements in a `Private` or a `ManeuverGroup`; `None` elsewhere.
    pub fn of(element: Element<'m, 'd>) -> Option<Actors<'m, 'd>> {
        let around = std::iter::once(element).chain(element.ancestors());
        let holder = around
            .into_iter()
            .find(|one| one.is("Private") || one.is("ManeuverGroup"))?;
        if holder.is("Private") {
            return Some(Actors {
                named: vec![holder],
                triggering: false,
            });
        }
        let Some(block) = holder.child("Actors") else {
            return Some(Actors {
                named: Vec::new(),
                triggering: false,
            });
        };
        Some(Actors {
            named: block.children_named("EntityRef").collect(),
            // An unknown value may be true.
            triggering: block.has("selectTriggeringEntities")
                && block.flag("selectTriggeringEntities") != Some(false),
        })
    }

    /// Returns the names of the actors, or `None` if one is unknown or triggering entities act,
    /// too.
    pub fn names(&self) -> Option<Vec<Cow<'d, str>>> {
        if self.triggering {
            return None;
        }
        self.named.iter().map(|one| one.text("entityRef")).collect()
    }
}
