//! Writes a result, its verdict file and its journal entry, and publishes the file.

use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;

use qcbus_disk::{FileFingerprint, write_both, write_whole};
use qcbus_environment::{disk, reached, step};
use qcbus_formats::pool::Pooled;
use qcbus_formats::xqar;
use qcbus_types::{FinishedJob, Judged, LostOutput};

use super::history::history;
use super::{Store, Unwritten, unwritten};
use crate::journal::Entry;
use crate::verdict_file;

impl Store {
    pub(super) fn write(
        &self,
        job: &FinishedJob,
        pooled: &Pooled,
        judged: &Judged,
    ) -> Result<(), Unwritten> {
        self.lock.hold().map_err(|error| Unwritten {
            what: error.to_string(),
            further: "; it is retried",
            for_good: false,
        })?;
        if let Some(gate) = &self.gate {
            let made_way = if judged.is_accepted() {
                gate.make_way(&job.path, judged)
            } else {
                gate.refuse(&job.path)
            };
            made_way.map_err(|error| unwritten(&gate.place(&job.path), &error))?;
            step("made way", &job.path);
        }
        let written = self.write_files(job, pooled, judged)?;
        step("named", &job.path);
        if let Some(gate) = self.gate.as_ref().filter(|_| judged.is_accepted()) {
            let published = gate.accept(&job.path, judged);
            published.map_err(|error| unwritten(&gate.place(&job.path), &error))?;
        }
        reached("written", &job.path);
        let entry = Entry::Judged {
            path: job.path.clone(),
            judged: Arc::new(judged.clone()),
            history: Some(Box::new(history(job, pooled))),
            written,
        };
        self.record(&[entry]).map_err(|what| Unwritten {
            what,
            further: "; it is retried",
            for_good: false,
        })
    }

    /// Writes the result and the verdict file, and returns the fingerprint of the verdict file.
    fn write_files(
        &self,
        job: &FinishedJob,
        pooled: &Pooled,
        judged: &Judged,
    ) -> Result<Option<FileFingerprint>, Unwritten> {
        let memory = TEXT.take();
        let text = xqar::write_into(memory, &pooled.results, self.dialect);
        let written = self.write_texts(job, pooled, judged, &text);
        if text.capacity() <= MOST_KEPT {
            TEXT.set(text);
        }
        written
    }

    fn write_texts(
        &self,
        job: &FinishedJob,
        pooled: &Pooled,
        judged: &Judged,
        text: &str,
    ) -> Result<Option<FileFingerprint>, Unwritten> {
        let xqar = self.places.xqar(&job.path);
        let result = (&*xqar, text.as_bytes());
        disk().map_err(|error| unwritten(&xqar, &error))?;
        self.outputs.changing(&xqar);
        if !self.verdict_files {
            let written = write_whole(result.0, result.1, self.durable);
            written.map_err(|error| unwritten(&xqar, &error))?;
            if let Some(fingerprint) = FileFingerprint::at(&xqar) {
                self.outputs.written(&xqar, &job.path, fingerprint);
            }
            return Ok(None);
        }
        let outside = self.gate.as_ref().map(|gate| gate.outside(&judged.inputs));
        let verdict = verdict_file::render(job, pooled, judged, outside);
        let path = self.places.verdict(&job.path);
        self.outputs.changing(&path);
        // A reader that sees the new result also sees its verdict.
        let written = write_both((&path, &verdict), result, self.durable);
        let [first, second] = written.map_err(|(path, error)| unwritten(path, &error))?;
        self.outputs.written(&path, &job.path, first);
        self.outputs.written(&xqar, &job.path, second);
        Ok(Some(first))
    }

    /// Returns the outputs of a file that are missing or replaced by another file.
    pub fn lost_outputs(&self, file: &Arc<Path>) -> Vec<LostOutput> {
        let results = [self.places.xqar(file), self.places.verdict(file)];
        let copy = self.gate.as_ref().map(|gate| gate.place(file));
        let places = results.into_iter().chain(copy);
        let lost = places.filter(|it| self.outputs.is_lost(it));
        lost.map(|output| LostOutput {
            file: file.clone(),
            output: output.into(),
        })
        .collect()
    }
}

thread_local! {
    /// Buffer of the last result's text. It is reused because an allocation for every small file
    /// costs more than writing the text.
    static TEXT: Cell<String> = const { Cell::new(String::new()) };
}

/// Maximum number of bytes that a thread keeps for the next text.
const MOST_KEPT: usize = 1 << 20;
