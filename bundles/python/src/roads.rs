//! The OpenDRIVE model: roads, sections, lanes and their positions.
//!
//! A value that depends on a missing or broken number cannot be evaluated. It is `None`, or
//! not-a-number in columns.

use std::sync::Arc;

use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use qcbus_opendrive::{LaneKey, LaneRef, RoadMap, SectionRef, Side};

use crate::column::{Column, Table};
use crate::element::Element;
use crate::lease::Lease;

/// Maximum number of rows in a table of samples. More rows would take gigabytes.
const MOST_SAMPLES: f64 = 20_000_000.0;

/// A point on a reference line with the direction of the line.
#[pyclass(frozen, module = "qcbus", get_all)]
pub(crate) struct Pose {
    /// East, in metres.
    x: f64,
    /// North, in metres.
    y: f64,
    /// Heading in radians, counter-clockwise from east, not wrapped.
    hdg: f64,
    /// Curvature in 1/m, positive in left curves.
    curvature: f64,
}

#[pymethods]
impl Pose {
    fn __repr__(&self) -> String {
        let Pose {
            x,
            y,
            hdg,
            curvature,
        } = self;
        format!("<pose x={x} y={y} hdg={hdg} curvature={curvature}>")
    }
}

/// A road of a map. It is valid until the rule's job has ended.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Road {
    lease: Arc<Lease>,
    index: usize,
}

/// Returns all roads of a map in document order.
pub(crate) fn roads(lease: &Arc<Lease>) -> PyResult<Vec<Road>> {
    let count = lease.map()?.with(|map| map.roads().len());
    let road = |index| Road {
        lease: lease.clone(),
        index,
    };
    Ok((0..count).map(road).collect())
}

/// Returns the first road with this id, or `None`.
pub(crate) fn road(lease: &Arc<Lease>, id: &str) -> PyResult<Option<Road>> {
    let index = lease
        .map()?
        .with(|map| map.road(id).map(|road| road.index()));
    Ok(index.map(|index| Road {
        lease: lease.clone(),
        index,
    }))
}

impl Road {
    fn look<T>(&self, look: impl FnOnce(&qcbus_opendrive::Road<'_>) -> T) -> PyResult<T> {
        let map = self.lease.map()?;
        map.with(|map| map.roads().get(self.index).map(look))
            .ok_or_else(|| PyIndexError::new_err("no such road"))
    }
}

#[pymethods]
impl Road {
    /// Returns its `@id`, or an empty text if it is missing.
    #[getter]
    fn id(&self) -> PyResult<String> {
        self.look(|road| road.id().to_owned())
    }

    /// Returns its `@length` in metres, or `None`.
    #[getter]
    fn length(&self) -> PyResult<Option<f64>> {
        self.look(|road| road.length())
    }

    /// Returns the id of the junction that it belongs to, or `None`.
    #[getter]
    fn junction(&self) -> PyResult<Option<String>> {
        self.look(|road| road.junction().map(str::to_owned))
    }

    /// Returns its element.
    #[getter]
    pub(crate) fn element(&self) -> PyResult<Element> {
        let index = self.look(|road| road.node().index())?;
        Ok(Element::new(&self.lease, index))
    }

    /// Returns the pose of the reference line at s in metres, or `None` outside the road.
    fn pose(&self, s: f64) -> PyResult<Option<Pose>> {
        let pose = self.look(|road| road.pose(s))?;
        Ok(pose.map(|it| Pose {
            x: it.x,
            y: it.y,
            hdg: it.hdg,
            curvature: it.curvature,
        }))
    }

    /// Returns the point (x, y, z) at s, t and h in metres, or `None`. Elevation and superelevation
    /// are applied.
    #[pyo3(signature = (s, t=0.0, h=0.0))]
    fn point(&self, s: f64, t: f64, h: f64) -> PyResult<Option<(f64, f64, f64)>> {
        let point = self.look(|road| road.point(s, t, h))?;
        Ok(point.map(|point| (point.x, point.y, point.z)))
    }

    /// Returns the height of the reference line at s, in metres; zero without an elevation.
    fn elevation(&self, s: f64) -> PyResult<Option<f64>> {
        self.look(|road| road.elevation().at_or_zero(s))
    }

    /// Returns the width of a lane at s, in metres; `None` if the lane or its width is not defined.
    fn width(&self, lane: i64, s: f64) -> PyResult<Option<f64>> {
        self.look(|road| {
            let side = Side::of_lane_id(lane).unwrap_or(Side::Right);
            let section = road.permanent()?.section_at(road, side, s)?;
            section.lane(lane)?.width(s - section.s()?)
        })
    }

    /// Returns its lane sections in document order.
    #[getter]
    fn sections(&self) -> PyResult<Vec<Section>> {
        let keys: Vec<(usize, usize)> = self.look(|road| {
            road.sections()
                .map(|it| (it.layer.index(), it.index()))
                .collect()
        })?;
        let section = |(layer, index)| Section {
            lease: self.lease.clone(),
            road: self.index,
            layer,
            index,
        };
        Ok(keys.into_iter().map(section).collect())
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("<road {:?}>", self.id()?))
    }
}

/// A lane section. It is valid until the rule's job has ended.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Section {
    lease: Arc<Lease>,
    road: usize,
    layer: usize,
    index: usize,
}

impl Section {
    fn look<T>(&self, look: impl FnOnce(SectionRef<'_, '_>) -> T) -> PyResult<T> {
        let map = self.lease.map()?;
        let found = map.with(|map| {
            let road = map.roads().get(self.road)?;
            let layer = road.layers().get(self.layer)?;
            layer.section(road, self.index).map(look)
        });
        found.ok_or_else(|| PyIndexError::new_err("no such section"))
    }

    fn lane_of(&self, key: LaneKey) -> PyLane {
        PyLane {
            lease: self.lease.clone(),
            key,
        }
    }
}

#[pymethods]
impl Section {
    /// Returns its start in metres along the road, or `None`.
    #[getter]
    fn s(&self) -> PyResult<Option<f64>> {
        self.look(|section| section.s())
    }

    /// Returns its length in metres, or `None`. The shorter side counts if the sides differ.
    #[getter]
    fn length(&self) -> PyResult<Option<f64>> {
        self.look(|section| section.shortest_length())
    }

    /// Returns its element.
    #[getter]
    pub(crate) fn element(&self) -> PyResult<Element> {
        let index = self.look(|section| section.node().index())?;
        Ok(Element::new(&self.lease, index))
    }

    /// Returns its lanes in document order, including the center lane.
    #[getter]
    fn lanes(&self) -> PyResult<Vec<PyLane>> {
        let keys: Vec<LaneKey> = self.look(|it| it.lanes().map(LaneRef::key).collect())?;
        Ok(keys.into_iter().map(|key| self.lane_of(key)).collect())
    }

    /// Returns the lane with an id, or `None`.
    fn lane(&self, id: i64) -> PyResult<Option<PyLane>> {
        let key = self.look(|section| section.lane(id).map(LaneRef::key))?;
        Ok(key.map(|key| self.lane_of(key)))
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(match self.s()? {
            Some(s) => format!("<lane section at s={s}>"),
            None => "<lane section>".to_owned(),
        })
    }
}

/// A lane of a section. It is valid until the rule's job has ended.
#[pyclass(frozen, module = "qcbus", name = "Lane")]
pub(crate) struct PyLane {
    lease: Arc<Lease>,
    key: LaneKey,
}

impl PyLane {
    fn look<T>(&self, look: impl FnOnce(LaneRef<'_, '_>) -> T) -> PyResult<T> {
        let map = self.lease.map()?;
        map.with(|map| map.lane(self.key).map(look))
            .ok_or_else(|| PyIndexError::new_err("no such lane"))
    }
}

#[pymethods]
impl PyLane {
    /// Returns its `@id`, or `None` if it is not an integer.
    #[getter]
    fn id(&self) -> PyResult<Option<i64>> {
        self.look(|lane| lane.lane().id())
    }

    /// Returns its `@type`, or `None`.
    #[getter]
    fn r#type(&self) -> PyResult<Option<String>> {
        self.look(|lane| lane.lane().kind().map(str::to_owned))
    }

    /// Returns its element.
    #[getter]
    pub(crate) fn element(&self) -> PyResult<Element> {
        let index = self.look(|lane| lane.lane().node().index())?;
        Ok(Element::new(&self.lease, index))
    }

    /// Returns its width `ds` metres from the section's start, or `None`; zero for the center lane.
    fn width(&self, ds: f64) -> PyResult<Option<f64>> {
        self.look(|lane| lane.width(ds))
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(match self.id()? {
            Some(id) => format!("<lane {id}>"),
            None => "<lane>".to_owned(),
        })
    }
}

/// Returns the poses of all reference lines, every `step` metres and at the end of each road.
pub(crate) fn poses(py: Python<'_>, lease: &Arc<Lease>, step: f64) -> PyResult<Table> {
    let map = lease.map()?;
    let mut roads = Vec::new();
    let [mut s, mut x, mut y, mut hdg, mut curvature] = [const { Vec::new() }; 5];
    py.detach(|| {
        map.with(|map| {
            for (road, stations) in stations(map, step)? {
                for station in stations {
                    let pose = road.pose(station).unwrap_or(NOWHERE);
                    roads.push(row_of(road));
                    s.push(station);
                    x.push(pose.x);
                    y.push(pose.y);
                    hdg.push(pose.hdg);
                    curvature.push(pose.curvature);
                }
            }
            Ok::<(), PyErr>(())
        })
    })?;
    let columns = vec![
        ("road", Column::ints(roads)),
        ("s", Column::floats(s)),
        ("x", Column::floats(x)),
        ("y", Column::floats(y)),
        ("hdg", Column::floats(hdg)),
        ("curvature", Column::floats(curvature)),
    ];
    Table::new(py, columns)
}

/// Value in the columns for a pose that cannot be evaluated.
const NOWHERE: qcbus_opendrive::geometry::Pose = qcbus_opendrive::geometry::Pose {
    x: f64::NAN,
    y: f64::NAN,
    hdg: f64::NAN,
    curvature: f64::NAN,
};

fn row_of(road: &qcbus_opendrive::Road<'_>) -> i64 {
    i64::try_from(road.index()).unwrap_or(i64::MAX)
}

/// Returns the widths of all lanes except the center lanes, every `step` metres of each road.
pub(crate) fn widths(py: Python<'_>, lease: &Arc<Lease>, step: f64) -> PyResult<Table> {
    let map = lease.map()?;
    let (mut roads, mut lanes) = (Vec::new(), Vec::new());
    let (mut places, mut widths) = (Vec::new(), Vec::new());
    py.detach(|| {
        map.with(|map| {
            for (road, stations) in stations(map, step)? {
                let Some(layer) = road.permanent() else {
                    continue;
                };
                for s in stations {
                    for side in Side::BOTH {
                        let Some(section) = layer.section_at(road, side, s) else {
                            continue;
                        };
                        let Some(start) = section.s() else { continue };
                        for lane in section.side(side) {
                            let Some(id) = lane.lane().id() else { continue };
                            roads.push(row_of(road));
                            places.push(s);
                            lanes.push(id);
                            widths.push(lane.width(s - start).unwrap_or(f64::NAN));
                        }
                    }
                }
            }
            Ok::<(), PyErr>(())
        })
    })?;
    let columns = vec![
        ("road", Column::ints(roads)),
        ("s", Column::floats(places)),
        ("lane", Column::ints(lanes)),
        ("width", Column::floats(widths)),
    ];
    Table::new(py, columns)
}

/// Returns the roads of known length with their sample positions: 0, `step`, 2 `step`, and the end.
fn stations<'m, 'a>(
    map: &'m RoadMap<'a>,
    step: f64,
) -> PyResult<
    Vec<(
        &'m qcbus_opendrive::Road<'a>,
        impl Iterator<Item = f64> + use<>,
    )>,
> {
    if !(step.is_finite() && step > 0.0) {
        return Err(PyValueError::new_err(format!(
            "the step must be a finite number greater than 0 m, found {step} m"
        )));
    }
    let roads = map.roads().iter();
    let roads: Vec<_> = roads
        .filter_map(|road| Some((road, road.length().filter(|length| *length > 0.0)?)))
        .collect();
    let samples: f64 = roads.iter().map(|(_, length)| length / step + 2.0).sum();
    if samples > MOST_SAMPLES {
        return Err(PyValueError::new_err(format!(
            "a step of {step} m gives {samples:.0} samples; at most {MOST_SAMPLES} are returned at once"
        )));
    }
    let along = |length: f64| {
        let steps = (0_u64..).map(move |number| number as f64 * step);
        let before_end = steps.take_while(move |s| *s < length);
        before_end.chain(std::iter::once(length))
    };
    Ok(roads
        .into_iter()
        .map(|(road, length)| (road, along(length)))
        .collect())
}
