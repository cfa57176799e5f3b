//! Validation of the children of one element against its content model, and recovery after a wrong
//! child.
//!
//! A wrong child is one of these: a child that the model expects only after others (these are
//! missing), a child that it no longer expects (repeated or misplaced), or a child that it does not
//! know (perhaps misspelt). In each case the automaton changes to the state that fits the remaining
//! children best. So one cause gives one violation.

use std::collections::HashMap;

use qcbus_document::Node;

use super::frame::{Body, Frame, Number};
use super::memo::{Meant, Memo};
use super::way::needed;
use super::{Walk, wording};
use crate::model::{AllModel, ElementDecl, Model};
use crate::names::NameId;
use crate::violation::Code;
use crate::work::steps;

impl<'a, 's> Walk<'a, 's> {
    /// Returns the declaration of an element in its parent, or `None` if its content is not
    /// checked.
    pub(super) fn declaration_of(&mut self, node: Node<'a>) -> Option<&'s ElementDecl> {
        let name = self.names.element(node);
        let frame = self.stack.last_mut()?;
        match &mut frame.body {
            Body::Children { model, state } => {
                let model: &'s Model = model;
                steps(model.edges(*state).len());
                if let Some(edge) = model.edges(*state).iter().find(|edge| edge.name == name) {
                    *state = edge.to;
                    return model.children.get(usize::from(edge.child));
                }
                if let Some(to) = model
                    .states
                    .get(usize::from(*state))
                    .and_then(|row| row.wildcard)
                {
                    *state = to;
                    return None;
                }
                let state = *state;
                self.strange_child(node, name, model, state)
            }
            Body::All { model, seen } => {
                let found = model.members.iter().position(|member| member.name == name);
                let Some(index) = found else {
                    return self.strange_member(node);
                };
                let bit = 1u64 << index.min(63);
                let repeated = *seen & bit != 0;
                *seen |= bit;
                let model: &'s AllModel = model;
                if repeated {
                    let key = std::ptr::from_ref(model) as usize;
                    self.is_surplus(node, name, key, |_| Some(1));
                }
                model.members.get(index)
            }
            Body::Nothing | Body::Text(_) => {
                let parent = self.document.node(frame.node)?;
                let key = (0, u32::from(node.name_number()));
                self.reporter.add(Code::UnexpectedElement, key, node, || {
                    wording::no_children(node, parent, &self.schema.title)
                });
                None
            }
        }
    }

    fn strange_child(
        &mut self,
        node: Node<'a>,
        name: NameId,
        model: &'s Model,
        state: u16,
    ) -> Option<&'s ElementDecl> {
        let Some(index) = model.children.iter().position(|child| child.name == name) else {
            return self.unknown_child(node, model, state);
        };
        let key = (std::ptr::from_ref(model) as usize, u32::from(name.0));
        let parent = self.document.node(self.stack.last()?.node)?;
        if let Some(way) = self.memo.way(model, state, Some(name)) {
            let (to, skipped) = (way.0, &way.1);
            let frame = self.stack.last_mut()?;
            let known = frame.stranger.take() == Some(state)
                || skipped.iter().any(|name| frame.troubles.contains(name));
            steps(frame.troubles.len() * skipped.len());
            for &name in skipped {
                if !frame.troubles.contains(&name) {
                    frame.troubles.push(name);
                }
            }
            frame.body = Body::Children { model, state: to };
            if !known {
                self.reporter.add(Code::MissingElement, key, node, || {
                    let mut names = needed(model, state, skipped, |edge, _| edge == Some(name));
                    if names.is_empty() {
                        names.clone_from(skipped);
                    }
                    wording::missing_before(node, parent, &names, self.schema)
                });
            }
        } else if let Some(at) = self
            .stack
            .last()?
            .troubles
            .iter()
            .position(|known| *known == name)
        {
            // The child was reported as missing before, but it only came late.
            self.stack.last_mut()?.troubles.swap_remove(at);
        } else if !self.is_surplus(node, name, key.0, |memo| memo.most(model, name)) {
            self.stack.last_mut()?.troubles.push(name);
            self.reporter.add(Code::MisplacedElement, key, node, || {
                wording::misplaced(node, parent, (model, state), self.schema, &mut self.memo)
            });
        }
        model.children.get(index)
    }

    /// Checks whether a name has more children than allowed. This is reported once, at the first
    /// child that does not fit.
    fn is_surplus(
        &mut self,
        node: Node<'a>,
        name: NameId,
        model: usize,
        most: impl FnOnce(&mut Memo<'s>) -> Option<u32>,
    ) -> bool {
        let (Some(parent), Some(frame)) = (node.parent(), self.stack.last_mut()) else {
            return false;
        };
        let names = &self.names;
        let numbers = frame.numbers.get_or_insert_with(|| {
            let mut numbers = HashMap::<NameId, Number>::new();
            for child in parent.children() {
                steps(1);
                numbers.entry(names.element(child)).or_default().children += 1;
            }
            numbers
        });
        // The model allows at least one child of every known name.
        let Some(number) = numbers.get_mut(&name).filter(|it| it.children > 1) else {
            return false;
        };
        let count = number.children;
        let Some(most) = most(&mut self.memo).filter(|most| count > *most) else {
            return false;
        };
        if !std::mem::replace(&mut number.told, true) {
            let key = (model, u32::from(name.0));
            self.reporter.add(Code::RepeatedElement, key, node, || {
                wording::repeated(node, parent, count, most)
            });
        }
        true
    }

    /// Handles a child with a name that the model does not know.
    fn unknown_child(
        &mut self,
        node: Node<'a>,
        model: &'s Model,
        state: u16,
    ) -> Option<&'s ElementDecl> {
        let parent = self.document.node(self.stack.last()?.node)?;
        if self.overlay.allows_element(parent.name(), node.name()) || self.reporter.is_full() {
            self.count_unknown(node, parent);
            return None;
        }
        let here = model.edges(state);
        let schema = self.schema;
        let Meant {
            here: meant,
            anywhere: suggestion,
        } = self.memo.child((node, parent), (model, state), schema);
        steps(here.len());
        let key = (
            std::ptr::from_ref(model) as usize,
            u32::from(node.name_number()) | 1 << 16,
        );
        self.reporter.add(Code::UnexpectedElement, key, node, || {
            wording::unexpected_child(node, parent, (model, state), suggestion, schema)
        });
        let frame = self.stack.last_mut()?;
        let found = here
            .iter()
            .find(|edge| Some(schema.names.text(edge.name)) == meant);
        let Some(edge) = found else {
            frame.stranger = Some(state);
            return None;
        };
        frame.body = Body::Children {
            model,
            state: edge.to,
        };
        model.children.get(usize::from(edge.child))
    }

    /// Counts an unknown child when the list is full, unless the overlay allows it.
    fn count_unknown(&mut self, node: Node<'a>, parent: Node<'a>) {
        if !self.overlay.allows_element(parent.name(), node.name()) {
            let key = (0, u32::from(node.name_number()));
            self.reporter.add(Code::UnexpectedElement, key, node, || {
                wording::no_children(node, parent, &self.schema.title)
            });
        }
    }

    /// Handles a child that an `all` group does not know.
    fn strange_member(&mut self, node: Node<'a>) -> Option<&'s ElementDecl> {
        let frame = self.stack.last_mut()?;
        let parent = self.document.node(frame.node)?;
        let Body::All { model, seen } = &mut frame.body else {
            return None;
        };
        if self.overlay.allows_element(parent.name(), node.name()) {
            return None;
        }
        let schema = self.schema;
        let meant = self.memo.member((node, parent), model, schema);
        // A member that is already present is not suggested.
        let open = |name: &&str| {
            let index = model
                .members
                .iter()
                .position(|member| schema.names.text(member.name) == *name);
            index.is_some_and(|index| *seen & (1 << index) == 0)
        };
        let meant = meant.filter(open);
        steps(2 * model.members.len());
        let key = (
            std::ptr::from_ref(*model) as usize,
            u32::from(node.name_number()) | 1 << 16,
        );
        let members = &model.members;
        self.reporter.add(Code::UnexpectedElement, key, node, || {
            wording::unexpected_member(node, parent, members, meant, schema)
        });
        let found = model
            .members
            .iter()
            .position(|member| Some(schema.names.text(member.name)) == meant);
        let Some(index) = found else {
            frame.strangers += 1;
            return None;
        };
        *seen |= 1 << index.min(63);
        model.members.get(index)
    }

    /// Checks at the end of an element whether required children are missing.
    pub(super) fn complete(&mut self, frame: &Frame<'s>) {
        match frame.body {
            Body::Children { model, state } => self.complete_children(frame, model, state),
            Body::All { model, seen } => {
                let missing = model.required & !seen;
                if missing == 0 || (model.optional && seen == 0) {
                    return;
                }
                let Some(node) = self.document.node(frame.node) else {
                    return;
                };
                // Each unknown child is probably a misspelling of a missing one.
                let members = model.members.iter().enumerate();
                let absent = members.filter(|(index, _)| missing & (1 << index) != 0);
                for (_, member) in absent.skip(frame.strangers as usize) {
                    let name = [member.name];
                    let key = (std::ptr::from_ref(model) as usize, u32::from(name[0].0));
                    self.reporter.add(Code::MissingElement, key, node, || {
                        wording::missing_children(node, &name, &name, self.schema)
                    });
                }
            }
            Body::Nothing | Body::Text(_) => {}
        }
    }

    fn complete_children(&mut self, frame: &Frame<'s>, model: &'s Model, state: u16) {
        if model
            .states
            .get(usize::from(state))
            .is_none_or(|row| row.accepts)
        {
            return;
        }
        let Some(node) = self.document.node(frame.node) else {
            return;
        };
        let way = self.memo.way(model, state, None);
        let skipped = way.map(|way| way.1.clone()).unwrap_or_default();
        steps(skipped.len() * frame.troubles.len());
        if frame.stranger == Some(state) || skipped.iter().any(|name| frame.troubles.contains(name))
        {
            return;
        }
        let expected: Vec<NameId> = model.edges(state).iter().map(|edge| edge.name).collect();
        let key = (
            std::ptr::from_ref(model) as usize,
            u32::from(state) | 1 << 17,
        );
        self.reporter.add(Code::MissingElement, key, node, || {
            let needed = needed(model, state, &skipped, |_, accepts| accepts);
            wording::missing_children(node, &needed, &expected, self.schema)
        });
    }
}
