"""Bundles and rules, as a script describes them."""

from __future__ import annotations

import inspect
import io
import re
import signal
import sys
import traceback  # noqa: F401  Needed when a rule raises, and then nothing can be read from the disk any more.
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Union

from . import _native

Check = Callable[["_native.Document", "_native.Found"], None]

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


@dataclass(frozen=True)
class Param:
    """A parameter of a rule, which a configuration may set: ``found.param(name)`` has its value."""

    name: str
    default: Union[float, bool, str]
    description: str
    unit: str = ""


@dataclass(frozen=True)
class Example:
    """A piece of a document, and what its rule is to say of it.

    ``text`` is a whole document, or what lies directly in its root. ``at`` are the XPaths at which something must be
    found, in document order; ``None`` means: something, somewhere; an empty list: nothing.
    """

    text: str
    at: Sequence[str] | None = None
    version: str | None = None


@dataclass
class Rule:
    """A rule of a bundle: what it is called, and the function that looks."""

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
    """A checker bundle: a name, the kinds of file that it takes, and rules."""

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
            raise ValueError(f"`{name}` is no name of a bundle: 1 to 64 of A-Z a-z 0-9 . _ -, not beginning with . _ -")
        self.name = name
        self.version = version
        self.kinds = tuple(kinds)
        if not self.kinds:
            raise ValueError("a bundle takes at least one kind of file: xodr, xosc or mosc")
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
        """Makes a rule of a function ``(doc, found)``. Its first line of documentation says what is demanded.

        ``uids``: the rules that it answers for, ``acme.example:xodr:1.0.0:road.named``. ``id``: the checker's name,
        without it ``check_BUNDLE_FUNCTION``. ``versions``: those of the standard that it applies to (``1.7.0..``).
        ``after``: rules that must have found no error before this one can look. ``good``, ``bad``: examples, which
        ``python -m qcbus.test`` tries.
        """
        if not uids:
            raise ValueError("a rule needs a UID: @bundle.rule(\"acme.example:xodr:1.0.0:road.named\")")
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
                raise ValueError(f"the bundle has a rule `{rule.id}` already")
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
        """Runs the bundle as its arguments say, if its script is the program that runs: on the bus
        (``--instance-dir``), on one file, or on a configuration of ASAM's framework. Ends the program."""
        frame = inspect.currentframe()
        caller = frame.f_back if frame else None
        if arguments is None and caller is not None and caller.f_globals.get("__name__") != "__main__":
            # The script is read by somebody else, such as its test.
            return
        sys.stdout.flush()
        # What was found goes to stdout; what rules print is for people. In lines, because a process on the bus may be
        # killed at any time.
        if isinstance(sys.stderr, io.TextIOWrapper):
            sys.stderr.reconfigure(line_buffering=True)
        sys.stdout = sys.stderr
        # Python would only take a note of it, and look at that when the check is over.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        sys.exit(self._native.run(list(sys.argv[1:] if arguments is None else arguments), *_places()))


def _places() -> tuple[list[Path], list[Path]]:
    """Where this interpreter finds modules: what it reads, and what it lists. A bundle on the bus may read nothing else
    once it has joined. Of the directory of the script that is what can be a module, and not whatever else lies there."""
    script = Path(sys.argv[0]).resolve().parent
    reads = [entry.resolve() for entry in map(Path, sys.path) if entry.is_absolute() and entry.resolve() != script]
    try:
        beside = list(script.iterdir())
    except OSError:
        beside = []
    reads += [it for it in beside if it.suffix in (".py", ".so") or (it / "__init__.py").is_file()]
    return reads, [script]


def _said(check: Check) -> tuple[str, str, str]:
    """Title, first paragraph and the rest of what a function says of itself."""
    documentation = inspect.getdoc(check) or ""
    summary, _, text = documentation.partition("\n\n")
    summary = " ".join(summary.split())
    if not summary:
        raise ValueError(
            f"`{check.__name__}` does not say what it demands: begin it with a sentence of documentation, "
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
