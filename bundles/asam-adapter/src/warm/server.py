

# The second part, after `watch.py`: the import, a job, its end, requests and answers.

# ---- the import


def first_imports(source, path):
    """The statements with which a program begins, as far as they do nothing but import."""
    tree = compile(source, path, "exec", _ast.PyCF_ONLY_AST, dont_inherit=True)
    imports = []
    for at, statement in enumerate(tree.body):
        text = isinstance(statement, _ast.Expr) and isinstance(statement.value, _ast.Constant)
        if not isinstance(statement, (_ast.Import, _ast.ImportFrom)):
            if at == 0 and text:
                continue
            break
        imports.append(statement)
    if not imports:
        raise Cold("`%s` does not begin with imports, so that nothing of it can be loaded ahead" % path)
    return compile(_ast.Module(body=imports, type_ignores=[]), path, "exec", dont_inherit=True)


def script_main(path):
    """The module `__main__` as an interpreter makes it for a script."""
    from importlib.machinery import SourceFileLoader

    main = bare_main()
    main.__dict__.update(__loader__=SourceFileLoader("__main__", path), __file__=path, __cached__=None)
    return main


def bare_main():
    main = type(sys)("__main__")
    main.__dict__["__builtins__"] = sys.modules["builtins"]
    if sys.version_info < (3, 14):
        main.__dict__["__annotations__"] = {}
    return main


def load_script():
    """Loads what the script imports first; gives what runs it."""
    with open(TARGET, "rb") as file:
        source = file.read()
    if not is_safe():
        sys.path.insert(0, os.path.dirname(os.path.realpath(TARGET)))
    sys.modules["__main__"] = main = script_main(TARGET)
    code = compile(source, TARGET, "exec", dont_inherit=True)
    imports = first_imports(source, TARGET)
    return (lambda: exec(imports, main.__dict__)), (lambda: exec(code, main.__dict__))


def load_module():
    """Loads what `python -m` would run, up to the end of its first imports; gives what runs it."""
    sys.modules["__main__"] = bare_main()
    import runpy

    def ahead():
        name, spec, _ = runpy._get_module_details(TARGET)
        before = name in sys.modules
        source = spec.loader.get_source(name)
        if source is None:
            raise Cold("the module `%s` has no source" % name)
        parts = {"__name__": name, "__package__": spec.parent, "__spec__": spec, "__file__": spec.origin}
        exec(first_imports(source, spec.origin), parts)
        if name in sys.modules and not before:
            raise Cold("the module `%s` is imported by one that it imports" % name)

    def run():
        if not is_safe():
            sys.path.insert(0, os.getcwd())
        runpy._run_module_as_main(TARGET)

    return ahead, run


def is_safe():
    return sys.flags.isolated or getattr(sys.flags, "safe_path", False)


STALE = {"now", "utcnow", "today", "seed", "default_rng", "uuid1", "uuid4", "urandom", "token_hex"}
STALE |= {"mkdtemp", "mkstemp", "TemporaryDirectory", "NamedTemporaryFile", "random", "randint", "choice", "shuffle"}


def refuse_what_is_stale():
    """A time, a seed, a random number that a module takes when it is loaded would be the same in each job."""
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        loader = getattr(getattr(module, "__spec__", None), "loader", None)
        if not file or is_library(file) or not hasattr(loader, "get_code"):
            continue
        code = loader.get_code(name)
        if code is None or not names_at_once(code) & STALE:
            continue
        # The names alone may be imports, or methods that are only named.
        tree = compile(loader.get_source(name) or "", file, "exec", _ast.PyCF_ONLY_AST, dont_inherit=True)
        for called in calls_at_once(tree):
            if called in STALE:
                raise Cold("loading `%s` calls `%s`, whose result would be that of another job" % (name, called))


def names_at_once(code):
    """The names in what runs when a module is loaded: its own statements, and those of its classes."""
    names = set(code.co_names)
    for inner in code.co_consts:
        if isinstance(inner, type(code)) and not inner.co_flags & 1:  # CO_OPTIMIZED: a function
            names |= names_at_once(inner)
    return names


def calls_at_once(node):
    """The names of what is called when a module is loaded."""
    if isinstance(node, _ast.Call):
        yield getattr(node.func, "attr", getattr(node.func, "id", None))
    for field in node._fields:
        if field == "body" and isinstance(node, (_ast.FunctionDef, _ast.AsyncFunctionDef, _ast.Lambda)):
            continue
        value = getattr(node, field, None)
        for inner in value if isinstance(value, list) else (value,):
            if isinstance(inner, _ast.AST):
                yield from calls_at_once(inner)


PRINTS = 64 << 10  # what each job prints again


def open_files():
    return set(os.listdir("/proc/self/fd"))


def load():
    """Imports what can be imported ahead; gives what runs the program, and what the import has printed and set."""
    sys.argv = Arguments([TARGET])
    before = open_files()
    variables = dict(os.environb)
    ahead, run = load_script() if KIND == "script" else load_module()
    end = watching()
    try:
        ahead()
    except Cold:
        raise
    except BaseException as error:
        raise Cold("loading it fails: %s: %s" % (type(error).__name__, error)) from None
    finally:
        end()
    if watch.seen is None and sys.getrefcount(sys.argv) > 2:
        watch.seen = "keeps its arguments"
    if watch.seen is not None:
        raise Cold("loading it %s, which is another thing in each job" % watch.seen)
    if len(open_files()) > len(before):
        raise Cold("loading it leaves a file open")
    refuse_what_is_stale()
    refuse_threads()
    sys.stdout.flush()
    sys.stderr.flush()
    return run, (printed(1), printed(2)), changes(variables, dict(os.environb))


def changes(before, after):
    """What the import has changed in its environment: so it does in that of each job."""
    return {it: after.get(it) for it in before.keys() | after.keys() if before.get(it) != after.get(it)}


def printed(fd):
    """What was printed so far, into a file in memory."""
    end = os.lseek(fd, 0, os.SEEK_CUR)
    if end > PRINTS:
        raise Cold("loading it prints more than %d bytes" % PRINTS)
    return os.pread(fd, end, 0)


def refuse_threads():
    """What threads hold is lost in a fork. Some libraries (OpenBLAS) end theirs before one, and start them again when needed."""
    pid = raw_fork()
    if pid == 0:
        os._exit(0)
    os.waitpid(pid, 0)
    threads = len(os.listdir("/proc/self/task"))
    for _ in range(50):
        if threads == 1:
            return
        time.sleep(0.002)
        threads = len(os.listdir("/proc/self/task"))
    raise Cold("loading it starts threads (%d run), and they would be missing in each job" % (threads - 1))


def raw_fork():
    """A fork without the warning that newer versions give while there are threads: they are looked for here."""
    warnings = sys.modules.get("warnings")
    filters = None if warnings is None else warnings.filters[:]
    if warnings is not None:
        warnings.simplefilter("ignore")
    try:
        return os.fork()
    finally:
        if warnings is not None:
            warnings.filters[:] = filters
            getattr(warnings, "_filters_mutated", getattr(warnings, "_filters_mutated_lock_held", int))()


# ---- one job


class Standard:
    """Makes the three standard streams as new, as the same objects: modules may have kept them."""

    def __init__(self):
        streams = (sys.__stdin__, sys.__stdout__, sys.__stderr__)
        self.kept = [(it, it.encoding, it.errors, it.write_through) for it in streams]

    def renew(self):
        for fd, (text, encoding, errors, through) in enumerate(self.kept):
            writes = fd > 0
            buffer = text.buffer
            buffered = hasattr(buffer, "raw")  # not with `-u`
            raw = buffer.raw if buffered else buffer
            mode = "wb" if writes else "rb"
            raw.__init__(fd, mode, closefd=False)
            if raw.seekable() != self.can_seek(fd):
                # It has remembered that of what was there before, and keeps to it: a pipe in place of a file.
                raw = type(raw)(fd, mode, closefd=False)
                buffer = buffer if buffered else raw
            raw.name = ("<stdin>", "<stdout>", "<stderr>")[fd]
            if buffered:
                buffer.__init__(raw, self.size(fd))
            by_line = not through and (raw.isatty() or fd == 2)
            text.__init__(buffer, encoding, errors, "\n", by_line, through)
            text.mode = "w" if writes else "r"

    def can_seek(self, fd):
        try:
            os.lseek(fd, 0, os.SEEK_CUR)
        except OSError:
            return False
        return True

    def size(self, fd):
        block = os.fstat(fd).st_blksize
        if sys.version_info >= (3, 14):
            return max(min(block, 8 << 20), 128 << 10)
        return block if block > 1 else 8192


class Loaded:
    """The program, up to the end of its first imports."""

    def __init__(self):
        streams = manner()
        self.run, self.prints, self.changed = load()
        if manner() != streams:
            raise Cold("loading it changes how its standard streams are written")
        self.standard = Standard()


def manner():
    streams = (sys.__stdin__, sys.__stdout__, sys.__stderr__)
    return [(it.buffer, it.encoding, it.errors, it.line_buffering, it.write_through) for it in streams]


class Job:
    """What a request asks for."""

    def __init__(self, request, fds):
        fields = request.split(b"\0")
        self.cwd = fields[0]
        self.limits = [int(it) if it else None for it in fields[1:4]]
        count = int(fields[4])
        self.argv = [os.fsdecode(it) for it in fields[5 : 5 + count]]
        self.environment = dict(it.split(b"=", 1) for it in fields[5 + count :] if it)
        self.fds = fds

    def enter(self, changed):
        """All that a plain start does before the program runs."""
        for fd, given in enumerate(self.fds):
            os.dup2(given, fd, inheritable=True)
        for given in self.fds:
            os.close(given)
        os.chdir(self.cwd)
        for which, limit in zip(LIMITS, self.limits):
            if limit is not None:
                resource.setrlimit(which, (limit, limit))
        self.take_environment(changed)

    def take_environment(self, changed):
        # An interpreter in the locale "C" sets this one for its children.
        coerced = os.environb.get(b"LC_CTYPE")
        if coerced is not None:
            self.environment.setdefault(b"LC_CTYPE", coerced)
        for name, value in changed.items():
            if value is None:
                self.environment.pop(name, None)
            else:
                self.environment[name] = value
        os.environb.clear()
        os.environb.update(self.environment)


def renew_library():
    """What Python's own modules and NumPy have taken when they were loaded. (`random` is seeded anew by every fork.)"""
    processes = sys.modules.get("multiprocessing.process")
    if hasattr(processes, "ORIGINAL_DIR"):
        processes.ORIGINAL_DIR = os.getcwd()
    logging = sys.modules.get("logging")
    if logging is not None and hasattr(logging, "_startTime"):
        logging._startTime = time.time_ns() if isinstance(logging._startTime, int) else time.time()
    mtrand = sys.modules.get("numpy.random.mtrand")
    generator = getattr(getattr(mtrand, "_rand", None), "_bit_generator", None)
    if getattr(generator, "_seed_seq", None) is not None:  # by chance, not by a number that the module gave
        mtrand.seed()


def begin(job, loaded, ready):
    """In the new process: becomes the job."""
    try:
        os.setsid()
        job.enter(loaded.changed)
        loaded.standard.renew()
        sys.__stdout__.buffer.write(loaded.prints[0])
        sys.__stderr__.buffer.write(loaded.prints[1])
        sys.__stderr__.flush()
        renew_library()
        sys.argv = ([TARGET] if KIND == "script" else ["-m"]) + job.argv
        if hasattr(sys, "orig_argv"):
            flags = sys.orig_argv[1 : sys.orig_argv.index("-c")]
            program = [TARGET] if KIND == "script" else ["-m", TARGET]
            sys.orig_argv = sys.orig_argv[:1] + flags + program + job.argv
    except BaseException as error:
        os.write(ready, ("%s: %s" % (type(error).__name__, error)).encode("utf-8", "replace")[:4000])
        os._exit(127)
    os.close(ready)


class Ending:
    """The end of a job.

    A plain run takes down everything that it has loaded, by which objects are told (`__del__`) and files that nobody has
    closed get what was written to them. That takes longer than many a job, and is left out where nobody can tell: where no
    object is left that wants to be told, no thread, and no handler that was there before this file.
    """

    def __init__(self):
        self.whole = atexit._ncallbacks() > 0
        self.code = None
        self.know_streams()
        self.exit = c_function("exit")
        # Registered first, it is called last.
        atexit.register(self.last)

    def know_streams(self):
        """Which objects the standard streams are made of: they want to be told of the end, and are flushed instead."""
        self.standard = set()
        for text in (sys.__stdin__, sys.__stdout__, sys.__stderr__):
            self.standard |= {id(text), id(text.buffer), id(getattr(text.buffer, "raw", None))}

    def see_loaded(self):
        self.whole = self.whole or self.exit is None or self.wanted()

    def wanted(self):
        """Whether an object wants to be told of the end. Those that were loaded are no longer among these in a job."""
        wants = {}
        for it in gc.get_objects():
            kind = type(it)
            if id(kind) not in wants:
                wants[id(kind)] = hasattr(kind, "__del__")
            if wants[id(kind)] and not self.has_ended(it):
                return True
        return False

    def has_ended(self, it):
        if id(it) in self.standard:
            return True
        if type(it) is GENERATOR:
            suspended = getattr(it, "gi_suspended", None)
            begun = it.gi_frame is not None and it.gi_frame.f_lasti != -1
            return not (begun if suspended is None else suspended)
        return isinstance(it, STREAM) and it.closed

    def last(self):
        if self.code is None or self.whole or _thread._count() or self.wanted() or not flushed():
            gc.unfreeze()
            return
        sys.modules["__main__"].__dict__.clear()
        gc.collect()
        self.exit(self.code)


GENERATOR = type(it for it in ())
STREAM = type(sys.__stdout__).__mro__[-2]


def flushed():
    try:
        for stream in (sys.stdout, sys.stderr, sys.__stdout__, sys.__stderr__):
            if stream is not None and not getattr(stream, "closed", False):
                stream.flush()
    except BaseException:
        return False
    return True


def c_function(name):
    """A function of the C library that takes a number: `exit` flushes what extensions have printed, and `os._exit` does not."""
    try:
        import _ctypes

        address = _ctypes.dlsym(_ctypes.dlopen(None, 2), name)
    except (ImportError, AttributeError, OSError):
        return None
    return lambda number: _ctypes.call_function(address, (number,))


def be(run, ending):
    """Runs the program. What it ends with is what the interpreter ends with."""
    try:
        run()
        ending.code = 0
        return
    except SystemExit as end:
        code = 0 if end.code is None else end.code
        # What is no number is printed at the end.
        ending.code = code & 0xFF if type(code) is int and abs(code) < 1 << 31 else None
        raise
    except BaseException as error:
        # Without the lines of this file.
        kind, failed = type(error), error.with_traceback(error.__traceback__.tb_next.tb_next)
    sys.excepthook(kind, failed, failed.__traceback__)
    del failed
    if issubclass(kind, KeyboardInterrupt):
        # The interpreter kills itself by the signal, when it has taken everything down; it has been told already.
        sys.excepthook = lambda *_: None
        raise kind
    ending.code = 1
    raise SystemExit(1)


# ---- requests and answers


class Line:
    """The socket: lengths and fields."""

    def __init__(self):
        self.socket = _socket.socket(fileno=os.dup(0))
        null = os.open(os.devnull, os.O_RDONLY)
        os.dup2(null, 0)
        os.close(null)

    def send(self, *fields):
        data = b"\0".join(it if isinstance(it, bytes) else os.fsencode(str(it)) for it in fields)
        self.socket.sendall(len(data).to_bytes(4, "little") + data)

    def receive(self):
        """A request and its descriptors; the process ends when nobody asks any more."""
        room = _socket.CMSG_SPACE(3 * 4)
        head, control, _, _ = self.socket.recvmsg(4, room)
        fds = []
        for level, kind, data in control:
            if (level, kind) == (_socket.SOL_SOCKET, _socket.SCM_RIGHTS):
                fds += [int.from_bytes(data[at : at + 4], sys.byteorder) for at in range(0, len(data) - 3, 4)]
        head += self.exactly(4 - len(head)) if head else b""
        if not head:
            os._exit(0)
        return Job(self.exactly(int.from_bytes(head, "little")), fds)

    def exactly(self, count):
        data = b""
        while len(data) < count:
            more = self.socket.recv(count - len(data))
            if not more:
                os._exit(0)
            data += more
        return data


class Server:
    """Forks and reaps."""

    def __init__(self, line, loaded):
        self.line = line
        self.loaded = loaded
        self.running = {}

    def serve(self):
        """Comes back in each new process, and never in this one."""
        while True:
            poll = select.poll()
            poll.register(self.line.socket.fileno(), select.POLLIN)
            for fd in self.running:
                poll.register(fd, select.POLLIN)
            for fd, _ in poll.poll():
                if fd in self.running:
                    self.reap(fd)
                elif self.fork(self.line.receive()):
                    return

    def reap(self, fd):
        pid = self.running.pop(fd)
        os.close(fd)
        _, status = os.waitpid(pid, 0)
        self.line.send("end", pid, status)

    def fork(self, job):
        """Whether this is the new process."""
        entered, ready = os.pipe()
        pid = os.fork()
        if pid == 0:
            os.close(entered)
            self.line.socket.close()
            for fd in self.running:
                os.close(fd)
            begin(job, self.loaded, ready)
            return True
        os.close(ready)
        for fd in job.fds:
            os.close(fd)
        failure = os.read(entered, 4096)
        os.close(entered)
        if failure:
            os.waitpid(pid, 0)
            self.line.send("failed", failure)
        else:
            self.running[os.pidfd_open(pid)] = pid
            self.line.send("pid", pid)
        return False


def files():
    """What the loaded modules were read from, and the directories in which others would have been found before them."""
    found = {TARGET if KIND == "script" else sys.executable, os.path.realpath(sys.executable)}
    found.add(os.path.join(sys.prefix, "pyvenv.cfg"))
    for module in list(sys.modules.values()):
        file = getattr(module, "__file__", None)
        if isinstance(file, str) and os.path.isabs(file) and not is_library(file):
            found.add(file)
    found.update(it for it in sys.path if not is_library(it + os.sep))
    return sorted(it for it in found if os.path.exists(it))


def prepare(line):
    if sys.version_info < (3, 9) or not hasattr(os, "pidfd_open"):
        raise Cold("its interpreter is Python %d.%d on a system without what is needed of 3.9" % sys.version_info[:2])
    if MEMORY:
        resource.setrlimit(resource.RLIMIT_DATA, (int(MEMORY), resource.getrlimit(resource.RLIMIT_DATA)[1]))
    ending = Ending()
    loaded = Loaded()
    gc.collect()
    ending.see_loaded()
    gc.freeze()
    return loaded.run, ending, Server(line, loaded)


def start():
    """Gives what runs the program, in each new process."""
    line = Line()
    try:
        run, ending, server = prepare(line)
    except Cold as why:
        line.send("cold", str(why))
        os._exit(0)
    except BaseException as error:
        line.send("cold", "it cannot be loaded ahead: %s: %s" % (type(error).__name__, error))
        os._exit(0)
    line.send("ready", *files())
    server.serve()
    # They are renewed in each.
    ending.know_streams()
    return run, ending


be(*start())
