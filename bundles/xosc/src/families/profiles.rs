//! Features that a simulator does not support. These rules run only on request.

use crate::prelude::*;

/// Reaction of a simulator to a feature that it does not support.
#[derive(Clone, Copy)]
pub(crate) enum Fate {
    /// The simulator refuses the scenario or ends the run.
    Stops,
    /// The simulator ignores the feature.
    Ignores,
}

/// An element that a simulator does not support. It may be limited to an attribute and its word.
pub(crate) struct Gap {
    /// The element.
    pub(crate) element: &'static str,
    /// The attribute, if the gap is only with this attribute.
    pub(crate) attribute: Option<(&'static str, Option<&'static str>)>,
    /// Reaction of the simulator.
    pub(crate) fate: Fate,
}

/// Creates a gap for an element that is not supported at all.
pub(crate) const fn gap(element: &'static str, fate: Fate) -> Gap {
    Gap {
        element,
        attribute: None,
        fate,
    }
}

impl Gap {
    /// Limits the gap to elements with this attribute.
    pub(crate) const fn with(self, attribute: &'static str) -> Gap {
        Gap {
            attribute: Some((attribute, None)),
            ..self
        }
    }

    /// Limits the gap to elements with this value of the attribute.
    pub(crate) const fn saying(self, attribute: &'static str, word: &'static str) -> Gap {
        Gap {
            attribute: Some((attribute, Some(word))),
            ..self
        }
    }

    fn is_in(&self, element: Element<'_, '_>) -> bool {
        match self.attribute {
            None => true,
            Some((attribute, None)) => element.has(attribute),
            Some((attribute, Some(word))) => element.word(attribute).as_deref() == Some(word),
        }
    }

    fn place<'d>(&self, element: Element<'_, 'd>) -> Place<'d> {
        match self.attribute {
            None => Place::Node(element.node()),
            Some((attribute, _)) => Place::attribute_or_node(element.node(), attribute),
        }
    }

    fn what(&self) -> String {
        match self.attribute {
            None => format!("`{}`", self.element),
            Some((attribute, None)) => format!("`{attribute}` of `{}`", self.element),
            Some((attribute, Some(word))) => {
                format!("`{attribute}=\"{word}\"` of `{}`", self.element)
            }
        }
    }
}

/// Reports the gaps that a scenario uses. Each kind is reported at its first place, with the number
/// of further places.
pub(crate) fn report(scenario: &Scenario<'_>, simulator: &str, gaps: &[Gap], found: &mut Sink<'_>) {
    for gap in gaps {
        let elements = scenario.elements(gap.element);
        let mut places = elements.filter(|element| gap.is_in(*element));
        let Some(first) = places.next() else {
            continue;
        };
        let text = format!(
            "{} is not supported by {simulator}, which {}{}",
            gap.what(),
            match gap.fate {
                Fate::Stops => "stops with an error",
                Fate::Ignores => "ignores it",
            },
            match places.count() {
                0 => String::new(),
                1 => " (one more use in this file)".to_owned(),
                more => format!(" ({more} more uses in this file)"),
            }
        );
        found.issue(gap.place(first), text);
    }
}
