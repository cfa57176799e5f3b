//! The running program: its path, a replacement at this path, and the environment that it belongs to.

use std::ffi::{OsStr, OsString};
use std::fs::Metadata;
use std::io;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use qcbus_disk::foreign;
use qcbus_messages::path_text::to_text;
use rustix::fs::{Access, access};

/// Path of the running program, even if the file was replaced. Also valid between fork and exec.
pub const RUNNING: &str = "/proc/self/exe";

/// Maximum number of links followed from the path by which the program was called. The kernel follows as many.
const LINKS: usize = 40;

/// Location of this program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OwnProgram {
    /// Path without links. Commands of the program's own children use it.
    path: PathBuf,
    /// Path by which the program was called. It may be a link.
    called: PathBuf,
    environment: Option<Environment>,
}

/// Directory of programs next to this one, including a Python interpreter.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Environment {
    /// Directory of the programs.
    programs: PathBuf,
    /// Whether it is a virtual environment of Python, so that all its programs belong together.
    is_virtual: bool,
}

impl OwnProgram {
    /// Returns the location of this program at the first call, which happens at its start.
    pub fn this() -> &'static OwnProgram {
        static THIS: LazyLock<OwnProgram> = LazyLock::new(OwnProgram::look);
        &THIS
    }

    fn look() -> OwnProgram {
        let path = std::env::current_exe().map_or_else(|_| RUNNING.into(), as_installed);
        let called = called().filter(|it| is_the_one_that_runs(it));
        let called = called.unwrap_or_else(|| path.clone());
        OwnProgram {
            environment: environment_of(&called),
            path,
            called,
        }
    }

    /// Returns the path without links.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Checks whether the first word of a command is this program.
    pub fn is(&self, word: &str) -> bool {
        // Commands are text, so the path is compared as text.
        self.path.to_string_lossy() == word
    }

    /// Returns the Python interpreter next to the program.
    pub fn python(&self) -> Option<PathBuf> {
        let environment = self.environment.as_ref()?;
        Some(environment.programs.join(PYTHON))
    }

    /// Returns the search path for programs: the environment of this program, followed by `PATH`.
    /// The environment may be inactive, as in services. A directory with an interpreter that is no
    /// virtual environment keeps its position in `PATH` if it has one. It may belong to the system.
    pub fn search_path(&self) -> OsString {
        let path =
            std::env::var_os("PATH").unwrap_or_else(|| "/usr/local/bin:/usr/bin:/bin".into());
        let Some(environment) = &self.environment else {
            return path;
        };
        behind(environment, path)
    }

    /// Returns a message for the user if another file, or none, is at the program's path. Waits for the disk.
    pub fn replaced(&self) -> Option<String> {
        let shown = to_text(&self.called);
        let what = match foreign::metadata(&self.called) {
            Ok(data) if is_same(&data, &std::fs::metadata(RUNNING).ok()?) => return None,
            Ok(_) => {
                format!("{shown} was replaced: this broker still runs the previous program")
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                format!("{shown} was removed: this broker still runs it")
            }
            Err(error) => {
                return Some(format!(
                    "{shown} cannot be accessed ({error}): it is unknown whether this broker runs it"
                ));
            }
        };
        Some(format!(
            "{what} and starts its bundles from it; to run the installed program, restart the broker (`qcbus \
             down`, then `qcbus serve` as before, or `systemctl restart` of its service)"
        ))
    }
}

const PYTHON: &str = "python3";

fn behind(environment: &Environment, path: OsString) -> OsString {
    let own = &environment.programs;
    let others: Vec<PathBuf> = std::env::split_paths(&path).collect();
    if !environment.is_virtual && others.contains(own) {
        return path;
    }
    let others = others.into_iter().filter(|it| it != own);
    // A directory with a colon in its name cannot be part of `PATH`.
    std::env::join_paths(std::iter::once(own.clone()).chain(others)).unwrap_or(path)
}

/// Returns the path by which this program was called, found as a shell does.
fn called() -> Option<PathBuf> {
    let word = PathBuf::from(std::env::args_os().next()?);
    if word.components().count() > 1 {
        return std::path::absolute(word).ok();
    }
    let path = std::env::var_os("PATH")?;
    let mut places = std::env::split_paths(&path).map(|it| it.join(&word));
    let found = places.find(|it| it.is_file() && access(it, Access::EXEC_OK).is_ok())?;
    std::path::absolute(found).ok()
}

/// Returns the path at which the running program was installed. The kernel adds a word to it if the file was replaced
/// or removed, for example by an upgrade while the program starts. With this word the commands of the children would
/// differ from those of the next broker, which would check all files again.
fn as_installed(running: PathBuf) -> PathBuf {
    match running.as_os_str().as_bytes().strip_suffix(b" (deleted)") {
        Some(installed) if !is_the_one_that_runs(&running) => OsStr::from_bytes(installed).into(),
        _ => running,
    }
}

fn is_the_one_that_runs(path: &Path) -> bool {
    let both = std::fs::metadata(path).and_then(|it| Ok((it, std::fs::metadata(RUNNING)?)));
    both.is_ok_and(|(there, running)| is_same(&there, &running))
}

fn is_same(a: &Metadata, b: &Metadata) -> bool {
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

/// Returns the environment of a program that was called by this path. Both a link and its target may lie in one. A
/// virtual environment has priority over a directory that only contains an interpreter.
fn environment_of(called: &Path) -> Option<Environment> {
    let next = |path: &PathBuf| {
        let target = path.parent()?.join(std::fs::read_link(path).ok()?);
        // Only the parent is resolved: the last name may be a link inside an environment.
        Some(
            std::fs::canonicalize(target.parent()?)
                .ok()?
                .join(target.file_name()?),
        )
    };
    let links = std::iter::successors(Some(called.to_path_buf()), next).take(LINKS);
    let mut found: Vec<Environment> = links.filter_map(|it| beside(&it)).collect();
    let best = found.iter().position(|it| it.is_virtual).unwrap_or(0);
    (best < found.len()).then(|| found.swap_remove(best))
}

fn beside(program: &Path) -> Option<Environment> {
    let programs = program.parent()?;
    let python = programs.join(PYTHON);
    let is_there = python.is_file() && access(&python, Access::EXEC_OK).is_ok();
    let marker = programs.parent().map(|it| it.join("pyvenv.cfg"));
    is_there.then(|| Environment {
        programs: programs.to_path_buf(),
        is_virtual: marker.is_some_and(|it| it.is_file()),
    })
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    /// Creates a directory with programs, optionally with `pyvenv.cfg` above it and an interpreter in it.
    fn place(dir: &Path, name: &str, is_virtual: bool, has_python: bool) -> PathBuf {
        let programs = dir.join(name).join("bin");
        std::fs::create_dir_all(&programs).unwrap();
        std::fs::write(programs.join("qcbus"), "").unwrap();
        if is_virtual {
            std::fs::write(dir.join(name).join("pyvenv.cfg"), "").unwrap();
        }
        if has_python {
            symlink("/bin/sh", programs.join(PYTHON)).unwrap();
        }
        programs
    }

    #[test]
    fn environment_is_directory_of_program_or_its_link() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name, is_virtual, has_python| place(dir.path(), name, is_virtual, has_python);
        let [system, venv, bare] = [
            at("system", false, true),
            at("venv", true, true),
            at("bare", false, false),
        ];
        let found = |path: PathBuf| environment_of(&path).map(|it| (it.programs, it.is_virtual));
        assert_eq!(found(bare.join("qcbus")), None);
        assert_eq!(found(system.join("qcbus")), Some((system.clone(), false)));
        assert_eq!(found(venv.join("qcbus")), Some((venv.clone(), true)));
        // Two links outside lead into the environment. One link inside leads out of it.
        symlink("../../venv/bin/qcbus", bare.join("link")).unwrap();
        symlink(venv.join("qcbus"), system.join("link")).unwrap();
        symlink(bare.join("qcbus"), venv.join("link")).unwrap();
        for link in [&bare, &system, &venv] {
            assert_eq!(found(link.join("link")), Some((venv.clone(), true)));
        }
        symlink("loop", bare.join("loop")).unwrap();
        assert_eq!(found(bare.join("loop")), None);
    }

    #[test]
    fn environment_comes_first_unless_it_may_be_system() {
        let environment = |is_virtual| Environment {
            programs: "/e/bin".into(),
            is_virtual,
        };
        let path = |is_virtual, path: &str| behind(&environment(is_virtual), path.into());
        assert_eq!(path(true, "/usr/bin:/bin"), "/e/bin:/usr/bin:/bin");
        assert_eq!(path(true, "/usr/bin:/e/bin"), "/e/bin:/usr/bin");
        assert_eq!(path(false, "/usr/bin:/bin"), "/e/bin:/usr/bin:/bin");
        assert_eq!(path(false, "/usr/bin:/e/bin"), "/usr/bin:/e/bin");
    }

    #[test]
    fn replaced_program_file_is_reported() {
        let dir = tempfile::tempdir().unwrap();
        let mut program = OwnProgram::look();
        assert_eq!(program.replaced(), None);
        program.called = dir.path().join("qcbus");
        let said = program.replaced().unwrap();
        assert!(said.contains("was removed"), "{said}");
        std::fs::copy("/bin/sh", &program.called).unwrap();
        let said = program.replaced().unwrap();
        assert!(said.contains("was replaced"), "{said}");
        assert!(said.contains("restart the broker"), "{said}");
        std::fs::remove_file(&program.called).unwrap();
        symlink(&program.path, &program.called).unwrap();
        assert_eq!(program.replaced(), None);
    }
}
