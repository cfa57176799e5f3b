//! Tests with modules that misbehave on purpose. In each case, every checker of the module is
//! failed and gives the reason. No process and no directory of the module remains.

use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Timeout that ends a hanging test. It is long enough for the slowest machine.
const WATCHDOG: Duration = Duration::from_secs(240);

/// Beginning of every guest script: location of the input, and a function that writes a result.
const MANNERS: &str = include_str!("guests/manners.sh");

/// A guest module and its files.
struct Guest {
    dir: tempfile::TempDir,
    /// Text in the command line of every process that it starts and leaves behind.
    mark: String,
}

impl Guest {
    /// Creates a guest that answers sample runs correctly and executes this script for a real file.
    fn doing(script: &str) -> Guest {
        let dir = tempfile::tempdir().unwrap();
        let mark = format!("{}.{}", 86_400 + std::process::id(), unique());
        let text = format!("#!/bin/sh\nMARK={mark}\n{MANNERS}\n{script}\n");
        let program = dir.path().join("guest");
        std::fs::write(&program, text).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        std::fs::write(
            dir.path().join("real.xodr"),
            include_str!("../../src/samples/sample.xodr"),
        )
        .unwrap();
        Guest { dir, mark }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn command(&self, limits: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qcbus-asam-adapter"));
        command
            .args(["--name", "guest", "--kind", "xodr", "--exec"])
            .arg(self.at("guest"))
            .arg("--scratch")
            .arg(self.at("scratch"))
            .args(limits)
            .arg(self.at("real.xodr"))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// Lets the guest check the file. Returns the exit code and the whole output.
    fn judge(&self, limits: &[&str]) -> (Option<i32>, String) {
        let output = within(self.command(limits).spawn().unwrap());
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said).into_owned();
        self.is_gone(&said);
        (output.status.code(), said)
    }

    /// Asserts that no process and no directory of the guest remains.
    fn is_gone(&self, said: &str) {
        let begin = Instant::now();
        while !processes_with(&self.mark).is_empty() {
            assert!(begin.elapsed() < WATCHDOG, "no process may remain; {said}");
            std::thread::yield_now();
        }
        assert_eq!(self.rooms(), Vec::<PathBuf>::new(), "{said}");
    }

    fn rooms(&self) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(self.at("scratch")).into_iter().flatten();
        entries.map(|it| it.unwrap().path()).collect()
    }

    /// Asserts that both its checkers have failed with these reasons.
    fn is_open(&self, limits: &[&str], why: &[&str]) {
        let (code, said) = self.judge(limits);
        assert_eq!(code, Some(3), "{said}");
        for checker in ["one", "two"] {
            let line = said
                .lines()
                .find(|it| it.contains(&format!(": {checker} failed: ")));
            let line = line.unwrap_or_else(|| panic!("{checker} must have failed: {said}"));
            for why in why {
                assert!(line.contains(why), "{why}: {said}");
            }
        }
    }
}

fn unique() -> u32 {
    use std::sync::atomic::{AtomicU32, Ordering};
    static NEXT: AtomicU32 = AtomicU32::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

fn within(mut child: Child) -> Output {
    let id = child.id();
    let (done, is_done) = std::sync::mpsc::channel::<()>();
    let watchdog = std::thread::spawn(move || {
        if is_done.recv_timeout(WATCHDOG).is_err() {
            let pid = rustix::process::Pid::from_raw(id.cast_signed()).unwrap();
            let _ = rustix::process::kill_process(pid, rustix::process::Signal::KILL);
        }
    });
    let stderr = child.stderr.take();
    let errors = std::thread::spawn(move || {
        let mut text = Vec::new();
        if let Some(mut stderr) = stderr {
            std::io::Read::read_to_end(&mut stderr, &mut text).unwrap();
        }
        text
    });
    let mut output = child.wait_with_output().unwrap();
    output.stderr = errors.join().unwrap();
    drop(done);
    watchdog.join().unwrap();
    output
}

/// Returns the living processes that have this text in their command line.
fn processes_with(mark: &str) -> Vec<i32> {
    let entries = std::fs::read_dir("/proc").unwrap().flatten();
    let pids = entries.filter_map(|it| it.file_name().to_str()?.parse::<i32>().ok());
    let has = |pid: &i32| {
        let read = |name: &str| std::fs::read(format!("/proc/{pid}/{name}")).unwrap_or_default();
        let line = String::from_utf8_lossy(&read("cmdline")).into_owned();
        let stat = String::from_utf8_lossy(&read("stat")).into_owned();
        line.contains(mark) && !stat.contains(") Z ")
    };
    pids.filter(has).collect()
}

#[test]
fn result_of_well_behaved_module_is_accepted() {
    let guest = Guest::doing("polite");
    assert_eq!(guest.judge(&[]), (Some(0), String::new()));
    let guest = Guest::doing(
        r#"{ begin; checker one completed "$(issue 1 "wrong in $input")"; checker two completed; end; } > "$result""#,
    );
    let (code, said) = guest.judge(&[]);
    assert_eq!(code, Some(1), "{said}");
    let real = guest.at("real.xodr");
    let text = format!(
        "error: wrong in {} [guest.example:xodr:1.0.0:rule]",
        real.display()
    );
    assert!(said.contains(&text), "{said}");
}

#[test]
fn module_gets_original_bytes_and_private_directories() {
    let guest = Guest::doing(
        r#"cmp "$input" "REAL" || exit 4
        [ "$PWD" = "$ASAM_QC_FRAMEWORK_WORKING_DIR" ] || exit 5
        case "$input" in "${PWD%/work}"/input/*) ;; *) exit 6;; esac
        [ -z "$QCBUS_LAUNCH$QCBUS_SANDBOX" ] || exit 7
        [ "$MINE" = "a b" ] || exit 8
        [ -w "$TMPDIR" ] || exit 9
        polite"#,
    );
    let real = guest.at("real.xodr");
    let script = std::fs::read_to_string(guest.at("guest")).unwrap();
    std::fs::write(
        guest.at("guest"),
        script.replace("REAL", real.to_str().unwrap()),
    )
    .unwrap();
    assert_eq!(
        guest.judge(&["--env", "MINE=a b"]),
        (Some(0), String::new())
    );
}

#[test]
fn missing_result_despite_exit_code_0_is_failure() {
    Guest::doing("echo I am done; exit 0").is_open(&[], &["no result", "I am done"]);
}

#[test]
fn truncated_result_is_failure() {
    let half = r#"polite; head -c 250 "$result" > half; mv half "$result""#;
    Guest::doing(half).is_open(&[], &["cannot be read"]);
    Guest::doing(": > \"$result\"").is_open(&[], &["cannot be read"]);
}

#[test]
fn result_about_another_file_is_failure() {
    let other = r#"{ begin /somewhere/else.xodr; checker one completed; checker two completed; end; } > "$result""#;
    Guest::doing(other).is_open(&[], &["about another file", "/somewhere/else.xodr"]);
}

#[test]
fn result_older_than_its_run_is_failure() {
    Guest::doing("polite; touch -d 2001-01-01 \"$result\"").is_open(&[], &["older than its run"]);
}

#[test]
fn result_that_is_no_regular_file_is_failure() {
    Guest::doing("mkfifo \"$result\"").is_open(&[], &["not a file"]);
    Guest::doing("polite; mv \"$result\" x; ln -s x \"$result\"").is_open(&[], &["not a file"]);
    Guest::doing("mkdir \"$result\"").is_open(&[], &["not a file"]);
}

#[test]
fn crash_is_reported_with_last_output() {
    Guest::doing("polite; exit 7").is_open(&[], &["exit code 7", "printed nothing"]);
    Guest::doing("polite; echo oh no >&2; kill -SEGV $$").is_open(&[], &["signal 11", "oh no"]);
    let many = "i=0; while [ $i -lt 2000 ]; do echo line $i; i=$((i+1)); done; exit 1";
    Guest::doing(many).is_open(&[], &["exit code 1", "line 1999"]);
}

#[test]
fn module_beyond_time_limit_is_killed() {
    Guest::doing("polite; while :; do :; done")
        .is_open(&["--seconds", "1"], &["did not finish within 1 s"]);
    Guest::doing("polite; kill -STOP $$")
        .is_open(&["--seconds", "1"], &["did not finish within 1 s"]);
    let deaf = "polite; trap '' TERM INT HUP; while :; do sleep 1; done";
    Guest::doing(deaf).is_open(&["--seconds", "1"], &["did not finish within 1 s"]);
}

#[test]
fn module_beyond_output_limit_is_killed() {
    Guest::doing("polite; yes").is_open(&["--output-mb", "1"], &["printed more than 1 MB"]);
    Guest::doing("polite; yes >&2").is_open(&["--output-mb", "1"], &["printed more than 1 MB"]);
    let file = "polite; exec yes > \"$result\"";
    Guest::doing(file).is_open(&["--output-mb", "1"], &["file of more than 1 MB"]);
}

#[test]
fn module_beyond_memory_limit_is_killed() {
    // The script doubles a text until the memory limit is reached.
    let leak = "polite; x=xxxxxxxxxxxxxxxx; while :; do x=$x$x; done";
    Guest::doing(leak).is_open(
        &["--memory-mb", "64", "--seconds", "60"],
        &["the module `guest`"],
    );
}

#[test]
fn descendants_of_module_end_with_it() {
    let children = r#"polite
        i=0; while [ $i -lt 20 ]; do setsid sh -c "sleep $MARK & sleep $MARK" </dev/null & i=$((i+1)); done
        setsid sh -c "trap '' TERM; (sleep $MARK &) ; sleep $MARK" & exit 0"#;
    let guest = Guest::doing(children);
    assert_eq!(
        guest.judge(&[]),
        (Some(0), String::new()),
        "the result counts"
    );
    let crashed = children.replace("exit 0", "exit 9");
    Guest::doing(&crashed).is_open(&[], &["exit code 9"]);
}

#[test]
fn module_with_too_many_processes_is_killed() {
    let many =
        r#"polite; i=0; while [ $i -lt 400 ]; do setsid sleep $MARK & i=$((i+1)); done; wait"#;
    Guest::doing(many).is_open(&["--seconds", "60"], &["more than 256 processes"]);
}

#[test]
fn result_of_module_that_changed_its_document_is_failure() {
    let change = r#"polite; chmod u+w "$input"; echo "<!-- -->" >> "$input""#;
    Guest::doing(change).is_open(&[], &["changed its copy of", "real.xodr"]);
    Guest::doing("polite; rm \"$input\"").is_open(&[], &["changed its copy of"]);
}

#[test]
fn module_that_removes_its_directory_has_no_result() {
    Guest::doing("polite; cd /; rm -rf \"${ASAM_QC_FRAMEWORK_WORKING_DIR%/work}\"; exit 0")
        .is_open(&[], &["the module `guest`"]);
}

#[test]
fn scratch_directory_without_permissions_is_removed() {
    let lock = "polite; mkdir -p a/b/c; echo x > a/b/c/d; chmod 0 a/b/c a/b a; exit 0";
    assert_eq!(Guest::doing(lock).judge(&[]), (Some(0), String::new()));
}

#[test]
fn missing_checker_is_open_and_others_are_not() {
    let guest = Guest::doing(r#"{ begin; checker two completed; end; } > "$result""#);
    let (code, said) = guest.judge(&[]);
    assert_eq!(code, Some(3), "{said}");
    assert!(
        said.contains("one failed: the module's result does not mention this checker"),
        "{said}"
    );
    assert!(!said.contains("two failed"), "{said}");
}

#[test]
fn findings_of_unknown_checker_are_kept() {
    let guest = Guest::doing(
        r#"{ begin; checker one completed; checker two completed; checker three completed "$(issue 1 "new and wrong")"; end; } > "$result""#,
    );
    let (code, said) = guest.judge(&[]);
    assert!(said.contains("new and wrong"), "{said}");
    assert!(
        said.contains("did not have when it was started: `three`"),
        "{said}"
    );
    assert_eq!(code, Some(1), "an error rejects the file: {said}");
    let quiet = Guest::doing(
        r#"{ begin; checker one completed; checker two completed; checker three completed; end; } > "$result""#,
    );
    assert_eq!(
        quiet.judge(&[]).0,
        Some(3),
        "the checker was unknown at the start of the module"
    );
}

#[test]
fn error_status_fails_checker_and_skipped_status_does_not() {
    let guest =
        Guest::doing(r#"{ begin; checker one error; checker two skipped; end; } > "$result""#);
    let (code, said) = guest.judge(&[]);
    assert_eq!(code, Some(3), "{said}");
    assert!(
        said.contains("one failed: the module reports that it failed"),
        "{said}"
    );
    assert!(!said.contains("two"), "skipped is a valid answer: {said}");
}

#[test]
fn module_that_describes_no_checkers_is_refused() {
    let guest = Guest::doing("polite");
    for script in ["exit 0", "exit 3", "kill -9 $$"] {
        std::fs::write(
            guest.at("guest"),
            format!("#!/bin/sh\necho because\n{script}\n"),
        )
        .unwrap();
        let (code, said) = guest.judge(&[]);
        assert_eq!(code, Some(5), "{said}");
        assert!(
            said.contains("cannot be used as a bundle") && said.contains("because"),
            "{said}"
        );
        assert!(
            said.contains("`guest`, `xodrBundle`") && said.contains("\"application\""),
            "the section may have another name: {said}"
        );
    }
}

/// Returns the id of a child of this process that has this word in its command line.
fn child_of(parent: u32, word: &str) -> Option<i32> {
    let children =
        std::fs::read_to_string(format!("/proc/{parent}/task/{parent}/children")).ok()?;
    let pids = children.split_whitespace().filter_map(|it| it.parse().ok());
    let mut pids = pids.filter(|pid: &i32| {
        let line = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        line.split(|it| *it == 0).any(|it| it == word.as_bytes())
    });
    pids.next()
}

fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begin.elapsed() < WATCHDOG, "{what}");
        std::thread::yield_now();
    }
}

fn kill(pid: i32) {
    let pid = rustix::process::Pid::from_raw(pid).unwrap();
    rustix::process::kill_process(pid, rustix::process::Signal::KILL).unwrap();
}

#[test]
fn killed_process_leaves_no_module_process_or_directory() {
    if !Path::new("/proc/thread-self/children").exists() {
        eprintln!("skipped: this kernel does not list the children of a process");
        return;
    }
    // The module starts processes whose command lines have the mark and no other text of the guest.
    let script = "sleep $MARK & sleep $MARK";
    for victim in ["the bus process", "the runner"] {
        let guest = Guest::doing(script);
        let child = guest.command(&[]).spawn().unwrap();
        until("it runs", || {
            (processes_with(&guest.mark).len() >= 2).then_some(())
        });
        let runner = until("the runner", || child_of(child.id(), "--runner"));
        match victim {
            "the runner" => kill(runner),
            _ => kill(child.id().cast_signed()),
        }
        let output = within(child);
        assert!(!output.status.success(), "{victim}");
        let is_module = |pid: &i32| processes_with(&guest.mark).contains(pid);
        if victim == "the bus process" {
            until("no process is left", || {
                processes_with(&guest.mark).is_empty().then_some(())
            });
            until("no directory is left", || {
                guest.rooms().is_empty().then_some(())
            });
            continue;
        }
        // Only a broker ends the processes that the module's shell started, as its descendants. No
        // broker runs here, so the test kills them.
        processes_with(&guest.mark)
            .into_iter()
            .filter(is_module)
            .for_each(kill);
        assert_eq!(guest.rooms().len(), 1, "{victim}");
        std::fs::write(guest.at("guest"), format!("#!/bin/sh\n{MANNERS}\npolite")).unwrap();
        assert_eq!(
            guest.judge(&[]).0,
            Some(0),
            "the next run begins with an empty directory"
        );
    }
}
