//! Cache of actors for actions. The actors of a group are looked up once for all its actions.

use std::rc::Rc;

use crate::prelude::*;
use foldhash::HashMap;

/// The actors of a `ManeuverGroup` or `Private` by name, with the elements that name them.
pub(crate) struct Cast<'m, 'd> {
    /// Offset of the group or `Private` in the document.
    pub(crate) at: u32,
    pub(crate) by_name: HashMap<String, Element<'m, 'd>>,
}

/// Casts that are already looked up.
#[derive(Default)]
pub(crate) struct Casts<'m, 'd> {
    known: HashMap<u32, Rc<Cast<'m, 'd>>>,
}

impl<'m, 'd> Casts<'m, 'd> {
    /// Returns the actors of an action, or `None` if it has none.
    pub(crate) fn of(&mut self, action: Element<'m, 'd>) -> Option<Rc<Cast<'m, 'd>>> {
        let mut around = action.ancestors();
        let holder = around.find(|one| one.is("Private") || one.is("ManeuverGroup"))?;
        let at = holder.node().offset();
        if let Some(cast) = self.known.get(&at) {
            return Some(Rc::clone(cast));
        }
        let mut by_name = HashMap::default();
        for actor in Actors::of(holder)?.named {
            if let Some(name) = actor.text("entityRef") {
                by_name.entry(name.into_owned()).or_insert(actor);
            }
        }
        let cast = Rc::new(Cast { at, by_name });
        self.known.insert(at, Rc::clone(&cast));
        Some(cast)
    }
}
