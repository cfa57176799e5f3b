//! Programs of manifests. Only the broker's user may be able to change the files that a command runs.

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::str::CharIndices;

use qcbus_disk::trust::{self, TrustError};

use super::hosted;
use crate::own_program::OwnProgram;

/// Text around the command of a manifest, so that the shell parses it, as in ASAM's framework.
const BEFORE: &str = "exec ";
const BEHIND: &str = " \"$@\"";

/// Returns the words that start a command of a manifest.
pub(super) fn shell_command(command: &str) -> Vec<String> {
    let line = format!("{BEFORE}{command}{BEHIND}");
    ["sh", "-c", &line, "sh"].map(str::to_owned).to_vec()
}

/// Checks the files that the command of a manifest runs: its program, and its first file argument,
/// which may be the script of an interpreter. Files that these read themselves are not checked.
///
/// # Errors
/// When another user controls a file, or when the shell would have to expand the command. A missing
/// file is reported later, at the start.
pub(super) fn look_at(command: &str) -> Result<(), String> {
    resolve(command).map(drop)
}

/// Returns the command of a manifest, or `None` for a child that comes with the program.
pub fn command_of(words: &[String]) -> Option<&str> {
    if let Some(command) = hosted::command_of(words) {
        return Some(command);
    }
    let [_, _, line, _] = words else {
        return None;
    };
    line.strip_prefix(BEFORE)?.strip_suffix(BEHIND)
}

/// Returns the files that a child runs: the program of its manifest, even if missing, and its script argument.
pub(super) fn files_of(words: &[String]) -> Vec<PathBuf> {
    let mut words = Words {
        rest: command_of(words).unwrap_or_default(),
    };
    let Some(program) = words.next_word() else {
        return Vec::new();
    };
    let program = find(&program).unwrap_or_else(|| absolute(Path::new(&program)));
    let script = first_file(&mut words).filter(|it| is_script(it));
    std::iter::once(program).chain(script).collect()
}

/// Returns the first word that is not an option, as a path.
fn first_file(words: &mut Words<'_>) -> Option<PathBuf> {
    let word = std::iter::from_fn(|| words.next_word()).find(|word| !word.starts_with('-'));
    word.map(|it| absolute(Path::new(&it)))
}

/// Checks whether a file argument is a script for the program. A file that the program writes, such
/// as its log, changes often and must not cause an upgrade each time.
fn is_script(file: &Path) -> bool {
    let begins_as_one = || {
        let mut begin = [0; 2];
        let opened = std::fs::File::open(file);
        opened.is_ok_and(|mut it| it.read_exact(&mut begin).is_ok()) && begin == *b"#!"
    };
    let is_named_as_one = file.extension().is_some_and(|it| it == "py");
    file.is_file() && (is_named_as_one || is_executable(file) || begins_as_one())
}

/// Returns the words that start a child, after a last check of a manifest's program. They contain
/// the path at which the program was found, so no lookup happens between the check and the start.
///
/// # Errors
/// As `look_at`, and when the program does not exist.
pub fn ready(words: &[String]) -> Result<Vec<String>, String> {
    hosted::ready(words)?;
    let ([shell, flag, _, name], Some(command)) = (words, command_of(words)) else {
        return Ok(words.to_vec());
    };
    let Some((program, rest)) = resolve(command)? else {
        let program = first_word(command);
        return Err(format!(
            "its command was not found ({program}); see its manifest"
        ));
    };
    let line = format!("{BEFORE}{}{rest}{BEHIND}", quoted(&program));
    Ok([shell, flag, &line, name].map(Clone::clone).to_vec())
}

fn first_word(command: &str) -> &str {
    command.split_whitespace().next().unwrap_or_default()
}

/// Returns the path in single quotes, for the shell.
fn quoted(path: &str) -> String {
    format!("'{}'", path.replace('\'', "'\\''"))
}

/// Returns the absolute program of a command and the rest of the command after its name. Returns
/// `None` if the program does not exist.
fn resolve(command: &str) -> Result<Option<(String, &str)>, String> {
    let mut words = Words { rest: command };
    let program = words.next_word();
    let rest = words.rest;
    let Some(program) = program.filter(|it| !it.is_empty()) else {
        return Err(format!(
            "`{}`: the program can only be determined by the shell; begin the command with the path of the \
             program",
            first_word(command)
        ));
    };
    let Some(found) = find(&program) else {
        return Ok(None);
    };
    accept(&found)?;
    if let Some(script) = first_file(&mut words).filter(|it| it.is_file()) {
        accept(&script)?;
    }
    let found = found.into_os_string().into_string();
    let found = found.map_err(|it| format!("{}: its name is not valid UTF-8", it.display()))?;
    Ok(Some((found, rest)))
}

fn accept(file: &Path) -> Result<(), String> {
    match trust::look_at_file(file) {
        Err(error @ TrustError::Foreign { .. }) => Err(error.to_string()),
        // The file is missing or inaccessible. The start reports this.
        Ok(()) | Err(TrustError::Io { .. }) => Ok(()),
    }
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
}

fn is_executable(path: &Path) -> bool {
    rustix::fs::access(path, rustix::fs::Access::EXEC_OK).is_ok()
}

/// Returns the path at which the shell finds a program. The broker starts the shell with the same `PATH`.
pub(super) fn find(program: &str) -> Option<PathBuf> {
    let is_program = |path: &PathBuf| path.is_file() && is_executable(path);
    if program.contains('/') {
        return Some(absolute(Path::new(program))).filter(is_program);
    }
    let path = OwnProgram::this().search_path();
    let places = std::env::split_paths(&path).map(|place| absolute(&place.join(program)));
    places.into_iter().find(is_program)
}

/// Words of a command as the shell parses them, up to the first one that needs an expansion.
struct Words<'c> {
    rest: &'c str,
}

impl Words<'_> {
    fn next_word(&mut self) -> Option<String> {
        let start = self.rest.trim_start();
        let mut word = String::new();
        let mut letters = start.char_indices();
        let mut any = false;
        let end = loop {
            let Some((at, letter)) = letters.next() else {
                break start.len();
            };
            match letter {
                ' ' | '\t' => break at,
                '\'' => quote(&mut letters, &mut word, '\'')?,
                '"' => quote(&mut letters, &mut word, '"')?,
                '\\' => word.push(letters.next()?.1),
                '$' => word.push_str(&variable(&mut letters)?),
                '~' if !any => return None,
                c if SPECIAL.contains(c) => return None,
                c => word.push(c),
            }
            any = true;
        };
        self.rest = &start[end..];
        any.then_some(word)
    }
}

/// Characters with a special meaning for the shell outside of quotes.
const SPECIAL: &str = "`*?[;&|<>(){}#!\n";

/// Returns the value of the variable whose name follows. A child sees the same value. Returns
/// `None` if it is not set, or if the shell would split or expand the value.
fn variable(letters: &mut CharIndices<'_>) -> Option<String> {
    let rest = letters.as_str();
    let (name, length) = match rest.strip_prefix('{') {
        Some(inner) => inner
            .split_once('}')
            .map(|(name, _)| (name, name.len() + 2))?,
        None => {
            let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
            let name = &rest[..end.unwrap_or(rest.len())];
            (name, name.len())
        }
    };
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.is_empty() || !name.chars().all(is_name) {
        return None;
    }
    let value = std::env::var(name).ok()?;
    let plain = |c: char| !c.is_whitespace() && !SPECIAL.contains(c);
    // The name consists of one-byte characters.
    letters.nth(length - 1);
    value.chars().all(plain).then_some(value)
}

/// Reads a quoted text. Returns `None` if the quote is not closed, or if the shell would expand something.
fn quote(letters: &mut CharIndices<'_>, word: &mut String, mark: char) -> Option<()> {
    loop {
        match letters.next()?.1 {
            c if c == mark => return Some(()),
            '`' if mark == '"' => return None,
            '$' if mark == '"' => word.push_str(&variable(letters)?),
            '\\' if mark == '"' => word.push(letters.next()?.1),
            c => word.push(c),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(command: &str) -> Vec<String> {
        let mut words = Words { rest: command };
        std::iter::from_fn(|| words.next_word()).collect()
    }

    #[test]
    fn command_words_are_split_like_in_shell() {
        let list: &[(&str, &[&str])] = &[
            ("/opt/run --x 7", &["/opt/run", "--x", "7"]),
            (" '/opt/my run' \"a b\"c\\ d ", &["/opt/my run", "a bc d"]),
            ("run 2>/dev/null more", &["run"]),
            (
                "$CARGO_PKG_NAME/run ${CARGO_PKG_NAME}x",
                &["qcbus-configuration/run", "qcbus-configurationx"],
            ),
            ("\"$CARGO_PKG_NAME\"", &["qcbus-configuration"]),
            ("$no_such_variable_here/run", &[]),
            ("${CARGO_PKG_NAME:-x}", &[]),
            ("$1 x", &[]),
            ("~/run", &[]),
            ("\"$(evil)\" x", &[]),
            ("'$(name)'", &["$(name)"]),
            ("'open", &[]),
            ("", &[]),
            ("''", &[""]),
        ];
        for (command, expected) in list {
            assert_eq!(words(command), *expected, "{command}");
        }
    }

    #[test]
    fn program_is_started_by_its_found_path() {
        let ready = |command: &str| ready(&shell_command(command));
        let shell = find("sh").unwrap();
        let words = ready("sh -c 'exit 3' x").unwrap();
        assert_eq!(
            words[2],
            format!("exec '{}' -c 'exit 3' x \"$@\"", shell.display())
        );
        let missing = ready("/nowhere/at/all x").unwrap_err();
        assert!(
            missing.contains("was not found (/nowhere/at/all)"),
            "{missing}"
        );
        let unclear = ready("$(cat x)").unwrap_err();
        assert!(unclear.contains("path of the program"), "{unclear}");
        let other = ["program".to_owned(), "x".to_owned()];
        assert_eq!(super::ready(&other).unwrap(), other);
    }

    #[test]
    fn files_of_command_are_its_program_and_script() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("rules.py"), "pass").unwrap();
        std::fs::write(at("script"), "#!/bin/sh\n").unwrap();
        std::fs::write(at("log"), "it grows").unwrap();
        let shell = find("sh").unwrap();
        let files = |line: &str| {
            let line = line.replace("DIR", &dir.path().to_string_lossy());
            files_of(&shell_command(&line))
        };
        assert_eq!(files("DIR/nothing here"), [at("nothing")]);
        assert_eq!(files("sh -e DIR/script"), [shell.clone(), at("script")]);
        assert_eq!(files("sh DIR/rules.py"), [shell.clone(), at("rules.py")]);
        assert_eq!(files("sh --log DIR/log"), [shell]);
        assert!(files("$(cat x)").is_empty());
        assert!(files_of(&["program".to_owned()]).is_empty());
    }

    #[test]
    fn program_writable_by_others_is_not_started() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let script = dir.path().join("it's a script");
        std::fs::write(&script, "#!/bin/sh\n").unwrap();
        let mode = |mode| {
            let mode = std::fs::Permissions::from_mode(mode);
            std::fs::set_permissions(&script, mode).unwrap();
        };
        let alone = quoted(&script.to_string_lossy());
        let commands = [alone.clone(), format!("sh -e {alone} --more")];
        mode(0o755);
        for command in &commands {
            look_at(command).unwrap();
        }
        mode(0o777);
        for command in &commands {
            let said = look_at(command).unwrap_err();
            assert!(said.contains("chmod o-w"), "{command}: {said}");
            assert_eq!(ready(&shell_command(command)).unwrap_err(), said);
        }
    }
}
