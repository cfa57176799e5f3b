"""Columns and tables of numbers."""

import math

import pytest
from looking import HEADER, look

MAP = f"""<OpenDRIVE>{HEADER}
<road id="a" length="100"><planView><geometry s="0" length="60"/><geometry s="60" length="x"/></planView></road>
<road id="b"><planView><geometry s="0" length="inf"/></planView></road>
</OpenDRIVE>"""


def test_a_table_of_elements():
    def of(doc):
        roads, geometry = doc.table("road", "length"), doc.table("geometry", "s", "length", "no")
        return {
            "rows": (len(roads), len(geometry)),
            "s": list(geometry["s"]),
            "length": [str(it) for it in geometry["length"]],
            "no": all(math.isnan(it) for it in geometry["no"]),
            "roads": list(geometry.within(roads)),
            "none": list(roads.within(geometry)),
            "element": geometry[-1].getparent().getparent().get("id"),
            "keys": geometry.keys(),
        }

    assert look(MAP, of) == {
        "rows": (2, 3),
        "s": [0.0, 60.0, 0.0],
        "length": ["60.0", "nan", "nan"],
        "no": True,
        "roads": [0, 0, 1],
        "none": [-1, -1],
        "element": "b",
        "keys": ["s", "length", "no"],
    }
    with pytest.raises(KeyError, match="`x` was not requested"):
        look(MAP, lambda doc: doc.table("road", "length")["x"])
    with pytest.raises(IndexError):
        look(MAP, lambda doc: doc.table("road")[2])


def test_a_column_is_a_buffer():
    table = look(MAP, lambda doc: doc.table("geometry", "s"))
    view = memoryview(table["s"])
    assert (view.format, view.itemsize, view.shape, view.strides, view.readonly) == ("d", 8, (3,), (8,), True)
    assert view.tolist() == [0.0, 60.0, 0.0]
    with pytest.raises(TypeError):
        view[0] = 1.0
    assert memoryview(look("<OpenDRIVE/>", lambda doc: doc.table("road", "s"))["s"]).tolist() == []
    within = look(MAP, lambda doc: doc.table("geometry").within(doc.table("road")))
    assert (memoryview(within).format, list(memoryview(within))) == ("q", [0, 0, 1])
    # A view keeps its column alive.
    view = memoryview(look(MAP, lambda doc: doc.table("geometry", "s")["s"]))
    assert view.tolist() == [0.0, 60.0, 0.0]


def test_a_column_is_an_array_without_a_copy():
    numpy = pytest.importorskip("numpy")
    column = look(MAP, lambda doc: doc.table("geometry", "s")["s"])
    array = column.numpy()
    assert (array.dtype, array.sum()) == (numpy.float64, 60.0)
    assert numpy.shares_memory(array, numpy.asarray(column))
    rows = look(MAP, lambda doc: [doc.table("geometry", "s")[at].get("s") for at in numpy.flatnonzero(array > 1)])
    assert rows == ["60"]


RING = f"""<OpenDRIVE>{HEADER}
<road id="r" length="10" junction="-1">
<planView><geometry s="0" x="1" y="2" hdg="0" length="10"><line/></geometry></planView>
<elevationProfile><elevation s="0" a="3" b="0.5" c="0" d="0"/></elevationProfile>
<lanes><laneSection s="0">
<left><lane id="1" type="driving" level="false"><width sOffset="0" a="3" b="0.1" c="0" d="0"/></lane></left>
<center><lane id="0" type="none" level="false"/></center>
<right><lane id="-1" type="sidewalk" level="false"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes></road>
<road id="broken" length="4"><planView/></road>
</OpenDRIVE>"""


def test_the_model_of_a_map():
    def of(doc):
        road = doc.road("r")
        section = road.sections[0]
        pose = road.pose(4.0)
        return {
            "roads": [it.id for it in doc.roads],
            "none": (doc.road("x"), road.junction, road.pose(11.0), road.width(5, 0.0), doc.road("broken").pose(0.0)),
            "pose": (pose.x, pose.y, pose.hdg, pose.curvature),
            "point": road.point(4.0, 1.0, 2.0),
            "elevation": road.elevation(4.0),
            "widths": [road.width(lane, 5.0) for lane in (1, 0, -1)],
            "lanes": [(lane.id, lane.type, lane.width(10.0)) for lane in section.lanes],
            "lane": section.lane(-1).element.getpath(),
            "section": (section.s, section.length, section.lane(7), section.element.tag),
            "element": road.element.get("id"),
        }

    assert look(RING, of) == {
        "roads": ["r", "broken"],
        "none": (None, None, None, None, None),
        "pose": (5.0, 2.0, 0.0, 0.0),
        "point": (5.0, 3.0, 7.0),
        "elevation": 5.0,
        "widths": [3.5, 0.0, 2.0],
        "lanes": [(1, "driving", 4.0), (0, "none", 0.0), (-1, "sidewalk", 2.0)],
        "lane": "/OpenDRIVE/road[@id='r']/lanes/laneSection/right/lane[@id='-1']",
        "section": (0.0, 10.0, None, "laneSection"),
        "element": "r",
    }


def test_samples():
    poses = look(RING, lambda doc: doc.poses(4.0))
    assert list(poses["road"]) == [0, 0, 0, 0, 1, 1]
    assert list(poses["s"]) == [0.0, 4.0, 8.0, 10.0, 0.0, 4.0]
    assert list(poses["x"])[:4] == [1.0, 5.0, 9.0, 11.0]
    assert math.isnan(poses["x"][4])
    widths = look(RING, lambda doc: doc.widths(10.0))
    rows = list(zip(widths["road"], widths["s"], widths["lane"], widths["width"]))
    assert rows == [(0, 0.0, 1, 3.0), (0, 0.0, -1, 2.0), (0, 10.0, 1, 4.0), (0, 10.0, -1, 2.0)]
    for step in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="must be a finite number"):
            look(RING, lambda doc: doc.poses(step))
    with pytest.raises(ValueError, match="samples; at most"):
        look(RING, lambda doc: doc.poses(1e-9))
    with pytest.raises(KeyError, match="no column `z`; the columns are road, s, x, y, hdg, curvature"):
        poses["z"]
