#!/usr/bin/env python3
"""What a file costs each thread of `qcbus serve` and of its bundles, and what more cores would make of it.

    cargo build --release -p qcbus
    python3 tests/stages.py [--qcbus PATH] [--cases DIR]

CPU time is that of the scheduler (`/proc/PID/task/TID/schedstat`), while many files come at once. From it follows a
model: no more files per second than there are cores for all of it, and no more than the one thread of the
broker's loop can pass on. The rate that was measured stands beside what the model says for this machine. Not part of
CI: it measures.
"""

import argparse
import collections
import itertools
import pathlib
import re
import signal
import sys
import tempfile

sys.dont_write_bytecode = True  # the tree stays as it is
import rivals
import xodr_speed

# Whose thread it is, by its name in the broker. All others of its threads are few and idle.
BROKER = {"qcbus": "loop", "tokio-rt-worker": "readers", "write": "writers"}
CORES = (2, 16, 64)
RUNS = 3


def below(pid):
    """A process and all that it has started, and they have."""
    tasks = pathlib.Path(f"/proc/{pid}/task").iterdir()
    children = {int(it) for task in tasks for it in (task / "children").read_text().split()}
    return [pid, *(one for child in children for one in below(child))]


def used(server):
    """Milliseconds of CPU by stage, since the threads were started."""
    sums = collections.Counter()
    for pid in below(server.process.pid):
        for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
            try:
                name = re.sub(r"-?\d+$", "", (task / "comm").read_text().strip())
                spent = int((task / "schedstat").read_text().split()[0]) / 1e6
            except OSError:
                continue  # it has ended
            is_broker = pid == server.process.pid
            sums[BROKER.get(name, "rest of the broker") if is_broker else "bundles"] += spent
    return sums


def burst(server, texts):
    """Milliseconds of CPU for each file, by stage, and files per second."""
    names = [server.stage(text) for text in texts]
    before = used(server)
    took = server.deliver(*names)
    after = used(server)
    return {stage: (after[stage] - before[stage]) / len(texts) for stage in after}, 1e3 * len(texts) / took


def best_of(qcbus, base, texts):
    """The burst with the highest rate: what else the machine does only takes away from it."""
    server = rivals.Server(qcbus, base)
    try:
        numbers = itertools.count()
        fresh = lambda: [rivals.distinct(text, next(numbers)) for text in texts]
        bursts = [burst(server, fresh()) for _ in range(RUNS)]
    finally:
        server.stop()
    return max(bursts, key=lambda it: it[1])


def rate(costs, cores):
    """Files per second by the model, and what they wait for."""
    by_cores, by_loop = 1e3 * cores / sum(costs.values()), 1e3 / costs["loop"]
    return min((by_cores, "cores"), (by_loop, "loop"))


def row(name, costs, measured):
    stages = ("loop", "readers", "writers", "rest of the broker", "bundles")
    cells = [f"{costs.get(stage, 0):.2f}" for stage in stages]
    cells += [f"{sum(costs.values()):.2f}", f"{measured:,.0f}"]
    for cores in CORES:
        files, limit = rate(costs, cores)
        cells.append(f"{files:,.0f} ({limit})")
    print("| " + " | ".join([name, *cells]) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--qcbus", help="ours (default: target/release/qcbus)")
    parser.add_argument("--cases", type=pathlib.Path, default=rivals.ROOT.parent / "shared/cases")
    args = parser.parse_args()
    # Whoever ends this ends what it started, too.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    rivals.adopt()
    print(rivals.machine())
    parts = [f"model: files/s on {cores} cores" for cores in CORES]
    costs = ("loop", "readers", "writers", "rest of the broker", "bundles", "all")
    rivals.head("ms of CPU for each file", *costs, "measured files/s", *parts)
    with tempfile.TemporaryDirectory(prefix="qcbus-stages-") as base:
        qcbus = rivals.Qcbus(rivals.our_program(args))
        small = [xodr_speed.generated(10_000, "many").encode()] * 500
        row("10 KB", *best_of(qcbus, base, small))
        cases, made = args.cases.resolve(), rivals.ROOT / "target/xodr-speed"
        if not (cases / xodr_speed.MOTORWAY).is_file():
            return rivals.skip(f"maps of 1.3 MB: {cases} has none (--cases DIR)")
        made.mkdir(parents=True, exist_ok=True)
        text = xodr_speed.make_map(cases, made, "motorway-x4.xodr").read_bytes()
        row("1.3 MB, 1.8", *best_of(qcbus, base, [text] * 60))


if __name__ == "__main__":
    sys.exit(main())
