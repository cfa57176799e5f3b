#!/usr/bin/env python3
"""Times qcbus and another checker alternately in one run, and prints tables with ratios.

    cargo build --release -p qcbus
    python3 tests/rivals.py [--quick] [--rival 'PROGRAM ARGS {}'] [--qcbus PATH] [--cases DIR]

The rival is any command line; `{}` becomes the file and `{out}` a temporary directory. It can also be
given in the variable QCBUS_RIVAL. If the rival is another qcbus, its `serve` is compared with ours:

    python3 tests/rivals.py --rival 'OTHER/qcbus check {} --quiet --out {out}'

Times are medians of the wall time of whole processes, ours and the rival's alternately. CPU is that of
all processes of a run. Real maps are from the corpus (default `../shared/cases`). Missing maps are
skipped with a message. The exit code is 1 if a run of ours failed. It is a benchmark and not part of CI.
"""

import argparse
import collections
import ctypes
import json
import os
import pathlib
import platform
import re
import select
import shlex
import shutil
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True  # no cache files in the tree
import xodr_speed

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Exit codes with a verdict: accepted, rejected, undetermined.
VERDICTS = (0, 1, 3)
# Maximum seconds for a run of ours or a verdict.
LIMIT = 300
# Seconds of idle time before each file, as on a farm.
REST = 0.03
# Maps by name, with the number of runs: normally, and with --quick.
MAPS = {
    "7 KB": (xodr_speed.SMALL, 31, 9),
    "324 KB, 1.8": (xodr_speed.MOTORWAY, 21, 7),
    "1.3 MB, 1.8": ("motorway-x4.xodr", 15, 7),
    "20 MB, 1.4": ("town-20MB.xodr", 9, 3),
    "20 MB, 1.8": ("motorway-20MB.xodr", 9, 3),
    "100 MB, 1.4": ("town-100MB.xodr", 5, 1),
}
SERVED = ("7 KB", "324 KB, 1.8", "1.3 MB, 1.8", "20 MB, 1.4", "20 MB, 1.8")

failures = []
skipped = []
noted = []


def fail(what):
    failures.append(what)
    print(f"FAILED: {what}", file=sys.stderr, flush=True)


def note(what):
    if what not in noted:
        noted.append(what)
        print(f"NOTE: {what}", file=sys.stderr, flush=True)


def skip(what):
    skipped.append(what)
    print(f"SKIPPED: {what}", file=sys.stderr, flush=True)


class Failed(Exception):
    """A run of ours that failed."""


class Slow(Exception):
    """A run of the rival that took too long or failed."""


Run = collections.namedtuple("Run", "wall cpu code")


def spawn(command, cores=None, log=None):
    """Starts a process, on the given cores only if any. Its children inherit them."""
    before = os.sched_getaffinity(0)
    try:
        if cores:
            os.sched_setaffinity(0, cores)
        streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
        return subprocess.Popen(command, stderr=log or subprocess.DEVNULL, start_new_session=True, **streams)
    finally:
        if cores:
            os.sched_setaffinity(0, before)


def kill(process):
    """Kills a process started by this script, and its children. They are a session of their own."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass  # it has ended already


PR_SET_CHILD_SUBREAPER = 36


def adopt():
    """Makes orphaned descendants children of this process, so that their CPU time can be read."""
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def children():
    tasks = pathlib.Path("/proc/self/task").iterdir()
    return {int(child) for task in tasks for child in (task / "children").read_text().split()}


# Running brokers.
serving = set()


def reap():
    """Waits for the processes that an ended process left, and returns their CPU seconds."""
    used, end = 0.0, time.monotonic() + 30
    while left := children() - serving:
        for pid in left:
            if time.monotonic() > end:
                os.kill(pid, signal.SIGKILL)
            pid, _, usage = os.wait4(pid, os.WNOHANG)
            used += usage.ru_utime + usage.ru_stime if pid else 0
        time.sleep(0.002)
    return used


def run(command, limit, cores=None):
    """Runs a process. Returns its wall and CPU milliseconds and its exit code, or None after the limit."""
    start = time.perf_counter()
    process = spawn(command, cores)
    watch = os.pidfd_open(process.pid)
    try:
        ended, _, _ = select.select([watch], [], [], limit)
        if not ended:
            kill(process)
        _, status, used = os.wait4(process.pid, 0)
    except BaseException:
        kill(process)
        process.wait()
        raise
    finally:
        os.close(watch)
    wall = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    cpu = used.ru_utime + used.ru_stime + reap()
    return Run(1e3 * wall, 1e3 * cpu, process.returncode) if ended else None


class Qcbus:
    """A qcbus: ours or the rival."""

    def __init__(self, program):
        self.program = program
        text = subprocess.run([program, "check", "--help"], capture_output=True, text=True).stdout
        self.has_warm = "--cold" in text

    def check(self, paths, out, cores=None):
        cold = ["--cold"] if self.has_warm else []
        return self.judged([*cold, *paths], out, cores)

    def check_warm(self, path, out, server):
        return self.judged(["--instance-dir", server.instance, path], out)

    def judged(self, arguments, out, cores=None):
        command = [self.program, "check", "--quiet", "--out", out, *arguments]
        ended = run(command, LIMIT, cores)
        if ended is None or ended.code not in VERDICTS:
            how = "took too long" if ended is None else f"ended with {ended.code}"
            raise Failed(f"{shlex.join(map(str, command))}: {how}")
        if ended.code == 3:
            note(f"undetermined: {self.program} check {' '.join(map(str, arguments))}")
        return ended


class Rival:
    """Another checker, given by its command line."""

    def __init__(self, line, limit, out):
        self.words = shlex.split(line)
        self.limit, self.out = limit, out
        if not any("{}" in word for word in self.words):
            sys.exit("--rival: {} must mark the place of the file")
        program = shutil.which(self.words[0])
        self.name = None if program is None else line
        self.qcbus = None
        if program and self.words[1:2] == ["check"]:
            said = subprocess.run([program, "serve", "--help"], capture_output=True, text=True)
            if said.returncode == 0 and "--instance-dir" in said.stdout:
                self.qcbus = Qcbus(program)
        self.given_up = set()

    def check(self, path):
        """Runs a process for one file. A file that failed or took too long is not tried again."""
        if path in self.given_up:
            raise Slow("given up before")
        values = {"{}": str(path), "{out}": str(self.out)}
        put = lambda word: re.sub(r"\{(?:out)?\}", lambda it: values[it[0]], word)
        ended = run([put(word) for word in self.words], self.limit)
        if ended is None or not 0 <= ended.code < 126:
            self.given_up.add(path)
            raise Slow(f"> {self.limit:g} s" if ended is None else f"failed with {ended.code}")
        return ended

    def check_each(self, paths):
        runs = [self.check(path) for path in paths]
        return Run(sum(it.wall for it in runs), sum(it.cpu for it in runs), 0)


class Arrivals:
    """Waits for files in a directory without polling."""

    CREATE, MOVED_TO = 0x100, 0x80

    def __init__(self, directory):
        self.directory = directory
        libc = ctypes.CDLL(None, use_errno=True)
        self.events = libc.inotify_init1(os.O_CLOEXEC | os.O_NONBLOCK)
        watch = os.fsencode(directory)
        if self.events < 0 or libc.inotify_add_watch(self.events, watch, self.CREATE | self.MOVED_TO) < 0:
            raise OSError(ctypes.get_errno(), "inotify")

    def wait_for(self, names, alive, limit=LIMIT):
        """Returns the time at which the last of these files appeared. Fails if their writer ends."""
        missing, end = set(names), time.perf_counter() + limit
        while missing:
            ready, _, _ = select.select([self.events], [], [], 0.5)
            now = time.perf_counter()
            if ready:
                missing -= self.heard()
            else:  # an event may be lost, but the file exists
                missing -= {name for name in missing if (self.directory / name).exists()}
            if missing and not alive():
                raise Failed("the broker has ended")
            if missing and now > end:
                raise Failed(f"{len(missing)} of {len(names)} files are missing, such as {min(missing)}")
        return now

    def heard(self):
        names, at = set(), 0
        events = os.read(self.events, 1 << 20)
        while at < len(events):
            length = struct.unpack_from("iIII", events, at)[3]
            names.add(os.fsdecode(events[at + 16 : at + 16 + length].rstrip(b"\0")))
            at += 16 + length
        return names

    def close(self):
        os.close(self.events)


class Server:
    """`qcbus serve`, warm: it has judged a few maps after the constructor."""

    def __init__(self, qcbus, base, cores=None):
        self.base = pathlib.Path(tempfile.mkdtemp(dir=base))
        self.inbox, self.out, self.staging = (self.base / name for name in ("in", "out", "staging"))
        for directory in (self.inbox, self.out, self.staging):
            directory.mkdir()
        self.instance = self.base / "instance"
        self.count, self.name = 0, qcbus.program
        self.arrivals = Arrivals(self.out)
        command = [qcbus.program, "serve", self.inbox, "--out", self.out, "--instance-dir", self.instance]
        self.log = open(self.base / "log", "wb")
        self.process = spawn(command, cores, self.log)
        serving.add(self.process.pid)
        try:
            for number in range(10):
                self.deliver(self.stage(xodr_speed.generated(10_000, f"warm {number}").encode()))
        except BaseException:
            self.stop()
            raise

    def stage(self, text):
        """Writes a map beside the watched directory for a later rename. Returns its name."""
        self.count += 1
        path = self.staging / f"{self.count}.xodr"
        path.write_bytes(text)
        return path.name

    def deliver(self, *names):
        """Returns the milliseconds from the first rename to the last verdict file."""
        start = time.perf_counter()
        for name in names:
            os.rename(self.staging / name, self.inbox / name)
        end = self.arrivals.wait_for([f"{name}.verdict.json" for name in names], self.is_alive)
        return 1e3 * (end - start)

    def is_alive(self):
        return self.process.poll() is None

    def undetermined(self):
        verdicts = (json.loads(path.read_text())["verdict"] for path in self.out.glob("*.verdict.json"))
        return sum(1 for verdict in verdicts if verdict not in ("accepted", "rejected"))

    def stop(self):
        """Stops the server and waits for its end."""
        self.process.terminate()
        try:
            code = self.process.wait(60)
        except subprocess.TimeoutExpired:
            kill(self.process)
            code = self.process.wait()
        serving.remove(self.process.pid)
        reap()
        self.log.close()
        self.arrivals.close()
        if code != 0:
            said = (self.base / "log").read_text(errors="replace").splitlines()[-3:]
            fail(f"{self.name} serve ended with {code}: {' / '.join(said)}")
        elif open_ones := self.undetermined():
            note(f"{open_ones} verdicts of {self.name} serve are undetermined")
        # The files stay until the end of all measurements. ext4 without a journal does not reuse an inode that was
        # freed a minute ago and searches past all of them, which would slow down the next measurement.


def distinct(text, number):
    """Returns the map with another name in its header: different bytes, the same work."""
    start = text.index(b"<header")
    end = text.index(b">", start)
    header = re.sub(rb'\sname\s*=\s*"[^"]*"', b"", text[start:end])
    return b"%s<header name=\"%d\"%s%s" % (text[:start], number, header[len(b"<header") :], text[end:])


def in_turn(runs, ours, theirs):
    """Returns the results of both in alternating order, and the reason why `theirs` has none, if it is None or fails."""
    gave, why = ([], []), None
    for turn in range(runs):
        order = (0, 1) if turn % 2 == 0 else (1, 0)
        for who in order:
            if who == 0:
                gave[0].append(ours())
            elif theirs and why is None:
                try:
                    gave[1].append(theirs())
                except (Slow, Failed) as error:
                    why = str(error)
    return gave[0], gave[1] if why is None else [], why or "–"


def number(value):
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def times(name, ours, theirs, without, ratio=lambda ours, theirs: theirs / ours):
    """Prints a row of medians and their ratio. `without` is the reason why the rival has no figure."""
    median = lambda runs: statistics.median(getattr(it, "wall", it) for it in runs)
    cpu = lambda runs: number(statistics.median(it.cpu for it in runs)) if runs and hasattr(runs[0], "cpu") else "–"
    mine = median(ours)
    cells = [name, str(len(ours)), number(mine), number(median(theirs)) if theirs else without]
    if theirs:
        cells.append(f"**{ratio(mine, median(theirs)):.2f}**")
    else:
        cells.append("–")
    print("| " + " | ".join([*cells, cpu(ours), cpu(theirs)]) + " |", flush=True)


def head(*columns):
    print("\n| " + " | ".join(columns) + " |\n|" + "---|" * len(columns), flush=True)


class Bench:
    def __init__(self, args, base, ours, rival):
        self.args, self.base, self.ours, self.rival = args, base, ours, rival
        self.out = base / "out"
        self.maps = self.find_maps()

    def find_maps(self):
        cases, made, found = self.args.cases.resolve(), ROOT / "target/xodr-speed", {}
        made.mkdir(parents=True, exist_ok=True)
        for name, (file, runs, quick) in MAPS.items():
            source = xodr_speed.MADE.get(file, (file,))[0]
            if not (cases / source).is_file():
                skip(f"maps of {name}: {cases / source} not found (--cases DIR)")
                continue
            path = xodr_speed.make_map(cases, made, file) if file in xodr_speed.MADE else cases / file
            found[name] = (path, quick if self.args.quick else runs)
        return found

    def row(self, name, measure):
        """Prints one row. A failure of ours is printed instead, and the other rows follow."""
        try:
            measure()
        except Failed as error:
            fail(f"{name}: {error}")
            print(f"| {name} | **FAILED** |", flush=True)

    def checks(self):
        head("`check`, whole process", "runs", "ours, ms", "rival, ms", "rival ÷ ours", "CPU ours", "CPU rival")
        for name, (path, runs) in self.maps.items():
            theirs = self.rival and (lambda path=path: self.rival.check(path))
            ours = lambda path=path: self.ours.check([path], self.out)
            self.row(name, lambda: times(name, *in_turn(runs, ours, theirs)))
        self.row("200 files of 10 KB", self.many_small)
        self.row("7 KB, warm", self.warm)

    def many_small(self):
        directory = self.base / "small"
        directory.mkdir()
        paths = [directory / f"{number}.xodr" for number in range(200)]
        for place, path in enumerate(paths):
            path.write_text(xodr_speed.generated(10_000, f"small {place}"))
        theirs = None
        if self.rival and self.rival.qcbus:
            theirs = lambda: self.rival.qcbus.check([directory], self.base / "other")
        elif self.rival:
            theirs = lambda: self.rival.check_each(paths)
        ours = lambda: self.ours.check([directory], self.out)
        runs = 2 if self.args.quick else 5
        times("200 files of 10 KB, in one go", *in_turn(runs, ours, theirs))

    def warm(self):
        """Times `check` with a running broker of the instance and warm bundles."""
        if "7 KB" not in self.maps:
            return
        path, runs = self.maps["7 KB"]
        if not self.ours.has_warm:
            print("| 7 KB, a broker runs | – | not supported | – | – | – | – |", flush=True)
            return skip("a warm `check`: `qcbus check --help` has no --cold")
        server = Server(self.ours, self.base)
        try:
            ours = lambda: self.ours.check_warm(path, self.out, server)
            theirs = self.rival and (lambda: self.rival.check(path))
            times("7 KB, a broker runs", *in_turn(runs, ours, theirs))
        finally:
            server.stop()

    def servers(self, measure, cores=None):
        """Calls a function with our server and, if the rival is a qcbus, with its server."""
        servers = [Server(self.ours, self.base, cores)]
        try:
            if self.rival and self.rival.qcbus:
                servers.append(Server(self.rival.qcbus, self.base, cores))
            return measure(*servers)
        finally:
            for server in servers:
                server.stop()

    def serves(self):
        whose = "its `serve`" if self.rival and self.rival.qcbus else "a process per file"
        head("`serve`: renamed into place → verdict file", "files", "ours, p50 ms", f"rival, ms ({whose})",
             "rival ÷ ours", "CPU ours", "CPU rival")
        for name in SERVED:
            if name in self.maps:
                self.row(name, lambda: self.servers(lambda *servers: self.latency(name, *servers)))

    def latency(self, name, server, other=None):
        path, runs = self.maps[name]
        text = path.read_bytes()

        def once(where):
            staged = where.stage(distinct(text, where.count))
            time.sleep(REST)
            return where.deliver(staged)

        theirs = (lambda: once(other)) if other else self.rival and (lambda: self.rival.check(path))
        runs = runs if len(text) > 1_000_000 else 3 * runs
        times(name, *in_turn(runs, lambda: once(server), theirs))

    def burst(self):
        head("many at once, first rename → last verdict file", "runs", "ours, files/s", "rival, files/s",
             "ours ÷ rival", "CPU ours", "CPU rival")
        name = "500 files of 10 KB"
        self.row(name, lambda: self.servers(lambda *servers: self.at_once(name, *servers)))

    def at_once(self, name, server, other=None):
        count = 500
        maps = lambda: [xodr_speed.generated(10_000, f"at once {number}") for number in range(count)]

        def once(where):
            texts = [text.replace('name="at', f'name="{where.count} at', 1).encode() for text in maps()]
            staged = [where.stage(text) for text in texts]
            return 1e3 * count / where.deliver(*staged)

        runs, theirs = 2 if self.args.quick else 7, None
        if other:
            theirs = lambda: once(other)
        elif self.rival:
            paths = [self.base / "small" / f"{number}.xodr" for number in range(20)]
            theirs = lambda: 1e3 * len(paths) / self.rival.check_each(paths).wall
        times(name, *in_turn(runs, lambda: once(server), theirs), ratio=lambda ours, theirs: ours / theirs)

    def two_cores(self):
        pair = cores()
        head("two cores against one", "runs", "1 core", "2 cores", "2 ÷ 1", "CPU 1", "CPU 2")
        if pair is None:
            return skip("two cores against one: this process has one core")
        checkers = [("ours", self.ours)]
        if self.rival and self.rival.qcbus:
            checkers.append(("rival", self.rival.qcbus))
        one, two = pair[:1], pair
        for who, qcbus in checkers:
            for name in ("20 MB, 1.4", "20 MB, 1.8"):
                if name not in self.maps:
                    continue
                path, runs = self.maps[name]
                with_one = lambda: qcbus.check([path], self.out, one)
                with_two = lambda: qcbus.check([path], self.out, two)
                say = f"{who}: `check` of {name}, ms"
                faster = lambda one, two: one / two
                self.row(say, lambda: gain(say, *in_turn(runs, with_one, with_two), faster))
            if "1.3 MB, 1.8" in self.maps:
                say = f"{who}: a stream of 1.3 MB maps, MB/s"
                self.row(say, lambda: self.stream(say, qcbus, one, two))

    def stream(self, say, qcbus, one, two):
        """Measures many maps at once through `serve`, alternately on one core and on two."""
        text = self.maps["1.3 MB, 1.8"][0].read_bytes()
        count, runs = (12, 3) if self.args.quick else (40, 7)

        def once(where):
            staged = [where.stage(distinct(text, where.count)) for _ in range(count)]
            return len(text) * count / 1e3 / where.deliver(*staged)

        servers = [Server(qcbus, self.base, one)]
        try:
            servers.append(Server(qcbus, self.base, two))
            slow, fast, why = in_turn(runs, lambda: once(servers[0]), lambda: once(servers[1]))
        finally:
            for server in servers:
                server.stop()
        gain(say, slow, fast, why, lambda one, two: two / one)


def gain(name, one, two, why, ratio):
    """Prints a row about the gain of a second core. Both runs are ours, so a failure on two cores is a failure."""
    if not two:
        raise Failed(why)
    times(name, one, two, why, ratio)


def cores():
    """Returns two cores of this process, on different physical cores if possible."""
    ours = sorted(os.sched_getaffinity(0))

    def heart(core):
        topology = pathlib.Path(f"/sys/devices/system/cpu/cpu{core}/topology")
        names = ("physical_package_id", "core_id")
        try:
            return [(topology / name).read_text().strip() for name in names]
        except OSError:
            return [str(core)]

    others = [core for core in ours[1:] if heart(core) != heart(ours[0])] or ours[1:]
    return [ours[0], others[0]] if others else None


def machine():
    text = lambda path: pathlib.Path(path).read_text()
    model = re.search(r"^model name\s*:\s*(.*)", text("/proc/cpuinfo"), re.M)
    memory = re.search(r"^MemTotal:\s*(\d+)", text("/proc/meminfo"), re.M)
    load = " ".join(text("/proc/loadavg").split()[:3])
    cpu = model[1] if model else platform.machine()
    free = len(os.sched_getaffinity(0))
    gib = int(memory[1]) / (1 << 20) if memory else 0
    return f"{cpu}, {free} cores, {gib:.1f} GiB, Linux {platform.release()}, load {load}"


def our_program(args):
    """Returns the program to measure, and builds it if it is missing."""
    if args.qcbus:
        found = shutil.which(args.qcbus)
        return found or sys.exit(f"--qcbus: program not found: {args.qcbus}")
    program = ROOT / "target/release/qcbus"
    if not program.is_file():
        if shutil.which("cargo") is None:
            skip("everything: target/release/qcbus is missing, and no cargo to build it")
            sys.exit(0)
        subprocess.run(["cargo", "build", "--release", "-p", "qcbus"], cwd=ROOT, check=True)
    return str(program)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rival", default=os.environ.get("QCBUS_RIVAL"), help="its command line; {} is the file")
    parser.add_argument("--rival-limit", type=float, default=120.0, help="seconds for a run of the rival")
    parser.add_argument("--qcbus", help="our program (default: target/release/qcbus)")
    parser.add_argument("--cases", type=pathlib.Path, default=ROOT.parent / "shared/cases")
    parser.add_argument("--quick", action="store_true", help="fewer runs")
    args = parser.parse_args()
    # SIGTERM must also end the processes that this script started.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    adopt()
    ours = Qcbus(our_program(args))
    with tempfile.TemporaryDirectory(prefix="qcbus-rivals-") as directory:
        base = pathlib.Path(directory).resolve()
        rival = Rival(args.rival, args.rival_limit, base / "other") if args.rival else None
        if rival is None or rival.name is None:
            missing = "no --rival and no QCBUS_RIVAL" if rival is None else f"program not found: {rival.words[0]}"
            skip(f"the rival: {missing}")
            rival = None
        bench = Bench(args, base, ours, rival)
        print(machine())
        print(f"\nThe rival: `{rival.name}`" if rival else "\nNo rival.")
        for part in (bench.checks, bench.serves, bench.burst, bench.two_cores):
            part()
    print(f"\nload at the end {os.getloadavg()[0]:.1f}")
    for what, how in ((skipped, "Skipped"), (noted, "Note"), (failures, "FAILED")):
        for line in what:
            print(f"- {how}: {line}")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
