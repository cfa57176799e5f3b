"""Proves that the other validator is wrong if it accepts a document and ours does not.

A proof takes its facts from the document and the XSD. It fixes the one fault and checks that both
validators then accept the document. A disagreement without a proof stays unexplained.
`docs/evidence/schema.md` has the rules of the standard for each class.
"""

import re

import lxml.etree as et

from mutate import elements


class Case:
    """A document with different verdicts of the two validators, and our first finding."""

    def __init__(self, text, oracle, judge_ours, wanted, ours):
        self.text, self.oracle, self.judge_ours = text, oracle, judge_ours
        self.wanted, self.verdict, self.code = wanted, ours.verdict, ours.code
        self.offset = len(text.encode()[: ours.offset].decode())

    def both(self, text):
        """Returns the verdict of both on another text, or None if they differ."""
        ours, theirs = self.judge_ours(self.oracle.name, [text])[0].verdict, self.oracle.judge(text)[0]
        return ours if ours == theirs else None

    def value(self):
        """Returns the attribute value of the finding."""
        if self.text[self.offset - 1] not in "\"'":
            return None
        return self.text[self.offset : self.text.index(self.text[self.offset - 1], self.offset)]

    def with_value(self, value):
        """Returns the text with another value at the place of the finding."""
        return self.text[: self.offset] + value + self.text[self.offset + len(self.value()) :]

    def element(self):
        """Returns the element of the finding."""
        found = [one for one in elements(self.text) if one.start == self.offset]
        return found[0] if found else None


def explanation(case):
    """Returns the proven class of the case, or None."""
    if case.wanted == "ill-formed":
        return namespace_name(case)
    if (case.wanted, case.verdict) != ("valid", "invalid"):
        return None
    proofs = {
        "invalid-value": [nan_under_bound, exponent_without_digits],
        "unexpected-text": [text_between_children, space_in_empty],
        "dangling-reference": [dangling_reference],
    }
    return next((why for why in (proof(case) for proof in proofs.get(case.code, [])) if why), None)


def nan_under_bound(case):
    """Proves that the value is NaN and that numbers are valid within a bound and invalid beyond it."""
    if (case.value() or "").strip() != "NaN":
        return None
    inside = any(case.both(case.with_value(value)) == "valid" for value in ("0.5", "1.5"))
    beyond = any(case.both(case.with_value(value)) == "invalid" for value in ("-1e300", "1e300"))
    return "NaN passes a bound" if inside and beyond else None


def exponent_without_digits(case):
    """Proves that the value is a number without the digits of its exponent."""
    value = (case.value() or "").strip()
    if case.oracle.slow or not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)[eE][+-]?", value):
        return None
    fixed = case.both(case.with_value(value + "0")) == "valid"
    number = case.both(case.with_value("x")) == "invalid"
    return "an exponent without digits passes for a number" if fixed and number else None


def own_text(case, element):
    """Returns the text of an element around its children, and the document without this text."""
    end = case.text.rindex("</", 0, element.end)
    parts, kept, at = [], [], element.tag_end
    for child in element.children:
        parts.append(case.text[at : child.start])
        kept.append(case.text[child.start : child.end])
        at = child.end
    parts.append(case.text[at:end])
    return "".join(parts), case.text[: element.tag_end] + "".join(kept) + case.text[end:]


def text_between_children(case):
    """Proves that every type of an element of this name has children and is not mixed."""
    element = case.element()
    if element is None or element.empty or not case.oracle.slow:
        return None
    text, without = own_text(case, element)
    types = case.oracle.types_of(element.name)
    pure = types and all(one.is_complex() and one.has_complex_content() and not one.mixed for one in types)
    if not re.sub(r"<!--.*?-->|<\?.*?\?>", "", text, flags=re.S).strip() or not pure:
        return None
    return "text beside elements of a type that is not mixed" if case.both(without) == "valid" else None


def space_in_empty(case):
    """Proves that every type of an element of this name is empty and that the element has white space."""
    element = case.element()
    if element is None or element.empty or element.children or not case.oracle.slow:
        return None
    text, without = own_text(case, element)
    types = case.oracle.types_of(element.name)
    empty = types and all(one.is_complex() and one.is_empty() and not one.mixed for one in types)
    if not text or text.strip() or not empty:
        return None
    return "white space in an element without content" if case.both(without) == "valid" else None


def dangling_reference(case):
    """Proves with XPath that a reference to a key, compared as a string, has no key."""
    value = case.value()
    root = et.fromstring(case.text.encode())
    if root.nsmap.get(None) or value is None:
        return None
    for scope, field, references, keys in case.oracle.references():
        for within in root.iter(scope):
            known = {key for selector, name in keys for key in within.xpath(f"({selector})/{name}")}
            given = set(within.xpath(f"({references})/{field}"))
            if value in given - known and known:
                # All references to the key are fixed, because one may not be the only fault.
                alike = rf"(\s{field[1:]}\s*=\s*[\"'])" + re.escape(value) + r"(?=[\"'])"
                fixed = re.sub(alike, lambda it: it.group(1) + sorted(known)[0], case.text)
                return "a reference to no key" if case.both(fixed) == "valid" else None
    return None


def namespace_name(case):
    """Proves that libxml2 reports only a namespace name that is no URI, and otherwise agrees."""
    parser = et.XMLParser()  # A shared parser would keep the faults of other documents.
    try:
        et.fromstring(case.text.encode(), parser)
        return None
    except et.XMLSyntaxError:
        if {one.type_name for one in parser.error_log} != {"WAR_NS_URI"}:
            return None
    verdict, _ = case.oracle.judge(case.text, et.XMLParser(recover=True))
    return "a namespace name that is no URI is refused" if verdict == case.verdict else None
