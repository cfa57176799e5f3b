"""Comparison with lxml: the same tree with the same names."""

import pytest
from looking import look

etree = pytest.importorskip("lxml.etree")

TEXTS = {
    "plain": '<a><b x="1" y="2"/><b/><c><b z="3">t</b></c>u</a>',
    "entities": '<a q="&lt;&#228;&quot;\'">&amp;&#x41;<![CDATA[<&]]></a>',
    "declared": '<?xml version="1.0" encoding="UTF-8"?>\n<!-- c -->\n<a>\n <b>\n  <?p i?><c/>\n </b>\n</a>\n',
    "deep": "<a>" * 200 + "</a>" * 200,
    "wide": "<a>" + '<b i="1"/>' * 3000 + "</a>",
    "white": '<a v=" x\t y "><b>\n</b></a>',
}
PATHS = ["b", "c/b", ".//b", "b[1]", "b[last()]", "*", "c/*", ".//*", "b[@x]", "b[@x='1']", ".//b[@z='3']", "none"]


def described(element):
    parent, following = element.getparent(), element.getnext()
    return (
        element.tag,
        dict(element.attrib),
        element.keys(),
        element.sourceline,
        len(element),
        [it.tag for it in element],
        None if parent is None else parent.tag,
        None if following is None else following.tag,
        [it.tag for it in element.iterancestors()],
        element.get("x"),
    )


@pytest.mark.parametrize("name", TEXTS)
def test_the_tree_is_that_of_lxml(name):
    text = TEXTS[name]
    parser = etree.XMLParser(remove_comments=True, remove_pis=True, huge_tree=True)
    theirs = etree.fromstring(text.encode(), parser)
    assert look(text, lambda doc: [described(it) for it in doc.iter()]) == [described(it) for it in theirs.iter()]
    for path in PATHS:
        ours = look(text, lambda doc: [described(it) for it in doc.findall(path)])
        assert ours == [described(it) for it in theirs.xpath(path)], path
    for path in ("//b", "/a/b", "/a", "//b[@x]"):
        ours = look(text, lambda doc: [described(it) for it in doc.xpath(path)])
        assert ours == [described(it) for it in theirs.xpath(path)], path


@pytest.mark.parametrize("name", TEXTS)
def test_text_is_all_of_its_own(name):
    """lxml's `text` ends at the first child. Ours is the whole text directly in the element, or `None` if it is only
    white space."""
    theirs = etree.fromstring(TEXTS[name].encode())
    whole = ["".join(it.xpath("text()")) for it in theirs.iter(etree.Element)]
    ours = look(TEXTS[name], lambda doc: [it.text for it in doc.iter()])
    assert ours == [text if text.strip() else None for text in whole]


def test_a_row_is_that_of_the_beginning():
    """libxml2 uses the row of the tag's end."""
    text = "<a>\n<b x='1'\n  y='2'/>\n</a>"
    assert etree.fromstring(text)[0].sourceline == 3
    assert look(text, lambda doc: (doc.root[0].sourceline, doc.root[0].sourcecolumn)) == (2, 1)
