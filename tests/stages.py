#!/usr/bin/env python3
"""CPU time of a file in each thread of `qcbus serve` and its bundles, and a prediction for more cores.

    cargo build --release -p qcbus
    python3 tests/stages.py [--qcbus PATH] [--cases DIR]

The CPU time is that of the scheduler (`/proc/PID/task/TID/schedstat`) while many files arrive at once. A model limits
the files per second by the CPU time of all cores and by the single thread of the broker's loop. The table shows the
measured rate beside the model. It is a benchmark and not part of CI.
"""

import argparse
import collections
import itertools
import pathlib
import re
import signal
import sys
import tempfile

sys.dont_write_bytecode = True  # no cache files in the tree
import rivals
import xodr_speed

# Stages of the broker by thread name. Its other threads are few and idle.
BROKER = {"qcbus": "loop", "tokio-rt-worker": "readers", "write": "writers"}
CORES = (2, 16, 64)
RUNS = 3


def below(pid):
    """Returns a process and all its descendants."""
    tasks = pathlib.Path(f"/proc/{pid}/task").iterdir()
    children = {int(it) for task in tasks for it in (task / "children").read_text().split()}
    return [pid, *(one for child in children for one in below(child))]


def used(server):
    """Returns the milliseconds of CPU by stage since the start of the threads."""
    sums = collections.Counter()
    for pid in below(server.process.pid):
        for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
            try:
                name = re.sub(r"-?\d+$", "", (task / "comm").read_text().strip())
                spent = int((task / "schedstat").read_text().split()[0]) / 1e6
            except OSError:
                continue  # the thread has ended
            is_broker = pid == server.process.pid
            sums[BROKER.get(name, "rest of the broker") if is_broker else "bundles"] += spent
    return sums


def burst(server, texts):
    """Returns the milliseconds of CPU per file by stage, and the files per second."""
    names = [server.stage(text) for text in texts]
    before = used(server)
    took = server.deliver(*names)
    after = used(server)
    return {stage: (after[stage] - before[stage]) / len(texts) for stage in after}, 1e3 * len(texts) / took


def best_of(qcbus, base, texts):
    """Returns the burst with the highest rate, because other load on the machine only lowers it."""
    server = rivals.Server(qcbus, base)
    try:
        numbers = itertools.count()
        fresh = lambda: [rivals.distinct(text, next(numbers)) for text in texts]
        bursts = [burst(server, fresh()) for _ in range(RUNS)]
    finally:
        server.stop()
    return max(bursts, key=lambda it: it[1])


def rate(costs, cores):
    """Returns the files per second of the model and the limiting resource."""
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
    parser.add_argument("--qcbus", help="our program (default: target/release/qcbus)")
    parser.add_argument("--cases", type=pathlib.Path, default=rivals.ROOT.parent / "shared/cases")
    args = parser.parse_args()
    # SIGTERM must also end the processes that this script started.
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
            return rivals.skip(f"maps of 1.3 MB: not found in {cases} (--cases DIR)")
        made.mkdir(parents=True, exist_ok=True)
        text = xodr_speed.make_map(cases, made, "motorway-x4.xodr").read_bytes()
        row("1.3 MB, 1.8", *best_of(qcbus, base, [text] * 60))


if __name__ == "__main__":
    sys.exit(main())
