//! The reference line: `<planView>` and its `<geometry>` elements (OpenDRIVE 1.9, 9.2 to 9.7).

use qcbus_document::Node;

use crate::geometry::{Cubic, Curve, ParamPoly3, ParamRange, Placed, Point, Poly3, Pose, Spiral};
use crate::station::Station;
use crate::steps::{Starts, Steps};
use crate::value::{known, numbers};

/// How far beyond the ends, in metres, a place still counts as on the road.
pub(crate) const END_TOLERANCE: f64 = 1e-6;

/// The kinds of shape that a `<geometry>` may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ShapeKind {
    /// `<line>`
    Line,
    /// `<spiral>`
    Spiral,
    /// `<arc>`
    Arc,
    /// `<poly3>`
    Poly3,
    /// `<paramPoly3>`
    ParamPoly3,
}

impl ShapeKind {
    /// The kind of shape that an element stands for.
    pub fn of(node: Node<'_>) -> Option<ShapeKind> {
        match node.name() {
            "line" => Some(ShapeKind::Line),
            "spiral" => Some(ShapeKind::Spiral),
            "arc" => Some(ShapeKind::Arc),
            "poly3" => Some(ShapeKind::Poly3),
            "paramPoly3" => Some(ShapeKind::ParamPoly3),
            _ => None,
        }
    }

    /// The element's name.
    pub fn as_str(self) -> &'static str {
        match self {
            ShapeKind::Line => "line",
            ShapeKind::Spiral => "spiral",
            ShapeKind::Arc => "arc",
            ShapeKind::Poly3 => "poly3",
            ShapeKind::ParamPoly3 => "paramPoly3",
        }
    }
}

/// One `<geometry>`.
#[derive(Debug, Clone, Copy)]
pub struct Geometry<'a> {
    node: Node<'a>,
    s: f64,
    x: f64,
    y: f64,
    hdg: f64,
    length: f64,
    shape: Option<(ShapeKind, Node<'a>)>,
    curve: Option<Curve>,
}

impl<'a> Geometry<'a> {
    fn read(node: Node<'a>) -> Geometry<'a> {
        let [s, x, y, hdg, length] = numbers(node, ["s", "x", "y", "hdg", "length"]);
        let shape = node
            .children()
            .find_map(|child| Some((ShapeKind::of(child)?, child)));
        Geometry {
            node,
            s,
            x,
            y,
            hdg,
            length,
            shape,
            curve: shape.and_then(|(kind, node)| read_curve(kind, node, length)),
        }
    }

    /// The `<geometry>` element.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// `@s`, in metres.
    pub fn s(&self) -> Option<f64> {
        known(self.s)
    }

    /// `@length`, in metres.
    pub fn length(&self) -> Option<f64> {
        known(self.length)
    }

    /// `@hdg`, in radians.
    pub fn hdg(&self) -> Option<f64> {
        known(self.hdg)
    }

    /// `@x` and `@y`, in metres.
    pub fn origin(&self) -> Option<Point> {
        Point::finite(self.x, self.y)
    }

    /// The kind of the first shape.
    pub fn kind(&self) -> Option<ShapeKind> {
        self.shape.map(|(kind, _)| kind)
    }

    /// The element of the first shape.
    pub fn shape_node(&self) -> Option<Node<'a>> {
        self.shape.map(|(_, node)| node)
    }

    /// All shapes within it; the standard allows exactly one.
    pub fn shapes(&self) -> impl Iterator<Item = Node<'a>> + use<'a> {
        self.node
            .children()
            .filter(|child| ShapeKind::of(*child).is_some())
    }

    /// The shape as a curve; `None` when a parameter is missing, broken or degenerate.
    pub fn curve(&self) -> Option<Curve> {
        self.curve
    }

    /// The parametric curve, if that is its shape.
    pub fn param_poly3(&self) -> Option<ParamPoly3> {
        match self.curve? {
            Curve::ParamPoly3(curve) => Some(curve),
            _ => None,
        }
    }

    /// The curve in the plan view; `None` when place, heading or curve are missing, or the
    /// length is negative.
    pub fn placed(&self) -> Option<Placed> {
        if self.length.is_nan() || self.length < 0.0 {
            return None;
        }
        Some(Placed {
            origin: self.origin()?,
            hdg: self.hdg()?,
            length: self.length,
            curve: self.curve?,
        })
    }

    /// The pose `ds` metres after the start.
    pub fn pose(&self, ds: f64) -> Option<Pose> {
        self.placed()?.pose(ds)
    }

    /// The pose where the curve begins; differs from `@x`, `@y`, `@hdg` when a polynomial has
    /// coefficients a or b that move or turn it.
    pub fn start(&self) -> Option<Pose> {
        self.pose(0.0)
    }

    /// The pose where the curve ends, after `@length` metres (at the last parameter of a
    /// parametric curve).
    pub fn end(&self) -> Option<Pose> {
        self.pose(self.length)
    }

    /// The place where the curve begins; defined even where it has no direction.
    pub fn start_point(&self) -> Option<Point> {
        self.placed()?.point(0.0)
    }

    /// The place where the curve ends; defined even where it has no direction.
    pub fn end_point(&self) -> Option<Point> {
        self.placed()?.point(self.length)
    }

    /// The true length of the curve in metres; see [`Curve::true_length`].
    pub fn true_length(&self) -> Option<f64> {
        self.curve?.true_length(self.length()?)
    }
}

/// Reads the parameters of a shape. `length` is the geometry's.
pub(crate) fn read_curve(kind: ShapeKind, node: Node<'_>, length: f64) -> Option<Curve> {
    let all = |values: &[f64]| values.iter().all(|value| value.is_finite());
    match kind {
        ShapeKind::Line => Some(Curve::Line),
        ShapeKind::Arc => {
            let [curvature] = numbers(node, ["curvature"]);
            all(&[curvature]).then_some(Curve::Arc { curvature })
        }
        ShapeKind::Spiral => {
            let [start, end] = numbers(node, ["curvStart", "curvEnd"]);
            Spiral::between(start, end, length).map(Curve::Spiral)
        }
        ShapeKind::Poly3 => {
            let [a, b, c, d] = numbers(node, ["a", "b", "c", "d"]);
            let v = Cubic { a, b, c, d };
            all(&[a, b, c, d]).then_some(Curve::Poly3(Poly3 { v }))
        }
        ShapeKind::ParamPoly3 => read_param_poly3(node).map(Curve::ParamPoly3),
    }
}

fn read_param_poly3(node: Node<'_>) -> Option<ParamPoly3> {
    let names = ["aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV"];
    let values = numbers(node, names);
    if !values.iter().all(|value| value.is_finite()) {
        return None;
    }
    let [au, bu, cu, du, av, bv, cv, dv] = values;
    Some(ParamPoly3 {
        u: Cubic::new(au, bu, cu, du),
        v: Cubic::new(av, bv, cv, dv),
        range: read_range(node)?,
    })
}

/// `@pRange`; where it is missing, as 1.4 allowed, the parameter is normalized.
fn read_range(node: Node<'_>) -> Option<ParamRange> {
    match node.attr("pRange") {
        Some("arcLength") => Some(ParamRange::ArcLength),
        None | Some("normalized") => Some(ParamRange::Normalized),
        Some(_) => None,
    }
}

impl Starts for Geometry<'_> {
    fn start(&self) -> f64 {
        self.s
    }
}

/// The reference line of a road or of a junction. When a geometry has no `@s`, nobody can say
/// which one holds where: then it cannot be evaluated.
#[derive(Debug, Clone, Default)]
pub struct PlanView<'a> {
    steps: Steps<Geometry<'a>>,
}

/// A place on the reference line.
#[derive(Debug, Clone, Copy)]
pub struct Located<'p, 'a> {
    /// The geometry on which the place lies.
    pub geometry: &'p Geometry<'a>,
    /// Its place among the geometries, in document order.
    pub index: usize,
    /// Distance from the geometry's start, in metres.
    pub ds: f64,
}

impl<'a> PlanView<'a> {
    /// Reads the `<geometry>` children of a `<planView>`.
    pub fn read(plan_view: Option<Node<'a>>) -> PlanView<'a> {
        let geometries = plan_view
            .into_iter()
            .flat_map(|node| node.children().filter(|child| child.is("geometry")))
            .map(Geometry::read)
            .collect();
        PlanView {
            steps: Steps::new(geometries),
        }
    }

    /// The geometries in document order.
    pub fn geometries(&self) -> &[Geometry<'a>] {
        self.steps.items()
    }

    /// The geometries in ascending order of `@s`.
    pub fn in_order(&self) -> impl DoubleEndedIterator<Item = &Geometry<'a>> {
        self.steps.in_order()
    }

    /// Where the last geometry ends, in metres along s: `@s + @length`.
    pub fn end(&self) -> Option<f64> {
        let last = self.in_order().next_back()?;
        crate::geometry::finite(last.s()? + last.length()?)
    }

    /// The geometry on which `s` lies: the last that starts at or before it. `None` before the
    /// first one; beyond the last one's end that one goes on.
    pub fn locate(&self, s: impl Into<Station>) -> Option<Located<'_, 'a>> {
        let station = s.into();
        let near_start = |first: &&Geometry<'a>| first.s - station.x() <= END_TOLERANCE;
        let index = match self.steps.rank_at(station) {
            Some(rank) => self.steps.index(rank)?,
            None => {
                self.in_order().next().filter(near_start)?;
                self.steps.index(0)?
            }
        };
        let geometry = self.geometries().get(index)?;
        let ds = (station.x() - geometry.s).max(0.0);
        Some(Located {
            geometry,
            index,
            ds,
        })
    }

    /// The pose at `s`, on the geometry that [`locate`](PlanView::locate) finds.
    pub fn pose(&self, s: impl Into<Station>) -> Option<Pose> {
        let located = self.locate(s)?;
        located.geometry.pose(located.ds)
    }

    /// The pose at the start of the first geometry.
    pub fn first(&self) -> Option<Pose> {
        self.in_order().next()?.start()
    }

    /// The pose at the end of the last geometry.
    pub fn last(&self) -> Option<Pose> {
        self.in_order().next_back()?.end()
    }
}
