use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        for plan_view in junction.node().children_named("planView") {
            check(junction, plan_view, found);
        }
    }
}

fn check(junction: &Junction<'_>, plan_view: Node<'_>, found: &mut Sink<'_>) {
    let demand = "a junction reference line must be exactly one `geometry` with exactly one `line`";
    let id = junction.id();
    let mut geometries = plan_view.children_named("geometry");
    let Some(first) = geometries.next() else {
        let text = format!("the reference line of junction `{id}` is empty; {demand}");
        found.issue(plan_view, text);
        return;
    };
    for further in geometries {
        let text =
            format!("the reference line of junction `{id}` has a further `geometry`; {demand}");
        found.issue(further, text).at(first, "the first one");
    }
    let shapes: Vec<Node<'_>> = first
        .children()
        .filter(|child| ShapeKind::of(*child).is_some())
        .collect();
    match shapes.as_slice() {
        [line] if line.is("line") => {}
        [] => {
            let text = format!("the reference line of junction `{id}` has no shape; {demand}");
            found.issue(first, text);
        }
        [.., other] => {
            let what = match shapes.len() {
                1 => format!("has the shape `{}`", other.name()),
                many => format!("has {many} shapes"),
            };
            let text = format!("the reference line of junction `{id}` {what}; {demand}");
            found.issue(*other, text);
        }
    }
}
