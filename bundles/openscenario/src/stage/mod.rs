//! A scenario on a stage: the bodies of its entities, and the lines that its routes and
//! trajectories follow in the world.
//!
//! It is made for pictures. Long lines are thinned, and positions whose place is unknown are counted.

mod along;
mod shapes;

use qcbus_opendrive::RoadMap;

use crate::places::{Origins, Whereabouts};
use crate::queries::actors::Actors;
use crate::queries::element::Element;
use crate::queries::init::init_actions;
use crate::queries::scenario::Scenario;
use crate::types::entities::EntityKind;
use crate::types::storyboard::StoryKind;
use along::Lanes;

/// A point in the world: x and y in metres.
pub type Spot = [f64; 2];

/// Maximum number of lines.
pub const MOST_COURSES: usize = 2_000;

/// Maximum number of points of one line.
pub const MOST_POINTS: usize = 1_500;

/// Maximum number of points of all lines.
pub const MOST_POINTS_OF_ALL: usize = 60_000;

/// The bodies and lines of a scenario.
#[derive(Debug, Default)]
pub struct Stage {
    /// Bodies of the entities, in the order of the file.
    pub bodies: Vec<Body>,
    /// Lines of `Init`, then of the storyboard, in the order of the file.
    pub courses: Vec<Course>,
    /// Number of routes and trajectories that are left out because there are too many.
    pub left_out: usize,
}

/// Body of an entity.
#[derive(Debug)]
pub struct Body {
    /// Name of the entity.
    pub entity: String,
    /// Its kind.
    pub kind: EntityKind,
    /// Its category, such as `car`.
    pub category: Option<String>,
    /// Length and width in metres, if they are known.
    pub size: Option<[f64; 2]>,
    /// Vector from the reference point to the center of the box, in metres.
    pub center: [f64; 2],
}

/// Kind of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CourseKind {
    /// A route: waypoints.
    Route,
    /// A trajectory.
    Trajectory,
    /// A single target, such as that of an `AcquirePositionAction`.
    Target,
}

/// A line that entities follow.
#[derive(Debug)]
pub struct Course {
    /// Its kind.
    pub kind: CourseKind,
    /// Name of the route or trajectory.
    pub name: Option<String>,
    /// Index of the action in [`crate::Storyboard::elements`]. `None` for an action of `Init`.
    pub element: Option<usize>,
    /// Names of the entities that follow it.
    pub entities: Vec<String>,
    /// Points of the line.
    pub points: Vec<Spot>,
    /// Waypoints of a route, or the target.
    pub stops: Vec<Spot>,
    /// Whether the line is that of the scenario. A route that is not found along the lanes has
    /// straight lines between its waypoints.
    pub is_exact: bool,
    /// Number of positions whose place is unknown.
    pub unplaced: usize,
    /// Whether points of the line are left out.
    pub is_thinned: bool,
}

impl Stage {
    /// Returns the stage of a scenario.
    pub fn of(scenario: &Scenario<'_>) -> Stage {
        let on_map = scenario.on_map(|map| Stage::on(scenario, Some(map)));
        on_map.unwrap_or_else(|| Stage::on(scenario, None))
    }

    fn on(scenario: &Scenario<'_>, map: Option<&RoadMap<'_>>) -> Stage {
        let mut reader = Reader {
            origins: Origins::of(scenario, map),
            lanes: map.map(Lanes::new),
            stage: Stage {
                bodies: bodies(scenario),
                ..Stage::default()
            },
            points: 0,
        };
        for one in init_actions(scenario) {
            reader.action(one.action, None, || one.entities.clone());
        }
        let elements = scenario.storyboard().elements().iter().enumerate();
        for (place, one) in elements.filter(|(_, one)| one.kind() == StoryKind::Action) {
            let element = one.element(scenario);
            let private = element.child("PrivateAction");
            let Some(kind) = private.and_then(|it| it.children().next()) else {
                continue;
            };
            let action = match kind.name() {
                "RoutingAction" => kind.children().next(),
                _ => Some(kind),
            };
            if let Some(action) = action {
                reader.action(action, Some(place), || acting(element));
            }
        }
        reader.stage
    }
}

fn bodies(scenario: &Scenario<'_>) -> Vec<Body> {
    let objects = scenario.entities().objects().iter();
    let bodies = objects.map(|entity| {
        let object = entity.object(scenario);
        let bounds = object.and_then(|it| it.child("BoundingBox"));
        let pair = |element: &str, names: [&str; 2]| {
            let element = bounds?.child(element)?;
            Some([element.number(names[0])?, element.number(names[1])?])
        };
        let category = object.and_then(|it| {
            let names = [
                "vehicleCategory",
                "pedestrianCategory",
                "miscObjectCategory",
            ];
            names.iter().find_map(|name| it.word(name))
        });
        Body {
            entity: entity.name().to_owned(),
            kind: entity.kind(),
            category: category.map(std::borrow::Cow::into_owned),
            size: pair("Dimensions", ["length", "width"])
                .filter(|[length, width]| *length > 0.0 && *width > 0.0),
            center: pair("Center", ["x", "y"]).unwrap_or([0.0, 0.0]),
        }
    });
    bodies.collect()
}

/// Returns the names of the entities that an action moves, as far as they are known.
fn acting(action: Element<'_, '_>) -> Vec<String> {
    let names = Actors::of(action).and_then(|actors| actors.names());
    let entities = action.scenario().entities();
    let mut all: Vec<String> = Vec::new();
    for name in names.unwrap_or_default() {
        for entity in entities.expand(&name).unwrap_or_default() {
            if !all.iter().any(|other| other == entity.name()) {
                all.push(entity.name().to_owned());
            }
        }
    }
    all
}

/// Reader of the lines.
struct Reader<'m, 'd, 'w, 'r> {
    origins: Origins<'m, 'd, 'w, 'r>,
    lanes: Option<Lanes<'w, 'r>>,
    stage: Stage,
    /// Number of points so far.
    points: usize,
}

impl<'m, 'd, 'w, 'r> Reader<'m, 'd, 'w, 'r> {
    fn action(
        &mut self,
        action: Element<'m, 'd>,
        element: Option<usize>,
        entities: impl FnOnce() -> Vec<String>,
    ) {
        let is_start = element.is_none();
        let kind = match action.name() {
            "FollowTrajectoryAction" => CourseKind::Trajectory,
            "AssignRouteAction" => CourseKind::Route,
            "AcquirePositionAction" => CourseKind::Target,
            "TeleportAction" if !is_start => CourseKind::Target,
            _ => return,
        };
        if self.stage.courses.len() >= MOST_COURSES || self.points >= MOST_POINTS_OF_ALL {
            self.stage.left_out += 1;
            return;
        }
        let course = match kind {
            CourseKind::Trajectory => self.trajectory(action, is_start),
            CourseKind::Route => self.route(action, is_start),
            CourseKind::Target => self.target(action, is_start),
        };
        let Some(course) = course else { return };
        self.points += course.points.len() + course.stops.len();
        self.stage.courses.push(Course {
            element,
            entities: entities(),
            ..course
        });
    }

    fn trajectory(&self, action: Element<'m, 'd>, is_start: bool) -> Option<Course> {
        let within = action.child("TrajectoryRef");
        let within = within.and_then(|reference| reference.child_or_entry(&["Trajectory"]));
        let trajectory = within.or_else(|| action.child_or_entry(&["Trajectory"]))?;
        let is_closed = trajectory.flag("closed").unwrap_or(false);
        let place = |position: Element<'m, 'd>| self.place(position, is_start);
        let line = shapes::line(trajectory.child("Shape")?, &place)?;
        let mut points = line.points;
        if is_closed && let Some(first) = points.first().copied() {
            points.push(first);
        }
        let is_exact = line.is_exact;
        Some(Course {
            name: name_of(trajectory),
            points,
            is_exact,
            unplaced: line.unplaced,
            is_thinned: line.is_thinned,
            ..Course::empty(CourseKind::Trajectory)
        })
    }

    fn route(&self, action: Element<'m, 'd>, is_start: bool) -> Option<Course> {
        let route = action.child_or_entry(&["Route"])?;
        let waypoints = route.children_named("Waypoint").take(MOST_POINTS + 1);
        let waypoints: Vec<Element<'m, 'd>> = waypoints.collect();
        let mut course = Course {
            name: name_of(route),
            is_thinned: waypoints.len() > MOST_POINTS,
            is_exact: true,
            ..Course::empty(CourseKind::Route)
        };
        let mut last: Option<Whereabouts<'w, 'r>> = None;
        for waypoint in waypoints.into_iter().take(MOST_POINTS) {
            let position = waypoint.child("Position");
            let Some(here) = position.and_then(|it| self.place(it, is_start)) else {
                course.unplaced += 1;
                course.is_exact = false;
                continue;
            };
            let from = last.replace(here);
            course.stops.push([here.x, here.y]);
            if let Some(from) = from {
                self.lead(&from, &here, &mut course);
            }
            course.points.push([here.x, here.y]);
        }
        course.is_thinned |= shapes::thin(&mut course.points);
        Some(course)
    }

    /// Adds the points between two waypoints.
    fn lead(&self, from: &Whereabouts<'w, 'r>, to: &Whereabouts<'w, 'r>, course: &mut Course) {
        let on = |place| self.origins.on(place);
        let way = self
            .lanes
            .as_ref()
            .and_then(|lanes| lanes.between(on(from)?, on(to)?));
        match way {
            Some(points) => course.points.extend(points),
            None => course.is_exact = false,
        }
    }

    fn target(&self, action: Element<'m, 'd>, is_start: bool) -> Option<Course> {
        let place = self.place(action.child("Position")?, is_start);
        Some(Course {
            stops: place.iter().map(|it| [it.x, it.y]).collect(),
            is_exact: true,
            unplaced: usize::from(place.is_none()),
            ..Course::empty(CourseKind::Target)
        })
    }

    /// Returns the place of a `Position`. Positions relative to entities are known in `Init` only.
    fn place(&self, position: Element<'m, 'd>, is_start: bool) -> Option<Whereabouts<'w, 'r>> {
        let kind = position.children().next()?;
        let place = self.origins.locate(kind, is_start)?;
        (place.x.is_finite() && place.y.is_finite()).then_some(place)
    }
}

impl Course {
    fn empty(kind: CourseKind) -> Course {
        Course {
            kind,
            name: None,
            element: None,
            entities: Vec::new(),
            points: Vec::new(),
            stops: Vec::new(),
            is_exact: false,
            unplaced: 0,
            is_thinned: false,
        }
    }
}

fn name_of(element: Element<'_, '_>) -> Option<String> {
    Some(element.text("name")?.into_owned())
}
