//! Ground boxes of objects with a surface (OpenDRIVE 1.9, 13.1, 13.4, 13.13).

use super::object_parts::number;
use crate::prelude::*;
use qcbus_opendrive::Repeat;

/// Maximum numbers of copies of one object, and of boxes of all objects together.
const MOST_COPIES: f64 = 1000.0;
const MOST: usize = 50_000;

/// The box of an object with a surface, or of one of its copies.
pub(crate) struct SurfaceBox<'m, 'a> {
    pub road: &'m Road<'a>,
    pub object: Object<'a>,
    /// s and t of its middle on the road, in metres.
    pub s: f64,
    pub t: f64,
    /// The corners of its base, counter-clockwise.
    pub corners: [Point; 4],
    /// Height of its lowest and of its highest point.
    pub heights: [f64; 2],
}

/// Returns the boxes of all objects with a surface, copies included.
pub(crate) fn surface_boxes<'m, 'a>(map: &'m RoadMap<'a>) -> Vec<SurfaceBox<'m, 'a>> {
    let mut boxes = Vec::new();
    for (road, object) in map.objects() {
        if object.crgs().next().is_none() || object.outlines().next().is_some() {
            continue;
        }
        let mut repeats = object.repeats().peekable();
        if repeats.peek().is_none() {
            let place = object.s().zip(object.t());
            boxes.extend(place.and_then(|(s, t)| surface_box(road, object, s, t, None)));
        }
        for repeat in repeats {
            boxes.extend(copies(road, object, repeat));
        }
        if boxes.len() > MOST {
            break;
        }
    }
    boxes
}

/// Returns the copies that a `<repeat>` creates. A repeat without a distance is one long object,
/// which must not have a surface.
fn copies<'m, 'a>(
    road: &'m Road<'a>,
    object: Object<'a>,
    repeat: Repeat<'a>,
) -> impl Iterator<Item = SurfaceBox<'m, 'a>> {
    let values = repeat.distance().zip(repeat.length()).zip(repeat.s());
    let curved = [repeat.b_t(), repeat.c_t(), repeat.d_t()]
        .into_iter()
        .flatten()
        .any(|it| it != 0.0);
    let plain = repeat.detached() != Some(true) && !curved;
    let values =
        values.filter(|((distance, length), _)| plain && *distance > 0.0 && *length >= 0.0);
    values
        .into_iter()
        .flat_map(move |((distance, length), start)| {
            let count = (length / distance + 1e-9).floor().min(MOST_COPIES) as usize;
            (0..=count).filter_map(move |index| {
                let along = index as f64 * distance;
                let share = if length > 0.0 { along / length } else { 0.0 };
                let (from, to) = repeat.t_start().zip(repeat.t_end())?;
                let t = from + share * (to - from);
                surface_box(road, object, start + along, t, Some((repeat, share)))
            })
        })
}

fn surface_box<'m, 'a>(
    road: &'m Road<'a>,
    object: Object<'a>,
    s: f64,
    t: f64,
    copy: Option<(Repeat<'a>, f64)>,
) -> Option<SurfaceBox<'m, 'a>> {
    // A repeat may change sizes from its start to its end.
    let value = |own: Option<f64>, start: &str, end: &str| {
        let changed = copy.and_then(|(repeat, share)| {
            let (from, to) = number(repeat.node(), start).zip(number(repeat.node(), end))?;
            Some(from + share * (to - from))
        });
        changed.or(own)
    };
    let length = value(object.length(), "lengthStart", "lengthEnd")?;
    let width = value(object.width(), "widthStart", "widthEnd")?;
    let tilted = [object.pitch(), object.roll()]
        .into_iter()
        .flatten()
        .any(|angle| angle.abs() > 1e-6);
    let proper = length > 0.0 && width > 0.0 && object.radius().is_none_or(|radius| radius == 0.0);
    if !proper || tilted {
        return None;
    }
    let pose = road.pose(s)?;
    let origin = pose.beside(t)?;
    let (sin, cos) = (pose.hdg + object.hdg().unwrap_or(0.0)).sin_cos();
    let corner = |u: f64, v: f64| {
        let (u, v) = (0.5 * u * length, 0.5 * v * width);
        Point::finite(origin.x + u * cos - v * sin, origin.y + u * sin + v * cos)
    };
    let corners = [
        corner(-1.0, -1.0)?,
        corner(1.0, -1.0)?,
        corner(1.0, 1.0)?,
        corner(-1.0, 1.0)?,
    ];
    let offset = value(object.z_offset(), "zOffsetStart", "zOffsetEnd").unwrap_or(0.0);
    let low = road.point(s, t, 0.0)?.z + offset;
    let height = value(object.height(), "heightStart", "heightEnd").unwrap_or(0.0);
    Some(SurfaceBox {
        road,
        object,
        s,
        t,
        corners,
        heights: [low, low + height.max(0.0)],
    })
}

impl SurfaceBox<'_, '_> {
    /// Returns the smallest and the largest x of its corners.
    pub fn extent(&self) -> [f64; 2] {
        let values = self.corners.iter().map(|corner| corner.x);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        [low, values.fold(f64::NEG_INFINITY, f64::max)]
    }
}
