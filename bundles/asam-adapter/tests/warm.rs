//! A forked run has the same result as a plain run, but it is faster.
//!
//! Every program here runs once in a shell with its command, and again in a fork server. Both runs
//! must write, print and end the same.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot continue panics, and a skipped test is reported"
)]

#[path = "warm/programs.rs"]
mod programs;
#[path = "warm/workshop.rs"]
mod workshop;

use programs::{ENDS, REFUSED};
use workshop::{Outcome, Workshop, end_of, wait_for};

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::os::fd::AsFd;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use qcbus_asam_adapter::warm::{Limits, Run, Server, SpawnError, recognise};
use rustix::process::{Pid, Signal, WaitOptions, kill_process, set_child_subreaper, waitpid};

/// Everything that a program can observe of its start.
const LOOKS: &str = "
import os, sys, logging
logging.basicConfig(format='%(message)s', level=logging.INFO)
def main():
    import __main__
    print(sys.argv, sys.orig_argv[1:] if hasattr(sys, 'orig_argv') else '')
    print(sys.path, sys.flags, sys.executable, sys.prefix)
    print(sorted(it for it in os.environ.items() if it[0] not in ('SHLVL', '_', 'OLDPWD')))
    print(os.getcwd(), __name__)
    print({name: str(it).split(' at ')[0] for name, it in vars(__main__).items() if name != '__builtins__'})
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        print(stream, stream.line_buffering, stream.write_through, stream.buffer, stream.buffer.raw, stream.fileno())
    print(repr(sys.stdin.read()), sorted(os.listdir('/proc/self/fd'))[:-1])
    logging.info('logged')
    print('to stderr', file=sys.stderr)
    open('written', 'w').write('by it')
";

#[test]
fn program_sees_same_environment_on_fork_server() {
    let Some(shop) = Workshop::new() else { return };
    shop.console("looks", LOOKS);
    let seen = shop.same("looks -c $ASAM_QC_FRAMEWORK_CONFIG_FILE \"${QCBUS_X}\" 'x y'");
    assert!(seen.status.success(), "{seen:?}");
    assert!(
        seen.stdout.contains("'-c', '/a', 'b/c.xml', '1', 'x y']"),
        "{}",
        seen.stdout
    );
    assert_eq!(seen.stderr, "logged\nto stderr\n");
    assert_eq!(seen.files["written"], "by it");
    // The program is called by its full path, by its interpreter and as a module.
    let (script, python) = (shop.path("bin/looks"), shop.python.display().to_string());
    shop.same(&format!("{} a", script.display()));
    shop.same(&format!("{python} -u {} a", script.display()));
    shop.module(
        "runs.py",
        &format!("{LOOKS}\nif __name__ == '__main__':\n    main()\n"),
    );
    let seen = shop.same(&format!("{python} -s -m runs a b"));
    assert!(
        seen.stdout.contains("/lib/runs.py', 'a', 'b']"),
        "{}",
        seen.stdout
    );
}

#[test]
fn every_shebang_form_is_recognised() {
    let Some(shop) = Workshop::new() else { return };
    shop.module("form_main.py", "def main():\n    print('here')\n");
    let python = shop.python.display();
    for first in [
        format!("#!{python} -sE"),
        format!("#! {python}"),
        format!("#!/bin/sh\n'''exec' \"{python}\" \"$0\" \"$@\"\n' '''"),
        format!("#!/bin/sh\n'''exec' {python} \"$0\" \"$@\"\n' '''"),
        "#!/usr/bin/env python3".to_owned(),
    ] {
        // `-E` ignores PYTHONPATH.
        let path = shop.path("lib");
        let body = "import sys\nimport os\nif __name__ == '__main__':\n    sys.path.append(PATH)\n    \
                    from form_main import main\n    sys.exit(main())\n";
        let body = body.replace("PATH", &format!("{path:?}"));
        shop.program("form", &format!("{first}\n{body}"));
        assert_eq!(shop.same("form").stdout, "here\n", "{first}");
    }
}

#[test]
fn every_exit_is_the_same_on_fork_server() {
    let Some(shop) = Workshop::new() else { return };
    for (name, code, module) in ENDS {
        shop.console(name, module);
        let outcome = shop.same(name);
        assert_eq!(outcome.status.code(), *code, "{name}: {outcome:?}");
    }
    let left = shop.same("unclosed");
    assert_eq!(left.files["left"], "all of it");
    assert_eq!(shop.same("kills").status.signal(), Some(9));
    assert!(shop.same("raises").stderr.starts_with("Traceback"));
    assert_eq!(shop.same("at_end").stdout, "two\none\n");
    assert_eq!(shop.same("prints_early").stdout, "at import\nlater\n");
}

#[test]
fn script_body_runs_again_for_each_job() {
    let Some(shop) = Workshop::new() else { return };
    let python = shop.python.display();
    for (name, body) in [
        (
            "guarded",
            "import json\ndef f():\n    print(json.dumps([1]))\nif __name__ == '__main__':\n    f()\n",
        ),
        (
            "guarded_other",
            "import json\nif '__main__' == __name__:\n    print('yes')\nelse:\n    print('no')\n",
        ),
        (
            "bare",
            "\"\"\"What it does.\"\"\"\nfrom __future__ import annotations\nimport sys\nprint(__doc__, sys.argv)\nopen('made', 'a').write('x')\n",
        ),
        ("raises", "import os\n\n\nraise OSError('at top')\n"),
    ] {
        let script = shop.program(name, body);
        let outcome = shop.same(&format!("{python} {} 1", script.display()));
        assert!(
            outcome.stdout.len() + outcome.stderr.len() > 3,
            "{name}: {outcome:?}"
        );
    }
}

#[test]
fn jobs_do_not_see_state_of_earlier_jobs() {
    let Some(shop) = Workshop::new() else { return };
    let module = "import os, sys, random, tempfile\nseen = []\nmark = object()\ndef main():\n    \
        seen.append(os.getpid())\n    os.environ['LEFT'] = '1'\n    sys.path.append('/left')\n    os.umask(0o77)\n    \
        print(len(seen), sys.path.count('/left'), random.random(), tempfile.mktemp(), flush=True)\n    \
        print(os.getpid() == os.getsid(0) == os.getpgid(0), file=sys.stderr)\n    os.chdir('/')\n    sys.stdout.close()\n";
    shop.console("globals", module);
    let environment = shop.environment(&[]);
    let mut server = shop.start("globals").unwrap();
    let outcomes: Vec<Outcome> = (0..3)
        .map(|_| shop.warm(&mut server, &environment))
        .collect();
    for outcome in &outcomes {
        assert!(outcome.stdout.starts_with("1 1 "), "{outcome:?}");
        assert!(outcome.stderr.starts_with("True"), "{outcome:?}");
    }
    assert_ne!(
        outcomes[0].stdout, outcomes[1].stdout,
        "the random values differ in each job"
    );
    assert_ne!(
        outcomes[1].stdout, outcomes[2].stdout,
        "the random values differ in each job"
    );
}

#[test]
fn jobs_run_in_parallel_and_can_be_killed() {
    let Some(shop) = Workshop::new() else { return };
    shop.console("sleeps", "import time\ndef main():\n    time.sleep(600)\n");
    let mut server = shop.start("sleeps").unwrap();
    let (environment, cwd, null) = (
        shop.environment(&[]),
        shop.path("run"),
        File::open("/dev/null").unwrap(),
    );
    let out = File::create("/dev/null").unwrap();
    let run = Run {
        environment: &environment,
        cwd: &cwd,
        limits: Limits::default(),
        stdin: null.as_fd(),
        stdout: out.as_fd(),
        stderr: out.as_fd(),
    };
    let mut pids: Vec<u32> = (0..4).map(|_| server.spawn(&run).unwrap()).collect();
    assert!(server.ended().unwrap().is_none());
    for pid in &pids {
        rustix::process::kill_process_group(process(*pid), Signal::KILL).unwrap();
    }
    let mut ended: Vec<u32> = (0..4)
        .map(|_| {
            let (pid, status) = end_of(&mut server);
            assert_eq!(status.signal(), Some(9));
            pid
        })
        .collect();
    ended.sort_unstable();
    pids.sort_unstable();
    assert_eq!(ended, pids);
}

fn process(pid: u32) -> Pid {
    Pid::from_raw(pid.cast_signed()).unwrap()
}

#[test]
fn job_process_gets_limits_of_its_job() {
    let Some(shop) = Workshop::new() else { return };
    shop.console("limits", "import resource as r\ndef main():\n    print([r.getrlimit(it) for it in (r.RLIMIT_DATA, r.RLIMIT_FSIZE)])\n");
    let mut server = shop.start("limits").unwrap();
    let (environment, cwd) = (shop.environment(&[]), shop.path("run"));
    let limits = Limits {
        memory: Some(1 << 30),
        file_size: Some(5000),
    };
    let outcome = shop.within(|stdin, stdout, stderr| {
        let run = Run {
            environment: &environment,
            cwd: &cwd,
            limits,
            stdin: stdin.as_fd(),
            stdout: stdout.as_fd(),
            stderr: stderr.as_fd(),
        };
        server.spawn(&run).unwrap();
        end_of(&mut server).1
    });
    assert_eq!(outcome.stdout, "[(1073741824, 1073741824), (5000, 5000)]\n");
    // A run without limits is not affected by earlier limits.
    assert!(!shop.warm(&mut server, &environment).stdout.contains("5000"));
    // A missing directory is a failure of this job, not of the server.
    let null = File::open("/dev/null").unwrap();
    let run = Run {
        environment: &environment,
        cwd: Path::new("/nowhere/at/all"),
        limits,
        stdin: null.as_fd(),
        stdout: null.as_fd(),
        stderr: null.as_fd(),
    };
    let failed = server.spawn(&run).unwrap_err();
    assert!(
        matches!(&failed, SpawnError::Cold(why) if why.to_string().contains("/nowhere/at/all")),
        "{failed}"
    );
    assert!(shop.warm(&mut server, &environment).status.success());
}

#[test]
fn module_that_would_behave_differently_is_run_plainly() {
    let Some(shop) = Workshop::new() else { return };
    for (name, module, why) in REFUSED {
        shop.console(name, &format!("{module}\ndef main():\n    pass\n"));
        let got = shop.why_cold(name);
        assert_eq!(got, *why, "{name}");
    }
    // A name without a call is accepted.
    shop.console("named", "from datetime import datetime\nclass A:\n    seed = None\n    def x(self): return datetime.now()\ndef main(now=datetime.now):\n    print('a')\n");
    assert_eq!(shop.same("named").stdout, "a\n");
}

#[test]
fn unsupported_command_is_refused_with_reason() {
    let Some(shop) = Workshop::new() else { return };
    let python = shop.python.display();
    shop.program("shell", "#!/bin/sh\necho hello\n");
    shop.program("late", &format!("#!{python}\nx = 1\nimport json\n"));
    shop.program("broken", &format!("#!{python}\nimport (\n"));
    shop.program("spaced", &format!("#!{python} -s -E\nimport json\n"));
    shop.program("split", "#!/usr/bin/env -S python3 -s\nimport json\n");
    shop.program("python3.99", "#!/bin/sh\nexec python3 \"$@\"\n");
    shop.program(
        "shim",
        &format!("#!{}\nimport json\n", shop.path("bin/python3.99").display()),
    );
    shop.module("loops.py", "import loops_too\n");
    shop.module("loops_too.py", "import loops\n");
    for (command, why) in [
        ("shell", "/bin/shell` is not a Python program"),
        ("/bin/ls", "/bin/ls` is not a Python program"),
        ("no-such-program", "`no-such-program` is not on the PATH"),
        ("./late", "use its absolute path"),
        (
            "late",
            "/bin/late` does not begin with imports, so it cannot be loaded in advance",
        ),
        ("broken", "it cannot be loaded in advance: SyntaxError: "),
        (
            "spaced",
            "its interpreter has the option `-s -E`, which only a plain run supports",
        ),
        ("split", "/bin/split` is not a Python program"),
        (
            "shim",
            "is a script, which may choose an interpreter for each job",
        ),
        ("late > file", "its command needs a shell because of `>`"),
        ("cd / && late", "its command needs a shell because of `&`"),
        (
            "X=1 late",
            "its command begins with something that only a shell can run",
        ),
        (
            "exec late",
            "its command begins with something that only a shell can run",
        ),
        (
            "PYTHON",
            "it names no script or module that is the same for each job",
        ),
        (
            "PYTHON $QCBUS_X",
            "it names no script or module that is the same for each job",
        ),
        (
            "PYTHON script.py",
            "the script `script.py` depends on the directory of each job; use its absolute path",
        ),
        (
            "PYTHON /no/script.py",
            "the script `/no/script.py` is not a file",
        ),
        (
            "PYTHON -c pass",
            "its interpreter has the option `-c`, which only a plain run supports",
        ),
        (
            "PYTHON -X dev x.py",
            "its interpreter has the option `-X`, which only a plain run supports",
        ),
        ("PYTHON -m a/b", "it names no module after -m"),
        (
            "PYTHON -m no_such_module",
            "loading it fails: ImportError: No module named no_such_module",
        ),
        (
            "PYTHON -m loops",
            "the module `loops` is in a cycle of imports",
        ),
    ] {
        let got = shop.why_cold(&command.replace("PYTHON", &python.to_string()));
        assert!(got.contains(why), "{command}: {got}");
    }
}

#[test]
fn job_with_different_environment_is_run_plainly() {
    let Some(shop) = Workshop::new() else { return };
    shop.module("other.py", "import json\nprint('ran')\n");
    let mut server = shop
        .start(&format!("{} -m other $QCBUS_X", shop.python.display()))
        .unwrap();
    let why = |server: &mut Server, environment: &[(OsString, OsString)]| {
        let (cwd, null) = (shop.path("run"), File::open("/dev/null").unwrap());
        let run = Run {
            environment,
            cwd: &cwd,
            limits: Limits::default(),
            stdin: null.as_fd(),
            stdout: null.as_fd(),
            stderr: null.as_fd(),
        };
        server.spawn(&run).unwrap_err().to_string()
    };
    let other = shop.environment(&[("TZ", "UTC")]);
    assert_eq!(
        why(&mut server, &other),
        "$TZ of this job differs from its value at load time"
    );
    let less = &shop.environment(&[])[..2];
    assert_eq!(
        why(&mut server, less),
        "$LANG of this job differs from its value at load time"
    );
    let stars = shop.environment(&[("QCBUS_X", "*")]);
    assert!(why(&mut server, &stars).contains("put it in double quotes"));
    fs::write(shop.path("run").join("json.py"), "").unwrap();
    let plain = shop.environment(&[]);
    assert_eq!(
        why(&mut server, &plain),
        "the directory of this job has `json.py`, which Python would find before installed modules"
    );
    assert_eq!(shop.warm(&mut server, &plain).stdout, "ran\n");
}

#[test]
fn upgraded_module_makes_fork_server_outdated() {
    let Some(shop) = Workshop::new() else { return };
    shop.module("part.py", "VALUE = 'old'\n");
    shop.console(
        "upgraded",
        "import part\ndef main():\n    print(part.VALUE)\n",
    );
    let environment = shop.environment(&[]);
    let mut server = shop.start("upgraded").unwrap();
    assert_eq!(shop.warm(&mut server, &environment).stdout, "old\n");
    shop.module("part.py", "VALUE = 'newer'\n");
    let (cwd, null) = (shop.path("run"), File::open("/dev/null").unwrap());
    let run = Run {
        environment: &environment,
        cwd: &cwd,
        limits: Limits::default(),
        stdin: null.as_fd(),
        stdout: null.as_fd(),
        stderr: null.as_fd(),
    };
    let outdated = server.spawn(&run).unwrap_err();
    assert!(matches!(outdated, SpawnError::Outdated(_)), "{outdated}");
    assert!(
        outdated
            .to_string()
            .ends_with("/lib/part.py` has changed since it was loaded")
    );
    drop(server);
    let mut server = shop.start("upgraded").unwrap();
    assert_eq!(shop.warm(&mut server, &environment).stdout, "newer\n");
    // Python would find this module before an installed one.
    fs::write(shop.path("bin/part.py"), "VALUE = 'nearer'\n").unwrap();
    let outdated = server.spawn(&run).unwrap_err();
    assert!(
        outdated
            .to_string()
            .ends_with("/bin` has changed since it was loaded"),
        "{outdated}"
    );
    let mut server = shop.start("upgraded").unwrap();
    assert_eq!(shop.warm(&mut server, &environment).stdout, "nearer\n");
    fs::remove_file(shop.path("bin/upgraded")).unwrap();
    assert!(matches!(server.spawn(&run), Err(SpawnError::Outdated(_))));
}

#[test]
fn killed_fork_server_leaves_its_jobs_to_subreaper() {
    let Some(shop) = Workshop::new() else { return };
    set_child_subreaper(Some(rustix::process::getpid())).unwrap();
    shop.console(
        "waits",
        "import sys\ndef main():\n    sys.stdin.read(1)\n    sys.exit(7)\n",
    );
    let mut server = shop.start("waits").unwrap();
    let (environment, cwd) = (shop.environment(&[]), shop.path("run"));
    let (theirs, ours) = std::io::pipe().unwrap();
    let out = File::create("/dev/null").unwrap();
    let run = Run {
        environment: &environment,
        cwd: &cwd,
        limits: Limits::default(),
        stdin: theirs.as_fd(),
        stdout: out.as_fd(),
        stderr: out.as_fd(),
    };
    let pid = server.spawn(&run).unwrap();
    kill_process(process(server.id()), Signal::KILL).unwrap();
    wait_for(&server);
    let gone = server.ended().unwrap_err();
    assert_eq!(gone.kind(), std::io::ErrorKind::UnexpectedEof);
    assert!(gone.to_string().ends_with("has ended"), "{gone}");
    assert!(matches!(server.spawn(&run), Err(SpawnError::Gone(_))));
    drop(server);
    // The job continues, and the subreaper receives its exit status.
    drop(ours);
    let (_, status) = waitpid(Some(process(pid)), WaitOptions::empty())
        .unwrap()
        .unwrap();
    assert_eq!(status.exit_status(), Some(7));
    // A new server replaces the killed one.
    let mut server = shop.start("waits").unwrap();
    assert_eq!(shop.warm(&mut server, &environment).status.code(), Some(7));
}

/// Compares runs of ASAM's own modules and prints the time of each. `QCBUS_ASAM_VENV` names the
/// environment; without it, `target/asam-venv`.
#[test]
fn asam_modules_give_same_results_on_fork_server() {
    let venv = std::env::var_os("QCBUS_ASAM_VENV").map(PathBuf::from);
    let venv = venv
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/asam-venv"));
    let Some(shop) = Workshop::new() else { return };
    let (road, scenario) = (
        "<OpenDRIVE><header revMajor='1' revMinor='7'/></OpenDRIVE>",
        "<OpenSCENARIO><FileHeader revMajor='1' revMinor='2'/></OpenSCENARIO>",
    );
    for (program, bundle, ends, text) in [
        ("qc_opendrive", "xodrBundle", "xodr", road),
        ("qc_openscenario", "xoscBundle", "xosc", scenario),
    ] {
        let program = venv.join("bin").join(program);
        if !program.exists() {
            println!(
                "SKIPPED: there is no {}; pip install asam-qc-opendrive asam-qc-openscenarioxml",
                program.display()
            );
            continue;
        }
        let input = shop.path("input").with_extension(ends);
        fs::write(&input, text).unwrap();
        let config = shop.path("config.xml");
        fs::write(
            &config,
            format!(
                "<Config><Param name='InputFile' value='{}'/><CheckerBundle application='{bundle}'>\
             <Param name='resultFile' value='result.xqar'/></CheckerBundle></Config>",
                input.display()
            ),
        )
        .unwrap();
        compare(&shop, &program, config.to_str().unwrap());
    }
}

fn compare(shop: &Workshop, program: &Path, config: &str) {
    let command = format!(
        "{} -c \"$ASAM_QC_FRAMEWORK_CONFIG_FILE\"",
        program.display()
    );
    let environment = shop.environment(&[("ASAM_QC_FRAMEWORK_CONFIG_FILE", config)]);
    shop.plain(&command, &environment);
    let begun = Instant::now();
    let plain = shop.plain(&command, &environment);
    let cold = begun.elapsed();
    let mut server = shop.start(&command).unwrap();
    let begun = Instant::now();
    let warm = shop.warm(&mut server, &environment);
    println!(
        "{}: plain {cold:?}, warm {:?}",
        program.display(),
        begun.elapsed()
    );
    assert!(plain.status.success(), "{plain:?}");
    assert_eq!(warm.status, plain.status, "{warm:?}");
    assert_eq!(warm.files, plain.files);
    assert!(warm.files["result.xqar"].contains("checkerId"), "{warm:?}");
    // Log lines begin with the time, so it is removed.
    let without_times = |text: &str| -> Vec<String> {
        text.lines()
            .map(|line| line.split_once(" - ").unwrap_or(("", line)).1.to_owned())
            .collect()
    };
    assert_eq!(without_times(&warm.stderr), without_times(&plain.stderr));
    assert_eq!(OsStr::new(&warm.stdout), OsStr::new(&plain.stdout));
}

#[test]
fn fork_server_ends_with_its_parent() {
    let Some(shop) = Workshop::new() else { return };
    shop.console("lives", "def main():\n    pass\n");
    let starts = || {
        let server = shop.start("lives").unwrap();
        let pid = server.id();
        // The server is not dropped, as when its caller is killed. The kernel must end it.
        std::mem::forget(server);
        pid
    };
    let pid = std::thread::scope(|scope| scope.spawn(starts).join().unwrap());
    let (_, status) = waitpid(Some(process(pid)), WaitOptions::empty())
        .unwrap()
        .unwrap();
    assert_eq!(status.terminating_signal(), Some(9));
}

#[test]
fn slow_import_times_out() {
    let Some(shop) = Workshop::new() else { return };
    shop.console(
        "slow",
        "import time\ntime.sleep(600)\ndef main():\n    pass\n",
    );
    let environment = shop.environment(&[]);
    let entry = recognise("slow", &environment[0].1).unwrap();
    let patience = Duration::from_millis(300);
    let why = Server::start(&entry, &environment, &Limits::default(), patience).unwrap_err();
    assert_eq!(why.to_string(), "it was not loaded within 300ms");
}
