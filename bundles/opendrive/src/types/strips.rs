//! Cross section surfaces: strips of road surface with coefficients over s (OpenDRIVE 1.9, 10.5.4).

use qcbus_document::Node;

use crate::geometry::finite;
use crate::types::profile::Profile;
use crate::types::station::Station;
use crate::types::value::integer;

/// A `<crossSectionSurface>`.
#[derive(Debug)]
pub struct CrossSectionSurface<'a> {
    node: Node<'a>,
    /// The common shift of all strips in t, in metres.
    pub t_offset: Profile<'a>,
    /// The strips in document order.
    pub strips: Vec<Strip<'a>>,
}

/// A `<strip>`: a polynomial in t whose coefficients are polynomials in s.
#[derive(Debug)]
pub struct Strip<'a> {
    node: Node<'a>,
    /// `@id`: 1 and -1 for the inner strips, 2 and -2 for the outer ones.
    pub id: Option<i64>,
    /// The width of an inner strip over s, in metres.
    pub width: Profile<'a>,
    /// The coefficients over s for powers 0, 1, 2 and 3 of dt: `<constant>`, `<linear>`,
    /// `<quadratic>`, `<cubic>`.
    pub coefficients: [Profile<'a>; 4],
}

/// Reference of the heights of an outer strip (`e_strip_mode`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StripMode {
    /// Elevation of the reference line.
    Independent,
    /// Outer edge of the inner strip.
    Relative,
}

impl<'a> CrossSectionSurface<'a> {
    pub(crate) fn read(node: Node<'a>) -> CrossSectionSurface<'a> {
        let strips = node
            .children()
            .filter(|child| child.is("surfaceStrips"))
            .flat_map(|list| list.children().filter(|child| child.is("strip")))
            .map(Strip::read)
            .collect();
        CrossSectionSurface {
            node,
            t_offset: coefficients(node, "tOffset"),
            strips,
        }
    }

    /// Returns the element.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns the first strip with this id.
    pub fn strip(&self, id: i64) -> Option<&Strip<'a>> {
        self.strips.iter().find(|strip| strip.id == Some(id))
    }

    /// Returns the height at (s, t) in metres. A side without strips has the height zero. t counts
    /// from `tOffset`. An inner strip without a width reaches the edge of the road. An outer strip
    /// counts dt from the edge of the inner strip. In relative mode, it also counts its height from
    /// there. Returns `None` if the mode of a strip is missing or unknown, or a width is negative.
    pub fn height(&self, s: impl Into<Station>, t: f64) -> Option<f64> {
        let s = s.into();
        let t = finite(t - self.t_offset.at_or_zero(s)?)?;
        // By 10.5.4, t = 0 belongs to the right side.
        let sign = if t > 0.0 { 1 } else { -1 };
        let Some(inner) = self.strip(sign) else {
            return if self.strip(2 * sign).is_none() {
                Some(0.0)
            } else {
                None
            };
        };
        if inner.width.is_empty() {
            return inner.height(s, t);
        }
        let width = inner.width.at(s).filter(|width| *width >= 0.0)?;
        if t.abs() <= width {
            return inner.height(s, t);
        }
        let edge = if t > 0.0 { width } else { -width };
        let outer = self.strip(2 * sign)?;
        let height = outer.height(s, t - edge)?;
        match outer.mode()? {
            StripMode::Independent => Some(height),
            StripMode::Relative => finite(height + inner.height(s, edge)?),
        }
    }
}

impl<'a> Strip<'a> {
    fn read(node: Node<'a>) -> Strip<'a> {
        let names = ["constant", "linear", "quadratic", "cubic"];
        Strip {
            node,
            id: integer(node, "id"),
            width: coefficients(node, "width"),
            coefficients: names.map(|name| coefficients(node, name)),
        }
    }

    /// Returns the element.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns `@mode`. The standard defines no default.
    pub fn mode(&self) -> Option<StripMode> {
        match self.node.attr("mode") {
            Some("independent") => Some(StripMode::Independent),
            Some("relative") => Some(StripMode::Relative),
            _ => None,
        }
    }

    /// Returns the value of the polynomial at `dt` metres from the strip's inner edge (negative to
    /// the right). Missing components are zero.
    pub fn height(&self, s: impl Into<Station>, dt: f64) -> Option<f64> {
        let s = s.into();
        let mut height = 0.0;
        for component in self.coefficients.iter().rev() {
            height = height * dt + component.at_or_zero(s)?;
        }
        finite(height)
    }
}

/// Reads the `<coefficients>` of the child `name`. Absent ones are zero.
fn coefficients<'a>(node: Node<'a>, name: &str) -> Profile<'a> {
    let lists = node.child(name).into_iter();
    let records = lists.flat_map(|list| list.children().filter(|child| child.is("coefficients")));
    Profile::read_sparse(records, "s")
}
