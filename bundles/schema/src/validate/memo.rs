//! Cached results about wrong children, because a document can repeat one mistake a million times.

use std::collections::HashMap;
use std::rc::Rc;

use qcbus_document::Node;

use super::limit;
use super::way::{Way, way_to};
use crate::model::{AllModel, Model, Schema};
use crate::names::NameId;
use crate::similar::closest;
use crate::versions::is_known_elsewhere;
use crate::work::steps;

/// Maximum number of cached results. A schema and a document usually need at most a few dozen.
const MOST: usize = 65_536;

/// A model, one of its states, and the name read there.
type Transition = (usize, u16, u16);

#[derive(Debug, Default)]
pub(super) struct Memo<'s> {
    ways: HashMap<Transition, Option<Rc<Way>>>,
    meant: HashMap<Transition, Meant<'s>>,
    /// Maximum number of children for a model and a name.
    most: HashMap<(usize, u16), Option<u32>>,
}

/// Suggestions for a misspelt child.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Meant<'s> {
    /// A child that is allowed here.
    pub(super) here: Option<&'s str>,
    /// A child that the parent allows anywhere.
    pub(super) anywhere: Option<&'s str>,
}

impl<'s> Memo<'s> {
    /// Returns the path from a state to the child of this name, or (without a name) to the end.
    pub(super) fn way(
        &mut self,
        model: &'s Model,
        state: u16,
        wanted: Option<NameId>,
    ) -> Option<Rc<Way>> {
        let search = || {
            match wanted {
                Some(_) => way_to(model, state, |edge, _| edge == wanted),
                None => way_to(model, state, |_, accepts| accepts),
            }
            .map(Rc::new)
        };
        let name = wanted.unwrap_or(NameId::UNKNOWN).0;
        let key = (std::ptr::from_ref(model) as usize, state, name);
        if self.ways.len() >= MOST {
            return self.ways.get(&key).cloned().unwrap_or_else(search);
        }
        self.ways.entry(key).or_insert_with(search).clone()
    }

    /// Returns the maximum number of children with a name, or `None` without a limit.
    pub(super) fn most(&mut self, model: &'s Model, name: NameId) -> Option<u32> {
        let key = (std::ptr::from_ref(model) as usize, name.0);
        *self
            .most
            .entry(key)
            .or_insert_with(|| limit::most(model, name))
    }

    /// Returns the suggestions for a child that a model does not know. There are none if another
    /// version knows the child, or if the cache is full.
    pub(super) fn child(
        &mut self,
        (node, parent): (Node<'_>, Node<'_>),
        (model, state): (&'s Model, u16),
        schema: &'s Schema,
    ) -> Meant<'s> {
        let (name, number) = (node.name(), node.name_number());
        let names = &schema.names;
        let key = (std::ptr::from_ref(model) as usize, state, number);
        self.known(key, || {
            let edges = model.edges(state);
            steps(edges.len() + model.children.len());
            let here = closest(name, edges.iter().map(|edge| names.text(edge.name)));
            let all = model.children.iter().map(|child| names.text(child.name));
            let anywhere = here.or_else(|| closest(name, all));
            if anywhere.is_some() && is_known_elsewhere(schema, parent.name(), name) {
                return Meant::default();
            }
            Meant { here, anywhere }
        })
    }

    /// Returns the suggestion for a member of an `all` group in the same way.
    pub(super) fn member(
        &mut self,
        (node, parent): (Node<'_>, Node<'_>),
        model: &'s AllModel,
        schema: &'s Schema,
    ) -> Option<&'s str> {
        let (name, number) = (node.name(), node.name_number());
        let names = &schema.names;
        let key = (std::ptr::from_ref(model) as usize, 0, number);
        let meant = self.known(key, || {
            steps(model.members.len());
            let all = model.members.iter().map(|member| names.text(member.name));
            let here =
                closest(name, all).filter(|_| !is_known_elsewhere(schema, parent.name(), name));
            Meant {
                here,
                anywhere: None,
            }
        });
        meant.here
    }

    fn known(&mut self, key: Transition, search: impl FnOnce() -> Meant<'s>) -> Meant<'s> {
        if self.meant.len() >= MOST {
            return self.meant.get(&key).copied().unwrap_or_default();
        }
        *self.meant.entry(key).or_insert_with(search)
    }
}
