//! The modules of the test programs. Each has a `main`.

/// Programs with their endings: name, exit code (none if a signal ends it), module text.
pub const ENDS: &[(&str, Option<i32>, &str)] = &[
    (
        "normal",
        Some(0),
        r"
def main():
    print('x' * 100000)
",
    ),
    (
        "returns_text",
        Some(1),
        r"
def main():
    return 'no'
",
    ),
    (
        "exit_code",
        Some(3),
        r"
import sys
def main():
    print('a'); sys.exit(3)
",
    ),
    (
        "exit_large",
        Some(255),
        r"
import sys
def main():
    sys.exit(-1)
",
    ),
    (
        "exit_text",
        Some(1),
        r"
import sys
def main():
    print('a'); sys.exit('text')
",
    ),
    (
        "raises",
        Some(1),
        r"
def inner():
    raise ValueError('bad')
def main():
    print('a'); inner()
",
    ),
    (
        "raises_in",
        Some(1),
        r"
def main():
    try:
        1 / 0
    except Exception as e:
        raise KeyError(2) from e
",
    ),
    (
        "own_hook",
        Some(1),
        r"
import sys
sys.excepthook = lambda *it: print('hook', it[0])
def main():
    1 / 0
",
    ),
    (
        "leaves",
        Some(4),
        r"
import os
def main():
    print('lost'); os._exit(4)
",
    ),
    (
        "kills",
        None,
        r"
import os
def main():
    print('lost'); os.kill(os.getpid(), 9)
",
    ),
    (
        "segfaults",
        None,
        r"
import os
def main():
    print('a', flush=True); os.kill(os.getpid(), 11)
",
    ),
    (
        "interrupted",
        None,
        r"
def main():
    print('a'); raise KeyboardInterrupt
",
    ),
    (
        "at_end",
        Some(0),
        r"
import atexit
atexit.register(print, 'one')
def main():
    atexit.register(print, 'two')
",
    ),
    (
        "bad_at_end",
        Some(0),
        r"
import atexit
def main():
    atexit.register(lambda: 1 / 0)
",
    ),
    (
        "daemon",
        Some(0),
        r"
import threading, time
def main():
    threading.Thread(target=time.sleep, args=(600,), daemon=True).start()
    print('a')
",
    ),
    (
        "thread",
        Some(0),
        r"
import threading, time
def late():
    time.sleep(.1); print('late')
def main():
    threading.Thread(target=late).start()
    print('a')
",
    ),
    (
        "unclosed",
        Some(0),
        r"
def main():
    global f
    f = open('left', 'w'); f.write('all of it')
",
    ),
    (
        "removed",
        Some(0),
        r"
class A:
    def __del__(self): print('removed')
a = A()
def main():
    print('a')
",
    ),
    (
        "children",
        Some(0),
        r"
import subprocess
def main():
    print(subprocess.run(['sh', '-c', 'echo $QCBUS_X; pwd'], capture_output=True))
",
    ),
    (
        "pool",
        Some(0),
        r"
import multiprocessing
def main():
    with multiprocessing.get_context('fork').Pool(2) as p:
        print(p.map(abs, [-1, 2]))
",
    ),
    (
        "prints_early",
        Some(0),
        r"
import sys
print('at import'); print('also', file=sys.stderr)
def main():
    print('later')
",
    ),
    (
        "sets_early",
        Some(0),
        r"
import os
os.environ['MINE'] = 'x'
os.environ.pop('LANG')
def main():
    print(os.environ['MINE'], 'LANG' in os.environ, os.popen('echo $MINE').read())
",
    ),
    (
        "suspended",
        Some(0),
        r"
def g():
    try:
        yield 1
    finally:
        print('closed')
def main():
    global it
    it = g(); next(it)
",
    ),
    (
        "cycle",
        Some(0),
        r"
def main():
    class A:
        def __del__(self): print('gone')
    a = A(); a.a = a
",
    ),
    (
        "full",
        Some(120),
        r"
import os
def main():
    os.dup2(os.open('/dev/full', os.O_WRONLY), 1); print('x')
",
    ),
    (
        "closed",
        Some(0),
        r"
import sys
def main():
    print('a'); sys.stdout.close()
",
    ),
    (
        "replaced",
        Some(0),
        r"
import sys, io
def main():
    print('a'); sys.stdout = io.StringIO(); print('b')
",
    ),
    (
        "exit_odd",
        Some(1),
        r"
def main():
    raise SystemExit(1, 2)
",
    ),
    (
        "c_prints",
        Some(0),
        r"
import ctypes
def main():
    ctypes.CDLL(None).printf(b'by C\n')
",
    ),
    (
        "warns",
        Some(0),
        r"
import warnings
warnings.warn('early')
def main():
    warnings.warn('late')
",
    ),
    (
        "sees_main",
        Some(0),
        r"
import sys
file = sys.modules['__main__'].__file__
def main():
    print(file)
",
    ),
];

/// Programs that must not run in a fork server, with the reason. Their `main` does nothing.
pub const REFUSED: &[(&str, &str, &str)] = &[
    (
        "threads",
        r"
import threading, time
threading.Thread(target=time.sleep, args=(600,), daemon=True).start()
",
        "loading it starts threads (1 running), which would be missing in each job",
    ),
    (
        "fails",
        r"
raise ValueError('not today')
",
        "loading it fails: ValueError: not today",
    ),
    (
        "exits",
        r"
import sys
sys.exit(2)
",
        "loading it fails: SystemExit: 2",
    ),
    (
        "dies",
        r"
import os
os._exit(9)
",
        "its interpreter ended during loading",
    ),
    (
        "dies_loudly",
        r"
import os
os.write(2, b'first\nfor a reason\n')
os._exit(9)
",
        "its interpreter ended during loading: for a reason",
    ),
    (
        "reads_env",
        r"
import os
x = os.environ.get('ASAM_QC_FRAMEWORK_CONFIG_FILE')
",
        "loading it reads the variable ASAM_QC_FRAMEWORK_CONFIG_FILE, which differs between jobs",
    ),
    (
        "reads_all",
        r"
import os
x = dict(os.environ)
",
        "loading it reads its whole environment, which differs between jobs",
    ),
    (
        "reads_args",
        r"
import sys
x = sys.argv[1:]
",
        "loading it reads its arguments, which differs between jobs",
    ),
    (
        "keeps_args",
        r"
from sys import argv
",
        "loading it keeps its arguments, which differs between jobs",
    ),
    (
        "parses",
        r"
import argparse
args = argparse.ArgumentParser().parse_args()
",
        "loading it reads its arguments, which differs between jobs",
    ),
    (
        "where",
        r"
import os
x = os.path.abspath('x')
",
        "loading it reads its working directory, which differs between jobs",
    ),
    (
        "which",
        r"
import os
x = os.getpid()
",
        "loading it reads its process id, which differs between jobs",
    ),
    (
        "when",
        r"
import time
x = time.time()
",
        "loading it reads the clock, which differs between jobs",
    ),
    (
        "when_else",
        r"
from datetime import datetime
class A:
    x = datetime.now()
",
        "loading `when_else_main` calls `now`, and its result would be the same in each job",
    ),
    (
        "seeds",
        r"
import random
random.seed(1)
",
        "loading `seeds_main` calls `seed`, and its result would be the same in each job",
    ),
    (
        "logs",
        r"
import logging
logging.FileHandler('log')
",
        "loading it reads its working directory, which differs between jobs",
    ),
    (
        "writes",
        r"
open('/dev/full', 'w')
",
        "loading it writes `/dev/full`, which differs between jobs",
    ),
    (
        "reads_here",
        r"
import os
os.path.exists('x') or open('/proc/../etc/passwd').read(); open('etc/passwd')
",
        "loading it reads `etc/passwd` in its working directory, which differs between jobs",
    ),
    (
        "keeps_open",
        r"
f = open('/etc/passwd')
",
        "loading it leaves a file open",
    ),
    (
        "starts",
        r"
import subprocess
subprocess.run(['true'])
",
        "loading it starts another process (subprocess.Popen), which differs between jobs",
    ),
    (
        "floods",
        r"
print('x' * 65536, flush=True)
",
        "loading it prints more than 65536 bytes",
    ),
];
