use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let of = |kind| {
            road.layers()
                .iter()
                .filter(move |layer| layer.kind() == kind)
        };
        for kind in [LayerKind::Permanent, LayerKind::Temporary] {
            let mut layers = of(kind);
            let Some(first) = layers.next() else { continue };
            for further in layers {
                let text = format!(
                    "road `{}` has a second {} lane layer; it must have exactly one permanent and at most \
                     one temporary layer (without `layer`, `lanes` are permanent)",
                    road.id(),
                    kind.as_str()
                );
                found
                    .issue(further.node(), text)
                    .at(first.node(), "the first one");
            }
        }
        let only = of(LayerKind::Temporary).next();
        let others = of(LayerKind::Permanent)
            .chain(of(LayerKind::Unknown))
            .count();
        if let Some(layer) = only.filter(|_| others == 0) {
            let text = format!(
                "road `{}` has a temporary lane layer, but no permanent one; it must have exactly one permanent \
                 layer",
                road.id()
            );
            found.issue(layer.node(), text);
        }
    }
}
