use crate::families::ids::{Class, KINDS, Kind, plain};
use crate::families::lane_references;
use crate::families::object_parts::outlines;
use crate::prelude::*;
use foldhash::{HashMap, HashSet};

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    backport: Backport::Alike { since: "" },
    each: Some(each),
    run,
    ..Rule::after(READABLE)
};

/// An attribute that refers to another element.
struct Reference {
    element: &'static str,
    parent: &'static str,
    attribute: &'static str,
    target: Target,
    /// Values that mean "none".
    none: &'static [&'static str],
}

enum Target {
    /// An element of the class, anywhere in the file.
    Any(Class),
    /// The class depends on another attribute of the same element.
    By(&'static str, &'static [(&'static str, Class)]),
    /// An element of the class within the same object.
    InObject(Class),
}

const fn to(
    parent: &'static str,
    element: &'static str,
    attribute: &'static str,
    target: Target,
    none: &'static [&'static str],
) -> Reference {
    Reference {
        element,
        parent,
        attribute,
        target,
        none,
    }
}

const LINKED: Target = Target::By(
    "elementType",
    &[("road", Class::Road), ("junction", Class::Junction)],
);
const ELEMENT: Target = Target::By(
    "elementType",
    &[("object", Class::Object), ("signal", Class::Signal)],
);
const ROAD: Target = Target::Any(Class::Road);
const SIGNAL: Target = Target::Any(Class::Signal);

/// Parent, element, attribute, target, values for "none". Parents distinguish equal names.
const REFERENCES: &[Reference] = &[
    to(
        "OpenDRIVE",
        "road",
        "junction",
        Target::Any(Class::Junction),
        &["-1", ""],
    ),
    to("link", "predecessor", "elementId", LINKED, &[]),
    to("link", "successor", "elementId", LINKED, &[]),
    to("OpenDRIVE", "junction", "mainRoad", ROAD, &[]),
    to("junction", "connection", "incomingRoad", ROAD, &["-1"]),
    to("junction", "connection", "connectingRoad", ROAD, &[]),
    to("junction", "connection", "linkedRoad", ROAD, &[]),
    to("junction", "priority", "high", ROAD, &[]),
    to("junction", "priority", "low", ROAD, &[]),
    to(
        "junction",
        "controller",
        "id",
        Target::Any(Class::Controller),
        &[],
    ),
    to("junction", "crossPath", "crossingRoad", ROAD, &[]),
    to("junction", "crossPath", "roadAtStart", ROAD, &[]),
    to("junction", "crossPath", "roadAtEnd", ROAD, &[]),
    to("", "roadSection", "roadId", ROAD, &[]),
    to("boundary", "segment", "roadId", ROAD, &[]),
    to(
        "junctionGroup",
        "junctionReference",
        "junction",
        Target::Any(Class::Junction),
        &[],
    ),
    to("controller", "control", "signalId", SIGNAL, &[]),
    to("signal", "dependency", "id", SIGNAL, &[]),
    to("signal", "reference", "elementId", ELEMENT, &[]),
    to("signals", "signalReference", "id", SIGNAL, &[]),
    to(
        "objects",
        "objectReference",
        "id",
        Target::Any(Class::Object),
        &[],
    ),
    to("signal", "positionRoad", "roadId", ROAD, &[]),
    to("vmsGroup", "vmsBoardReference", "signalId", SIGNAL, &[]),
    to("platform", "segment", "roadId", ROAD, &[]),
    to("switch", "mainTrack", "id", ROAD, &[]),
    to("switch", "sideTrack", "id", ROAD, &[]),
    to("switch", "partner", "id", Target::Any(Class::Switch), &[]),
    to(
        "borders",
        "border",
        "outlineId",
        Target::InObject(Class::Outline),
        &[],
    ),
    to(
        "",
        "cornerReference",
        "id",
        Target::InObject(Class::Corner),
        &[],
    ),
];

/// The defined ids: by class in the file, and by class in each object.
struct Defined<'d> {
    anywhere: Vec<(Class, HashSet<&'d str>)>,
    in_object: HashMap<(Node<'d>, Class), HashSet<&'d str>>,
}

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    lane_references::of_lanes(map.part(part), found);
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let Some(root) = map.root() else { return };
    let document = &root.document();
    let defined = Defined::of(document);
    for reference in REFERENCES {
        for node in document.elements(reference.element) {
            let parent = node.parent();
            if is_user_data(node) {
                continue;
            }
            if reference.parent.is_empty() || parent.is_some_and(|it| it.is(reference.parent)) {
                check(reference, node, &defined, found);
            }
        }
    }
    lane_references::of_junctions(map, found);
    lane_references::of_boundaries(map, found);
}

fn check(reference: &Reference, node: Node<'_>, defined: &Defined<'_>, found: &mut Sink<'_>) {
    let Some(id) = node
        .attr(reference.attribute)
        .filter(|id| !reference.none.contains(id))
    else {
        return;
    };
    let (class, exists, within) = match reference.target {
        Target::Any(class) => (class, defined.anywhere(class, id), ""),
        Target::By(attribute, classes) => {
            let kind = node.attr(attribute);
            // The schema reports a type that does not exist.
            let Some((_, class)) = classes.iter().find(|(name, _)| Some(*name) == kind) else {
                return;
            };
            (*class, defined.anywhere(*class, id), "")
        }
        Target::InObject(class) => {
            let Some(object) = node.ancestors().find(|ancestor| ancestor.is("object")) else {
                return;
            };
            let home = outline_of_border(node, object).unwrap_or(object);
            let ids = defined.in_object.get(&(home, class));
            let place = if home == object {
                " in this object"
            } else {
                " in the outline of this border"
            };
            (class, ids.is_some_and(|ids| ids.contains(plain(id))), place)
        }
    };
    if !exists {
        let text = format!(
            "`{}=\"{id}\"` of `{}` refers to an undefined {}{within}; a reference must name one that exists{}",
            reference.attribute,
            reference.element,
            Kind::of(class).name,
            of_another_type(reference, node, id, defined)
        );
        let finding = found.issue(Place::attribute_or_node(node, reference.attribute), text);
        if within.is_empty() {
            finding.fault(format!("undefined {} {id}", Kind::of(class).name));
        }
    }
}

/// Returns a hint if only the type is wrong and the id exists for another type. Elements around the
/// reference are excluded.
fn of_another_type(
    reference: &Reference,
    node: Node<'_>,
    id: &str,
    defined: &Defined<'_>,
) -> String {
    let Target::By(attribute, classes) = reference.target else {
        return String::new();
    };
    let mut others = classes.iter();
    let is_itself = |word: &str| {
        let mut around = node.ancestors();
        around.any(|one| one.is(word) && one.attr("id") == Some(id))
    };
    let meant = others.find(|(word, class)| defined.anywhere(*class, id) && !is_itself(word));
    meant.map_or_else(String::new, |(word, class)| {
        let name = Kind::of(*class).name;
        format!("; a {name} `{id}` exists: did you mean `{attribute}=\"{word}\"`?")
    })
}

/// Returns the outline to which the border around a corner reference refers.
fn outline_of_border<'d>(reference: Node<'d>, object: Node<'d>) -> Option<Node<'d>> {
    let border = reference.parent().filter(|parent| parent.is("border"))?;
    let id = plain(border.attr("outlineId")?);
    let named = |outline: &Node<'_>| outline.attr("id").is_some_and(|it| plain(it) == id);
    outlines(object).find(named)
}

impl<'d> Defined<'d> {
    fn of(document: &Document<'d>) -> Defined<'d> {
        let mut defined = Defined {
            anywhere: Vec::with_capacity(KINDS.len()),
            in_object: HashMap::default(),
        };
        for kind in KINDS {
            let mut ids = HashSet::default();
            for node in kind.nodes(document) {
                let Some(id) = node.attr("id") else { continue };
                ids.insert(id);
                if matches!(kind.class, Class::Outline | Class::Corner)
                    && let Some(object) = node.ancestors().find(|ancestor| ancestor.is("object"))
                {
                    let outline = node.parent().filter(|_| kind.class == Class::Corner);
                    for home in [Some(object), outline].into_iter().flatten() {
                        let ids = defined.in_object.entry((home, kind.class)).or_default();
                        ids.insert(plain(id));
                    }
                }
            }
            defined.anywhere.push((kind.class, ids));
        }
        defined
    }

    fn anywhere(&self, class: Class, id: &str) -> bool {
        let mut of_class = self.anywhere.iter().filter(|(other, _)| *other == class);
        of_class.any(|(_, ids)| ids.contains(id))
    }
}
