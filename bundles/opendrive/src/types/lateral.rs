//! Lateral profile: superelevation, shape and cross section surface (OpenDRIVE 1.9, 10.5.2 to
//! 10.5.4).

use qcbus_document::Node;

use crate::geometry::finite;
use crate::types::profile::Profile;
use crate::types::station::Station;
use crate::types::strips::CrossSectionSurface;
use crate::types::value::number;

/// Content of `<lateralProfile>`.
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

    /// Returns the height above the reference plane at (s, t), in metres, from shape or cross
    /// section surface. It is zero without either and undefined with both, which is not allowed.
    pub fn height(&self, s: impl Into<Station>, t: f64) -> Option<f64> {
        let s = s.into();
        match &self.cross_section_surface {
            None => self.shape.height(s.x(), t),
            Some(surface) if self.shape.is_empty() => surface.height(s, t),
            Some(_) => None,
        }
    }

    /// Checks whether all points of a cross section lie in one plane.
    pub fn is_flat(&self) -> bool {
        self.shape.is_empty() && self.cross_section_surface.is_none()
    }
}

/// The `<shape>` records, grouped by `@s`.
#[derive(Debug, Default)]
pub struct Shape<'a> {
    rows: Vec<ShapeRow<'a>>,
    /// Whether a record has no `@s`, so that its cross section is unknown.
    unplaced: bool,
}

/// The shape of one cross section: all `<shape>` records with the same `@s`.
#[derive(Debug)]
pub struct ShapeRow<'a> {
    /// `@s` of the records, in metres.
    pub s: f64,
    /// Height over t. The records start at their `@t`.
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

    /// Checks whether there is no shape.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty() && !self.unplaced
    }

    /// Returns the cross sections in ascending order of s.
    pub fn rows(&self) -> &[ShapeRow<'a>] {
        &self.rows
    }

    /// Returns the height at (s, t) in metres. Between two cross sections, it is interpolated
    /// linearly along s (10.5.3). The last one continues to the end of the road. Before the first
    /// one, the height is zero, the default. Returns `None` if a cross section does not reach t.
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
