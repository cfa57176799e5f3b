#!/usr/bin/env python3
"""Times qcbus and ASAM's own bundle on the same scenarios in one run.

    cargo build --release -p qcbus
    python3 tests/xosc_speed.py [--cases DIR] [--work DIR] [--runs N] [--no-asam]

Uses a small scenario of the corpus (default `../shared/cases`) and makes large ones of it by repeating its
stories under new names. Prints a table in Markdown with CPU times and their ratios: `qcbus check`, a
whole process with all bundles; a warm broker with its bundles, per scenario in its watched directory;
ASAM's bundle (from PyPI, if this Python has it: `pip install asam-qc-openscenarioxml`), a process per
scenario. It is a benchmark and not part of CI.
"""

import argparse
import os
import pathlib
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Valid by its schema, because ASAM's bundle runs no semantic checker on an invalid scenario.
SMALL = "real/esmini/resources/xosc/auto_light.xosc"
MEGABYTE = 1_000_000
TICK = os.sysconf("SC_CLK_TCK")

CONFIG = """<?xml version="1.0" encoding="UTF-8"?>
<Config><Param name="InputFile" value="{scenario}"/>
<CheckerBundle application="xoscBundle"><Param name="resultFile" value="{result}"/>
{checkers}</CheckerBundle></Config>
"""


def repeated(text, size):
    """Returns the scenario with its stories repeated under new names until it has this size."""
    start, end = text.index("<Story "), text.rindex("</Story>") + len("</Story>")
    story = text[start:end]
    parts, length, copy = [text[:start]], len(text) - len(story), 0
    while length < size:
        fresh = re.sub(r'<(Story) name="([^"]*)"', rf'<\1 name="\2 {copy}"', story)
        parts.append(fresh + "\n")
        length += len(fresh) + 1
        copy += 1
    return "".join(parts) + text[end:]


def make_scenarios(cases, directory):
    """Returns the paths of the scenarios to measure, the small one first. Its neighbours are linked beside the
    large ones, so that their map and catalogs are found."""
    small = cases / SMALL
    home = directory / "xosc"
    home.mkdir(parents=True, exist_ok=True)
    for neighbour in ("xodr", "models"):
        link = directory / neighbour
        if not link.exists() and (small.parent.parent / neighbour).exists():
            link.symlink_to(small.parent.parent / neighbour)
    for entry in small.parent.iterdir():
        link = home / entry.name
        if entry.is_dir() and not link.exists():
            link.symlink_to(entry)
    scenarios = [small]
    text = small.read_text(encoding="utf-8")
    for megabytes in (10, 20):
        path = home / f"stories-{megabytes}MB.xosc"
        path.write_text(repeated(text, megabytes * MEGABYTE), encoding="utf-8")
        scenarios.append(path)
    return scenarios


def cpu_of(command, directory, limit=None):
    """Returns the CPU milliseconds of a process and its children, and whether it ended within the limit."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = True
    try:
        subprocess.run(command, capture_output=True, cwd=directory, timeout=limit)
    except subprocess.TimeoutExpired:
        ended = False
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return 1e3 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime), ended


def one_shot(program, scenario, runs):
    with tempfile.TemporaryDirectory() as directory:
        command = [program, "check", "--out", directory, scenario]
        return statistics.median(cpu_of(command, directory)[0] for _ in range(runs))


def family(pid):
    """Returns the CPU seconds of a process and all its living descendants."""
    total, pids = 0.0, [pid]
    for one in pids:
        fields = pathlib.Path(f"/proc/{one}/stat").read_text().rsplit(")", 1)[1].split()
        total += (int(fields[11]) + int(fields[12])) / TICK
        for task in pathlib.Path(f"/proc/{one}/task").iterdir():
            pids += [int(child) for child in (task / "children").read_text().split()]
    return total


def results_in(directory):
    return sum(1 for _ in directory.rglob("*.verdict.json"))


def until(what, condition, seconds=120):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            sys.exit(f"timeout: {what}")
        time.sleep(0.02)


def warm(program, scenario, copies):
    """Returns the CPU milliseconds per scenario of all processes of a warm broker, for many copies."""
    with tempfile.TemporaryDirectory() as directory:
        base = pathlib.Path(directory)
        inbox, out = base / "farm/xosc", base / "out"
        inbox.mkdir(parents=True)
        for neighbour in scenario.parent.iterdir():
            if neighbour.is_dir():
                (inbox / neighbour.name).symlink_to(neighbour.resolve())
        maps = scenario.parent.parent / "xodr"
        if maps.exists():
            (inbox.parent / "xodr").symlink_to(maps.resolve())
        text = scenario.read_bytes()
        command = [program, "serve", inbox, "--out", out, "--instance-dir", base / "instance"]
        broker = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            until("the start of the broker", lambda: (base / "instance").exists())
            (inbox / "first.xosc").write_bytes(text)
            until("the first verdict", lambda: results_in(out) >= 1)
            time.sleep(0.5)
            there, begun = results_in(out), family(broker.pid)
            for copy in range(copies):
                (inbox / f"copy-{copy}.xosc").write_bytes(text + b"<!-- %d -->\n" % copy)
            until("all verdicts", lambda: results_in(out) >= there + copies)
            return 1e3 * (family(broker.pid) - begun) / copies
        finally:
            broker.terminate()
            broker.wait()


def asam_checkers():
    """Returns the ids of all checkers of the installed bundle of ASAM, or an empty list."""
    code = (
        "import pathlib, re, qc_openscenario\n"
        "for file in sorted(pathlib.Path(qc_openscenario.__file__).parent.rglob('*.py')):\n"
        "    print(*re.findall(r'CHECKER_ID\\s*=[\\s(]*\"([^\"]+)\"', file.read_text()), sep='\\n')\n"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    return sorted(set(run.stdout.split())) if run.returncode == 0 else []


def asam(scenario, checkers, limit):
    with tempfile.TemporaryDirectory() as directory:
        config, result = pathlib.Path(directory) / "config.xml", pathlib.Path(directory) / "result.xqar"
        listed = "".join(f'<Checker checkerId="{one}" minLevel="1" maxLevel="3"/>' for one in checkers)
        config.write_text(CONFIG.format(scenario=scenario, result=result, checkers=listed))
        command = [sys.executable, "-m", "qc_openscenario.main", "-c", str(config)]
        used, ended = cpu_of(command, directory, limit)
        if ended and not result.exists():
            sys.exit(f"ASAM's bundle wrote no result for {scenario}")
        return used, ended


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=pathlib.Path, default=ROOT.parent / "shared/cases")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "target/xosc-speed")
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "target/release/qcbus")
    parser.add_argument("--runs", type=int, default=9)
    parser.add_argument("--asam-limit", type=float, default=600.0, help="seconds per scenario")
    parser.add_argument("--no-asam", action="store_true")
    args = parser.parse_args()
    if not args.program.exists():
        sys.exit("build it first: cargo build --release -p qcbus")
    args.work.mkdir(parents=True, exist_ok=True)
    scenarios = make_scenarios(args.cases.resolve(), args.work.resolve())
    checkers = [] if args.no_asam else asam_checkers()
    print(f"load {os.getloadavg()[0]:.1f}; ASAM: {len(checkers)} checkers\n")
    print("| scenario | size | `check`, ms | warm, ms | ASAM, ms | ratio of `check` | ratio of warm |")
    print("|---|---|---|---|---|---|---|")
    shots = {}
    for path in scenarios:
        size = path.stat().st_size
        small = size < MEGABYTE
        shot = one_shot(args.program, path, args.runs)
        shots[size] = shot
        per_file = warm(args.program, path, 200 if small else 3)
        compared = "- | - | -"
        if checkers:
            theirs, ended = asam(path, checkers, args.asam_limit)
            more = "" if ended else "> "
            compared = f"{more}{theirs:,.0f} | {more}{theirs / shot:,.0f} | {more}{theirs / per_file:,.0f}"
        print(f"| {path.name} | {size:,} | {shot:.1f} | {per_file:.2f} | {compared} |", flush=True)
    *_, ten, twenty = shots.values()
    print(f"\n20 MB against 10 MB: {twenty / ten:.2f}")


if __name__ == "__main__":
    main()
