//! Finds the Python program that a shell would run for a command.

use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::Read;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use rustix::fs::{Access, access};

use super::WhyCold;
use super::command::{Word, words};

/// A Python program for a fork server, with the arguments of each job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Absolute path of the interpreter.
    pub(super) interpreter: PathBuf,
    /// Options of the interpreter, such as `-sE`.
    pub(super) options: Vec<String>,
    pub(super) program: Program,
    pub(super) arguments: Vec<Word>,
    /// The recognised command, and the search path used for it.
    command: String,
    pub(super) path: OsString,
}

impl Entry {
    /// Checks whether the command still runs the same program. A new program may come first on the
    /// PATH.
    pub(super) fn is_current(&self) -> bool {
        recognise(&self.command, &self.path).as_ref() == Ok(self)
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Program {
    /// A script with the path that it sees as its own.
    Script(PathBuf),
    /// A module started with `python -m`.
    Module(String),
}

/// An interpreter, its options, the program and the arguments of the program.
type Parts = (PathBuf, Vec<String>, Program, Vec<Word>);

/// Number of bytes of a script that are read for its first lines.
const HEAD: u64 = 4096;

/// Reads a command as a shell would, with programs in the directories of `path`.
///
/// # Errors
///
/// The reason why the command must be run plainly: it needs a shell, its program is not Python, or
/// the program depends on the directory of each job.
pub fn recognise(command: &str, path: &OsStr) -> Result<Entry, WhyCold> {
    let mut words = words(command)?;
    let arguments = words.split_off(1);
    let Some(first) = words.first().filter(|it| !it.is_builtin()) else {
        return Err(WhyCold::new(
            "its command begins with something that only a shell can run",
        ));
    };
    let name = first.fixed().unwrap_or_default();
    let program = find(&name, path)?;
    let head = head(&program)?;
    let (interpreter, options, program, arguments) = if head.starts_with(b"\x7fELF") {
        by_interpreter(program, arguments)?
    } else {
        let (interpreter, options) = shebang(&program, &head, path)?;
        let program = Program::Script(program);
        (checked(interpreter)?, options, program, arguments)
    };
    Ok(Entry {
        interpreter,
        options,
        program,
        arguments,
        command: command.to_owned(),
        path: path.to_owned(),
    })
}

/// Finds the file that a shell runs for a name.
fn find(name: &str, path: &OsStr) -> Result<PathBuf, WhyCold> {
    if name.contains('/') {
        let program = PathBuf::from(name);
        if !program.is_absolute() {
            return Err(WhyCold::new(format!(
                "`{name}` depends on the working directory; use its absolute path"
            )));
        }
        return runnable(&program)
            .then_some(program)
            .ok_or_else(|| WhyCold::new(format!("`{name}` is not an executable file")));
    }
    for directory in std::env::split_paths(path) {
        if !directory.is_absolute() {
            return Err(WhyCold::new(
                "the PATH contains a relative directory before the directory of the program",
            ));
        }
        let program = directory.join(name);
        if runnable(&program) {
            return Ok(program);
        }
    }
    Err(WhyCold::new(format!("`{name}` is not on the PATH")))
}

fn runnable(program: &Path) -> bool {
    program.is_file() && access(program, Access::EXEC_OK).is_ok()
}

fn head(program: &Path) -> Result<Vec<u8>, WhyCold> {
    let mut head = Vec::new();
    let read = File::open(program).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.map_err(|error| WhyCold::new(format!("`{}` cannot be read: {error}", program.display())))?;
    Ok(head)
}

/// Reads `python [options] -m module …` and `python [options] /script.py …`.
fn by_interpreter(interpreter: PathBuf, arguments: Vec<Word>) -> Result<Parts, WhyCold> {
    let interpreter = checked(interpreter)?;
    let mut arguments = arguments.into_iter();
    let mut options = Vec::new();
    let program = loop {
        let word = arguments.next().and_then(|it| it.fixed());
        let Some(word) = word else {
            return Err(WhyCold::new(
                "it names no script or module that is the same for each job",
            ));
        };
        if word == "-m" {
            break module(arguments.next())?;
        }
        if !word.starts_with('-') {
            break script(&word)?;
        }
        options.push(option(word)?);
    };
    Ok((interpreter, options, program, arguments.collect()))
}

fn module(word: Option<Word>) -> Result<Program, WhyCold> {
    let name = word.and_then(|it| it.fixed()).unwrap_or_default();
    let part = |it: &str| {
        !it.is_empty()
            && it.chars().all(|it| it.is_alphanumeric() || it == '_')
            && !it.starts_with(|it: char| it.is_numeric())
    };
    if name.split('.').all(part) {
        Ok(Program::Module(name))
    } else {
        Err(WhyCold::new("it names no module after -m"))
    }
}

fn script(word: &str) -> Result<Program, WhyCold> {
    let path = PathBuf::from(word);
    if !path.is_absolute() {
        return Err(WhyCold::new(format!(
            "the script `{word}` depends on the directory of each job; use its absolute path"
        )));
    }
    if path.is_file() {
        Ok(Program::Script(path))
    } else {
        Err(WhyCold::new(format!("the script `{word}` is not a file")))
    }
}

/// Checks that an option of the interpreter does not affect the assumptions of forked runs.
fn option(word: String) -> Result<String, WhyCold> {
    let letters = word.strip_prefix('-').unwrap_or_default();
    if !letters.is_empty() && letters.chars().all(|it| "EsIBuPOSbq".contains(it)) {
        Ok(word)
    } else {
        Err(WhyCold::new(format!(
            "its interpreter has the option `{word}`, which only a plain run supports"
        )))
    }
}

/// Checks that a file is a real interpreter. A script, such as those of pyenv, may choose another
/// interpreter by the directory.
fn checked(interpreter: PathBuf) -> Result<PathBuf, WhyCold> {
    let name = interpreter.file_name().unwrap_or_default().as_bytes();
    let version = name
        .strip_prefix(b"python")
        .map(|it| it.iter().all(|byte| byte.is_ascii_digit() || *byte == b'.'));
    let shown = interpreter.display();
    if version != Some(true) {
        return Err(WhyCold::new(format!("`{shown}` is not a Python program")));
    }
    if !interpreter.is_absolute() || !runnable(&interpreter) {
        return Err(WhyCold::new(format!(
            "`{shown}` is not an executable interpreter"
        )));
    }
    if head(&interpreter)?.starts_with(b"\x7fELF") {
        Ok(interpreter)
    } else {
        Err(WhyCold::new(format!(
            "`{shown}` is a script, which may choose an interpreter for each job"
        )))
    }
}

/// Returns the interpreter from the first line of a script.
fn shebang(program: &Path, head: &[u8], path: &OsStr) -> Result<(PathBuf, Vec<String>), WhyCold> {
    let not_python = || WhyCold::new(format!("`{}` is not a Python program", program.display()));
    let head = String::from_utf8_lossy(head);
    let mut lines = head.split('\n');
    let first = lines.next().and_then(|it| it.strip_prefix("#!"));
    let first = first.ok_or_else(not_python)?.trim();
    if first == "/bin/sh" {
        let second = lines.next().and_then(long_shebang);
        return Ok((second.ok_or_else(not_python)?, Vec::new()));
    }
    // The kernel passes the text after the interpreter as one argument.
    let (interpreter, argument) = match first.split_once([' ', '\t']) {
        Some((interpreter, argument)) => (interpreter, Some(argument.trim())),
        None => (first, None),
    };
    if interpreter == "/usr/bin/env" || interpreter == "/bin/env" {
        let name =
            argument.filter(|it| it.starts_with("python") && !it.contains([' ', '\t', '/', '=']));
        let name = name.ok_or_else(not_python)?;
        return Ok((find(name, path)?, Vec::new()));
    }
    let options = argument.map(|it| option(it.to_owned())).transpose()?;
    Ok((PathBuf::from(interpreter), options.into_iter().collect()))
}

/// Reads pip's second line, `'''exec' "/a/long/path/python" "$0" "$@"`. pip writes it if the path
/// of the interpreter has a space or is too long for the kernel.
fn long_shebang(line: &str) -> Option<PathBuf> {
    let command = line.strip_prefix("'''exec' ")?;
    let command = command.trim_end().strip_suffix(" \"$0\" \"$@\"")?;
    let word = words(command).ok().filter(|words| words.len() == 1)?;
    let path = word.first()?.fixed()?;
    path.starts_with('/').then(|| PathBuf::from(path))
}
