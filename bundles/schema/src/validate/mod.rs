//! Validation in one walk over the document image.
//!
//! Every element is visited once. One lookup in its parent's automaton gives its declaration, and
//! the table of its type gives its attributes. Names are compared as numbers, with one lookup per
//! distinct name of the document. Memory grows with depth, keys and violations, not with size.

mod attributes;
mod children;
mod frame;
mod keys;
mod limit;
mod memo;
mod names;
mod overlay;
mod reporter;
mod text;
mod types;
mod way;
mod wording;

use qcbus_document::{Document, Node};

pub use overlay::Overlay;

use crate::model::{ElementDecl, Schema};
use crate::violation::{Code, Limits, Report};
use crate::work::steps;
use frame::{Body, Frame};
use keys::{Keys, Opening};
use memo::Memo;
pub(crate) use names::NameMap;
use reporter::Reporter;
use types::Bindings;

impl Schema {
    /// Validates a document. Namespaces are ignored: elements are compared by their local names.
    ///
    /// Takes time linear in the document's size.
    pub fn validate<'a>(&self, document: &Document<'a>, limits: Limits) -> Report<'a> {
        self.validate_with(document, limits, Overlay::None)
    }

    /// Validates a document that may contain more than its schema allows.
    pub fn validate_with<'a>(
        &self,
        document: &Document<'a>,
        limits: Limits,
        overlay: Overlay,
    ) -> Report<'a> {
        let Some(root) = document.root() else {
            return Report::default();
        };
        let mut walk = Walk {
            schema: self,
            document: *document,
            names: NameMap::new(document, self),
            sources: sources(document),
            stack: Vec::new(),
            keys: Keys::default(),
            memo: Memo::default(),
            bindings: Bindings::default(),
            reporter: Reporter::new(limits, &self.title),
            overlay,
        };
        walk.run(root);
        walk.reporter.finish()
    }
}

/// Returns start and text of each file in ascending order.
fn sources<'a>(document: &Document<'a>) -> Vec<(u32, &'a str)> {
    let mut sources: Vec<(u32, &str)> = document
        .sources()
        .map(|source| (source.start, document.source_text(&source)))
        .collect();
    sources.sort_by_key(|(start, _)| *start);
    sources
}

struct Walk<'a, 's> {
    schema: &'s Schema,
    document: Document<'a>,
    names: NameMap,
    /// Start and text of each file in ascending order.
    sources: Vec<(u32, &'a str)>,
    stack: Vec<Frame<'s>>,
    keys: Keys<'a, 's>,
    memo: Memo<'s>,
    /// Prefixes bound by open elements.
    bindings: Bindings<'a>,
    reporter: Reporter<'a, 's>,
    overlay: Overlay,
}

impl<'a, 's> Walk<'a, 's> {
    fn run(&mut self, root: Node<'a>) {
        let Some(declared) = self.schema.root(root.name()) else {
            self.unknown_root(root);
            return;
        };
        let end = root.subtree_end();
        let mut next = self.start(root, declared);
        while next < end {
            self.close_until(next);
            let Some(node) = self.document.node(next) else {
                break;
            };
            next = if node.is_element() {
                self.element(node)
            } else {
                self.run_of_text(node)
            };
        }
        self.close_until(end);
    }

    /// Visits an element below the root and returns the index of the next node.
    fn element(&mut self, node: Node<'a>) -> u32 {
        steps(1);
        if self.is_spliced_include(node) {
            return node.subtree_end();
        }
        match self.declaration_of(node) {
            Some(declared) => self.start(node, declared),
            None => node.subtree_end(),
        }
    }

    /// Checks for an OpenDRIVE `include` that was replaced by the content of its file. Only that
    /// content is validated, in its order.
    fn is_spliced_include(&self, node: Node<'a>) -> bool {
        self.sources.len() > 1 && node.is("include") && node.attr("file").is_some()
    }

    /// Checks an element against its declaration and opens it. Returns the index of the next node.
    fn start(&mut self, node: Node<'a>, declared: &'s ElementDecl) -> u32 {
        let name = self.names.element(node);
        let end = node.subtree_end();
        self.bind(node);
        let nil = self.is_nil(node, declared);
        let Some(ty) = self.type_of(node, declared) else {
            return end;
        };
        self.attributes(node, ty);
        self.conditions(node, ty);
        let body = if nil { Body::Nothing } else { Body::of(ty) };
        self.text_content(node, body);
        let constraints = declared.constraints.as_deref();
        let opening = Opening {
            node,
            name,
            kind: ty,
            constraints,
            schema: self.schema,
            names: &self.names,
        };
        let keys = self.keys.enter(&opening, &mut self.reporter);
        let mixed = Body::is_mixed(ty);
        self.emptiness(node, body, mixed);
        self.stack.push(Frame {
            node: node.index(),
            end,
            body,
            mixed,
            keys,
            troubles: Vec::new(),
            stranger: None,
            strangers: 0,
            numbers: None,
        });
        node.index() + 1
    }

    /// Closes the elements that end before `next`.
    fn close_until(&mut self, next: u32) {
        while self.stack.last().is_some_and(|frame| frame.end <= next) {
            let Some(frame) = self.stack.pop() else {
                return;
            };
            self.complete(&frame);
            self.keys.leave(frame.keys, self.schema, &mut self.reporter);
        }
    }

    fn unknown_root(&mut self, root: Node<'a>) {
        let known: Vec<&str> = self
            .schema
            .roots
            .iter()
            .map(|root| self.schema.names.text(root.name))
            .collect();
        self.reporter.add(Code::UnknownRoot, (0, 0), root, || {
            wording::unknown_root(root, &known, &self.schema.title)
        });
    }
}
