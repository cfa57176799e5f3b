//! One file with the newest report of every checked file.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::output::{clear_place, earlier, write_named};
use crate::{ReportError, ReportFormat};

/// A file of sections, one per checked file. New sections are appended if the format allows it. An
/// existing section is replaced. [`ArtifactStore::finish`] sorts the sections by their paths.
pub struct ArtifactStore<F: ReportFormat> {
    path: PathBuf,
    sections: BTreeMap<String, F::Section>,
    sorted: bool,
    /// Whether all writing waits for the end.
    waits: bool,
}

impl<F: ReportFormat> ArtifactStore<F> {
    /// Opens the file. With `keep`, sections written earlier stay (for a restarted daemon);
    /// otherwise the file begins empty. With `waits`, it is written when all sections are present.
    ///
    /// # Errors
    /// [`ReportError::Write`] when the file cannot be read or emptied.
    pub fn open(
        path: &Path,
        format: &F,
        keep: bool,
        waits: bool,
    ) -> Result<ArtifactStore<F>, ReportError> {
        let earlier = if keep { earlier(path)? } else { None };
        let artifacts = ArtifactStore {
            path: path.to_owned(),
            sections: earlier.map(|text| format.split(&text)).unwrap_or_default(),
            sorted: false,
            waits,
        };
        if waits {
            clear_place(path)?;
        } else {
            // This removes sections that were truncated by a crash.
            artifacts.rewrite(format)?;
        }
        Ok(artifacts)
    }

    /// Inserts a section, and returns after it was written unless `waits` is set.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn put(&mut self, format: &F, key: &str, section: F::Section) -> Result<(), ReportError> {
        let appended = format.appended(key, &section);
        let earlier = self.sections.insert(key.to_owned(), section);
        let is_as_before = earlier.as_ref() == self.sections.get(key);
        if is_as_before {
            return Ok(());
        }
        self.sorted = false;
        if self.waits {
            return Ok(());
        }
        match appended.filter(|_| earlier.is_none()) {
            None => self.rewrite(format),
            Some(text) => {
                append(&self.path, text.as_bytes()).map_err(|source| ReportError::Write {
                    path: self.path.clone(),
                    source,
                })
            }
        }
    }

    /// Removes a section if it exists.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn withdraw(&mut self, format: &F, key: &str) -> Result<(), ReportError> {
        match self.sections.remove(key) {
            Some(_) if self.waits => Ok(()),
            Some(_) => self.rewrite(format),
            None => Ok(()),
        }
    }

    /// Sorts the sections by their paths, and writes the delayed ones.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn finish(&mut self, format: &F) -> Result<(), ReportError> {
        if !self.sorted {
            self.rewrite(format)?;
            self.sorted = true;
        }
        Ok(())
    }

    fn rewrite(&self, format: &F) -> Result<(), ReportError> {
        write_named(&self.path, format.whole(&self.sections)?.as_bytes())
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
    use qcbus_messages::ResultMessage;

    use super::*;
    use crate::{Destination, Sources};

    /// Format with one section per line, `path=text`.
    struct Lines;

    impl ReportFormat for Lines {
        type Section = String;
        const SUFFIX: &'static str = "lines";

        fn section(
            &self,
            _: &ResultMessage,
            _: &dyn Sources,
            _: Destination,
        ) -> Result<String, ReportError> {
            Err(ReportError::Form("sections are put in as they are".into()))
        }

        fn whole(&self, sections: &BTreeMap<String, String>) -> Result<String, ReportError> {
            Ok(sections.values().map(String::as_str).collect())
        }

        fn split(&self, text: &str) -> BTreeMap<String, String> {
            text.split_inclusive('\n')
                .filter(|line| line.ends_with('\n'))
                .filter_map(|line| Some((line.split_once('=')?.0.to_owned(), line.to_owned())))
                .collect()
        }

        fn appended(&self, _: &str, section: &String) -> Option<String> {
            Some(section.clone())
        }
    }

    #[test]
    fn newest_section_of_each_path_is_kept_and_sorted() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("all.txt");
        let read = || std::fs::read_to_string(&path).unwrap();
        let mut artifacts = ArtifactStore::open(&path, &Lines, false, false).unwrap();
        artifacts.put(&Lines, "b", "b=1\n".into()).unwrap();
        artifacts.put(&Lines, "a", "a=1\n".into()).unwrap();
        assert_eq!(read(), "b=1\na=1\n");
        artifacts.finish(&Lines).unwrap();
        assert_eq!(read(), "a=1\nb=1\n");
        artifacts.put(&Lines, "a", "a=2\n".into()).unwrap();
        assert_eq!(read(), "a=2\nb=1\n");
        artifacts.withdraw(&Lines, "a").unwrap();
        artifacts.withdraw(&Lines, "never there").unwrap();
        assert_eq!(read(), "b=1\n");
    }

    #[test]
    fn file_is_written_once_at_end_of_run() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("all.txt");
        let read = || std::fs::read_to_string(&path).unwrap();
        let mut artifacts = ArtifactStore::open(&path, &Lines, false, true).unwrap();
        artifacts.put(&Lines, "b", "b=1\n".into()).unwrap();
        artifacts.put(&Lines, "a", "a=1\n".into()).unwrap();
        assert!(!path.exists(), "no partial report is written");
        artifacts.finish(&Lines).unwrap();
        assert_eq!(read(), "a=1\nb=1\n");
    }

    #[test]
    fn restart_keeps_only_complete_sections() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("all.txt");
        std::fs::write(&path, "a=1\nb=2\nc=to").unwrap();
        ArtifactStore::open(&path, &Lines, true, false).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "a=1\nb=2\n");
        ArtifactStore::open(&path, &Lines, false, false).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "");
    }
}
