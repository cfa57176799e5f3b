use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::process::Command;
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::Duration;

use super::*;

const WATCHDOG: Duration = Duration::from_secs(60);

/// Runs `work` on another thread, because it might never end.
fn in_time<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let (done, wait) = channel();
    std::thread::spawn(move || done.send(work()));
    wait.recv_timeout(WATCHDOG)
        .expect("watchdog timeout: the work has not ended")
}

fn fifo(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status().unwrap();
    assert!(made.success());
}

#[test]
fn only_regular_files_are_opened_without_waiting() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fifo(&at("pipe.xodr"));
    symlink("pipe.xodr", at("link.xodr")).unwrap();
    let _socket = UnixListener::bind(at("socket.xodr")).unwrap();
    std::fs::create_dir(at("directory.xodr")).unwrap();
    let special = ["pipe.xodr", "link.xodr", "socket.xodr"].map(at);
    let kernels = ["/dev/zero", "/dev/tty", "/proc/self/status", "/proc/kmsg"].map(PathBuf::from);
    for path in special.into_iter().chain(kernels) {
        let opened = in_time({
            let path = path.clone();
            move || open(&path).map(|_| ())
        });
        // The check needs no read permission: it also refuses files that only root can read.
        let refused = matches!(&opened, Err(Refused::Special(_)));
        assert!(refused, "{}: {opened:?}", path.display());
        let read = in_time(move || read(&path, 10)).unwrap_err();
        assert!(
            crate::is_for_good(&read),
            "the error is permanent: {read:?}"
        );
        assert!(!is_of_the_moment(&read));
    }
    assert!(matches!(
        open(&at("directory.xodr")),
        Err(Refused::Directory)
    ));
    let nothing = open(&at("nothing.xodr")).map(|_| ());
    let is_missing = |it: &io::Error| it.kind() == io::ErrorKind::NotFound;
    assert!(
        matches!(&nothing, Err(Refused::System(it)) if is_missing(it)),
        "{nothing:?}"
    );
}

#[test]
fn file_is_read_up_to_the_limit() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.xodr");
    let bytes: Vec<u8> = (0..9 << 20).map(|at: u32| at as u8).collect();
    std::fs::write(&path, &bytes).unwrap();
    let len = bytes.len() as u64;
    assert!(read(&path, len).unwrap() == bytes);
    let too_large = read(&path, len - 1).unwrap_err();
    assert_eq!(too_large.kind(), io::ErrorKind::FileTooLarge);
    assert_eq!(too_large.to_string(), "it has more than 9437183 bytes");
    let (mut file, data) = open(&path).unwrap();
    assert_eq!(data.len(), len);
    let mut some = Vec::new();
    read_on(&path, &mut file, 5 << 20, &mut some).unwrap();
    assert!(some == bytes[..5 << 20]);
}

#[test]
fn temporary_errors_differ_from_errors_of_the_file() {
    let of = |error: Errno| is_of_the_moment(&error.into());
    for error in [
        Errno::MFILE,
        Errno::IO,
        Errno::STALE,
        Errno::AGAIN,
        Errno::NOTCONN,
    ] {
        assert!(of(error), "{error:?}");
    }
    for error in [
        Errno::ACCESS,
        Errno::NOENT,
        Errno::LOOP,
        Errno::NAMETOOLONG,
        Errno::ISDIR,
    ] {
        assert!(!of(error), "{error:?}");
    }
    assert!(is_of_the_moment(&io::ErrorKind::TimedOut.into()));
}

/// Starts a connection that goes on until `end` is dropped.
fn hang(io_watchdog: &Arc<IoWatchdog>, owner: Option<u64>, path: &Path) -> Hanging {
    let ((end, ended), (begun, begins)) = (channel::<()>(), channel());
    let (io_watchdog, path) = (io_watchdog.clone(), path.to_path_buf());
    let thread = std::thread::spawn(move || {
        let attendance = match owner {
            Some(owner) => io_watchdog.attend(owner),
            None => io_watchdog.attend_for_good(),
        };
        let access = Access::begin(&path).unwrap();
        begun.send(()).unwrap();
        let _ = ended.recv();
        drop(access);
        let further = metadata(Path::new("/")).map(|_| ()).map_err(|it| it.kind());
        (attendance.was_given_up(), further)
    });
    begins.recv_timeout(WATCHDOG).unwrap();
    Hanging { end, thread }
}

struct Hanging {
    end: std::sync::mpsc::Sender<()>,
    thread: std::thread::JoinHandle<(bool, Result<(), io::ErrorKind>)>,
}

impl Hanging {
    fn end(self) -> (bool, Result<(), io::ErrorKind>) {
        drop(self.end);
        self.thread.join().unwrap()
    }
}

#[test]
fn hanging_watcher_is_reported_and_resumes_on_an_answer() {
    let io_watchdog = Arc::new(IoWatchdog::default());
    let path = Path::new("/farm/hung");
    let watcher = hang(&io_watchdog, None, path);
    let overdue = io_watchdog.overdue(Duration::ZERO);
    assert_eq!((overdue[0].owner, &*overdue[0].path), (None, path));
    assert_eq!(io_watchdog.hanging(), [path]);
    let attendance = io_watchdog.attend(8);
    assert_eq!(metadata(path).unwrap_err().kind(), io::ErrorKind::TimedOut);
    drop(attendance);

    let (was_given_up, further) = watcher.end();
    assert!(!was_given_up);
    assert_eq!(further, Ok(()), "the watcher continues with other paths");
    assert!(io_watchdog.hanging().is_empty());
}

#[test]
fn nested_accesses_are_tracked_separately() {
    let io_watchdog = Arc::new(IoWatchdog::default());
    let attendance = io_watchdog.attend_for_good();
    let (directory, rules) = (Path::new("/farm"), Path::new("/farm/.qcignore"));
    let outer = Access::begin(directory).unwrap();
    assert_eq!(io_watchdog.overdue(Duration::ZERO)[0].path, directory);
    let inner = Access::begin(rules).unwrap();
    assert!(
        io_watchdog.hanging().is_empty(),
        "the directory has answered"
    );
    assert_eq!(io_watchdog.overdue(Duration::ZERO)[0].path, rules);
    drop(inner);
    assert!(io_watchdog.hanging().is_empty());
    assert_eq!(
        io_watchdog.overdue(Duration::ZERO)[0].path,
        directory,
        "the access to the directory continues"
    );
    drop(outer);
    assert!(io_watchdog.hanging().is_empty());
    assert_eq!(io_watchdog.overdue(Duration::ZERO), []);
    assert_eq!(attendance.waits_since(), None);
}

#[test]
fn hanging_reader_is_reported_once_and_given_up() {
    let io_watchdog = Arc::new(IoWatchdog::default());
    let path = Path::new("/farm/hung/map.xodr");
    let patient = hang(&io_watchdog, Some(7), path);
    assert_eq!(io_watchdog.overdue(Duration::from_secs(3600)), []);
    let overdue = io_watchdog.overdue(Duration::ZERO);
    assert_eq!(overdue.len(), 1);
    assert_eq!((overdue[0].owner, &*overdue[0].path), (Some(7), path));
    assert_eq!(io_watchdog.overdue(Duration::ZERO), [], "reported once");
    assert_eq!(io_watchdog.hanging(), [path]);

    let attendance = io_watchdog.attend(8);
    assert_eq!(metadata(path).unwrap_err().kind(), io::ErrorKind::TimedOut);
    assert!(
        attendance.moment().is_some(),
        "the data read does not count"
    );
    assert!(
        metadata(Path::new("/")).is_ok(),
        "other paths are accessible"
    );
    assert!(!attendance.was_given_up());
    drop(attendance);
    assert!(
        metadata(Path::new("/")).is_ok(),
        "the thread is no longer attended"
    );

    let (was_given_up, further) = patient.end();
    assert!(was_given_up);
    assert_eq!(
        further,
        Err(io::ErrorKind::TimedOut),
        "the abandoned thread makes no further access"
    );
    assert!(io_watchdog.hanging().is_empty(), "the access has ended");
    let _attendance = io_watchdog.attend(9);
    let answer = metadata(path).unwrap_err();
    assert_eq!(
        answer.kind(),
        io::ErrorKind::NotFound,
        "the path may be accessed again"
    );
}

#[test]
fn hanging_directory_blocks_few_threads() {
    let io_watchdog = Arc::new(IoWatchdog::default());
    let at = |number: usize| PathBuf::from(format!("/farm/hung/{number}.xodr"));
    let hanging: Vec<_> = (0..io_watchdog::PER_DIRECTORY)
        .map(|number| hang(&io_watchdog, Some(1), &at(number)))
        .collect();
    assert_eq!(
        io_watchdog.overdue(Duration::ZERO).len(),
        io_watchdog::PER_DIRECTORY
    );
    let attendance = io_watchdog.attend(2);
    let refused = metadata(&at(99)).unwrap_err();
    assert_eq!(refused.kind(), io::ErrorKind::TimedOut);
    let beside = metadata(Path::new("/farm/nothing.xodr")).unwrap_err();
    assert_eq!(beside.kind(), io::ErrorKind::NotFound);
    drop(attendance);
    for one in hanging {
        let _ = one.end();
    }
    assert!(io_watchdog.hanging().is_empty());
}

#[test]
fn hanging_file_system_blocks_few_threads() {
    let io_watchdog = Arc::new(IoWatchdog::default());
    let at = |number| PathBuf::from(format!("/proc/directory-{number}/a.xodr"));
    let hanging: Vec<_> = (0..io_watchdog::PER_MOUNT)
        .map(|number| hang(&io_watchdog, Some(1), &at(number)))
        .collect();
    let found = io_watchdog.overdue(Duration::ZERO).len();
    assert_eq!(found, io_watchdog::PER_MOUNT);
    let attendance = io_watchdog.attend(2);
    let other = Path::new("/proc/self/status");
    assert_eq!(metadata(other).unwrap_err().kind(), io::ErrorKind::TimedOut);
    assert!(
        metadata(Path::new("/")).is_ok(),
        "another file system is not affected"
    );
    for it in hanging {
        assert!(it.end().0, "the thread must have been given up");
    }
    assert!(metadata(other).is_ok());
    drop(attendance);
}

#[test]
fn slow_disk_is_not_overdue() {
    let io_watchdog = Arc::new(IoWatchdog::default());
    let attendance = io_watchdog.attend(1);
    let access = Access::begin(Path::new("/farm/large.xodr")).unwrap();
    let begun = attendance.waits_since().unwrap();
    access.goes_on();
    assert!(attendance.waits_since().unwrap() > begun);
    drop(access);
    assert_eq!(attendance.waits_since(), None);
}

#[test]
fn first_temporary_error_is_remembered_while_attended() {
    let io_watchdog = Arc::new(IoWatchdog::default());
    let attendance = io_watchdog.attend(1);
    let meet =
        |path: &str, error: Errno| noted::<(), io::Error>(Path::new(path), Err(error.into()));
    assert!(meet("a", Errno::NOENT).is_err());
    assert_eq!(attendance.moment(), None);
    assert!(meet("b", Errno::MFILE).is_err());
    assert!(meet("c", Errno::IO).is_err());
    let (path, why) = attendance.moment().unwrap();
    assert_eq!(path, Path::new("b"));
    assert!(why.starts_with("Too many open files"), "{why}");
}
