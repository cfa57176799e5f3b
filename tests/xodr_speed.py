#!/usr/bin/env python3
"""Times all OpenDRIVE rules and ASAM's own bundle on the same maps of four sizes.

    python3 tests/xodr_speed.py [--cases DIR] [--maps DIR] [--runs N] [--no-asam]

Takes two maps of the corpus (default `../shared/cases`) and makes large ones of them by repeating their
roads and junctions with new ids. Prints a table in Markdown: the CPU time of our rules from the image of
the document in one thread; that of ASAM's bundle (from PyPI, if this Python has it:
`pip install asam-qc-opendrive`), a process per map with its start; and the ratio. It is a benchmark and
not part of CI.
"""

import argparse
import math
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SMALL = "real/esmini/resources/xodr/straight_500m.xodr"
TOWN = "real/esmini/resources/xodr/multi_intersections.xodr"
MOTORWAY = "real/qc-framework/.github/workflows/linux-files/UC_Motorway-Exit-Entry.xodr"
MEGABYTE = 1_000_000
# Distance between copies in metres, so large that their roads are never close to each other.
APART = 5000.0

# Attributes with ids of the whole file, by element.
IDS = {
    "road": ("id", "junction"),
    "predecessor": ("elementId",),
    "successor": ("elementId",),
    "junction": ("id", "mainRoad"),
    "connection": ("incomingRoad", "connectingRoad", "linkedRoad"),
    "priority": ("high", "low"),
    "signal": ("id",),
    "signalReference": ("id",),
    "object": ("id",),
    "objectReference": ("id",),
    "controller": ("id",),
    "control": ("signalId",),
    "dependency": ("id",),
    "reference": ("elementId",),
}
TAG = re.compile(r"<(" + "|".join(sorted(IDS, key=len, reverse=True)) + r")\b([^>]*)>")
ATTRIBUTE = re.compile(r'([\w:]+)(\s*=\s*")([^"]*)"')
X = re.compile(r'(<geometry\b[^>]*?\sx\s*=\s*")([^"]*)"')


def copied(text, copy):
    """Returns the elements with new ids (numbers stay numbers), moved to the east."""
    if copy == 0:
        return text

    def fresh(value):
        return str(int(value) + copy * 100_000) if value.isdigit() else f"{value}-{copy}"

    def attribute(names, match):
        name, between, value = match.groups()
        if name in names and value not in ("", "-1"):
            value = fresh(value)
        return f'{name}{between}{value}"'

    def tag(match):
        names = IDS[match[1]]
        return f"<{match[1]}{ATTRIBUTE.sub(lambda one: attribute(names, one), match[2])}>"

    def moved(match):
        return f'{match[1]}{float(match[2]) + copy * APART!r}"'

    return X.sub(moved, TAG.sub(tag, text))


def repeated(text, size=0, copies=0):
    """Returns the map with everything after its header repeated, up to this size or number of copies."""
    start = text.index("<road ")
    end = text.rindex("</OpenDRIVE>")
    head, body, tail = text[:start], text[start:end], text[end:]
    parts, length, copy = [head], len(head) + len(tail), 0
    while copy < copies or length < size:
        parts.append(copied(body, copy))
        length += len(parts[-1])
        copy += 1
    return "".join(parts) + tail


# Large maps with their source and size; `tests/rivals.py` measures some of them too.
MADE = {
    "motorway-x4.xodr": (MOTORWAY, {"copies": 4}),
    "town-10MB.xodr": (TOWN, {"size": 10 * MEGABYTE}),
    "town-20MB.xodr": (TOWN, {"size": 20 * MEGABYTE}),
    "town-100MB.xodr": (TOWN, {"size": 100 * MEGABYTE}),
    "motorway-10MB.xodr": (MOTORWAY, {"size": 10 * MEGABYTE}),
    "motorway-20MB.xodr": (MOTORWAY, {"size": 20 * MEGABYTE}),
}


def make_map(cases, directory, name):
    """Returns the path of a large map and makes it if it is missing. An interrupted run leaves no partial map."""
    path = directory / name
    if not path.exists():
        source, how = MADE[name]
        text = repeated((cases / source).read_text(encoding="utf-8"), **how)
        half = directory / f".{name}.{os.getpid()}"
        half.write_text(text, encoding="utf-8")
        half.rename(path)
    return path


def make_maps(cases, directory):
    """Returns the maps to measure, small ones first."""
    large = ("motorway-x4", "town-10MB", "town-20MB", "motorway-10MB", "motorway-20MB")
    made = [make_map(cases, directory, f"{name}.xodr") for name in large]
    return [cases / SMALL, cases / TOWN, cases / MOTORWAY, *made]


ROAD = """    <road name="Road {id}" length="{length}" id="{id}" junction="-1">
        <planView>
{geometries}        </planView>
        <lanes>
            <laneSection s="0">
                <center>
                    <lane id="0" type="none" level="false"/>
                </center>
                <right>
                    <lane id="-1" type="driving" level="false">
                        <width sOffset="0" a="3.5" b="0" c="0" d="0"/>
                    </lane>
                </right>
            </laneSection>
        </lanes>
    </road>
"""
GEOMETRY = """            <geometry s="{s!r}" x="{x!r}" y="{y!r}" hdg="{hdg!r}" length="{length!r}">
                <line/>
            </geometry>
"""


def generated(size, name):
    """Returns a map of about this size without faults and without the corpus: a series of bends."""
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>\n<OpenDRIVE>\n'
        f'    <header revMajor="1" revMinor="7" name="{name}" version="1" date="2026-03-02T08:00:00"\n'
        '            north="9000" south="-100" east="9000" west="-100" vendor="qcbus"/>\n'
    ]
    length, road, step = len(parts[0]), 0, 12.345678901234
    while length < size - 1000 or road == 0:
        x, y, geometries = 131.4 * (road % 64), 53.1 * (road // 64), ""
        for part in range(8):
            hdg = 0.01 * part
            geometries += GEOMETRY.format(s=step * part, x=x, y=y, hdg=hdg, length=step)
            x, y = x + step * math.cos(hdg), y + step * math.sin(hdg)
        road += 1
        parts.append(ROAD.format(id=road, length=repr(8 * step), geometries=geometries))
        length += len(parts[-1])
    return "".join(parts) + "</OpenDRIVE>\n"


def ours(maps, runs):
    """Returns the best and median CPU milliseconds per map."""
    command = ["cargo", "bench", "--quiet", "-p", "qcbus-xodr", "--bench", "rule_times"]
    command += ["--", "--runs", str(runs), *map(str, maps)]
    lines = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    words = [line.split() for line in lines.splitlines()]
    return [(float(line[0]), float(line[3])) for line in words]


CONFIG = """<?xml version="1.0" encoding="UTF-8"?>
<Config><Param name="InputFile" value="{map}"/>
<CheckerBundle application="xodrBundle"><Param name="resultFile" value="{result}"/>
{checkers}</CheckerBundle></Config>
"""


def asam_checkers():
    """Returns the ids of all checkers of the installed bundle of ASAM, or an empty list."""
    code = (
        "import pathlib, re, qc_opendrive\n"
        "for file in sorted(pathlib.Path(qc_opendrive.__file__).parent.rglob('*.py')):\n"
        "    print(*re.findall(r'CHECKER_ID\\s*=[\\s(]*\"([^\"]+)\"', file.read_text()), sep='\\n')\n"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    return sorted(set(run.stdout.split())) if run.returncode == 0 else []


def asam(path, checkers, limit):
    """Returns the CPU milliseconds of a process that checks one map, and whether it ended within the limit."""
    with tempfile.TemporaryDirectory() as directory:
        config = pathlib.Path(directory) / "config.xml"
        result = pathlib.Path(directory) / "result.xqar"
        listed = "".join(f'<Checker checkerId="{one}" minLevel="1" maxLevel="3"/>' for one in checkers)
        config.write_text(CONFIG.format(map=path, result=result, checkers=listed))
        command = [sys.executable, "-m", "qc_opendrive.main", "-c", str(config)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        ended = True
        try:
            subprocess.run(command, check=True, capture_output=True, cwd=directory, timeout=limit)
        except subprocess.TimeoutExpired:
            ended = False
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if ended and not result.exists():
            sys.exit(f"ASAM's bundle wrote no result for {path}")
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return 1e3 * used, ended


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=pathlib.Path, default=ROOT.parent / "shared/cases")
    parser.add_argument("--maps", type=pathlib.Path, default=ROOT / "target/xodr-speed")
    parser.add_argument("--runs", type=int, default=9)
    parser.add_argument("--asam-limit", type=float, default=120.0, help="seconds per map")
    parser.add_argument("--no-asam", action="store_true")
    parser.add_argument("--only-maps", action="store_true", help="make the maps and stop")
    args = parser.parse_args()
    args.maps.mkdir(parents=True, exist_ok=True)
    maps = make_maps(args.cases.resolve(), args.maps.resolve())
    if args.only_maps:
        return
    checkers = [] if args.no_asam else asam_checkers()
    print(f"load {os.getloadavg()[0]:.1f}; ASAM: {len(checkers)} checkers\n")
    print("| map | size | ours, best ms | median ms | ms/MB | ASAM, ms | ratio |")
    print("|---|---|---|---|---|---|---|")
    medians = {}
    for path in maps:
        [(best, median)] = ours([path], args.runs)
        medians[path.name] = median
        size = path.stat().st_size
        compared = "- | -"
        if checkers:
            theirs, ended = asam(path, checkers, args.asam_limit)
            more = "" if ended else "> "
            compared = f"{more}{theirs:,.0f} | {more}{theirs / median:,.0f}"
        row = f"| {path.name} | {size:,} | {best:.2f} | {median:.2f} | {1e6 * median / size:.1f}"
        print(f"{row} | {compared} |", flush=True)
    print()
    for kind in ("town", "motorway"):
        growth = medians[f"{kind}-20MB.xodr"] / medians[f"{kind}-10MB.xodr"]
        print(f"{kind}: 20 MB against 10 MB: {growth:.2f}")


if __name__ == "__main__":
    main()
