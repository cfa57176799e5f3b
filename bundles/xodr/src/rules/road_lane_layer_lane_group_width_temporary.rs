use crate::families::edges::{Piece, border, combine, sum};
use crate::families::on_road::OnRoad;
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.01,
    "m",
    "largest distance by which temporary lanes may extend beyond permanent ones",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let layers = road.layer(LayerKind::Temporary).zip(road.permanent());
        let Some((temporary, permanent)) = layers else {
            continue;
        };
        for side in Side::BOTH {
            let below: Vec<Piece> = permanent
                .in_order(road)
                .filter(|section| section.covers(side))
                .flat_map(|section| edge(section, side))
                .collect();
            for section in temporary
                .in_order(road)
                .filter(|section| section.covers(side))
            {
                if section.side(side).next().is_some() {
                    check(section, side, &below, found);
                }
            }
        }
    }
}

fn edge(section: SectionRef<'_, '_>, side: Side) -> Vec<Piece> {
    border(section, side, section.side(side).count())
}

fn check(section: SectionRef<'_, '_>, side: Side, below: &[Piece], found: &mut Sink<'_>) {
    let Some(start) = section.s() else { return };
    let from = below.partition_point(|piece| piece.to <= start);
    let outward = |one: Cubic, other: Cubic| sum(one, other.scaled(-1.0)).scaled(side.sign());
    let beyond = combine(&edge(section, side), &below[from..], outward);
    let worst = beyond.iter().filter_map(Piece::maximum);
    let Some(worst) = worst.max_by(|one, other| one.value.total_cmp(&other.value)) else {
        return;
    };
    let limit = found.number(&TOLERANCE);
    if worst.value > limit {
        let road = section.road;
        let name = match side {
            Side::Left => "left",
            Side::Right => "right",
        };
        let text = format!(
            "the temporary lanes of road `{}` extend {:.3} m beyond its permanent lanes on the {name} at s = \
             {:.2}; temporary lanes must lie on permanent lanes",
            road.id(),
            worst.value,
            worst.at
        );
        let t = section.edge_t(side, worst.at - start).unwrap_or(0.0);
        found.issue(section.node(), text).on(road, worst.at, t);
    }
}
