//! The lateral profile: superelevation, shape, cross section surface (OpenDRIVE 1.9, 10.5.2 to
//! 10.5.4).

use qcbus_document::Node;

use crate::geometry::finite;
use crate::profile::Profile;
use crate::station::Station;
use crate::strips::CrossSectionSurface;
use crate::value::number;

/// What `<lateralProfile>` holds.
#[derive(Debug, Default)]
pub struct LateralProfile<'a> {
    /// The roll angle over s, in radians (10.5.2).
    pub superelevation: Profile<'a>,
    /// The heights of the cross sections over t (10.5.3).
    pub shape: Shape<'a>,
    /// The surface strips of 1.8 (10.5.4).
    pub cross_section_surface: Option<CrossSectionSurface<'a>>,
}

impl<'a> LateralProfile<'a> {
    pub(crate) fn read(node: Option<Node<'a>>) -> LateralProfile<'a> {
        let Some(node) = node else {
            return LateralProfile::default();
        };
        LateralProfile {
            superelevation: Profile::read(node.children_named("superelevation"), "s"),
            shape: Shape::read(node),
            cross_section_surface: node
                .child("crossSectionSurface")
                .map(CrossSectionSurface::read),
        }
    }

    /// The height above the reference plane that shape or cross section surface give at (s, t),
    /// in metres; zero without either. Combining both is not allowed; then none can be evaluated.
    pub fn height(&self, s: impl Into<Station>, t: f64) -> Option<f64> {
        let s = s.into();
        match &self.cross_section_surface {
            None => self.shape.height(s.x(), t),
            Some(surface) if self.shape.is_empty() => surface.height(s, t),
            Some(_) => None,
        }
    }

    /// Whether every point of a cross section lies in one plane.
    pub fn is_flat(&self) -> bool {
        self.shape.is_empty() && self.cross_section_surface.is_none()
    }
}

/// The `<shape>` records, grouped by `@s`.
#[derive(Debug, Default)]
pub struct Shape<'a> {
    rows: Vec<ShapeRow<'a>>,
    /// A record has no `@s`: nobody can say to which cross section it belongs.
    unplaced: bool,
}

/// The shape of one cross section: all `<shape>` records with the same `@s`.
#[derive(Debug)]
pub struct ShapeRow<'a> {
    /// `@s` of the records, in metres.
    pub s: f64,
    /// Height over t; the records start at their `@t`.
    pub profile: Profile<'a>,
}

impl<'a> Shape<'a> {
    fn read(lateral: Node<'a>) -> Shape<'a> {
        let mut placed = Vec::new();
        let mut unplaced = false;
        for node in lateral.children().filter(|child| child.is("shape")) {
            match number(node, "s") {
                Some(s) => placed.push((s, node)),
                None => unplaced = true,
            }
        }
        placed.sort_by(|(one, _), (next, _)| one.total_cmp(next));
        let same_s = |one: &(f64, Node<'a>), next: &(f64, Node<'a>)| one.0 == next.0;
        let rows = placed.chunk_by(same_s).filter_map(|row| {
            let profile = Profile::read(row.iter().map(|(_, node)| *node), "t");
            let s = row.first()?.0;
            Some(ShapeRow { s, profile })
        });
        let rows = rows.collect();
        Shape { rows, unplaced }
    }

    /// Whether there is no shape at all.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty() && !self.unplaced
    }

    /// The cross sections in ascending order of s.
    pub fn rows(&self) -> &[ShapeRow<'a>] {
        &self.rows
    }

    /// The height at (s, t) in metres. Between two cross sections it is interpolated linearly
    /// along s (10.5.3); the last one goes on to the road's end, and before the first one there
    /// is none: zero, the default. `None` where a cross section does not reach out to t.
    pub fn height(&self, s: f64, t: f64) -> Option<f64> {
        if self.unplaced || !s.is_finite() {
            return None;
        }
        let after = self.rows.partition_point(|row| row.s <= s);
        let Some(before) = after.checked_sub(1).and_then(|at| self.rows.get(at)) else {
            return Some(0.0);
        };
        let low = before.profile.at(t)?;
        let Some(next) = self.rows.get(after) else {
            return Some(low);
        };
        let share = (s - before.s) / (next.s - before.s);
        if share == 0.0 {
            return Some(low);
        }
        finite(low + share * (next.profile.at(t)? - low))
    }
}
