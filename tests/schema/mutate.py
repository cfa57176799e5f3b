"""Seeded mutations of XML text as splices: (offset, characters removed, text inserted).

A splice can be applied to the same base document without this program.
"""

import random
import re

TOKEN = re.compile(
    r"<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>|<!DOCTYPE[^>]*>"
    r"|<(/?)([A-Za-z_][\w.:-]*)((?:\s+[\w.:-]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*)\s*(/?)>",
    re.S,
)
ATTRIBUTE = re.compile(r"\s+([\w.:-]+)\s*=\s*(\"[^\"]*\"|'[^']*')", re.S)
VALUES = [
    "", "abc", "-1", "0", "1", "1e5", " 1 ", "INF", "+INF", "NaN", "nan", "true", "yes", "no", "1.5", ".5", "5.", "-0",
    "007", "$p", "${1 + 2}", "${a,b}", "$1", "99999999999999999999", "2147483648", "65536", "2020-02-30T00:00:00",
    "town", "solid", "1.0e+00", "start", "end", "DE", "de", "virtual", "lane", "barrier", "multiBoard",
]


class Element:
    """One element: its start and end, tag, attributes, parent and children."""

    def __init__(self, start, tag_end, name, attributes, empty, parent):
        self.start, self.tag_end, self.name, self.empty = start, tag_end, name, empty
        self.attributes, self.parent = attributes, parent
        self.end = tag_end
        self.children = []


def elements(text):
    """Returns all elements of a well-formed text in document order."""
    found, stack = [], []
    for token in TOKEN.finditer(text):
        if token.group(2) is None:
            continue
        if token.group(1):
            stack.pop().end = token.end()
            continue
        base = token.start(3)
        attributes = [
            (m.group(1), base + m.start(), base + m.end(), base + m.start(2) + 1, base + m.end(2) - 1)
            for m in ATTRIBUTE.finditer(token.group(3))
        ]
        parent = stack[-1] if stack else None
        element = Element(token.start(), token.end(), token.group(2), attributes, bool(token.group(4)), parent)
        if parent:
            parent.children.append(element)
        found.append(element)
        if not element.empty:
            stack.append(element)
    return found


def splice(text, cut):
    """Returns the text after one splice."""
    offset, removed, inserted = cut
    return text[:offset] + inserted + text[offset + removed:]


def mutation(rng, text, found):
    """Returns one random mutation, or None if the chosen kind does not apply to the chosen element."""
    element = rng.choice(found)
    name, start, end, value_start, value_end = (
        rng.choice(element.attributes) if element.attributes else ("", 0, 0, 0, 0)
    )
    inner = not element.empty
    siblings = element.parent.children if element.parent else [element]
    whole = text[element.start:element.end]
    other = rng.choice(found)
    kind = rng.randrange(16)
    if kind == 0 and name:
        return start, end - start, ""
    if kind == 1 and name:
        donor = rng.choice(other.attributes)[0] if other.attributes else name + "x"
        taken = {one[0] for one in element.attributes}
        return None if donor in taken else (text.index(name, start), len(name), donor)
    if kind in (2, 3) and name:
        return value_start, value_end - value_start, rng.choice(VALUES)
    if kind == 4 and name and other.attributes:
        donor = rng.choice(other.attributes)
        value = text[donor[3]:donor[4]].replace('"', "&quot;")
        return value_start, value_end - value_start, value
    if kind == 5 and element.parent:
        return element.end, 0, whole
    if kind == 6 and element.parent:
        return element.start, element.end - element.start, ""
    if kind == 7 and element.parent:
        at = siblings.index(element)
        if at + 1 < len(siblings):
            after = siblings[at + 1]
            moved = text[after.start:after.end] + text[element.end:after.start] + whole
            return element.start, after.end - element.start, moved
    if kind == 8 and element.empty:
        return element.start + 1, len(element.name), other.name
    if kind == 9 and element.parent and len(whole) < 2000:
        return other.end if other.parent else other.tag_end, 0, whole
    if kind == 10 and inner:
        return element.tag_end, 0, rng.choice(["x", " ", "\n", "<!-- c -->", "<?p i?>", "<unknown/>", "&amp;"])
    if kind == 11 and element.empty:
        return element.tag_end - 2, 2, rng.choice(["></%s>", "> </%s>", ">x</%s>", "><unknown a='1'/></%s>"]) % element.name
    if kind == 12 and other.attributes:
        donor = rng.choice(other.attributes)
        if donor[0] not in {one[0] for one in element.attributes}:
            return element.start + 1 + len(element.name), 0, text[donor[1]:donor[2]]
    if kind == 13 and name:
        twins = [one for one in siblings if one.name == element.name and one is not element]
        values = [text[a[3]:a[4]] for one in twins for a in one.attributes if a[0] == name]
        if values:
            return value_start, value_end - value_start, rng.choice(values)
    if kind == 14 and name:
        value = text[value_start:value_end]
        at = rng.randrange(len(value) + 1)
        return value_start + at, 0, rng.choice([" ", "x", "-", ".", "1", "&#9;"])
    if kind == 15 and name:
        # libxml2 accepts "1e" as a number. The case is rare here, because otherwise most disagreements would be this one.
        return value_end, 0, "e" if rng.random() < 0.005 else rng.choice(["e5", ".0", "0", "_", "+", "E-2"])
    return None
