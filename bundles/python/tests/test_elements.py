"""Elements behave like those of lxml, and end with their job."""

import pytest
import qcbus
from looking import HEADER, look

MAP = f"""<?xml version="1.0"?>
<OpenDRIVE>
  {HEADER}
  <road id="1" name="Gr&#xfc;ner Weg &amp; mehr" length="1e2">
    <lanes><laneSection s="0"/><laneSection s="50"/></lanes>
    <userData code="x">some <![CDATA[<text>]]></userData>
  </road>
  <road id="2" length="NaN" junction="-1"/>
</OpenDRIVE>
"""


def at(path, of):
    return look(MAP, lambda doc: of(doc.find(path)))


def test_what_an_element_says_of_itself():
    assert look(MAP, lambda doc: doc.root.tag) == "OpenDRIVE"
    assert look(MAP, lambda doc: doc.getroot().tag) == "OpenDRIVE"
    assert at("road", lambda it: it.get("name")) == "Grüner Weg & mehr"
    assert at("road", lambda it: (it.get("no"), it.get("no", 5))) == (None, 5)
    assert at("road", lambda it: it.attrib) == {"id": "1", "name": "Grüner Weg & mehr", "length": "1e2"}
    assert at("road", lambda it: it.keys()) == ["id", "name", "length"]
    assert at("road[2]", lambda it: it.items()) == [("id", "2"), ("length", "NaN"), ("junction", "-1")]
    assert at("road/userData", lambda it: it.text) == "some <text>"
    assert at("road[2]", lambda it: it.text) is None
    assert at("road[2]", lambda it: (it.sourceline, it.sourcecolumn)) == (8, 3)
    assert at("road/lanes/laneSection[2]", lambda it: it.getpath()) == "/OpenDRIVE/road[@id='1']/lanes/laneSection[2]"
    assert at("road", repr) == '<road id="1" at row 4>'
    assert at("road", lambda it: it.sourcefile).endswith("a.xodr")


def test_numbers_are_numbers_or_none():
    assert at("road", lambda it: it.float("length")) == 100.0
    assert at("road", lambda it: (it.float("name"), it.float("no"))) == (None, None)
    assert at("road[2]", lambda it: it.float("length")) is None, "NaN is not a length"
    assert at("road[2]", lambda it: (it.int("junction"), it.int("id"), it.int("no"))) == (-1, 2, None)
    assert at("road", lambda it: it.int("length")) is None


def test_ways_through_the_tree():
    def tags(elements):
        return [it.tag for it in elements]

    assert look(MAP, lambda doc: tags(doc.iter())) == [
        "OpenDRIVE", "header", "road", "lanes", "laneSection", "laneSection", "userData", "road",
    ]
    assert look(MAP, lambda doc: [it.get("s") for it in doc.iter("laneSection")]) == ["0", "50"]
    assert look(MAP, lambda doc: tags(doc.iter("header", "lanes"))) == ["header", "lanes"]
    assert at("road", lambda it: tags(it.iter("laneSection"))) == ["laneSection", "laneSection"]
    assert at("road[2]", lambda it: tags(it.iter("laneSection"))) == []
    assert at("road", tags) == ["lanes", "userData"]
    assert at("road", lambda it: tags(it.iterchildren("userData"))) == ["userData"]
    assert at("road", lambda it: (len(it), it[0].tag, it[-1].tag)) == (2, "lanes", "userData")
    assert at("road", lambda it: (it.getprevious().tag, it.getnext().get("id"))) == ("header", "2")
    assert look(MAP, lambda doc: (doc.root.getparent(), doc.root.getnext(), doc.root.getprevious())) == (None,) * 3
    assert at("road/lanes/laneSection", lambda it: tags(it.iterancestors())) == ["lanes", "road", "OpenDRIVE"]
    assert at("road/lanes", lambda it: it.getparent() == it.getprevious()) is False
    assert at("road/lanes", lambda it: it.getparent().find("lanes") == it) is True
    assert at("road/lanes", lambda it: len({it, it.getparent().find("lanes")})) == 1
    with pytest.raises(IndexError):
        at("road", lambda it: it[2])
    with pytest.raises(IndexError):
        at("road", lambda it: it[-3])


def test_paths():
    assert look(MAP, lambda doc: doc.find("road/lanes/laneSection[@s='50']").get("s")) == "50"
    assert look(MAP, lambda doc: [it.get("id") for it in doc.findall("road")]) == ["1", "2"]
    assert look(MAP, lambda doc: [it.get("id") for it in doc.xpath("/OpenDRIVE/road")]) == ["1", "2"]
    assert look(MAP, lambda doc: len(doc.xpath("//laneSection"))) == 2
    assert at("road", lambda it: len(it.findall(".//laneSection"))) == 2
    assert at("road/lanes", lambda it: [at.get("id") for at in it.xpath("..")]) == ["1"]
    assert at("road", lambda it: (it.find("no"), it.findtext("userData"), it.findtext("no", "-"))) == (
        None, "some <text>", "-",
    )
    with pytest.raises(ValueError, match="evaluate the XPath 'road\\[': expected .* at character 6"):
        look(MAP, lambda doc: doc.find("road["))


def test_what_lxml_can_and_we_cannot_is_said():
    with pytest.raises(AttributeError, match="read in place and cannot be changed"):
        at("road", lambda it: it.set("id", "3"))
    with pytest.raises(AttributeError, match="character data between elements is not kept"):
        at("road", lambda it: it.tail)
    with pytest.raises(AttributeError):
        at("road", lambda it: setattr(it, "tag", "x"))
    assert at("road", lambda it: hasattr(it, "nothing")) is False


def test_the_document():
    assert look(MAP, lambda doc: (doc.kind, doc.version, doc.role, doc.linked, doc.map)) == (
        "xodr", (1, 8), None, [], None,
    )
    assert look(MAP, lambda doc: (doc.count("laneSection"), doc.count("no"))) == (2, 0)
    assert look(MAP, lambda doc: doc.is_well_formed) is True


def test_objects_end_with_their_job():
    def everything(doc):
        road = doc.find("road")
        table = doc.table("road", "length")
        begun = doc.iter()
        next(begun)
        return doc, road, begun, doc.iter("road"), table, doc.roads[0], doc.roads[0].sections[0]

    doc, road, begun, named, table, of_map, section = look(MAP, everything)
    for use in (
        lambda: doc.root, lambda: list(doc.iter()), lambda: doc.find("road"), lambda: doc.roads,
        lambda: road.tag, lambda: road.get("id"), lambda: road.attrib, lambda: repr(road), lambda: list(road),
        lambda: list(begun)[2000], lambda: list(named)[0].tag, lambda: table[0].tag,
        lambda: of_map.length, lambda: of_map.pose(0.0), lambda: section.lanes, lambda: doc.poses(1.0),
    ):  # fmt: skip
        with pytest.raises((qcbus.Closed, IndexError)):
            use()
    assert list(table["length"])[0] == 100.0, "numbers outlive the job"
    assert issubclass(qcbus.Closed, RuntimeError)


def test_many_elements():
    text = "<OpenDRIVE>" + HEADER + "".join(f'<road id="{n}"><a/></road>' for n in range(5000)) + "</OpenDRIVE>"
    ids = look(text, lambda doc: [it.get("id") for it in doc.iter("road")])
    assert ids == [str(n) for n in range(5000)]
    assert look(text, lambda doc: sum(1 for _ in doc.iter())) == 10002
    assert look(text, lambda doc: {len(list(road.iter("a"))) for road in doc.iter("road")}) == {1}
    assert look(text, lambda doc: [it.tag for it in doc.find("road[7]").iter("road", "a")]) == ["road", "a"]
    assert look(text, lambda doc: [it.get("id") for it in doc.find("road[7]").iter("road")]) == ["6"]
    assert look(text, lambda doc: [it.getparent().get("id") for it in doc.iter("a")][4999]) == "4999"
