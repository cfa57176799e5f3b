//! A scenario as a story, for `qcbus timeline`.

use qcbus_openscenario::story::Story;
use qcbus_sdk::{Model as _, Subject, Unbuilt};

use crate::model::Scene;

/// Returns the story of a scenario. A subject that is a catalog or a distribution has an empty
/// story.
///
/// # Errors
/// The reason if the scenario has no root element or an unsupported version.
pub fn story(subject: &Subject<'_>) -> Result<Story, String> {
    let scenario = Scene::build(subject).map_err(|why| match why {
        Unbuilt::NotApplicable(why) | Unbuilt::Broken(why) | Unbuilt::Failed(why) => why,
    })?;
    Ok(Story::of(&scenario))
}
