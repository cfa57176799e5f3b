//! The storyboard of a scenario, with maneuvers from catalogs.

use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::types::storyboard::{StoryElement, StoryKind, Storyboard};

impl<'d> Scenario<'d> {
    /// Returns the storyboard's tree, including maneuvers from catalogs.
    pub fn storyboard(&self) -> &Storyboard<'d> {
        self.storyboard.get_or_init(|| {
            let mut storyboard = Storyboard::default();
            if let Some(root) = self.root().child("Storyboard") {
                storyboard.add_within(root, None);
            }
            storyboard
        })
    }
}

impl<'d> StoryElement<'d> {
    /// Returns the element in the document or in a catalog.
    pub fn element<'m>(&self, scenario: &'m Scenario<'d>) -> Element<'m, 'd> {
        scenario.element_in(self.context, self.node)
    }
}

impl<'d> Storyboard<'d> {
    fn add_within(&mut self, around: Element<'_, 'd>, parent: Option<u32>) {
        for child in around.children() {
            let child = if child.is("CatalogReference") && around.is("ManeuverGroup") {
                match child.scenario().entry(child) {
                    Some(entry) => entry,
                    None => {
                        self.incomplete = true;
                        continue;
                    }
                }
            } else {
                child
            };
            if let Some(kind) = StoryKind::of_element(child.name()) {
                let place = self.add(StoryElement {
                    node: child.node,
                    context: child.context,
                    kind,
                    name: child.text("name"),
                    parent,
                });
                if kind != StoryKind::Action {
                    self.add_within(child, Some(place));
                }
            } else if child.class().is_none() && around.class().is_some() {
                // A misspelt element may contain the target of a reference.
                self.incomplete = true;
            }
        }
    }

    /// Returns the entry for an element of the storyboard.
    pub fn entry(&self, element: Element<'_, 'd>) -> Option<&StoryElement<'d>> {
        let of =
            |one: &&StoryElement<'d>| one.node == element.node && one.context == element.context;
        match element.text("name") {
            Some(name) => self.named(&name).find(of),
            None => self.elements().iter().find(of),
        }
    }
}
