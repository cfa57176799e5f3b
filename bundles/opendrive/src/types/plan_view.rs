//! The reference line: `<planView>` and its `<geometry>` elements (OpenDRIVE 1.9, 9.2 to 9.7).

use qcbus_document::Node;

use crate::geometry::{Cubic, Curve, ParamPoly3, ParamRange, Placed, Point, Poly3, Pose, Spiral};
use crate::types::station::Station;
use crate::types::steps::{Starts, Steps};
use crate::types::value::{known, numbers};

/// Maximum distance beyond the ends, in metres, at which a place still counts as on the road.
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
    /// Returns the kind of shape of an element.
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

    /// Returns the name of the element.
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

    /// Returns the `<geometry>` element.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns `@s`, in metres.
    pub fn s(&self) -> Option<f64> {
        known(self.s)
    }

    /// Returns `@length`, in metres.
    pub fn length(&self) -> Option<f64> {
        known(self.length)
    }

    /// Returns `@hdg`, in radians.
    pub fn hdg(&self) -> Option<f64> {
        known(self.hdg)
    }

    /// Returns `@x` and `@y`, in metres.
    pub fn origin(&self) -> Option<Point> {
        Point::finite(self.x, self.y)
    }

    /// Returns the kind of the first shape.
    pub fn kind(&self) -> Option<ShapeKind> {
        self.shape.map(|(kind, _)| kind)
    }

    /// Returns the element of the first shape.
    pub fn shape_node(&self) -> Option<Node<'a>> {
        self.shape.map(|(_, node)| node)
    }

    /// Returns all shapes of the geometry. The standard allows exactly one.
    pub fn shapes(&self) -> impl Iterator<Item = Node<'a>> + use<'a> {
        self.node
            .children()
            .filter(|child| ShapeKind::of(*child).is_some())
    }

    /// Returns the shape as a curve, or `None` if a parameter is missing, malformed or degenerate.
    pub fn curve(&self) -> Option<Curve> {
        self.curve
    }

    /// Returns the parametric curve, if that is the shape.
    pub fn param_poly3(&self) -> Option<ParamPoly3> {
        match self.curve? {
            Curve::ParamPoly3(curve) => Some(curve),
            _ => None,
        }
    }

    /// Returns the curve in the plan view. Returns `None` if place, heading or curve are missing,
    /// or the length is negative.
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

    /// Returns the pose `ds` metres after the start.
    pub fn pose(&self, ds: f64) -> Option<Pose> {
        self.placed()?.pose(ds)
    }

    /// Returns the pose at the start of the curve. It differs from `@x`, `@y`, `@hdg` if
    /// coefficients a or b of a polynomial move or turn it.
    pub fn start(&self) -> Option<Pose> {
        self.pose(0.0)
    }

    /// Returns the pose at the end of the curve, after `@length` metres. For a parametric curve,
    /// this is the pose at the last parameter.
    pub fn end(&self) -> Option<Pose> {
        self.pose(self.length)
    }

    /// Returns the start point of the curve. It is defined even where the curve has no direction.
    pub fn start_point(&self) -> Option<Point> {
        self.placed()?.point(0.0)
    }

    /// Returns the end point of the curve. It is defined even where the curve has no direction.
    pub fn end_point(&self) -> Option<Point> {
        self.placed()?.point(self.length)
    }

    /// Returns the true length of the curve in metres; see [`Curve::true_length`].
    pub fn true_length(&self) -> Option<f64> {
        self.curve?.true_length(self.length()?)
    }
}

/// Reads the parameters of a shape. `length` is the length of the geometry.
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

/// Reads `@pRange`. If it is missing, as 1.4 allowed, the parameter is normalized.
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

/// The reference line of a road or a junction. If a geometry has no `@s`, the order of the
/// geometries is unknown. The line then cannot be evaluated.
#[derive(Debug, Clone, Default)]
pub struct PlanView<'a> {
    steps: Steps<Geometry<'a>>,
}

/// A place on the reference line.
#[derive(Debug, Clone, Copy)]
pub struct Located<'p, 'a> {
    /// The geometry on which the place lies.
    pub geometry: &'p Geometry<'a>,
    /// Place of the geometry among the geometries, in document order.
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

    /// Returns the geometries in document order.
    pub fn geometries(&self) -> &[Geometry<'a>] {
        self.steps.items()
    }

    /// Returns the geometries in ascending order of `@s`.
    pub fn in_order(&self) -> impl DoubleEndedIterator<Item = &Geometry<'a>> {
        self.steps.in_order()
    }

    /// Returns the end of the last geometry, in metres along s: `@s + @length`.
    pub fn end(&self) -> Option<f64> {
        let last = self.in_order().next_back()?;
        crate::geometry::finite(last.s()? + last.length()?)
    }

    /// Returns the geometry at `s`: the last one that starts at or before it. Returns `None` before
    /// the first geometry. The last geometry continues beyond its end.
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

    /// Returns the pose at `s`, on the geometry that [`locate`](PlanView::locate) finds.
    pub fn pose(&self, s: impl Into<Station>) -> Option<Pose> {
        let located = self.locate(s)?;
        located.geometry.pose(located.ds)
    }

    /// Returns the pose at the start of the first geometry.
    pub fn first(&self) -> Option<Pose> {
        self.in_order().next()?.start()
    }

    /// Returns the pose at the end of the last geometry.
    pub fn last(&self) -> Option<Pose> {
        self.in_order().next_back()?.end()
    }
}
