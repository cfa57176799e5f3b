//! Files that this broker writes for others: results, verdict files, copies behind the gate.
//!
//! Another program may remove or change such a file while the broker runs. The kernel reports this.
//! All files are also scanned periodically, because kernels and file systems lose events. If an
//! output is lost, the file that it belongs to is judged again, which writes the output again.

mod scanner;

use std::collections::{BTreeMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use qcbus_disk::{FileFingerprint, foreign};
use qcbus_environment::{Bell, thread};
use qcbus_types::LostOutput;

use self::scanner::Scanner;

/// Callback for lost outputs. The scanner thread calls it.
pub type TellLost = Box<dyn FnMut(Vec<LostOutput>) + Send>;

/// Registry of existing outputs. Clones share it. The default registers no outputs, for a single run.
#[derive(Debug, Clone, Default)]
pub struct Outputs(Option<Arc<Shared>>);

#[derive(Debug)]
struct Shared {
    book: Mutex<Book>,
    /// Wakes the thread that waits for events.
    bell: Bell,
    is_over: AtomicBool,
}

/// Known outputs and their directories.
#[derive(Debug, Default)]
struct Book {
    written: BTreeMap<Arc<Path>, Written>,
    /// Directories that are watched or will be watched.
    directories: HashSet<PathBuf>,
    /// Directories among them that are not watched yet.
    fresh: Vec<PathBuf>,
}

#[derive(Debug, Clone)]
struct Written {
    file: Arc<Path>,
    fingerprint: FileFingerprint,
    /// Whether the loss was reported.
    is_told: bool,
}

/// Ends the scanner thread when it is dropped.
#[derive(Debug)]
pub struct OutputWatch(Arc<Shared>);

impl Drop for OutputWatch {
    fn drop(&mut self) {
        self.0.is_over.store(true, Ordering::Release);
        self.0.bell.ring();
    }
}

impl Outputs {
    /// Creates a registry of outputs for [`Outputs::watch`].
    ///
    /// # Errors
    /// When no file descriptor is available.
    pub fn kept() -> io::Result<Outputs> {
        Ok(Outputs(Some(Arc::new(Shared {
            book: Mutex::default(),
            bell: Bell::new()?,
            is_over: AtomicBool::new(false),
        }))))
    }

    /// Starts a thread that scans the outputs until the returned value is dropped. `None`: no
    /// outputs are registered.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn watch(&self, tell: TellLost) -> io::Result<Option<OutputWatch>> {
        let Some(shared) = self.0.clone() else {
            return Ok(None);
        };
        let scanner = Scanner::new(shared.clone(), tell);
        thread::Builder::new()
            .name("outputs".to_owned())
            .spawn(move || scanner.run())?;
        Ok(Some(OutputWatch(shared)))
    }

    /// Must be called before an output is written or removed. Until [`Outputs::written`] is called,
    /// a missing or different file does not count as a loss.
    pub fn changing(&self, output: &Path) {
        if let Some(shared) = &self.0 {
            shared.book().written.remove(output);
        }
    }

    /// Registers an output. `mark` is the fingerprint of exactly the written file.
    pub fn written(&self, output: &Path, file: &Arc<Path>, fingerprint: FileFingerprint) {
        let Some(shared) = &self.0 else { return };
        let mut book = shared.book();
        let written = Written {
            file: file.clone(),
            fingerprint,
            is_told: false,
        };
        book.written.insert(output.into(), written);
        let Some(directory) = output.parent() else {
            return;
        };
        if !book.directories.contains(directory) {
            book.directories.insert(directory.to_path_buf());
            book.fresh.push(directory.to_path_buf());
            drop(book);
            shared.bell.ring();
        }
    }

    /// Checks whether the loss of an output was reported and the output was not written again since then.
    pub fn is_told(&self, output: &Path) -> bool {
        let shared = self.0.as_ref();
        shared.is_some_and(|it| it.book().written.get(output).is_some_and(|it| it.is_told))
    }

    /// Checks whether an output was written and is now missing or replaced by another file.
    pub fn is_lost(&self, output: &Path) -> bool {
        let shared = self.0.as_ref();
        shared.is_some_and(|it| it.look(output, |_| true).is_some())
    }
}

impl Shared {
    fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns an output that is lost and `wanted`. The comparison with the written file runs without the lock, so
    /// writers do not wait for the disk. If the output is written meanwhile, the comparison is repeated.
    fn look(&self, output: &Path, wanted: impl Fn(&mut Written) -> bool) -> Option<LostOutput> {
        loop {
            let known = self.book().written.get(output)?.fingerprint;
            // If the system does not answer, the output counts as unchanged.
            let there = foreign::access(output, || Ok(FileFingerprint::at(output))).ok()?;
            if there.as_ref() == Some(&known) {
                return None;
            }
            let mut book = self.book();
            let written = book.written.get_mut(output)?;
            if written.fingerprint != known {
                continue;
            }
            return wanted(written).then(|| LostOutput {
                file: written.file.clone(),
                output: output.into(),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, channel};

    use super::*;

    struct WrittenDir {
        dir: tempfile::TempDir,
        outputs: Outputs,
        told: Receiver<Vec<LostOutput>>,
        _watch: OutputWatch,
    }

    impl WrittenDir {
        fn new() -> WrittenDir {
            let outputs = Outputs::kept().unwrap();
            let (tell, told) = channel();
            let watch = outputs.watch(Box::new(move |lost| drop(tell.send(lost))));
            WrittenDir {
                dir: tempfile::tempdir().unwrap(),
                outputs,
                told,
                _watch: watch.unwrap().unwrap(),
            }
        }

        fn write(&self, name: &str) -> PathBuf {
            let output = self.dir.path().join(name);
            std::fs::create_dir_all(output.parent().unwrap()).unwrap();
            self.outputs.changing(&output);
            std::fs::write(&output, name).unwrap();
            let fingerprint = FileFingerprint::at(&output).unwrap();
            self.outputs
                .written(&output, &Path::new("/a.xodr").into(), fingerprint);
            output
        }

        /// Returns the next reported output. The test runner's watchdog limits the wait.
        fn next(&self) -> PathBuf {
            let mut lost = self.told.recv().unwrap();
            assert_eq!(lost.len(), 1, "{lost:?}");
            lost.remove(0).output.to_path_buf()
        }
    }

    #[test]
    fn removed_changed_and_replaced_outputs_are_reported_once() {
        let place = WrittenDir::new();
        let output = place.write("sub/a.xqar");
        assert!(!place.outputs.is_lost(&output));
        std::fs::remove_file(&output).unwrap();
        assert_eq!(place.next(), output);
        place.write("sub/a.xqar");
        std::fs::write(&output, "another text").unwrap();
        assert_eq!(place.next(), output);
        place.write("sub/a.xqar");
        let other = place.dir.path().join("other");
        std::fs::write(&other, "sub/a.xqar").unwrap();
        std::fs::rename(&other, &output).unwrap();
        assert_eq!(place.next(), output);
        assert!(place.told.try_recv().is_err());
    }

    #[test]
    fn outputs_below_moved_directory_are_reported() {
        let place = WrittenDir::new();
        let output = place.write("one/two/a.xqar");
        place.write("one/b.xqar");
        let (from, to) = (place.dir.path().join("one"), place.dir.path().join("gone"));
        std::fs::rename(from, to).unwrap();
        let mut told = Vec::new();
        while told.len() < 2 {
            told.extend(place.told.recv().unwrap());
        }
        assert!(told.iter().any(|it| *it.output == *output), "{told:?}");
        // Both directories are watched again.
        place.write("one/two/a.xqar");
        std::fs::remove_file(&output).unwrap();
        assert_eq!(place.next(), output);
    }

    #[test]
    fn output_changed_by_broker_is_not_lost() {
        let place = WrittenDir::new();
        let output = place.write("a.xqar");
        place.outputs.changing(&output);
        std::fs::remove_file(&output).unwrap();
        assert!(!place.outputs.is_lost(&output));
        let other = place.write("b.xqar");
        std::fs::remove_file(&other).unwrap();
        assert_eq!(
            place.next(),
            other,
            "the loss of the first output is not reported"
        );
    }

    #[test]
    fn output_lost_before_watching_is_reported() {
        let outputs = Outputs::kept().unwrap();
        let dir = tempfile::tempdir().unwrap();
        let output = dir.path().join("a.xqar");
        std::fs::write(&output, "").unwrap();
        let fingerprint = FileFingerprint::at(&output).unwrap();
        outputs.written(&output, &Path::new("/a.xodr").into(), fingerprint);
        std::fs::remove_file(&output).unwrap();
        assert!(outputs.is_lost(&output));
        let (tell, told) = channel();
        let _watch = outputs.watch(Box::new(move |lost| drop(tell.send(lost))));
        assert_eq!(&*told.recv().unwrap()[0].output, &*output);
    }
}
