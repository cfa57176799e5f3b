//! What a simulator does not have. Such rules run only where they are asked for.

use qcbus_openscenario::{Element, Scenario};
use qcbus_sdk::{Place, Sink};

/// What becomes of something that a simulator does not have.
#[derive(Clone, Copy)]
pub(crate) enum Fate {
    /// It refuses the scenario or ends the run.
    Stops,
    /// It goes on as if it were not there.
    Ignores,
}

/// An element that a simulator does not have, or only with this attribute (and this word).
pub(crate) struct Gap {
    /// The element.
    pub(crate) element: &'static str,
    /// The attribute, where the element alone is no gap.
    pub(crate) attribute: Option<(&'static str, Option<&'static str>)>,
    /// What the simulator does.
    pub(crate) fate: Fate,
}

/// An element that is no use at all.
pub(crate) const fn gap(element: &'static str, fate: Fate) -> Gap {
    Gap {
        element,
        attribute: None,
        fate,
    }
}

impl Gap {
    /// Only where this attribute is there.
    pub(crate) const fn with(self, attribute: &'static str) -> Gap {
        Gap {
            attribute: Some((attribute, None)),
            ..self
        }
    }

    /// Only where this attribute says this.
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

/// Says the gaps that a scenario runs into: the first place of each kind, and how many more there are.
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
                Fate::Ignores => "goes on as if it were not there",
            },
            match places.count() {
                0 => String::new(),
                1 => " (once more in this file)".to_owned(),
                more => format!(" ({more} times more in this file)"),
            }
        );
        found.issue(gap.place(first), text);
    }
}
