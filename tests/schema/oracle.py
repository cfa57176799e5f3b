"""Reference validators: lxml for OpenDRIVE up to 1.7 and OpenSCENARIO, Python's xmlschema for OpenDRIVE 1.8."""

import re

import lxml.etree as et
import xmlschema

VIRES = {"xodr-1.1", "xodr-1.2"}
XS = "{http://www.w3.org/2001/XMLSchema}"


class Oracle:
    """The reference validator for one table."""

    def __init__(self, name, folder):
        self.name, self.folder = name, folder
        self.slow = name == "xodr-1.8"
        main = [p for p in sorted(folder.glob("*.xsd")) if re.search(r"_core|_Core|OpenDRIVE_1|OpenSCENARIO", p.name)][0]
        self.schema = xmlschema.XMLSchema11(str(main)) if self.slow else et.XMLSchema(et.parse(str(main)))

    def judge(self, text, parser=None):
        """Returns (verdict, line of the first error)."""
        text = re.sub(r"\sxmlns=(\"[^\"]*\"|'[^']*')", "", text)
        if self.name in VIRES:
            text = text.replace("<OpenDRIVE", '<OpenDRIVE xmlns="www.vires.com"', 1)
        try:
            tree = et.fromstring(text.encode(), parser)
        except et.XMLSyntaxError:
            return "ill-formed", 0
        if self.slow:
            return ("valid" if self.schema.is_valid(tree) else "invalid"), 0
        valid = self.schema.validate(tree)
        line = 0 if valid else self.schema.error_log[0].line
        return ("valid" if valid else "invalid"), line

    def words(self):
        """Returns the first error of lxml."""
        return "" if self.slow else str(self.schema.error_log[:1])

    def types_of(self, name):
        """Returns the types of all elements of a name; only for schemas of xmlschema."""
        declared = [one for one in self.schema.iter_components(xmlschema.validators.XsdElement) if one.local_name == name]
        return [one.type for one in declared] + [other.type for one in declared for other in one.alternatives]

    def references(self):
        """Returns all keyrefs to strings: element of the scope, field, selector, and (selector, field) of its keys."""
        documents = [et.parse(str(path)) for path in sorted(self.folder.glob("*.xsd"))]
        declared = [one for document in documents for one in document.iter(XS + "attribute") if one.get("name")]
        found = []
        for reference in (one for document in documents for one in document.iter(XS + "keyref")):
            scope = reference.getparent()
            selector, field = reference.find(XS + "selector").get("xpath"), reference.find(XS + "field").get("xpath")
            types = {one.get("type") for one in declared if "@" + one.get("name") == field}
            if types == {"xs:string"}:
                keys = [one for one in (*scope.iter(XS + "key"), *scope.iter(XS + "unique")) if one.get("name") == reference.get("refer")]
                keys = [(one.find(XS + "selector").get("xpath"), one.find(XS + "field").get("xpath")) for one in keys]
                found.append((scope.get("name"), field, selector, keys))
        return found
