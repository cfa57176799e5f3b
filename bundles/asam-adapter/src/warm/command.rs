//! Splits a shell command into words, if no shell is needed for it.

use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::{OsStrExt, OsStringExt};

use super::WhyCold;

/// A word of a command with variables that are filled in for each job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Word(Vec<Piece>);

#[derive(Debug, Clone, PartialEq, Eq)]
enum Piece {
    /// Literal text. An empty text represents empty quotes, which still make a word.
    Text(String),
    /// Value of a variable. Outside quotes a shell splits it and matches it against file names.
    Variable { name: String, quoted: bool },
}

/// Variables that a shell sets or interprets itself. The environment does not determine them.
const SHELLS_OWN: &str = "\
    IFS PWD OLDPWD PPID OPTIND OPTARG OPTERR LINENO RANDOM SRANDOM SECONDS EPOCHSECONDS \
    EPOCHREALTIME UID EUID GROUPS HOSTNAME HOSTTYPE MACHTYPE OSTYPE SHLVL SHELL SHELLOPTS \
    FUNCNAME DIRSTACK PIPESTATUS PATH PS1 PS2 PS4 TERM COLUMNS LINES HISTCMD _";

/// Words that a shell executes itself, even if a program of that name exists.
const BUILTINS: &str = "\
    . : alias bg bind break builtin caller case cd chdir command compgen complete compopt \
    continue coproc declare dirs disown do done echo elif else enable esac eval exec exit \
    export false fc fg fi for function getopts hash help history if in jobs kill let local \
    logout mapfile popd printf pushd pwd read readarray readonly return select set shift shopt \
    source suspend test then time times trap true type typeset ulimit umask unalias unset \
    until wait while";

fn has_word(list: &str, word: &str) -> bool {
    list.split(' ').any(|it| it == word)
}

/// Returns the words of `command`, or the reason why it needs a shell.
pub(super) fn words(command: &str) -> Result<Vec<Word>, WhyCold> {
    let mut reader = Reader {
        rest: command.chars().peekable(),
        words: Vec::new(),
        word: None,
    };
    reader.read()?;
    if reader.words.is_empty() {
        return Err(WhyCold::new("the command is empty"));
    }
    Ok(reader.words)
}

impl Word {
    /// Returns the word, if it is the same for each job.
    pub(super) fn fixed(&self) -> Option<String> {
        let text = |piece: &Piece| match piece {
            Piece::Text(text) => Some(text.clone()),
            Piece::Variable { .. } => None,
        };
        self.0.iter().map(text).collect()
    }

    /// Checks whether a shell would handle this word itself as the first word of a command.
    pub(super) fn is_builtin(&self) -> bool {
        self.fixed()
            .is_none_or(|it| has_word(BUILTINS, &it) || it.contains('='))
    }

    /// Appends the arguments that this word yields in `environment`: none, one or several.
    pub(super) fn fill(
        &self,
        environment: &[(OsString, OsString)],
        arguments: &mut Vec<OsString>,
    ) -> Result<(), WhyCold> {
        // `None` means that the argument is still empty. An argument that stays empty is left out.
        let mut open: Option<Vec<u8>> = None;
        for piece in &self.0 {
            match piece {
                Piece::Text(text) => open.get_or_insert_default().extend(text.as_bytes()),
                Piece::Variable { name, quoted: true } => {
                    open.get_or_insert_default()
                        .extend(value(environment, name).as_bytes());
                }
                Piece::Variable { name, .. } => {
                    split(name, value(environment, name), &mut open, arguments)?;
                }
            }
        }
        arguments.extend(open.map(OsString::from_vec));
        Ok(())
    }
}

fn value<'e>(environment: &'e [(OsString, OsString)], name: &str) -> &'e OsStr {
    let found = environment.iter().rfind(|(other, _)| other == name);
    found.map_or(OsStr::new(""), |(_, value)| value)
}

/// Splits the value of an unquoted variable at white space, as a shell does.
fn split(
    name: &str,
    value: &OsStr,
    open: &mut Option<Vec<u8>>,
    arguments: &mut Vec<OsString>,
) -> Result<(), WhyCold> {
    let value = value.as_bytes();
    if value.iter().any(|byte| b"*?[\\".contains(byte)) {
        return Err(WhyCold::new(format!(
            "the value of ${name} has characters that are special in a shell; put it in double quotes"
        )));
    }
    for byte in value {
        if b" \t\n".contains(byte) {
            arguments.extend(open.take().map(OsString::from_vec));
        } else {
            open.get_or_insert_default().push(*byte);
        }
    }
    Ok(())
}

struct Reader<'c> {
    rest: std::iter::Peekable<std::str::Chars<'c>>,
    words: Vec<Word>,
    word: Option<Vec<Piece>>,
}

impl Reader<'_> {
    fn read(&mut self) -> Result<(), WhyCold> {
        while let Some(next) = self.rest.next() {
            match next {
                ' ' | '\t' => self.end_word(),
                '\'' => self.single_quotes()?,
                '"' => self.double_quotes()?,
                '$' => self.variable(false)?,
                '#' | '~' if self.word.is_some() => self.push(next),
                'a'..='z' | 'A'..='Z' | '0'..='9' => self.push(next),
                '_' | '-' | '.' | '/' | ':' | ',' | '=' | '+' | '@' | '%' | '^' => self.push(next),
                other if !other.is_ascii() && !other.is_whitespace() && !other.is_control() => {
                    self.push(other);
                }
                other => {
                    return Err(needs_shell(&format!("of `{}`", other.escape_debug())));
                }
            }
        }
        self.end_word();
        Ok(())
    }

    fn end_word(&mut self) {
        self.words.extend(self.word.take().map(Word));
    }

    fn push(&mut self, next: char) {
        let pieces = self.word.get_or_insert_default();
        match pieces.last_mut() {
            Some(Piece::Text(text)) => text.push(next),
            _ => pieces.push(Piece::Text(next.into())),
        }
    }

    /// Begins a quoted part. Quotes make a word, even an empty one.
    fn quoted(&mut self) {
        self.word
            .get_or_insert_default()
            .push(Piece::Text(String::new()));
    }

    fn single_quotes(&mut self) -> Result<(), WhyCold> {
        self.quoted();
        loop {
            match self.rest.next() {
                Some('\'') => return Ok(()),
                Some(next) => self.push(next),
                None => return Err(unclosed()),
            }
        }
    }

    fn double_quotes(&mut self) -> Result<(), WhyCold> {
        self.quoted();
        loop {
            match self.rest.next() {
                Some('"') => return Ok(()),
                Some('$') => self.variable(true)?,
                Some(next @ ('`' | '\\')) => return Err(needs_shell(&format!("of `{next}`"))),
                Some(next) => self.push(next),
                None => return Err(unclosed()),
            }
        }
    }

    fn variable(&mut self, quoted: bool) -> Result<(), WhyCold> {
        let in_braces = self.rest.next_if_eq(&'{').is_some();
        let mut name = String::new();
        let part = |it: &char| it.is_ascii_alphanumeric() || *it == '_';
        while let Some(next) = self.rest.next_if(part) {
            name.push(next);
        }
        let closed = !in_braces || self.rest.next_if_eq(&'}').is_some();
        if !closed || name.is_empty() || name.starts_with(|it: char| it.is_ascii_digit()) {
            return Err(needs_shell("of a `$` that is not $NAME or ${NAME}"));
        }
        if has_word(SHELLS_OWN, &name) || name.starts_with("BASH") {
            return Err(needs_shell(&format!("${name} is a variable of the shell")));
        }
        let pieces = self.word.get_or_insert_default();
        pieces.push(Piece::Variable { name, quoted });
        Ok(())
    }
}

fn needs_shell(why: &str) -> WhyCold {
    WhyCold(format!("its command needs a shell because {why}"))
}

fn unclosed() -> WhyCold {
    WhyCold::new("its command has a quote that is not closed")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(command: &str) -> Result<Vec<String>, String> {
        let environment = [("A", "one two"), ("B", ""), ("G", "*"), ("P", "/x y/c.xml")]
            .map(|(name, value)| (name.into(), value.into()));
        let mut arguments = Vec::new();
        for word in words(command).map_err(|why| why.to_string())? {
            word.fill(&environment, &mut arguments)
                .map_err(|why| why.to_string())?;
        }
        let text = |it: OsString| it.into_string().unwrap();
        Ok(arguments.into_iter().map(text).collect())
    }

    /// Returns the words that `sh` reads from the same command.
    fn by_shell(command: &str) -> Vec<String> {
        let script = format!("set -- {command}\nfor it in \"$@\"; do printf '%s\\0' \"$it\"; done");
        let output = std::process::Command::new("sh")
            .args(["-c", &script])
            .envs([("A", "one two"), ("B", ""), ("G", "*"), ("P", "/x y/c.xml")])
            .output()
            .unwrap();
        assert!(output.status.success(), "{command}");
        let text = String::from_utf8(output.stdout).unwrap();
        text.split_terminator('\0').map(str::to_owned).collect()
    }

    #[test]
    fn command_words_are_split_like_in_shell() {
        for command in [
            "qc -c $P",
            "qc -c \"$P\"",
            "a'b c'd \"e f\"g",
            "x '' \"\" y",
            "x $B y",
            "x \"$B\" y",
            "x$A",
            "$A$A",
            "pre${A}post",
            "\"$A\"$A\"$A\"",
            "a#b x=y '$A' '\"' \"'\"",
            "$B$B",
            "é/ü \"ß\"",
            "a  \t b",
            "x$B\"\"",
            "$MISSING.",
            "a~b",
        ] {
            assert_eq!(filled(command), Ok(by_shell(command)), "{command}");
        }
    }

    #[test]
    fn command_that_needs_shell_is_refused_with_reason() {
        for (command, why) in [
            ("a; b", "its command needs a shell because of `;`"),
            ("a && b", "its command needs a shell because of `&`"),
            ("a | b", "its command needs a shell because of `|`"),
            ("a > b", "its command needs a shell because of `>`"),
            ("a *.xml", "its command needs a shell because of `*`"),
            ("a \\b", "its command needs a shell because of `\\\\`"),
            ("~/a", "its command needs a shell because of `~`"),
            ("a \"`b`\"", "its command needs a shell because of ``"),
            ("a #b", "its command needs a shell because of `#`"),
            ("a\nb", "its command needs a shell because of `\\n`"),
            ("a 'b", "its command has a quote that is not closed"),
            ("a \"b", "its command has a quote that is not closed"),
            (
                "a $PWD",
                "its command needs a shell because $PWD is a variable of the shell",
            ),
            ("  ", "the command is empty"),
        ] {
            let got = filled(command).unwrap_err();
            assert!(got.starts_with(why), "{command}: {got}");
        }
        for command in ["$(a)", "${A:-b}", "a $1", "a $", "a $$", "${A"] {
            let got = filled(command).unwrap_err();
            assert!(
                got.ends_with("that is not $NAME or ${NAME}"),
                "{command}: {got}"
            );
        }
        let got = filled("a $G").unwrap_err();
        assert!(got.contains("put it in double quotes"), "{got}");
        assert!(words("X=1 a").unwrap()[0].is_builtin());
        assert!(words("exec a").unwrap()[0].is_builtin());
    }
}
