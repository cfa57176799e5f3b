

# Second part, after `watch.py`: the import, a job, its end, requests and answers.

# ---- the import


def first_imports(source, path):
    """Returns the import statements at the beginning of a program."""
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
        raise Cold("`%s` does not begin with imports, so it cannot be loaded in advance" % path)
    return compile(_ast.Module(body=imports, type_ignores=[]), path, "exec", dont_inherit=True)


def script_main(path):
    """Returns the module `__main__` as an interpreter creates it for a script."""
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
    """Returns the functions that run the first imports of a script and the script."""
    with open(TARGET, "rb") as file:
        source = file.read()
    if not is_safe():
        sys.path.insert(0, os.path.dirname(os.path.realpath(TARGET)))
    sys.modules["__main__"] = main = script_main(TARGET)
    code = compile(source, TARGET, "exec", dont_inherit=True)
    imports = first_imports(source, TARGET)
    return (lambda: exec(imports, main.__dict__)), (lambda: exec(code, main.__dict__))


def load_module():
    """Returns the functions that run the first imports of the module of `python -m` and the module."""
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
            raise Cold("the module `%s` is in a cycle of imports" % name)

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
    """Refuses modules that read a time, a seed or a random number at import, because it would be the same in each job."""
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        loader = getattr(getattr(module, "__spec__", None), "loader", None)
        if not file or is_library(file) or not hasattr(loader, "get_code"):
            continue
        code = loader.get_code(name)
        if code is None or not names_at_once(code) & STALE:
            continue
        # The names alone may be imports or methods that are not called.
        tree = compile(loader.get_source(name) or "", file, "exec", _ast.PyCF_ONLY_AST, dont_inherit=True)
        for called in calls_at_once(tree):
            if called in STALE:
                raise Cold("loading `%s` calls `%s`, and its result would be the same in each job" % (name, called))


def names_at_once(code):
    """Returns the names in code that runs at import: the statements of the module and of its classes."""
    names = set(code.co_names)
    for inner in code.co_consts:
        if isinstance(inner, type(code)) and not inner.co_flags & 1:  # CO_OPTIMIZED: a function
            names |= names_at_once(inner)
    return names


def calls_at_once(node):
    """Yields the names of the functions that are called at import."""
    if isinstance(node, _ast.Call):
        yield getattr(node.func, "attr", getattr(node.func, "id", None))
    for field in node._fields:
        if field == "body" and isinstance(node, (_ast.FunctionDef, _ast.AsyncFunctionDef, _ast.Lambda)):
            continue
        value = getattr(node, field, None)
        for inner in value if isinstance(value, list) else (value,):
            if isinstance(inner, _ast.AST):
                yield from calls_at_once(inner)


PRINTS = 64 << 10  # maximum output of an import in bytes; each job prints it again


def open_files():
    return set(os.listdir("/proc/self/fd"))


def load():
    """Runs the first imports. Returns the function that runs the program, and the output and variables of the imports."""
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
        raise Cold("loading it %s, which differs between jobs" % watch.seen)
    if len(open_files()) > len(before):
        raise Cold("loading it leaves a file open")
    refuse_what_is_stale()
    refuse_threads()
    sys.stdout.flush()
    sys.stderr.flush()
    return run, (printed(1), printed(2)), changes(variables, dict(os.environb))


def changes(before, after):
    """Returns the changes of the import to its environment. Each job repeats them."""
    return {it: after.get(it) for it in before.keys() | after.keys() if before.get(it) != after.get(it)}


def printed(fd):
    """Returns the output so far, which is in a file in memory."""
    end = os.lseek(fd, 0, os.SEEK_CUR)
    if end > PRINTS:
        raise Cold("loading it prints more than %d bytes" % PRINTS)
    return os.pread(fd, end, 0)


def refuse_threads():
    """Refuses threads, because they are lost in a fork. Some libraries (OpenBLAS) end theirs before a fork and start them
    again when needed."""
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
    raise Cold("loading it starts threads (%d running), which would be missing in each job" % (threads - 1))


def raw_fork():
    """Forks without the warning of newer versions about threads, because the caller checks for threads."""
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
    """Renews the three standard streams. They stay the same objects, because modules may refer to them."""

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
                # The object caches whether the earlier file was seekable, but a pipe may have replaced a file.
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
    """The program after its first imports."""

    def __init__(self):
        streams = manner()
        self.run, self.prints, self.changed = load()
        if manner() != streams:
            raise Cold("loading it changes the settings of its standard streams")
        self.standard = Standard()


def manner():
    streams = (sys.__stdin__, sys.__stdout__, sys.__stderr__)
    return [(it.buffer, it.encoding, it.errors, it.line_buffering, it.write_through) for it in streams]


class Job:
    """A request for a job."""

    def __init__(self, request, fds):
        fields = request.split(b"\0")
        self.cwd = fields[0]
        self.limits = [int(it) if it else None for it in fields[1:3]]
        count = int(fields[3])
        self.argv = [os.fsdecode(it) for it in fields[4 : 4 + count]]
        self.environment = dict(it.split(b"=", 1) for it in fields[4 + count :] if it)
        self.fds = fds

    def enter(self, changed):
        """Sets up the process as a plain start does before the program runs."""
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
        # An interpreter in the locale "C" sets this variable for its children.
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
    """Renews the values that Python's own modules and NumPy read at import. (Every fork seeds `random` again.)"""
    processes = sys.modules.get("multiprocessing.process")
    if hasattr(processes, "ORIGINAL_DIR"):
        processes.ORIGINAL_DIR = os.getcwd()
    logging = sys.modules.get("logging")
    if logging is not None and hasattr(logging, "_startTime"):
        logging._startTime = time.time_ns() if isinstance(logging._startTime, int) else time.time()
    mtrand = sys.modules.get("numpy.random.mtrand")
    generator = getattr(getattr(mtrand, "_rand", None), "_bit_generator", None)
    if getattr(generator, "_seed_seq", None) is not None:  # seeded randomly, not with a number of the module
        mtrand.seed()


def begin(job, loaded, ready):
    """Turns the new process into the job."""
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

    A plain run destroys everything that it has loaded: objects are finalized (`__del__`), and open files are flushed. That
    can take longer than the job. It is skipped if it has no visible effect: no object with a finalizer is left, no thread,
    and no exit handler that was registered before this file.
    """

    def __init__(self):
        self.whole = atexit._ncallbacks() > 0
        self.code = None
        self.know_streams()
        self.exit = c_function("exit")
        # Registered first, it is called last.
        atexit.register(self.last)

    def know_streams(self):
        """Collects the objects of the standard streams. They have finalizers, but are flushed instead."""
        self.standard = set()
        for text in (sys.__stdin__, sys.__stdout__, sys.__stderr__):
            self.standard |= {id(text), id(text.buffer), id(getattr(text.buffer, "raw", None))}

    def see_loaded(self):
        self.whole = self.whole or self.exit is None or self.wanted()

    def wanted(self):
        """Checks whether an object has a finalizer. In a job, the loaded objects are frozen and not checked."""
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
    """Returns a function of the C library with one number. `exit` flushes the output of extensions, `os._exit` does not."""
    try:
        import _ctypes

        address = _ctypes.dlsym(_ctypes.dlopen(None, 2), name)
    except (ImportError, AttributeError, OSError):
        return None
    return lambda number: _ctypes.call_function(address, (number,))


def be(run, ending):
    """Runs the program. The interpreter ends with the same exit code or exception."""
    try:
        run()
        ending.code = 0
        return
    except SystemExit as end:
        code = 0 if end.code is None else end.code
        # An exit code that is no number is printed at the end.
        ending.code = code & 0xFF if type(code) is int and abs(code) < 1 << 31 else None
        raise
    except BaseException as error:
        # The traceback must not contain lines of this file.
        kind, failed = type(error), error.with_traceback(error.__traceback__.tb_next.tb_next)
    sys.excepthook(kind, failed, failed.__traceback__)
    del failed
    if issubclass(kind, KeyboardInterrupt):
        # The interpreter kills itself with the signal at its end. The exception is already printed.
        sys.excepthook = lambda *_: None
        raise kind
    ending.code = 1
    raise SystemExit(1)


# ---- requests and answers


class Line:
    """The socket. Messages have a length and fields."""

    def __init__(self):
        self.socket = _socket.socket(fileno=os.dup(0))
        null = os.open(os.devnull, os.O_RDONLY)
        os.dup2(null, 0)
        os.close(null)

    def send(self, *fields):
        data = b"\0".join(it if isinstance(it, bytes) else os.fsencode(str(it)) for it in fields)
        self.socket.sendall(len(data).to_bytes(4, "little") + data)

    def receive(self):
        """Receives a request and its descriptors. The process ends if the socket is closed."""
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
    """Forks and reaps the processes of jobs."""

    def __init__(self, line, loaded):
        self.line = line
        self.loaded = loaded
        self.running = {}

    def serve(self):
        """Serves requests. Returns in each new process and never in this one."""
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
        """Forks a process for a job. Returns true in the new process."""
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
    """Returns the files of the loaded modules, and the directories that could contain other modules of the same names."""
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
        raise Cold("its interpreter is Python %d.%d; it needs 3.9 or later and `os.pidfd_open`" % sys.version_info[:2])
    if MEMORY:
        resource.setrlimit(resource.RLIMIT_DATA, (int(MEMORY), resource.getrlimit(resource.RLIMIT_DATA)[1]))
    ending = Ending()
    loaded = Loaded()
    gc.collect()
    ending.see_loaded()
    gc.freeze()
    return loaded.run, ending, Server(line, loaded)


def start():
    """Starts the server. Returns in each new process with the function that runs the program."""
    line = Line()
    try:
        run, ending, server = prepare(line)
    except Cold as why:
        line.send("cold", str(why))
        os._exit(0)
    except BaseException as error:
        line.send("cold", "it cannot be loaded in advance: %s: %s" % (type(error).__name__, error))
        os._exit(0)
    line.send("ready", *files())
    server.serve()
    # The streams are renewed in each process.
    ending.know_streams()
    return run, ending


be(*start())
