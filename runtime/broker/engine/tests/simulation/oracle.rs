//! Invariants: those of every moment, and those after everything has settled.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use qcbus_disk::FileFingerprint;
use qcbus_messages::control::Response;
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Digest, JobId, Verdict};
use qcbus_publish::journal::Remembered;
use qcbus_publish::result_paths::with_suffix;
use qcbus_types::digest_of;
use serde::Deserialize;

use super::disk::{Disk, FILES, JUDGED, Lying, map_of};
use super::peers::SECOND;
use super::world::{Wait, World};

/// Content of a verdict file, as any program can read it.
#[derive(Debug, Clone, Deserialize)]
struct Written {
    verdict: Verdict,
    sha256: String,
    depends_on: Vec<Dependency>,
    demanded: Vec<String>,
}

impl Written {
    /// Checks whether the bundle that checks maps was required.
    fn maps(&self) -> bool {
        self.demanded.iter().any(|it| it == SECOND)
    }
}

#[derive(Debug, Clone, Deserialize)]
struct Dependency {
    path: String,
    sha256: Option<String>,
}

type Seen<T> = HashMap<PathBuf, (FileFingerprint, T)>;

/// Checks results and gate all the time.
pub struct Scanner {
    pub out: PathBuf,
    pub gate: PathBuf,
    /// Step at which a writer last began to store a result of each file.
    looked: HashMap<PathBuf, usize>,
    /// Step at which a writer last asked for the required bundles of each file.
    asked: HashMap<PathBuf, usize>,
    verdicts: Seen<Option<Written>>,
    published: Seen<Digest>,
}

impl Scanner {
    pub fn new(out: PathBuf, gate: PathBuf) -> Scanner {
        Scanner {
            out,
            gate,
            looked: HashMap::new(),
            asked: HashMap::new(),
            verdicts: HashMap::new(),
            published: HashMap::new(),
        }
    }

    pub fn looks(&mut self, path: &Path, step: usize) {
        self.looked.insert(path.to_path_buf(), step);
    }

    pub fn asks(&mut self, path: &Path, step: usize) {
        self.asked.insert(path.to_path_buf(), step);
    }

    fn verdict(&mut self, file: usize) -> Option<Written> {
        let path = with_suffix(&self.out.join(FILES[file]), ".verdict.json");
        let read = |path: &Path| serde_json::from_slice(&std::fs::read(path).ok()?).ok();
        seen(&mut self.verdicts, path, read).flatten()
    }

    /// Returns the digest of the bytes behind the gate.
    fn published(&mut self, file: usize) -> Option<Digest> {
        let path = self.gate.join(FILES[file]);
        let read = |path: &Path| digest_of(&std::fs::read(path).unwrap_or_default());
        seen(&mut self.published, path, read)
    }
}

/// Returns the value read from a file. The file is read again only if it has changed.
fn seen<T: Clone>(known: &mut Seen<T>, path: PathBuf, read: impl Fn(&Path) -> T) -> Option<T> {
    let fingerprint = FileFingerprint::at(&path)?;
    if let Some((_, value)) = known.get(&path).filter(|it| it.0 == fingerprint) {
        return Some(value.clone());
    }
    let value = read(&path);
    known.insert(path, (fingerprint, value.clone()));
    Some(value)
}

fn is(digest: Option<Digest>, text: &str) -> bool {
    digest.is_some_and(|it| it.to_string() == text)
}

impl World {
    /// Checks a verdict file that has just got its name. It must fit the bytes that existed when
    /// the writer looked, or later.
    pub fn verdict_is_written(&mut self, path: &Path) {
        let Some(file) = self.disk.file_at(path) else {
            return;
        };
        let Some(written) = self.scanner.verdict(file) else {
            return self.wrong(format!(
                "{} has no verdict after it was written",
                FILES[file]
            ));
        };
        let since = self.scanner.looked.get(path).copied().unwrap_or(0);
        let fits = |lying: &&Lying| fits(&self.disk, lying, file, &written);
        let moments: Vec<bool> = self
            .disk
            .since(since)
            .filter(fits)
            .map(|it| self.disk.is_sound(it, file, written.maps()))
            .collect();
        let accepted = written.verdict == Verdict::Accepted;
        if moments.is_empty() && !written.sha256.is_empty() {
            self.wrong(format!(
                "{} is {:?} for what was not there when the writer looked",
                FILES[file], written.verdict
            ));
        } else if accepted && !moments.contains(&true) {
            self.wrong(format!("{} is accepted and must not be", FILES[file]));
        }
        let asked = self.scanner.asked.get(path).copied().unwrap_or(0);
        let must = self.peers.second_since.is_some_and(|since| since < asked);
        if must && !written.maps() {
            let name = FILES[file];
            self.wrong(format!(
                "{name} is judged without one who must judge by now"
            ));
        }
    }

    /// Checks that every file behind the gate is accepted and complete.
    pub fn gate_is_true(&mut self) {
        for (file, name) in FILES.iter().enumerate() {
            let Some(digest) = self.scanner.published(file) else {
                continue;
            };
            if JUDGED.contains(&file) {
                let verdict = self.scanner.verdict(file);
                let stands =
                    |it: &Written| it.verdict == Verdict::Accepted && is(Some(digest), &it.sha256);
                if !verdict.as_ref().is_some_and(stands) {
                    self.wrong(format!(
                        "{name} is behind the gate and not accepted: {verdict:?}"
                    ));
                }
            }
        }
        let mut lying: Lying = [None; FILES.len()];
        for (file, it) in lying.iter_mut().enumerate() {
            *it = self.scanner.published(file);
        }
        for file in JUDGED {
            let maps = self.scanner.verdict(file).is_some_and(|it| it.maps());
            let complete = lying[file].is_none() || self.disk.is_sound(&lying, file, maps);
            let map = map_of(file).is_none_or(|map| lying[map].is_some());
            if !complete || (lying[file].is_some() && !map) {
                let name = FILES[file];
                self.wrong(format!("{name} is behind the gate without what it needs"));
            }
        }
    }

    /// Checks that no stale file is behind the gate while no work is under way.
    pub fn shut_is_shut(&mut self) {
        let open = self.summary.unpublished.iter();
        let mut open = open.filter_map(|path| self.disk.file_at(path));
        let open = open.find(|file| self.scanner.gate.join(FILES[*file]).exists());
        if let Some(file) = open {
            let name = FILES[file];
            self.wrong(format!(
                "{name} is stale, nobody is at work, and it is behind the gate"
            ));
        }
    }

    /// Takes over the answers to waiting clients.
    pub fn hear_answers(&mut self) {
        for mut wait in std::mem::take(&mut self.waits) {
            match wait.answer.try_recv() {
                Ok(response) => self.is_answered(&wait, &response),
                Err(tokio::sync::oneshot::error::TryRecvError::Empty) => self.waits.push(wait),
                // The broker is dead.
                Err(tokio::sync::oneshot::error::TryRecvError::Closed) => {}
            }
        }
    }

    fn is_answered(&mut self, wait: &Wait, response: &Response) {
        let (disk, file) = (&self.disk, wait.file);
        let maps = self.peers.second_since.is_some_and(|it| it < wait.asked);
        let mut moments = disk.since(wait.asked);
        let is_true = match response {
            Response::Verdict(told) => moments.any(|lying| {
                is(lying[file], &told.digest)
                    && match told.verdict {
                        Verdict::Accepted => disk.is_sound(lying, file, maps),
                        Verdict::Rejected => !disk.is_sound(lying, file, true),
                        Verdict::Undetermined => true,
                    }
            }),
            Response::Unwatched { .. } => moments.any(|lying| lying[file].is_none()),
            _ => false,
        };
        drop(moments);
        let name = FILES[file];
        if is_true {
            self.say(|| format!("who waits for {name} is told"));
        } else {
            let asked = wait.asked;
            self.wrong(format!(
                "who waited for {name} since {asked} is told {response:?}"
            ));
        }
    }

    /// Checks the state after everything has settled.
    ///
    /// # Errors
    /// The first violation.
    pub fn unsettled(&mut self) -> Result<(), String> {
        if !self.summary.quiet {
            return Err("there is work left".to_owned());
        }
        let rows = self.serving.as_ref().map(|it| it.store.remembered());
        let rows = rows
            .and_then(Result::ok)
            .ok_or("the journal cannot be read")?;
        let rows: BTreeMap<PathBuf, Remembered> = rows
            .into_iter()
            .map(|it| (it.path.to_path_buf(), it))
            .collect();
        let mut accepted = BTreeSet::new();
        for file in JUDGED {
            let row = rows.get(&self.disk.path(file));
            if self
                .agrees(file, row)
                .map_err(|why| format!("{}: {why}", FILES[file]))?
            {
                accepted.insert(file);
            }
        }
        if let Some(path) = rows.keys().find(|it| self.disk.file_at(it).is_none()) {
            return Err(format!("the journal knows {}", path.display()));
        }
        self.gate_holds(&accepted)?;
        self.no_litter()?;
        self.reports_are_new(&rows)?;
        let there = |it: &&Wait| self.disk.lying[it.file].is_some();
        if let Some(wait) = self.waits.iter().find(there) {
            return Err(format!("somebody still waits for {}", FILES[wait.file]));
        }
        Ok(())
    }

    /// Checks whether a file is accepted, provided that all sources about it agree and are true.
    fn agrees(&mut self, file: usize, row: Option<&Remembered>) -> Result<bool, String> {
        let written = self.scanner.verdict(file);
        let result = with_suffix(&self.scanner.out.join(FILES[file]), ".xqar").exists();
        if self.disk.lying[file].is_none() {
            let nothing = written.is_none() && !result && row.is_none();
            let why = || format!("it is gone: result {result}, {written:?}, journal {row:?}");
            return nothing.then_some(false).ok_or_else(why);
        }
        let (Some(written), Some(row), true) = (written, row, result) else {
            return Err("it has no result, or the journal does not know it".to_owned());
        };
        let judged = &row.judged;
        if judged.verdict != written.verdict {
            return Err(format!("the journal says {:?}", judged.verdict));
        }
        if row.written.as_ref()
            != self
                .scanner
                .verdicts
                .values()
                .map(|it| &it.0)
                .find(|fingerprint| row.written.as_ref() == Some(*fingerprint))
        {
            return Err("the journal knows another verdict file".to_owned());
        }
        // This concerns the file itself or the map that it depends on.
        let given_up = judged.why.iter().any(|it| {
            it.contains("in a new process with only this file")
                || it.contains("is undetermined: see")
        });
        if given_up && self.peers.deaths >= 2 {
            return Ok(false);
        }
        if !fits(&self.disk, &self.disk.lying, file, &written) {
            return Err(format!("its verdict is about other bytes: {written:?}"));
        }
        let digest = self.disk.lying[file];
        if Some(judged.digest) != digest {
            return Err("the journal knows other bytes".to_owned());
        }
        let sound = self.disk.is_sound(&self.disk.lying, file, true);
        let faulty = self.disk.is_faulty(&self.disk.lying, file);
        let is_true = match written.verdict {
            Verdict::Accepted => sound,
            Verdict::Rejected => !sound,
            Verdict::Undetermined => !sound && !faulty,
        };
        let path = with_suffix(&self.scanner.out.join(FILES[file]), ".xqar");
        let why = || {
            let result = std::fs::read_to_string(&path).unwrap_or_default();
            let (verdict, why) = (written.verdict, &judged.why);
            format!("it is {verdict:?}, sound: {sound}; {why:?}\n{result}")
        };
        is_true.then_some(sound).ok_or_else(why)
    }

    fn gate_holds(&mut self, accepted: &BTreeSet<usize>) -> Result<(), String> {
        let published = |file: &usize| {
            let map = map_of(*file);
            accepted.contains(file) && map.is_none_or(|map| accepted.contains(&map))
        };
        for (file, name) in FILES.iter().enumerate() {
            let belongs = match JUDGED.contains(&file) {
                true => published(&file),
                false => {
                    (0..2).any(|map| published(&map) && self.disk.includes(&self.disk.lying, map))
                }
            };
            let expected = self.disk.lying[file].filter(|_| belongs);
            if self.scanner.published(file) != expected {
                return Err(format!(
                    "{name} belongs behind the gate: {belongs}, and is not as it must be"
                ));
            }
        }
        Ok(())
    }

    fn no_litter(&self) -> Result<(), String> {
        let mut open = vec![self.scanner.out.clone(), self.scanner.gate.clone()];
        while let Some(next) = open.pop() {
            for entry in std::fs::read_dir(&next).into_iter().flatten().flatten() {
                let name = entry.file_name().to_string_lossy().into_owned();
                if entry.path().is_dir() {
                    open.push(entry.path());
                } else if name.starts_with(".qcbus-") && name.ends_with(".tmp") {
                    return Err(format!("a half file is left: {}", entry.path().display()));
                }
            }
        }
        Ok(())
    }

    fn reports_are_new(&self, rows: &BTreeMap<PathBuf, Remembered>) -> Result<(), String> {
        let jobs = rows
            .iter()
            .map(|(path, row)| (to_text(path), row.judged.job));
        let jobs: BTreeMap<String, JobId> = jobs.collect();
        let reports = &self.peers.reports;
        (*reports == jobs)
            .then_some(())
            .ok_or_else(|| format!("the reporter has {reports:?}, and there is {jobs:?}"))
    }
}

/// Checks whether a verdict is about the bytes of this state.
fn fits(disk: &Disk, lying: &Lying, file: usize, written: &Written) -> bool {
    let dependency = |it: &Dependency| match disk.file_at(Path::new(&it.path)) {
        // A dependency that could not be read has no digest, either.
        Some(other) => it.sha256.as_ref().is_none_or(|text| is(lying[other], text)),
        None => true,
    };
    is(lying[file], &written.sha256) && written.depends_on.iter().all(dependency)
}
