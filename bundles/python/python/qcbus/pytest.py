"""A plugin of pytest that runs the examples of rules as tests.

``pytest acme.py`` tests them if ``acme.py`` defines a bundle. So does every test module that imports one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from ._bundle import Bundle, Example, Rule
from .test import examples, wrong


def pytest_pycollect_makeitem(collector: Any, name: str, obj: object) -> pytest.Collector | None:
    if isinstance(obj, Bundle):
        return _Examples.from_parent(collector, name=name, bundle=obj)
    return None


class _Examples(pytest.Collector):
    def __init__(self, *, bundle: Bundle, **rest: Any) -> None:
        super().__init__(**rest)
        self.bundle = bundle

    def collect(self) -> Iterator[pytest.Item]:
        for rule in self.bundle.rules:
            if not (rule.good or rule.bad):
                yield _NoExample.from_parent(self, name=f"{rule.id} examples")
        for name, rule, example in examples(self.bundle):
            yield _Example.from_parent(self, name=name, bundle=self.bundle, rule=rule, example=example)


class _NoExample(pytest.Item):
    def runtest(self) -> None:
        pytest.skip("no example: without one, nothing shows that the rule finds anything")


class _Example(pytest.Item):
    def __init__(self, *, bundle: Bundle, rule: Rule, example: Example, **rest: Any) -> None:
        super().__init__(**rest)
        self.bundle, self.rule, self.example = bundle, rule, example

    def runtest(self) -> None:
        why = wrong(self.bundle, self.rule, self.example)
        if why is not None:
            raise _Wrong(why)

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        if isinstance(excinfo.value, _Wrong):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Any, int | None, str]:
        code = getattr(self.rule.check, "__code__", None)
        return self.path, code.co_firstlineno - 1 if code else None, self.name


class _Wrong(Exception):
    """The findings of an example differ from the expected ones."""
