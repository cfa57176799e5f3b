//! Objects in local coordinates: u, v and z from the origin (OpenDRIVE 1.9, 13.1 to 13.3).

use super::object_parts::is_before;
use super::on_road::OnRoad;
use crate::prelude::*;
use qcbus_opendrive::Corner;
use qcbus_opendrive::ObjectPoint;
use qcbus_opendrive::Polyline;

pub(crate) const TOLERANCE: Param = Param::number(
    "tolerance",
    0.05,
    "m",
    "maximum accepted excess of the object over its bounding volume",
);

/// Factor of the size, and difference in metres, beyond which an object is far too large.
const GROSS_SHARE: f64 = 3.0;
const GROSS: f64 = 100.0;

/// A point of an object in the local coordinates u, v and z, in metres.
#[derive(Clone, Copy)]
pub(crate) struct LocalPoint<'a> {
    pub node: Node<'a>,
    pub at: [f64; 3],
    /// Radius of the thing around the point, in metres.
    pub reach: f64,
}

/// Conversion of points from road coordinates to the coordinates of an object.
pub(crate) struct ObjectFrame<'m, 'a> {
    road: &'m Road<'a>,
    x: f64,
    y: f64,
    z: f64,
    sin: f64,
    cos: f64,
    upright: bool,
}

impl<'m, 'a> ObjectFrame<'m, 'a> {
    pub fn of(road: &'m Road<'a>, object: &Object<'a>) -> Option<ObjectFrame<'m, 'a>> {
        let (s, t) = (object.s()?, object.t()?);
        let pose = road.pose(s)?;
        let origin = pose.beside(t)?;
        let (sin, cos) = (pose.hdg + object.hdg().unwrap_or(0.0)).sin_cos();
        let level = |angle: Option<f64>| angle.unwrap_or(0.0).abs() < 1e-6;
        Some(ObjectFrame {
            road,
            x: origin.x,
            y: origin.y,
            z: road.elevation().at_or_zero(s)? + object.z_offset().unwrap_or(0.0),
            sin,
            cos,
            upright: level(object.pitch())
                && level(object.roll())
                && object.perp_to_road() != Some(true),
        })
    }

    /// Converts a point in s, t and dz. Returns `None` if the object is tilted.
    fn of_road(&self, point: &ObjectPoint<'a>) -> Option<[f64; 3]> {
        let s = point.s().filter(|_| self.upright)?;
        let place = self.road.pose(s)?.beside(point.t()?)?;
        let (dx, dy) = (place.x - self.x, place.y - self.y);
        let z = self.road.elevation().at_or_zero(s)? + point.dz().unwrap_or(0.0) - self.z;
        Some([
            dx * self.cos + dy * self.sin,
            dy * self.cos - dx * self.sin,
            z,
        ])
    }

    /// Converts a corner of an outline.
    pub fn corner(&self, corner: &Corner<'a>) -> Option<[f64; 3]> {
        match corner.kind {
            CornerKind::Road => self.of_road(&corner.point),
            CornerKind::Local | CornerKind::Curve => local(&corner.point),
        }
    }

    /// Returns the corners of an outline at the bottom and at the top.
    pub fn corners(&self, outline: &Outline<'a>) -> Vec<LocalPoint<'a>> {
        let bottoms = outline.corners().filter_map(|corner| {
            let height = corner.point.height().unwrap_or(0.0);
            Some((corner.point.node(), self.corner(&corner)?, height))
        });
        let both = bottoms.flat_map(|(node, at, height)| {
            let top = [at[0], at[1], at[2] + height];
            [at, top].map(|at| LocalPoint {
                node,
                at,
                reach: 0.0,
            })
        });
        both.collect()
    }

    /// Returns the vertices of a skeleton's polyline, with their radius if `around` is set.
    pub fn vertices(&self, polyline: &Polyline<'a>, around: bool) -> Vec<LocalPoint<'a>> {
        let of_road = polyline
            .road_vertices()
            .map(|one| (self.of_road(&one), one));
        let locals = polyline.local_vertices().map(|one| (local(&one), one));
        let points = of_road.chain(locals).filter_map(|(at, one)| {
            let half = one
                .width()
                .unwrap_or(0.0)
                .hypot(one.length().unwrap_or(0.0))
                / 2.0;
            let reach = one.radius().unwrap_or(half);
            Some(LocalPoint {
                node: one.node(),
                at: at?,
                reach: if around { reach.max(0.0) } else { 0.0 },
            })
        });
        points.collect()
    }
}

fn local(point: &ObjectPoint<'_>) -> Option<[f64; 3]> {
    Some([point.u()?, point.v()?, point.z()?])
}

/// Reports objects whose points need more space than their bounding volume. `points` returns the
/// points of an object, which are called `what` in the text.
pub(crate) fn report_outside<'m, 'a>(
    part: MapPart<'m, 'a>,
    points: impl Fn(&ObjectFrame<'m, 'a>, &Object<'a>) -> Vec<LocalPoint<'a>>,
    what: &str,
    found: &mut Sink<'_>,
) {
    for (road, object) in part.objects() {
        if let Some(frame) = ObjectFrame::of(road, &object) {
            report_too_large(road, &object, &points(&frame, &object), what, found);
        }
    }
}

/// Reports an object whose points need more space than its bounding volume. The standard does not
/// define the origin in the volume. Its examples put it in the middle or at a corner. Therefore
/// only extents are compared.
fn report_too_large(
    road: &Road<'_>,
    object: &Object<'_>,
    points: &[LocalPoint<'_>],
    what: &str,
    found: &mut Sink<'_>,
) {
    let tolerance = found.number(&TOLERANCE);
    let older = is_before(found, (1, 7));
    let worst = AXES
        .iter()
        .enumerate()
        .filter_map(|(axis, (name, attribute))| {
            let (size, attribute) = size_of(object, axis, attribute)?;
            let nearest = |one: &&LocalPoint<'_>| one.at[axis] + one.reach;
            let farthest = |one: &&LocalPoint<'_>| one.at[axis] - one.reach;
            let low = points
                .iter()
                .min_by(|one, other| nearest(one).total_cmp(&nearest(other)))?;
            let high = points
                .iter()
                .max_by(|one, other| farthest(one).total_cmp(&farthest(other)))?;
            let extent = farthest(&high) - nearest(&low);
            // The point farther from the origin is more likely to be wrong.
            let far = if low.at[axis].abs() > high.at[axis].abs() {
                low
            } else {
                high
            };
            (extent > size + tolerance).then_some((
                extent - size,
                extent,
                size,
                *name,
                attribute,
                far.node,
            ))
        });
    let worst = worst.max_by(|one, other| one.0.total_cmp(&other.0));
    let Some((_, extent, size, axis, attribute, node)) = worst else {
        report_away(road, object, points, what, found);
        return;
    };
    let text = format!(
        "{what} of object `{}` extends over {extent:.3} m along {axis}, but its bounding volume only over \
         {size:.3} m (`{attribute}`); all of it must lie inside",
        object.id().unwrap_or_default()
    );
    let finding = found
        .issue(node, text)
        .on(road, object.s().unwrap_or(0.0), object.t().unwrap_or(0.0))
        .at(object.node(), "the object");
    // Levels are lowered for older versions, but such a large excess is an error in every version.
    if older && extent > GROSS_SHARE * size && extent - size > GROSS {
        finding.level(Level::Error);
    }
}

/// Reports points outside the bounding volume that would fit into it elsewhere. They are farther
/// from the origin than the volume is large, so no volume can contain both.
fn report_away(
    road: &Road<'_>,
    object: &Object<'_>,
    points: &[LocalPoint<'_>],
    what: &str,
    found: &mut Sink<'_>,
) {
    let tolerance = found.number(&TOLERANCE);
    let far = AXES
        .iter()
        .enumerate()
        .filter_map(|(axis, (name, attribute))| {
            let (size, attribute) = size_of(object, axis, attribute)?;
            let away = |one: &LocalPoint<'_>| one.at[axis].abs() - one.reach;
            let point = points
                .iter()
                .max_by(|one, other| away(one).total_cmp(&away(other)))?;
            (away(point) > size + tolerance).then_some((
                away(point),
                size,
                *name,
                attribute,
                point.node,
            ))
        });
    let far = far.max_by(|one, other| (one.0 - one.1).total_cmp(&(other.0 - other.1)));
    let Some((away, size, axis, attribute, node)) = far else {
        return;
    };
    let text = format!(
        "{what} of object `{}` reaches {away:.3} m from its origin along {axis}, but its bounding volume is only \
         {size:.3} m large there (`{attribute}`); all of it must lie inside",
        object.id().unwrap_or_default()
    );
    found
        .issue(node, text)
        .on(road, object.s().unwrap_or(0.0), object.t().unwrap_or(0.0))
        .at(object.node(), "the object");
}

/// The axes with the attribute for the size along each axis.
const AXES: [(&str, &str); 3] = [("u", "length"), ("v", "width"), ("z", "height")];

fn size_of(
    object: &Object<'_>,
    axis: usize,
    attribute: &'static str,
) -> Option<(f64, &'static str)> {
    let positive = |size: &f64| *size > 0.0;
    let round = object.radius().filter(positive);
    match (axis, round) {
        (2, _) => Some((object.height().filter(positive)?, attribute)),
        (_, Some(radius)) => Some((2.0 * radius, "radius")),
        (0, None) => Some((object.length().filter(positive)?, attribute)),
        (_, None) => Some((object.width().filter(positive)?, attribute)),
    }
}
