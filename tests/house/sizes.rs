//! Limits for the size of functions and files of the broker, so that they stay readable.

use super::{root, sources};

/// Maximum number of lines of a function, with its signature and its last brace.
const LONGEST_FUNCTION: usize = 60;

/// Number of lines that nine in ten files must not exceed.
const LONG_FILE: usize = 400;

#[test]
fn broker_functions_and_files_are_short() {
    let sources = sources(&root().join("runtime/broker"));
    let mut wrong = Vec::new();
    let mut long = Vec::new();
    for (file, text) in &sources {
        let lines: Vec<&str> = text.lines().collect();
        if lines.len() > LONG_FILE {
            long.push(format!("{}: {} lines", file.display(), lines.len()));
        }
        for (at, name) in functions(&lines) {
            let length = length(&lines[at..]);
            if length > LONGEST_FUNCTION {
                wrong.push(format!("{}:{}: {name}: {length}", file.display(), at + 1));
            }
        }
    }
    assert!(sources.len() > 50, "too few files: {}", sources.len());
    assert!(wrong.is_empty(), "too long:\n{}", wrong.join("\n"));
    let nine_in_ten = long.len() * 10 <= sources.len();
    assert!(
        nine_in_ten,
        "more than one file in ten is long:\n{}",
        long.join("\n")
    );
}

/// Returns the lines on which functions begin, and their names.
fn functions<'l>(lines: &[&'l str]) -> Vec<(usize, &'l str)> {
    let name = |line: &&'l str| {
        let (before, after) = line.split_once("fn ")?;
        let is_word = |word: &str| matches!(word, "const" | "async" | "unsafe");
        let mut words = before.split_whitespace();
        let defines = words.all(|it| it.starts_with("pub") || it.ends_with(')') || is_word(it));
        let end = after.find(['(', '<'])?;
        defines.then(|| &after[..end])
    };
    let lines = lines.iter().enumerate();
    lines
        .filter_map(|(at, line)| Some((at, name(line)?)))
        .collect()
}

/// Returns the length of the first function. Its last brace is indented like its first line.
fn length(lines: &[&str]) -> usize {
    let ends = |line: &&str| line.ends_with(['{', ';', '}']);
    let signature = lines.iter().position(ends).unwrap_or_default();
    // The function is on one line or only declared.
    if !lines[signature].ends_with('{') {
        return signature + 1;
    }
    let indentation = lines[0].len() - lines[0].trim_start().len();
    let last = format!("{}}}", &lines[0][..indentation]);
    let end = lines.iter().position(|line| *line == last);
    end.map_or(lines.len(), |end| end + 1)
}

#[test]
fn length_of_a_function_is_measured() {
    let text = "impl A {\n    pub(super) fn one(\n        &self,\n    ) {\n        if x {\n        }\n    \
                }\n\n    fn two(&self) {}\n}\n\nasync fn three<T>() -> T;\n// fn four()\nlet a: fn (u8);";
    let lines: Vec<&str> = text.lines().collect();
    let found = functions(&lines);
    let found: Vec<_> = found
        .iter()
        .map(|(at, name)| (*name, length(&lines[*at..])))
        .collect();
    assert_eq!(found, [("one", 6), ("two", 1), ("three", 1)]);
}
