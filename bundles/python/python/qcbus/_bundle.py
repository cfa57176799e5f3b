"""Bundles and rules of a script."""

from __future__ import annotations

import inspect
import io
import re
import signal
import sys
import traceback  # noqa: F401  Needed when a rule raises, because a confined process cannot load it then.
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Union

from . import _native

Check = Callable[["_native.Document", "_native.Found"], None]

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


@dataclass(frozen=True)
class Param:
    """A parameter of a rule. A configuration may set it; ``found.param(name)`` returns its value."""

    name: str
    default: Union[float, bool, str]
    description: str
    unit: str = ""


@dataclass(frozen=True)
class Example:
    """A part of a document, and the expected findings of its rule.

    ``text`` is a whole document or the content of its root. ``at`` are the XPaths of the expected findings in document
    order. ``None`` means at least one finding anywhere, an empty list no finding.
    """

    text: str
    at: Sequence[str] | None = None
    version: str | None = None


@dataclass
class Rule:
    """A rule of a bundle: its names, its documentation and its function."""

    id: str
    uids: Sequence[str]
    level: str
    title: str
    summary: str
    text: str
    check: Check
    good: list[Example] = field(default_factory=list)
    bad: list[Example] = field(default_factory=list)

    def __call__(self, doc: _native.Document, found: _native.Found) -> None:
        self.check(doc, found)


class Bundle:
    """A checker bundle: a name, the kinds of its files, and rules."""

    def __init__(
        self,
        name: str,
        *,
        version: str,
        kinds: Iterable[str] = ("xodr",),
        description: str = "",
        alias: str | None = None,
        reads: str = "written",
    ) -> None:
        if not _NAME.fullmatch(name):
            raise ValueError(f"`{name}` is not a valid bundle name: use 1 to 64 of A-Z a-z 0-9 . _ -, and no . _ - at the start")
        self.name = name
        self.version = version
        self.kinds = tuple(kinds)
        if not self.kinds:
            raise ValueError("a bundle must have at least one kind of file: xodr, xosc or mosc")
        self.rules: list[Rule] = []
        self._native = _native.Native(
            name, alias or name, version, description or f"checks of {name}", list(self.kinds), reads
        )

    def rule(
        self,
        *uids: str,
        id: str | None = None,
        level: str = "error",
        versions: str = "",
        backport: bool = False,
        after: Iterable[Union[str, Rule]] = (),
        params: Iterable[Param] = (),
        default_on: bool = True,
        good: Iterable[Union[str, Example]] = (),
        bad: Iterable[Union[str, Example, tuple[str, ...]]] = (),
    ) -> Callable[[Check], Rule]:
        """Turns a function ``(doc, found)`` into a rule. The first line of its docstring states the requirement.

        ``uids``: UIDs of the rules that it checks, such as ``acme.example:xodr:1.0.0:road.named``. ``id``: name of the
        checker, by default ``check_BUNDLE_FUNCTION``. ``versions``: versions of the standard that it applies to
        (``1.7.0..``). ``after``: rules that must be without errors before this one runs. ``good``, ``bad``: examples,
        tested by ``python -m qcbus.test``.
        """
        if not uids:
            raise ValueError("a rule must have a UID: @bundle.rule(\"acme.example:xodr:1.0.0:road.named\")")
        def take(check: Check) -> Rule:
            title, summary, text = _said(check)
            name = re.sub(r"[^A-Za-z0-9_]", "_", self.name)
            rule = Rule(
                id=id or f"check_{name}_{check.__name__}",
                uids=uids,
                level=level,
                title=title,
                summary=summary,
                text=text,
                check=check,
                good=[_example(it, at=()) for it in good],
                bad=[_example(it, at=None) for it in bad],
            )
            if any(rule.id == other.id for other in self.rules):
                raise ValueError(f"the bundle already has a rule `{rule.id}`")
            self._native.add(
                id=rule.id,
                uids=list(uids),
                level=level,
                versions=versions,
                backport=backport,
                after=[it.id if isinstance(it, Rule) else it for it in after],
                params=[(it.name, it.default, it.unit, it.description) for it in params],
                default_on=default_on,
                page=f"# {title}\n\n{summary}\n\n{text}\n",
                function=check,
            )
            self.rules.append(rule)
            return rule

        return take

    def main(self, arguments: Sequence[str] | None = None) -> None:
        """Runs the bundle if its script is the main program, and exits. The arguments choose the mode: on the bus
        (``--instance-dir``), on one file, or on a configuration of ASAM's framework."""
        frame = inspect.currentframe()
        caller = frame.f_back if frame else None
        if arguments is None and caller is not None and caller.f_globals.get("__name__") != "__main__":
            # Another module, such as a test, imports the script.
            return
        sys.stdout.flush()
        # Findings go to stdout, so the output of rules goes to stderr. It is line-buffered, because a process on the bus
        # may be killed at any time.
        if isinstance(sys.stderr, io.TextIOWrapper):
            sys.stderr.reconfigure(line_buffering=True)
        sys.stdout = sys.stderr
        # Python would handle SIGINT only after the check.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        sys.exit(self._native.run(list(sys.argv[1:] if arguments is None else arguments), *_places()))


def _places() -> tuple[list[Path], list[Path]]:
    """Returns the paths that this interpreter reads for modules, and the directories that it lists. A registered bundle
    on the bus may read nothing else. Of the script's directory only files that can be modules are included."""
    script = Path(sys.argv[0]).resolve().parent
    reads = [entry.resolve() for entry in map(Path, sys.path) if entry.is_absolute() and entry.resolve() != script]
    try:
        beside = list(script.iterdir())
    except OSError:
        beside = []
    reads += [it for it in beside if it.suffix in (".py", ".so") or (it / "__init__.py").is_file()]
    return reads, [script]


def _said(check: Check) -> tuple[str, str, str]:
    """Returns the title of a function, and the first paragraph and the rest of its docstring."""
    documentation = inspect.getdoc(check) or ""
    summary, _, text = documentation.partition("\n\n")
    summary = " ".join(summary.split())
    if not summary:
        raise ValueError(
            f"`{check.__name__}` has no docstring: begin it with a sentence that states the requirement, "
            'such as """Every road has a name."""'
        )
    return check.__name__.replace("_", " "), summary, text


def _example(given: Union[str, Example, tuple[str, ...]], at: Sequence[str] | None) -> Example:
    if isinstance(given, Example):
        return given
    if isinstance(given, tuple):
        text, *paths = given
        return Example(text, at=paths)
    return Example(given, at=at)
