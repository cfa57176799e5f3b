"""Python bundle of a storm. It replaces `judges_strictly` of the zoo and does the same."""

import sys

import qcbus

_, name, _, version, *arguments = sys.argv
bundle = qcbus.Bundle(name, version=version, kinds=["xodr", "xosc", "mosc"])


def looks(found, document):
    for element in document.iter():
        for attribute, value in element.attrib.items():
            if "forbidden" in value:
                found.issue(element, f"`forbidden` in {document.path}", attribute=attribute)


@bundle.rule("example.org:xodr:1.0.0:zoo.strict", id="check_zoo_0")
def strict(doc, found):
    """The word appears nowhere."""
    for document in (doc, *doc.linked):
        looks(found, document)


@bundle.rule("example.org:xodr:1.0.0:zoo.nothing", id="check_zoo_1")
def nothing(doc, found):
    """A rule without a requirement."""


bundle.main(arguments)
