"""Tests the examples of rules: ``python -m qcbus.test acme.py …``.

Every ``good`` example must give no finding of its rule, every ``bad`` one a finding at each of its places. The exit code
is 0 if all examples pass.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path

from ._bundle import Bundle, Example, Rule

_ROOTS = {
    "xodr": ('<OpenDRIVE><header revMajor="{major}" revMinor="{minor}"/>', "</OpenDRIVE>", "OpenDRIVE", (1, 8)),
    "xosc": (
        '<OpenSCENARIO><FileHeader revMajor="{major}" revMinor="{minor}" date="2026-01-01T00:00:00" '
        'author="example" description="example"/>',
        "</OpenSCENARIO>",
        "OpenSCENARIO",
        (1, 3),
    ),
}


def load(path: Path) -> list[Bundle]:
    """Returns the bundles of a script. The script is imported, not run as a program."""
    spec = importlib.util.spec_from_file_location(f"qcbus_bundle_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is not a Python script")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(path.parent))
    return [it for it in vars(module).values() if isinstance(it, Bundle)]


def document(bundle: Bundle, example: Example) -> tuple[str, str]:
    """Returns an example as a whole document, and its file name."""
    kind = "xosc" if bundle.kinds[0] == "mosc" else bundle.kinds[0]
    head, tail, root, newest = _ROOTS[kind]
    text = example.text.strip()
    name = f"example.{kind}"
    if text.startswith("<?xml") or text.startswith(f"<{root}"):
        return text, name
    numbers = example.version.split(".") if example.version else newest
    return head.format(major=numbers[0], minor=numbers[1]) + "\n" + text + "\n" + tail, name


def wrong(bundle: Bundle, rule: Rule, example: Example) -> str | None:
    """Returns how the findings of an example differ from the expected ones, or ``None``."""
    text, name = document(bundle, example)
    found, unlooked = bundle._native.check(name, text.encode(), rule.id)
    if unlooked:
        return "\n".join(f"{checker} could not run: {why}" for checker, why in unlooked)
    said = "\n".join(f"  {it.get('xpath', '')} {it['level']}: {it['text']}" for it in found) or "  nothing"
    places = [it.get("xpath", "") for it in found]
    if example.at is None:
        return None if found else f"expected a finding, found nothing in\n{text}"
    if list(example.at) != places:
        expected = "\n".join(f"  {at}" for at in example.at) or "  nothing"
        return f"expected\n{expected}\nbut found\n{said}\nin\n{text}"
    return None


def examples(bundle: Bundle) -> Iterator[tuple[str, Rule, Example]]:
    """Yields all examples of a bundle with their names."""
    for rule in bundle.rules:
        for kind in ("good", "bad"):
            for number, example in enumerate(getattr(rule, kind), 1):
                yield f"{rule.id} {kind} {number}", rule, example


def main(arguments: list[str]) -> int:
    if not arguments:
        print("usage: python -m qcbus.test SCRIPT…", file=sys.stderr)
        return 2
    tried = failed = 0
    for path in map(Path, arguments):
        if not path.is_file():
            print(f"{path}: script not found", file=sys.stderr)
            return 2
        bundles = load(path)
        if not bundles:
            print(f"{path}: no qcbus.Bundle found", file=sys.stderr)
            return 2
        for bundle in bundles:
            untried = [rule.id for rule in bundle.rules if not (rule.good or rule.bad)]
            for id in untried:
                print(f"{id}: no example: without one, nothing shows that the rule finds anything")
            for name, rule, example in examples(bundle):
                tried += 1
                why = wrong(bundle, rule, example)
                if why is not None:
                    failed += 1
                    print(f"{name}: FAILED\n{why}\n")
    print(f"{tried} examples, {failed} failed")
    return 1 if failed or not tried else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
