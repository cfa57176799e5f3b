//! One file that holds the newest report of every checked file.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::{ReportError, Subject, replace_file};

/// How a report's sections follow each other in one file.
pub trait Format {
    /// Under what the section of a checked file is found again, as [`Format::split`] gives it.
    fn key(&self, subject: Subject<'_>) -> String;

    /// A report as a section.
    fn section(&self, key: &str, text: String) -> String;

    /// The sections of a file written earlier, by the path of the checked file. What is not of
    /// this form is dropped.
    fn split(&self, text: &str) -> BTreeMap<String, String>;
}

/// A file of sections, one per checked file. New sections are appended; a section that is there
/// already is replaced, and [`Shelf::sort`] brings them in the order of their paths.
pub struct Shelf {
    path: PathBuf,
    sections: BTreeMap<String, String>,
    sorted: bool,
}

impl Shelf {
    /// Opens the file. With `keep`, sections written earlier stay (a daemon that was restarted);
    /// otherwise the file begins empty.
    ///
    /// # Errors
    /// [`ReportError::Write`] when the file cannot be read or emptied.
    pub fn open(path: &Path, format: &dyn Format, keep: bool) -> Result<Shelf, ReportError> {
        let earlier = match std::fs::read_to_string(path) {
            Ok(text) if keep => text,
            Err(source) if keep && source.kind() != std::io::ErrorKind::NotFound => {
                return Err(ReportError::Write {
                    path: path.to_owned(),
                    source,
                });
            }
            _ => String::new(),
        };
        let shelf = Shelf {
            path: path.to_owned(),
            sections: format.split(&earlier),
            sorted: false,
        };
        // What was torn by a crash is gone after this.
        shelf.rewrite()?;
        Ok(shelf)
    }

    /// Puts a section in, and returns when it is in the file.
    ///
    /// # Errors
    /// [`ReportError::Write`].
    pub fn put(&mut self, key: &str, section: String) -> Result<(), ReportError> {
        let earlier = self.sections.insert(key.to_owned(), section);
        let section = &self.sections[key];
        match earlier {
            Some(earlier) if earlier == *section => Ok(()),
            Some(_) => self.rewrite(),
            None => {
                self.sorted = false;
                append(&self.path, section.as_bytes()).map_err(|source| ReportError::Write {
                    path: self.path.clone(),
                    source,
                })
            }
        }
    }

    /// Takes a section out, if it is there.
    ///
    /// # Errors
    /// [`ReportError::Write`].
    pub fn withdraw(&mut self, key: &str) -> Result<(), ReportError> {
        match self.sections.remove(key) {
            Some(_) => self.rewrite(),
            None => Ok(()),
        }
    }

    /// Brings the sections in the order of their paths.
    ///
    /// # Errors
    /// [`ReportError::Write`].
    pub fn sort(&mut self) -> Result<(), ReportError> {
        if !self.sorted {
            self.rewrite()?;
            self.sorted = true;
        }
        Ok(())
    }

    fn rewrite(&self) -> Result<(), ReportError> {
        let text: String = self.sections.values().map(String::as_str).collect();
        replace_file(&self.path, text.as_bytes())
    }
}

fn append(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = std::fs::OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)?;
    file.write_all(bytes)?;
    file.sync_data()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One section per line, `path=text`.
    struct Lines;

    impl Format for Lines {
        fn key(&self, subject: Subject<'_>) -> String {
            subject.input.to_owned()
        }

        fn section(&self, key: &str, text: String) -> String {
            format!("{key}={text}\n")
        }

        fn split(&self, text: &str) -> BTreeMap<String, String> {
            text.split_inclusive('\n')
                .filter(|line| line.ends_with('\n'))
                .filter_map(|line| Some((line.split_once('=')?.0.to_owned(), line.to_owned())))
                .collect()
        }
    }

    #[test]
    fn the_newest_section_of_each_path_is_kept_and_sorted_in_the_end() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("all.txt");
        let read = || std::fs::read_to_string(&path).unwrap();
        let mut shelf = Shelf::open(&path, &Lines, false).unwrap();
        shelf.put("b", "b=1\n".into()).unwrap();
        shelf.put("a", "a=1\n".into()).unwrap();
        assert_eq!(read(), "b=1\na=1\n");
        shelf.sort().unwrap();
        assert_eq!(read(), "a=1\nb=1\n");
        shelf.put("a", "a=2\n".into()).unwrap();
        assert_eq!(read(), "a=2\nb=1\n");
        shelf.withdraw("a").unwrap();
        shelf.withdraw("never there").unwrap();
        assert_eq!(read(), "b=1\n");
    }

    #[test]
    fn a_restart_keeps_what_is_whole() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("all.txt");
        std::fs::write(&path, "a=1\nb=2\nc=to").unwrap();
        Shelf::open(&path, &Lines, true).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "a=1\nb=2\n");
        Shelf::open(&path, &Lines, false).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "");
    }
}
