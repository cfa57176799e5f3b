"""Checks of your own for qcbus, in Python.

A rule is a function that reads a document and reports findings::

    import qcbus

    bundle = qcbus.Bundle("acme", version="1.0", kinds=["xodr"])

    @bundle.rule("acme.example:xodr:1.0.0:road.named", level="warning")
    def road_named(doc, found):
        \"\"\"Every road has a name.\"\"\"
        for road in doc.iter("road"):
            if not road.get("name"):
                found.issue(road, f"road `{road.get('id')}` has no name; give it one")

    bundle.main()

``docs/writing-a-bundle.md`` shows every step to a bundle that runs on a broker.
"""

import os

if "QCBUS_LAUNCH" in os.environ:
    # A broker has started this process. The limits must be set before the script imports a numerical library: only a
    # process with one thread can be confined. Its rules run one after the other and share the processors with others.
    for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS"):
        os.environ.setdefault(_name, "1")

from ._bundle import Bundle, Example, Param, Rule
from ._native import (
    Closed,
    Column,
    Document,
    Element,
    Elements,
    Finding,
    Found,
    Lane,
    Pose,
    Road,
    Rows,
    Section,
    Table,
    __version__,
)

__all__ = [
    "Bundle",
    "Closed",
    "Column",
    "Document",
    "Element",
    "Elements",
    "Example",
    "Finding",
    "Found",
    "Lane",
    "Param",
    "Pose",
    "Road",
    "Rows",
    "Rule",
    "Section",
    "Table",
    "__version__",
]
