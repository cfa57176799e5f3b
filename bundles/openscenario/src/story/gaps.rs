//! Unknown parts of the storyboard. With any of them, no times are known.

use super::FilePlace;
use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::types::storyboard::StoryKind;
use crate::wording::called;

/// An unknown part of the storyboard.
#[derive(Debug)]
pub struct Gap {
    /// The reason, such as "the maneuver `Cut in` of the catalog `Maneuvers` is not found".
    pub text: String,
    /// Its place.
    pub place: FilePlace,
}

/// Returns all unknown parts of the storyboard.
pub(super) fn all(scenario: &Scenario<'_>) -> Vec<Gap> {
    let storyboard = scenario.root().child("Storyboard");
    let mut gaps: Vec<Gap> = storyboard.into_iter().flat_map(within).collect();
    for one in scenario.storyboard().elements() {
        let element = one.element(scenario);
        if one.name().is_none() {
            let text = match element.written("name") {
                Some(written) => format!(
                    "the name `{written}` of `{}` cannot be resolved",
                    element.name()
                ),
                None => format!("{} has no name", called(element)),
            };
            gaps.push(Gap {
                text,
                place: FilePlace::of(element),
            });
        }
        if one.kind() != StoryKind::Action {
            gaps.extend(within(element));
        }
    }
    gaps
}

/// Returns the unknown children of an element.
fn within(around: Element<'_, '_>) -> Vec<Gap> {
    let is_known = around.class().is_some();
    let gaps = around.children().filter_map(|child| {
        let text = match child.name() {
            "CatalogReference" if around.is("ManeuverGroup") => not_found(child)?,
            // A misspelt element may contain storyboard elements.
            name if StoryKind::of_element(name).is_some() => return None,
            name if is_known && child.class().is_none() => {
                format!(
                    "`{name}` is not allowed in {}, so its content is unknown",
                    called(around)
                )
            }
            _ => return None,
        };
        Some(Gap {
            text,
            place: FilePlace::of(child),
        })
    });
    gaps.collect()
}

fn not_found(reference: Element<'_, '_>) -> Option<String> {
    if reference.scenario().entry(reference).is_some() {
        return None;
    }
    let text = |name: &str| reference.text(name).unwrap_or_default();
    Some(format!(
        "the maneuver `{}` of the catalog `{}` is not found",
        text("entryName"),
        text("catalogName")
    ))
}
