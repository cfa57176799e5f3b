"""Fork server: an interpreter that has imported a module and forks a process for each job.

It is run by `python -c` with its socket as stdin. Before a job it runs the first imports of the program, in a job the rest.
If that would differ from a plain run, it reports the reason (`cold`), and the program is run plainly.

This first part has its own imports and the watch over the program's imports. `server.py` follows in the same text.

Modules that only this file needs are removed from `sys.modules` again, because a program may have a module of the same
name beside it.
"""

import sys

if sys.path and sys.path[0] == "":
    del sys.path[0]  # `-c` searches the working directory first

at_start = set(sys.modules)
import _ast
import _socket
import _thread
import atexit
import gc
import os
import resource
import select
import time

for name in ("resource", "select"):
    if name not in at_start and name not in sys.builtin_module_names:
        del sys.modules[name]

_, KIND, TARGET, MEMORY = sys.argv
VARYING = ("ASAM_QC_FRAMEWORK_", "QCBUS_")
SHELLS = ("PWD", "OLDPWD", "SHLVL", "_", "TMPDIR")
LIMITS = (resource.RLIMIT_DATA, resource.RLIMIT_FSIZE)
STANDARD = os.path.dirname(os.__file__) + os.sep


class Cold(Exception):
    """The reason why the program cannot be loaded in advance."""


# ---- watch over values that an import reads and that differ between jobs


def varies(name):
    if isinstance(name, bytes):
        name = os.fsdecode(name)
    return name in SHELLS or name.startswith(VARYING)


def is_library(file):
    return file.startswith((STANDARD, "<frozen")) and "-packages" + os.sep not in file


def by_known():
    """Checks whether the caller is a package whose reads are known to have no effect on jobs. For its own tests, NumPy
    reads its process id and runs a program that detects features of the processor."""
    frame = sys._getframe(2)
    while frame is not None and (is_library(frame.f_code.co_filename) or frame.f_code.co_filename == "<string>"):
        frame = frame.f_back
    file = "" if frame is None else frame.f_code.co_filename
    return any("-packages/%s/" % package in file for package in ("numpy", "scipy"))


class Watch:
    """Records the first action of an import that would differ between jobs or must be repeated in each job."""

    on = True
    seen = None

    def note(self, what):
        if self.on and self.seen is None and not by_known():
            self.seen = what

    def audit(self, event, given):
        if not self.on:
            return
        if event == "open":
            self.opened(*given)
        elif event in ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.fork", "os.forkpty"):
            self.note("starts another process (%s)" % event)
        elif event in ("socket.connect", "socket.bind", "socket.sendto"):
            self.note("uses the network (%s)" % event)
        elif event == "os.chdir":
            self.note("changes its working directory")
        elif event in ("os.mkdir", "os.remove", "os.rename", "os.rmdir", "os.link", "os.symlink", "os.truncate"):
            if not any(compiled(it) for it in given):
                self.note("changes files (%s)" % event)

    def opened(self, path, mode, flags):
        if not isinstance(path, (str, bytes)) or compiled(path):
            return
        path = os.fsdecode(path)
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND) and path != os.devnull:
            self.note("writes `%s`" % path)
        elif not os.path.isabs(path):
            self.note("reads `%s` in its working directory" % path)


def compiled(path):
    return isinstance(path, (str, bytes)) and "__pycache__" in os.fsdecode(path)


watch = Watch()


def looks_for_proxies():
    """Checks whether `urllib` reads all variables, as it does even to open a file. It uses only those of proxies."""
    frame = sys._getframe(2)
    while frame is not None and is_library(frame.f_code.co_filename):
        if frame.f_code.co_name == "getproxies_environment":
            return True
        frame = frame.f_back
    return False


class Environment(os._Environ):
    """The environment during the import."""

    def __getitem__(self, name):
        if varies(name) and not looks_for_proxies():
            watch.note("reads the variable %s" % os.fsdecode(name))
        return super().__getitem__(name)

    def __iter__(self):
        if not looks_for_proxies():
            watch.note("reads its whole environment")
        return super().__iter__()


class Arguments(list):
    """The arguments during the import."""

    def __getitem__(self, at):
        watch.note("reads its arguments")
        return super().__getitem__(at)

    def __iter__(self):
        watch.note("reads its arguments")
        return super().__iter__()

    def __len__(self):
        watch.note("reads its arguments")
        return super().__len__()


class Watched:
    """Replaces a function and records its calls. It is no function itself, because a class would turn it into a method."""

    def __init__(self, module, name, what, of_library):
        self.module, self.name, self.what, self.of_library = module, name, what, of_library
        self.plain = getattr(module, name)
        setattr(module, name, self)

    def __call__(self, *given, **named):
        caller = sys._getframe(1).f_code.co_filename
        # The values of `multiprocessing` are renewed in each job.
        if watch.on and (self.of_library or not is_library(caller)) and not caller.endswith("/multiprocessing/process.py"):
            watch.note(self.what)
        return self.plain(*given, **named)

    def put_back(self):
        setattr(self.module, self.name, self.plain)


def watching():
    """Starts the watch and returns the function that ends it."""
    sys.addaudithook(watch.audit)
    os.environ.__class__ = os.environb.__class__ = Environment
    undo = [Watched(os, name, "reads its working directory", True) for name in ("getcwd", "getcwdb")]
    undo += [Watched(os, name, "reads its process id", False) for name in ("getpid", "getppid")]
    clocks = ("time", "time_ns", "localtime", "gmtime", "strftime", "ctime")
    undo += [Watched(time, name, "reads the clock", False) for name in clocks]

    def end():
        watch.on = False
        os.environ.__class__ = os.environb.__class__ = os._Environ
        for it in undo:
            it.put_back()

    return end
