"""A broker with its watched directory."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

#: The program of the package.
QCBUS = Path(sys.executable).with_name("qcbus")
#: Seconds after which a test counts as hanging. It is no bound on speed.
WATCHDOG = 120

TEN_LINES = '''
import qcbus
bundle = qcbus.Bundle("acme", version="1.0", kinds=["xodr"])

@bundle.rule("acme.example:xodr:1.0.0:road.named", level="warning")
def road_named(doc, found):
    """Every road has a name."""
    for road in doc.iter("road"):
        if not road.get("name"):
            found.issue(road, f"road `{road.get('id')}` has no name; give it one")

bundle.main()
'''

MAP = """<OpenDRIVE>
<header revMajor="1" revMinor="8"/>
  <road id="17" length="10" junction="-1"/>
</OpenDRIVE>
"""


class Farm:
    def __init__(self, place: Path) -> None:
        self.place = place
        self.files = place / "files"
        self.files.mkdir()
        (place / "run").mkdir()
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(place / "run"), "NO_COLOR": "1"}

    def qcbus(self, *arguments: object, code: int | None = 0, told: bool = False) -> str:
        """Returns the stdout of a command, or its stderr with ``told``."""
        it = subprocess.run(
            [QCBUS, *map(str, arguments)],
            cwd=self.place, env=self.environment, capture_output=True, text=True, timeout=WATCHDOG,
        )  # fmt: skip
        assert code is None or it.returncode == code, f"{arguments}: {it.returncode}\n{it.stdout}{it.stderr}"
        return it.stderr if told else it.stdout

    def status(self) -> dict[str, Any]:
        return json.loads(self.qcbus("status", "--json"))

    def peer(self, name: str) -> dict[str, Any] | None:
        return next((it for it in self.status()["peers"] if it["name"] == name), None)

    def script(self, text: str, name: str = "acme.py") -> Path:
        path = self.place / name
        path.write_text(text)
        return path

    def add(self, name: str, script: Path) -> None:
        """Adds a bundle and waits until it is ready."""
        self.qcbus("bundle", "add", name, sys.executable, script)
        self.until(lambda: (self.peer(name) or {}).get("state") == "ready")

    def until(self, true: Any) -> Any:
        end = time.monotonic() + WATCHDOG
        while not (value := true()):
            assert time.monotonic() < end, f"timeout\n{self.log()}"
            time.sleep(0.02)
        return value

    def put(self, name: str, text: str = MAP) -> Path:
        """Puts a file into the watched directory atomically."""
        (self.place / "coming").write_text(text)
        return (self.place / "coming").rename(self.files / name)

    def wait(self, path: Path) -> dict[str, Any]:
        return json.loads(self.qcbus("wait", path, "--json", code=None))

    def result(self, name: str, bundle: str = "acme") -> ElementTree.Element | None:
        root = ElementTree.parse(self.place / "qcbus-out" / f"{name}.xqar").getroot()
        return next((it for it in root.iter("CheckerBundle") if it.get("name") == bundle), None)

    def log(self) -> str:
        return (self.place / "log").read_text(errors="replace")


@contextmanager
def serving(place: Path, *arguments: str) -> Iterator[Farm]:
    farm = Farm(place)
    with (place / "log").open("wb") as log:
        broker = subprocess.Popen(
            [QCBUS, "serve", "files", *arguments], cwd=place, env=farm.environment, stdout=log, stderr=log
        )
    try:
        while b" serves " not in (place / "log").read_bytes():
            assert broker.poll() is None, farm.log()
            time.sleep(0.02)
        yield farm
    finally:
        broker.send_signal(signal.SIGTERM)
        try:
            broker.wait(WATCHDOG)
        except subprocess.TimeoutExpired:
            broker.kill()
            raise
    assert broker.returncode == 0, farm.log()
