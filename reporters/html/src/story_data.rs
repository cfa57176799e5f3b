//! Data of the timeline of a scenario, as `docs/html-report.md` describes it.

use std::collections::HashMap;

use qcbus_openscenario::stage::{Body, Course, CourseKind, Stage};
use qcbus_openscenario::story::{End, FilePlace, Sentence, Story, StoryboardElement};
use qcbus_openscenario::{Moment, Scenario};
use qcbus_reporter_sdk::{one_line, printable};
use serde::Serialize;

/// Maximum number of storyboard elements on a page.
const MOST_ELEMENTS: usize = 10_000;

/// Maximum number of entities on a page.
const MOST_ENTITIES: usize = 2_000;

/// Maximum number of unknown parts of a storyboard on a page.
const MOST_GAPS: usize = 50;

/// Maximum number of characters of a name.
const MOST_OF_NAME: usize = 200;

/// Maximum number of characters of a text.
const MOST_OF_TEXT: usize = 1_500;

/// The story of a scenario.
#[derive(Serialize)]
pub(crate) struct StoryData {
    timed: bool,
    gaps: Vec<GapData>,
    entities: Vec<EntityData>,
    globals: Vec<String>,
    elements: Vec<ElementData>,
    run: RunData,
    courses: Vec<CourseData>,
    cuts: Vec<String>,
}

#[derive(Serialize)]
struct GapData {
    text: String,
    file: Option<String>,
    row: u32,
}

#[derive(Serialize)]
struct EntityData {
    name: String,
    kind: &'static str,
    category: Option<String>,
    size: Option<[f64; 2]>,
    center: [f64; 2],
    at: Option<[f64; 3]>,
    speed: Option<f64>,
    text: String,
}

#[derive(Serialize)]
struct ElementData {
    kind: &'static str,
    name: Option<String>,
    parent: Option<usize>,
    action: Option<String>,
    actors: Vec<usize>,
    file: Option<String>,
    rows: [u32; 2],
    column: u32,
    start: MomentData,
    end: MomentData,
    head: String,
    text: String,
}

/// Earliest and latest time in seconds; null for never.
type MomentData = [Option<f64>; 2];

#[derive(Serialize)]
struct RunData {
    end: MomentData,
    text: String,
}

#[derive(Serialize)]
struct CourseData {
    kind: &'static str,
    name: Option<String>,
    element: Option<usize>,
    entities: Vec<usize>,
    points: Vec<f64>,
    stops: Vec<f64>,
    exact: bool,
    unplaced: usize,
}

impl StoryData {
    /// Returns the story of a scenario. `shown` returns the path for people of another file than
    /// that at `input`.
    pub(crate) fn of(
        scenario: &Scenario<'_>,
        input: &str,
        shown: &dyn Fn(&str) -> String,
    ) -> StoryData {
        let story = Story::of(scenario);
        let stage = Stage::of(scenario);
        let file = |place: &FilePlace| (place.path != input).then(|| shown(&place.path));
        let names: HashMap<&str, usize> = story
            .openings
            .iter()
            .take(MOST_ENTITIES)
            .enumerate()
            .map(|(at, opening)| (opening.entity.as_str(), at))
            .collect();
        let sentences = story.complete_sentences();
        let elements = story.elements.iter().zip(&sentences).take(MOST_ELEMENTS);
        let elements = elements.map(|(element, sentence)| {
            let actors = actors(scenario, element, &names);
            ElementData::of(element, sentence, actors, file(&element.place))
        });
        let gaps = story.gaps.iter().take(MOST_GAPS).map(|gap| GapData {
            text: text(&gap.text),
            file: file(&gap.place),
            row: gap.place.row,
        });
        StoryData {
            timed: story.is_timed,
            gaps: gaps.collect(),
            entities: entities(&story, &stage.bodies),
            globals: story.globals.iter().map(|it| name(it)).collect(),
            elements: elements.collect(),
            run: RunData::of(&story.end),
            courses: stage
                .courses
                .iter()
                .map(|it| CourseData::of(it, &names))
                .collect(),
            cuts: cuts(&story, &stage),
        }
    }
}

impl RunData {
    fn of(end: &End) -> RunData {
        let (head, rest) = end.sentence();
        RunData {
            end: moment(end.standard),
            text: text(&format!("{head}{rest}")),
        }
    }
}

fn entities(story: &Story, bodies: &[Body]) -> Vec<EntityData> {
    let openings = story.openings.iter().zip(bodies).take(MOST_ENTITIES);
    let entities = openings.map(|(opening, body)| {
        let world = opening.position.as_ref().and_then(|it| it.world);
        EntityData {
            name: name(&opening.entity),
            kind: body.kind.element(),
            category: body.category.as_deref().map(name),
            size: body.size.filter(|it| it.iter().all(|it| it.is_finite())),
            center: body.center,
            at: world.filter(|it| it.iter().all(|it| it.is_finite())),
            speed: opening.speed,
            text: text(&opening.sentence()),
        }
    });
    entities.collect()
}

/// Returns the indices of the entities that a maneuver group names.
fn actors(
    scenario: &Scenario<'_>,
    element: &StoryboardElement,
    names: &HashMap<&str, usize>,
) -> Vec<usize> {
    let mut found = Vec::new();
    for name in &element.actors {
        let entities = scenario.entities().expand(name).unwrap_or_default();
        let places = entities.iter().filter_map(|it| names.get(it.name()));
        found.extend(places.copied());
    }
    found.sort_unstable();
    found.dedup();
    found
}

impl ElementData {
    fn of(
        element: &StoryboardElement,
        sentence: &Sentence,
        actors: Vec<usize>,
        file: Option<String>,
    ) -> ElementData {
        ElementData {
            kind: element.kind.word(),
            name: element.name.as_deref().map(name),
            parent: element.parent,
            action: element.action.as_deref().map(name),
            actors,
            file,
            rows: [element.place.row, element.place.last_row],
            column: element.place.column,
            start: moment(element.standard.start),
            end: moment(element.standard.end),
            head: text(&sentence.head),
            text: text(&sentence.facts()),
        }
    }
}

impl CourseData {
    fn of(course: &Course, names: &HashMap<&str, usize>) -> CourseData {
        let entities = course.entities.iter();
        let entities = entities.filter_map(|it| names.get(it.as_str()).copied());
        CourseData {
            kind: match course.kind {
                CourseKind::Route => "route",
                CourseKind::Trajectory => "trajectory",
                CourseKind::Target => "target",
            },
            name: course.name.as_deref().map(name),
            element: course.element.filter(|it| *it < MOST_ELEMENTS),
            entities: entities.collect(),
            points: flat(&course.points),
            stops: flat(&course.stops),
            exact: course.is_exact,
            unplaced: course.unplaced,
        }
    }
}

/// Returns the coordinates of points, in metres with two decimals.
fn flat(points: &[[f64; 2]]) -> Vec<f64> {
    let finite = points
        .iter()
        .filter(|it| it.iter().all(|it| it.is_finite()));
    finite
        .flatten()
        .map(|it| (it * 100.0).round() / 100.0)
        .collect()
}

fn moment(moment: Moment) -> MomentData {
    // "After 3 s" is computed as 3.000001 s.
    let rounded = |seconds: f64| (seconds * 1000.0).round() / 1000.0;
    let finite = |seconds: f64| seconds.is_finite().then(|| rounded(seconds));
    [finite(moment.earliest), finite(moment.latest)]
}

fn cuts(story: &Story, stage: &Stage) -> Vec<String> {
    let mut cuts = Vec::new();
    let mut cut = |left_out: usize, of: &str| {
        if left_out > 0 {
            cuts.push(format!("{left_out} {of}"));
        }
    };
    let elements = story.elements.len().saturating_sub(MOST_ELEMENTS);
    cut(elements, "storyboard elements are not in the timeline");
    let entities = story.openings.len().saturating_sub(MOST_ENTITIES);
    cut(
        entities,
        "entities are not in the timeline and not on the map",
    );
    cut(stage.left_out, "routes and trajectories are not drawn");
    let thinned = stage.courses.iter().filter(|it| it.is_thinned).count();
    cut(
        thinned,
        "routes and trajectories are drawn with fewer points",
    );
    cut(
        story.gaps.len().saturating_sub(MOST_GAPS),
        "unknown parts of the storyboard are not listed",
    );
    cuts
}

fn name(text: &str) -> String {
    shortened(one_line(text), MOST_OF_NAME)
}

fn text(text: &str) -> String {
    shortened(printable(text), MOST_OF_TEXT)
}

fn shortened(text: String, most: usize) -> String {
    match text.char_indices().nth(most) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
