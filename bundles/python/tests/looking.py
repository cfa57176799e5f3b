"""Runs a function on a document, as a rule."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import qcbus

HEADER = '<header revMajor="1" revMinor="8"/>'


def bundle_of(check: Callable[[qcbus.Document, qcbus.Found], Any], **given: Any) -> qcbus.Bundle:
    """Returns a bundle with the only rule ``check``."""
    bundle = qcbus.Bundle("looking", version="1.0", kinds=["xodr", "xosc"])

    @bundle.rule("example.org:xodr:1.0.0:it.looks", **given)
    def looks(doc: qcbus.Document, found: qcbus.Found) -> None:
        """It looks."""
        check(doc, found)

    return bundle


def run(bundle: qcbus.Bundle, text: str | bytes, name: str = "a.xodr") -> tuple[list[dict], list[tuple[str, str]]]:
    """Returns the findings of a bundle in a text, and the checkers that could not run."""
    return bundle._native.check(name, text.encode() if isinstance(text, str) else text)


def look(text: str | bytes, at: Callable[[qcbus.Document], Any], name: str = "a.xodr") -> Any:
    """Returns the result of a function on a document, or raises its exception."""
    said: list[Any] = []

    def check(doc: qcbus.Document, found: qcbus.Found) -> None:
        try:
            said.append((at(doc), None))
        except Exception as error:  # noqa: BLE001  It is raised again in the test.
            said.append((None, error))

    _, unlooked = run(bundle_of(check), text, name)
    assert not unlooked, unlooked
    value, error = said[0]
    if error is not None:
        raise error
    return value
