//! What the short examples of the pages are put into: minimal scenarios with a hole.
//!
//! | `in=` | the example is |
//! |---|---|
//! | (nothing) | what follows the file header |
//! | `storyboard` | what follows `<Init>` in the storyboard: stories and the stop trigger |
//! | `catalog` | the entries of a catalog |

use qcbus_sdk::pages::Template;

macro_rules! scenario {
    ($($text:expr),*) => {
        concat!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenSCENARIO>\n",
            "<FileHeader revMajor=\"{major}\" revMinor=\"{minor}\" date=\"2026-01-01T00:00:00\" ",
            "description=\"example\" author=\"qcbus\"/>\n",
            $($text,)*
            "</OpenSCENARIO>\n"
        )
    };
}

/// The templates; the first is used when an example names none.
pub(crate) const TEMPLATES: &[Template] = &[
    Template {
        name: "scenario",
        text: scenario!("{example}\n"),
    },
    Template {
        name: "storyboard",
        text: scenario!(
            "<CatalogLocations/>\n<RoadNetwork/>\n",
            "<Entities><ScenarioObject name=\"Ego\"/></Entities>\n",
            "<Storyboard>\n<Init><Actions/></Init>\n{example}\n</Storyboard>\n"
        ),
    },
    Template {
        name: "catalog",
        text: scenario!("<Catalog name=\"examples\">\n{example}\n</Catalog>\n"),
    },
];
