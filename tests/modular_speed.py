#!/usr/bin/env python3
"""Times `qcbus expand` and the reference tool on the same archive in one run.

    cargo build --release -p qcbus
    python3 tests/modular_speed.py [--tool Modular2Simple.java] [--runs N]

The script makes the archive: a scenario with 16 references to a library. It prints a table in Markdown: the CPU
time of a whole process of each, and the ratio. Without `--tool` or a JDK it times only ours and prints a note.
It is a benchmark and not part of CI.
"""

import argparse
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
REFERENCES = 16


def scenario(groups):
    """Returns a scenario with one act that has these groups."""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<OpenSCENARIO>\n'
        '<FileHeader revMajor="1" revMinor="0" date="2026-01-01T00:00:00" description="d" author="a"/>\n'
        '<Entities><ScenarioObject name="ego"/></Entities>\n'
        f'<Storyboard><Story name="S"><Act name="A">\n{groups}\n</Act></Story></Storyboard>\n</OpenSCENARIO>\n'
    )


def library_group(number):
    """Returns a group with a dozen parameter attributes."""
    positions = "\n".join(
        f'<Action name="a{at}"><PrivateAction><RoutingAction><AcquirePositionAction><Position>'
        f'<WorldPosition parameterAttributes="x,y,z,h" x="{at}" y="0" z="0" h="0"/></Position>'
        "</AcquirePositionAction></RoutingAction></PrivateAction></Action>"
        for at in range(3)
    )
    return (
        f'<ManeuverGroup name="G{number}" maximumExecutionCount="1">'
        '<Actors selectTriggeringEntities="false"><EntityRef entityRef="veh"/></Actors>'
        f'<Maneuver name="m"><Event name="e" priority="overwrite">\n{positions}\n</Event></Maneuver></ManeuverGroup>'
    )


def reference(number):
    """Returns a group that refers to one of the library, with its own values."""
    return (
        f'<ManeuverGroup name="P{number}" maximumExecutionCount="1">'
        '<Actors selectTriggeringEntities="false"><EntityRef entityRef="ego"/></Actors>'
        f'<ScenarioReference scenarioFileName="library.xosc"><ManeuverGroupReference maneuverGroupName="G{number}">'
        f'<ParameterReference key="WorldPosition.x" value="{number}"/>'
        f'<ParameterReference key="WorldPosition.y" value="{number}"/>'
        "</ManeuverGroupReference></ScenarioReference></ManeuverGroup>"
    )


def cpu(command, cwd, runs):
    """Returns the median CPU seconds of a process and its children."""
    times = []
    for _ in range(runs):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, cwd=cwd, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return statistics.median(times)


def main():
    """Makes the archive and times both tools."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tool", type=pathlib.Path, help="source of the reference tool")
    parser.add_argument("--runs", type=int, default=11)
    arguments = parser.parse_args()
    qcbus = ROOT / "target/release/qcbus"
    if not qcbus.exists():
        sys.exit(f"{qcbus} is not built: cargo build --release -p qcbus")
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        (work / "main.xosc").write_text(scenario("\n".join(map(reference, range(REFERENCES)))))
        (work / "library.xosc").write_text(scenario("\n".join(map(library_group, range(REFERENCES)))))
        pack = [qcbus, "pack", "main.xosc", "library.xosc", "-o", "in.mosc"]
        subprocess.run(pack, cwd=work, check=True, stderr=subprocess.DEVNULL)
        ours = cpu([qcbus, "expand", "in.mosc", "-o", "ours.xosc"], work, arguments.runs)
        print(f"| expansion with {REFERENCES} references, a whole process | CPU |\n|---|--:|")
        print(f"| `qcbus expand` | {ours * 1000:.1f} ms |")
        if arguments.tool is None or shutil.which("javac") is None:
            print("\nThe reference tool was not timed: it needs --tool and a JDK.")
            return
        classes = work / "classes"
        subprocess.run(["javac", "-d", classes, arguments.tool.resolve()], check=True)
        command = ["java", "-cp", classes, arguments.tool.stem, "-cmx", "in.mosc", "theirs.xosc"]
        theirs = cpu(command, work, arguments.runs)
        assert (work / "theirs.xosc").stat().st_size > 0, "the reference tool wrote nothing"
        print(f"| the reference tool | {theirs * 1000:.0f} ms |\n| ratio | {theirs / ours:.0f} × |")
        os.sync()


if __name__ == "__main__":
    main()
