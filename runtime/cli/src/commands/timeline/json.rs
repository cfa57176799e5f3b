//! A story for programs.

use qcbus_openscenario::Moment;
use qcbus_openscenario::story::{Opening, StoryboardElement};
use serde_json::{Value, json};

use super::{Told, Warning};

/// Returns the story as JSON. `docs/timeline.md` describes its keys.
pub(super) fn of(told: &Told) -> Value {
    let story = &told.story;
    let end = &story.end;
    let noted = |text: &str, place: String| json!({"text": text, "place": place});
    let warnings = told.warnings.iter();
    let warnings = warnings.map(|Warning { text, place }| noted(text, place.clone()));
    let gaps = story
        .gaps
        .iter()
        .map(|gap| noted(&gap.text, gap.place.to_string()));
    json!({
        "schema": 1,
        "file": told.file,
        "warnings": warnings.collect::<Vec<_>>(),
        "timesKnown": story.is_timed,
        "unknown": gaps.collect::<Vec<_>>(),
        "init": story.openings.iter().map(opening).collect::<Vec<_>>(),
        "globalActions": story.globals,
        "elements": story.elements.iter().map(element).collect::<Vec<_>>(),
        "run": {
            "waitsUntil": end.waits,
            "end": moment(end.standard),
            "tolerantEnd": moment(end.tolerant),
            "neverEnds": end.never,
        },
    })
}

fn opening(opening: &Opening) -> Value {
    let position = opening.position.as_ref();
    let world = position.and_then(|position| position.world);
    json!({
        "entity": opening.entity,
        "position": position.map(|position| &position.written),
        "x": world.map(|[x, _, _]| x),
        "y": world.map(|[_, y, _]| y),
        "heading": world.map(|[_, _, heading]| heading),
        "speed": opening.speed,
        "actions": opening.actions,
    })
}

fn element(element: &StoryboardElement) -> Value {
    json!({
        "kind": element.kind.word(),
        "name": element.name,
        "parent": element.parent,
        "action": element.action,
        "actors": element.actors,
        "triggeringActors": element.are_triggering_actors,
        "place": element.place.to_string(),
        "start": moment(element.standard.start),
        "end": moment(element.standard.end),
        "tolerant": {
            "start": moment(element.tolerant.start),
            "end": moment(element.tolerant.end),
        },
        "waitsUntil": element.waits,
        "neverStarts": element.never_starts,
        "neverEnds": element.never_ends,
    })
}

/// Returns a moment: `earliest` is null for never, `latest` is null if it may never come.
fn moment(moment: Moment) -> Value {
    // "After 3 s" is computed as 3.000001 s.
    let rounded = |seconds: f64| (seconds * 1000.0).round() / 1000.0;
    let finite = |seconds: f64| seconds.is_finite().then(|| rounded(seconds));
    json!({"earliest": finite(moment.earliest), "latest": finite(moment.latest)})
}
