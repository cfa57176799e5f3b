//! Commands of the manifests that `qcbus bundle add` and `qcbus bundle upgrade` write.

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use qcbus_configuration::OwnProgram;
use qcbus_messages::path_text::to_text;
use rustix::fs::{Access, access};

use super::manifests::{Refusal, usage};
use super::settings::absolute;

const PYTHON: &str = "python3";

/// Maximum length in bytes of a script's first line, as in the kernel.
const FIRST_LINE: u64 = 256;

/// Returns the command of an ASAM module with the absolute path of its program, as in
/// [`command_line`]. The shell interprets the rest.
pub(super) fn asam_module_command(command: &str) -> Result<String, Refusal> {
    let command = qcbus_asam_adapter::goes_where_it_is(command).map_or(command, |(rest, _)| rest);
    let (program, rest) = first_word(command.trim())?;
    let found = find_program(&program).map_err(usage)?;
    let Some(path) = found.to_str() else {
        let shown = to_text(&found);
        return Err(usage(format!("{shown}: paths in a manifest must be UTF-8")));
    };
    Ok(format!("{}{rest}", quote(path)))
}

/// Returns the first word of a command as the shell reads it, without quotes and escapes, and the
/// unchanged rest.
fn first_word(command: &str) -> Result<(String, &str), Refusal> {
    if shlex::split(command).is_none() {
        let why = "a quote is not closed, or the command ends with a backslash";
        return Err(usage(format!("cannot run `{command}`: {why}")));
    }
    let spaces = command.char_indices().filter(|(_, c)| c.is_whitespace());
    let ends = spaces.map(|(at, _)| at).chain([command.len()]);
    // A text that ends at a space inside quotes or after a backslash is not a whole word.
    let mut words = ends.filter_map(|end| Some((shlex::split(&command[..end])?, end)));
    let first = words.find_map(|(words, end)| Some((words.into_iter().next()?, end)));
    let Some((program, end)) = first.filter(|(program, _)| !program.is_empty()) else {
        return Err(usage("no program is given"));
    };
    Ok((program, &command[end..]))
}

/// Returns the command of a manifest. Programs have absolute paths, because the broker may have
/// another directory and another `PATH`. The same is true for the interpreter of a Python script,
/// which decides what the script can import.
pub(super) fn command_line(words: &[String]) -> Result<String, Refusal> {
    let Some((program, arguments)) = words.split_first() else {
        return Err(usage("no program is given"));
    };
    let script = Path::new(program);
    let programs = if script.extension().is_some_and(|it| it == "py") {
        let script = script_at(script)?;
        let mut words = interpreter_of(&script).map_err(usage)?;
        words.push(script);
        words
    } else {
        vec![find_program(program).map_err(usage)?]
    };
    let mut quoted = Vec::new();
    for program in &programs {
        let Some(program) = program.to_str() else {
            let shown = to_text(program);
            return Err(usage(format!("{shown}: paths in a manifest must be UTF-8")));
        };
        quoted.push(quote(program));
    }
    quoted.extend(arguments.iter().map(|it| quote(it)));
    Ok(quoted.join(" "))
}

fn script_at(script: &Path) -> Result<PathBuf, Refusal> {
    let path = absolute(script);
    let shown = to_text(&path);
    match std::fs::metadata(&path) {
        Ok(data) if data.is_file() => Ok(path),
        Ok(_) => Err(usage(format!("cannot run {shown}: it is not a file"))),
        Err(error) => Err(usage(format!("cannot run {shown}: {error}"))),
    }
}

/// Returns the words that start a Python script: those of its first line, else the interpreter.
fn interpreter_of(script: &Path) -> Result<Vec<PathBuf>, String> {
    let Some(words) = shebang(script) else {
        return Ok(vec![find_program(PYTHON)?]);
    };
    let mut words = words.into_iter();
    let program = words.next().unwrap_or_default();
    let found = find_program(&program);
    let found =
        found.map_err(|why| format!("{why} (named in the first line of {})", to_text(script)))?;
    Ok(std::iter::once(found)
        .chain(words.map(PathBuf::from))
        .collect())
}

/// Returns the words of a script's first line if it names an interpreter. A program for `env` is
/// searched here.
fn shebang(script: &Path) -> Option<Vec<String>> {
    let mut bytes = Vec::new();
    let opened = File::open(script).ok()?;
    // The interpreter reports a script that cannot be read.
    opened.take(FIRST_LINE).read_to_end(&mut bytes).ok()?;
    let line = bytes.split(|byte| *byte == b'\n').next()?;
    let line = str::from_utf8(line).ok()?.strip_prefix("#!")?.trim();
    let (program, argument) = line.split_once([' ', '\t']).unwrap_or((line, ""));
    let argument = argument.trim();
    let words = if Path::new(program).file_name()? == "env" {
        let of_env = argument.strip_prefix("-S").unwrap_or(argument);
        of_env.split_whitespace().map(str::to_owned).collect()
    } else {
        let both = [program, argument].into_iter().filter(|it| !it.is_empty());
        both.map(str::to_owned).collect::<Vec<_>>()
    };
    (!words.is_empty()).then_some(words)
}

/// Returns the path of an executable program: in the environment of this program, or on the `PATH`.
fn find_program(program: &str) -> Result<PathBuf, String> {
    if program.contains('/') {
        let path = absolute(Path::new(program));
        return match executable(&path) {
            Ok(()) => Ok(path),
            Err(why) => Err(format!("cannot run {}: {why}", to_text(&path))),
        };
    }
    if program == PYTHON
        && let Some(found) = OwnProgram::this().python()
    {
        return Ok(found);
    }
    let paths = OwnProgram::this().search_path();
    let mut found = std::env::split_paths(&paths).map(|directory| directory.join(program));
    let found = found.find(|path| executable(path).is_ok());
    found
        .map(|path| absolute(&path))
        .ok_or_else(|| format!("cannot run `{program}`: not found in PATH; name its path"))
}

fn executable(path: &Path) -> Result<(), String> {
    let metadata = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if !metadata.is_file() {
        return Err("it is not a file".to_owned());
    }
    access(path, Access::EXEC_OK).map_err(|error| format!("it is not executable ({error})"))
}

fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-=:,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_word_of_a_command_follows_shell_quoting() {
        let cases = [
            ("qc_x", "qc_x", ""),
            ("qc_x -c $FILE", "qc_x", " -c $FILE"),
            ("'/a dir/x.sh' -c \"$FILE\"", "/a dir/x.sh", " -c \"$FILE\""),
            ("\"/a  dir/x.sh\" -c 'a b'", "/a  dir/x.sh", " -c 'a b'"),
            ("/a\\ dir/x.sh\t-c", "/a dir/x.sh", "\t-c"),
            ("/a' 'dir/\"x y\" z", "/a dir/x y", " z"),
            ("'it'\\''s' z", "it's", " z"),
            ("/straße/x z", "/straße/x", " z"),
        ];
        for (command, program, rest) in cases {
            let found = first_word(command).unwrap();
            assert_eq!(found, (program.to_owned(), rest), "{command}");
        }
    }

    #[test]
    fn first_line_of_a_script_names_its_interpreter() {
        let dir = tempfile::tempdir().unwrap();
        let script = dir.path().join("rules.py");
        let cases: [(&str, Option<&[&str]>); 9] = [
            ("import qcbus\n", None),
            ("", None),
            ("#!\n", None),
            ("# !/usr/bin/python3\n", None),
            ("#!/opt/x/python3\n", Some(&["/opt/x/python3"])),
            (
                "#! /opt/x/python3  -u -X dev\r\n",
                Some(&["/opt/x/python3", "-u -X dev"]),
            ),
            ("#!/usr/bin/env python3\n", Some(&["python3"])),
            ("#!/usr/bin/env -S python3 -u\n", Some(&["python3", "-u"])),
            ("#!/usr/bin/env\n", None),
        ];
        for (text, expected) in cases {
            std::fs::write(&script, text).unwrap();
            let expected = expected.map(|it| it.iter().map(ToString::to_string).collect());
            assert_eq!(shebang(&script), expected, "{text}");
        }
    }

    #[test]
    fn command_with_invalid_shell_syntax_is_refused() {
        let cases = [
            ("'/a dir/x.sh -c", "a quote is not closed"),
            ("qc_x -c \"$FILE", "a quote is not closed"),
            ("qc_x \\", "a backslash"),
            ("", "no program"),
            ("''", "no program"),
            ("# qc_x", "no program"),
        ];
        for (command, why) in cases {
            let (exit, said) = first_word(command).unwrap_err();
            assert_eq!(exit, qcbus_messages::Exit::Usage);
            assert!(said.contains(why), "{command}: {said}");
        }
    }
}
