//! Publications, and the files that lie behind the gate because of them. This module reads and
//! writes no bytes: it only gives names to files that are already written, or removes them.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_disk::{FileFingerprint, Temporary, remove, remove_empty_above};
use qcbus_messages::Digest;
use qcbus_messages::path_text::to_text;

use crate::outputs::Outputs;
use crate::result_paths::ResultPaths;

/// A file that an accepted file depends on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Need {
    pub(super) path: Arc<Path>,
    pub(super) digest: Digest,
    /// Size in bytes.
    pub(super) size: u64,
    /// Whether the file gets a verdict of its own. Otherwise it lies behind the gate for the files that need it.
    pub(super) judged: bool,
}

/// Publication of an accepted file.
#[derive(Debug, Clone)]
pub(super) struct Publication {
    pub(super) digest: Digest,
    /// Size in bytes.
    pub(super) size: u64,
    pub(super) needs: Vec<Need>,
    /// Reason, shown to the user, why the file is never published in this version, or `None`.
    pub(super) refused: Option<String>,
    /// Whether the file lies behind the gate with everything that it depends on.
    pub(super) published: bool,
    /// Whether the user was informed that the file is held back.
    pub(super) told: bool,
    /// Distinguishes this publication from others of the same file.
    pub(super) serial: u64,
}

impl Publication {
    /// Checks whether both publications have the same digest, the same needs and the same refusal.
    pub(super) fn agrees(&self, other: &Publication) -> bool {
        (self.digest, &self.needs, &self.refused) == (other.digest, &other.needs, &other.refused)
    }
}

/// A file behind the gate.
#[derive(Debug)]
struct Lying {
    digest: Digest,
    /// Published files that need this file. A file that is published itself is in its own set.
    users: BTreeSet<Arc<Path>>,
}

/// Files that are published in one step.
#[derive(Debug)]
pub(super) struct Plan {
    /// Accepted files with the serial numbers of their publications. Each comes after those that it depends on.
    roots: Vec<(Arc<Path>, u64)>,
    /// Files that do not lie behind the gate yet.
    pub(super) lacking: Vec<(Arc<Path>, Digest)>,
}

/// State of a publication: which step comes next.
#[derive(Debug)]
pub(super) enum PublicationState {
    /// No step: there is no publication, or the file is already published.
    Settled,
    /// The file can be published.
    Ready(Plan),
    /// The file is held back.
    HeldBack {
        /// Reason, shown to the user.
        why: String,
        /// Whether the file stays held back until another verdict comes.
        lasting: bool,
    },
}

/// Copies that are written but have no final names yet.
pub(super) type Copies = HashMap<Arc<Path>, (Digest, Temporary)>;

/// All publications.
#[derive(Debug)]
pub(super) struct Publications {
    directory: PathBuf,
    paths: ResultPaths,
    outputs: Outputs,
    publications: HashMap<Arc<Path>, Publication>,
    /// For each file: the publications that depend on it.
    resting: HashMap<Arc<Path>, BTreeSet<Arc<Path>>>,
    lying: HashMap<Arc<Path>, Lying>,
    /// Files with a verdict other than an acceptance.
    refused: HashSet<Arc<Path>>,
    /// Copies that are no longer needed and still have to be removed.
    litter: BTreeSet<PathBuf>,
    next_serial: u64,
}

impl Publications {
    pub(super) fn new(directory: PathBuf, paths: ResultPaths, outputs: Outputs) -> Publications {
        Publications {
            directory,
            paths,
            outputs,
            publications: HashMap::new(),
            resting: HashMap::new(),
            lying: HashMap::new(),
            refused: HashSet::new(),
            litter: BTreeSet::new(),
            next_serial: 0,
        }
    }

    /// Returns the place of a file behind the gate.
    pub(super) fn place(&self, path: &Path) -> PathBuf {
        self.directory.join(self.paths.relative(path))
    }

    pub(super) fn get(&self, path: &Path) -> Option<&Publication> {
        self.publications.get(path)
    }

    pub(super) fn get_mut(&mut self, path: &Path) -> Option<&mut Publication> {
        self.publications.get_mut(path)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (&Arc<Path>, &Publication)> {
        self.publications.iter()
    }

    pub(super) fn is_published(&self, path: &Path) -> bool {
        self.get(path)
            .is_some_and(|publication| publication.published)
    }

    /// Checks whether the files behind the gate for a publication are still there and unchanged.
    pub(super) fn is_whole(&self, path: &Arc<Path>) -> bool {
        let Some(publication) = self.get(path) else {
            return true;
        };
        let files = self.files_of(path, publication).into_iter();
        let mut places = files.map(|(file, _)| self.place(&file));
        !places.any(|place| self.outputs.is_lost(&place))
    }

    /// Inserts a publication. There must be no other publication of this file.
    pub(super) fn insert(&mut self, path: &Arc<Path>, publication: Publication) {
        self.next_serial += 1;
        for need in &publication.needs {
            let resting = self.resting.entry(need.path.clone()).or_default();
            resting.insert(path.clone());
        }
        let publication = Publication {
            serial: self.next_serial,
            ..publication
        };
        self.refused.remove(path);
        self.publications.insert(path.clone(), publication);
    }

    /// Returns the publications that depend on a file.
    pub(super) fn resting_on(&self, path: &Path) -> Vec<Arc<Path>> {
        let resting = self.resting.get(path).into_iter().flatten();
        resting.cloned().collect()
    }

    /// Records that a file has a verdict other than an acceptance.
    pub(super) fn refuse(&mut self, path: &Arc<Path>) {
        self.refused.insert(path.clone());
    }

    /// Removes the record that a file was refused.
    pub(super) fn forget(&mut self, path: &Path) {
        self.refused.remove(path);
    }

    /// Returns the next step for a publication. Unpublished ones that it depends on are included.
    pub(super) fn state_of_publication(&self, root: &Arc<Path>) -> PublicationState {
        if self
            .get(root)
            .is_none_or(|publication| publication.published)
        {
            return PublicationState::Settled;
        }
        let unpublished = |path: &Path| -> Vec<Arc<Path>> {
            let needs = self
                .get(path)
                .map_or(&[][..], |publication| &publication.needs);
            let needs = needs.iter().filter(|need| self.is_judged(need));
            let needs = needs.filter(|need| !self.is_published(&need.path));
            needs.map(|need| need.path.clone()).collect()
        };
        let order = each_after(vec![root.clone()], unpublished);
        let mut plan = Plan {
            roots: Vec::new(),
            lacking: Vec::new(),
        };
        for path in order {
            let Some(publication) = self.get(&path) else {
                return self.held_by(&path);
            };
            if let Some(held) = self.held(publication) {
                return held;
            }
            for (file, digest) in self.files_of(&path, publication) {
                let lies = self.lying.get(&file).is_some_and(|it| it.digest == digest);
                if lies {
                    continue;
                }
                match plan.lacking.iter().find(|(other, _)| *other == file) {
                    // One of the two verdicts is out of date, and the file is judged again. Until
                    // then a retry cannot satisfy both.
                    Some((_, other)) if *other != digest => {
                        let file = to_text(&file);
                        let why = format!(
                            "{file} changed between the verdicts of two files that belong together; they are judged again first"
                        );
                        let lasting = false;
                        return PublicationState::HeldBack { why, lasting };
                    }
                    Some(_) => {}
                    None => plan.lacking.push((file, digest)),
                }
            }
            plan.roots.push((path, publication.serial));
        }
        PublicationState::Ready(plan)
    }

    /// Returns the reason why a file is not published: it is refused, or a need was not accepted with these bytes.
    fn held(&self, publication: &Publication) -> Option<PublicationState> {
        if let Some(why) = &publication.refused {
            return Some(PublicationState::HeldBack {
                why: why.clone(),
                lasting: true,
            });
        }
        let mut judged = publication.needs.iter().filter(|need| self.is_judged(need));
        let differs = |need: &&Need| {
            let there = self.get(&need.path);
            there.is_none_or(|publication| publication.digest != need.digest)
        };
        judged.find(differs).map(|need| self.held_by(&need.path))
    }

    fn held_by(&self, path: &Path) -> PublicationState {
        let (shown, lasting) = (to_text(path), self.refused.contains(path));
        let why = if lasting {
            format!("it depends on {shown}, which is not accepted")
        } else {
            format!("it waits for {shown} to be accepted")
        };
        PublicationState::HeldBack { why, lasting }
    }

    /// Checks whether a needed file must have a publication of its own.
    fn is_judged(&self, need: &Need) -> bool {
        need.judged
            || self.publications.contains_key(&need.path)
            || self.refused.contains(&need.path)
    }

    /// Returns the files that lie behind the gate for one publication. The accepted file is the last.
    fn files_of(&self, path: &Arc<Path>, publication: &Publication) -> Vec<(Arc<Path>, Digest)> {
        let fragments = publication
            .needs
            .iter()
            .filter(|need| !self.is_judged(need));
        let fragments = fragments.map(|need| (need.path.clone(), need.digest));
        let own = (path.clone(), publication.digest);
        fragments.chain([own]).collect()
    }

    /// Publishes the files of a plan. Returns `false` if the publications have changed since then.
    /// In that case the files of the plan are not published.
    ///
    /// # Errors
    /// When a file cannot get or lose its name. The files that are still published are complete
    /// then.
    pub(super) fn publish(&mut self, plan: &Plan, mut copies: Copies) -> io::Result<bool> {
        // Other bytes in these places are older. Everything published with them is removed first.
        for (path, digest) in &plan.lacking {
            let other = self.lying.get(path).filter(|it| it.digest != *digest);
            let users: Vec<Arc<Path>> = other
                .into_iter()
                .flat_map(|it| it.users.iter().cloned())
                .collect();
            for user in users {
                self.close(&user)?;
            }
        }
        if !self.still_holds(plan, &copies) {
            return Ok(false);
        }
        for (root, _) in &plan.roots {
            if let Err(error) = self.put(root, &mut copies) {
                // The files put there for this root are no longer needed. Files that depend on it,
                // in a cycle of references, are not complete.
                self.drop_user(root);
                self.close(root)?;
                return Err(error);
            }
        }
        Ok(true)
    }

    fn still_holds(&self, plan: &Plan, copies: &Copies) -> bool {
        plan.roots.iter().all(|(root, serial)| {
            let Some(publication) = self.get(root).filter(|it| it.serial == *serial) else {
                return false;
            };
            let there = |(path, digest): &(Arc<Path>, Digest)| {
                let lies = self.lying.get(path).map(|it| it.digest);
                let copied = copies.get(path).map(|it| it.0);
                lies == Some(*digest) || copied == Some(*digest)
            };
            let accepted = |need: &Need| {
                let planned = plan.roots.iter().any(|(root, _)| *root == need.path);
                planned || self.is_published(&need.path)
            };
            let mut judged = publication.needs.iter().filter(|need| self.is_judged(need));
            self.held(publication).is_none()
                && judged.all(accepted)
                && self.files_of(root, publication).iter().all(there)
        })
    }

    /// Gives the files of one publication their names. The accepted file is the last, which publishes it.
    fn put(&mut self, root: &Arc<Path>, copies: &mut Copies) -> io::Result<()> {
        let Some(publication) = self.get(root) else {
            return Ok(());
        };
        for (path, digest) in self.files_of(root, publication) {
            if !self.lying.contains_key(&path) {
                self.lay(&path, copies.remove(&path).map(|it| it.1))?;
            }
            let lying = self.lying.entry(path).or_insert_with(|| Lying {
                digest,
                users: BTreeSet::new(),
            });
            lying.users.insert(root.clone());
        }
        if let Some(publication) = self.get_mut(root) {
            publication.published = true;
            publication.told = false;
        }
        Ok(())
    }

    /// Gives a copy its final name. Without a copy, the file already lies there.
    fn lay(&mut self, path: &Arc<Path>, copy: Option<Temporary>) -> io::Result<()> {
        let place = self.place(path);
        let fingerprint = FileFingerprint::at(copy.as_ref().map_or(&place, Temporary::path));
        if let Some(copy) = copy {
            self.outputs.changing(&place);
            name(copy, &place)?;
            self.litter.remove(&place);
        }
        if let Some(fingerprint) = fingerprint {
            self.outputs.written(&place, path, fingerprint);
        }
        Ok(())
    }

    /// Removes a file from behind the gate. Everything that depends on it is removed first, then
    /// the file, then the files that are no longer needed. The publications stay recorded.
    ///
    /// # Errors
    /// When a file cannot be removed. The files that are still published are complete then.
    pub(super) fn close(&mut self, path: &Arc<Path>) -> io::Result<()> {
        let published = |path: &Path| -> Vec<Arc<Path>> {
            let mut resting = self.resting_on(path);
            resting.retain(|it| self.is_published(it));
            resting
        };
        let order = each_after(vec![path.clone()], published);
        for root in order {
            if !self.is_published(&root) {
                continue;
            }
            let place = self.place(&root);
            self.outputs.changing(&place);
            remove(&place)?;
            remove_empty_above(&place, &self.directory);
            self.lying.remove(&root);
            if let Some(publication) = self.get_mut(&root) {
                publication.published = false;
            }
            self.drop_user(&root);
        }
        self.tidy()
    }

    /// Removes a file from behind the gate and drops its publication.
    ///
    /// # Errors
    /// As [`Publications::close`]. The publication stays then.
    pub(super) fn revoke(&mut self, path: &Arc<Path>) -> io::Result<()> {
        self.close(path)?;
        let Some(publication) = self.publications.remove(path) else {
            return Ok(());
        };
        for need in publication.needs {
            if let Some(resting) = self.resting.get_mut(&need.path) {
                resting.remove(path);
                if resting.is_empty() {
                    self.resting.remove(&need.path);
                }
            }
        }
        Ok(())
    }

    /// Removes a root as a user of its files. Files without another user are scheduled for removal.
    fn drop_user(&mut self, root: &Arc<Path>) {
        let needs = self
            .get(root)
            .map_or(&[][..], |publication| &publication.needs);
        let paths: Vec<Arc<Path>> = needs.iter().map(|need| need.path.clone()).collect();
        for path in paths.into_iter().chain([root.clone()]) {
            let Some(lying) = self.lying.get_mut(&path) else {
                continue;
            };
            lying.users.remove(root);
            if lying.users.is_empty() {
                self.lying.remove(&path);
                let place = self.place(&path);
                self.outputs.changing(&place);
                self.litter.insert(place);
            }
        }
    }

    fn tidy(&mut self) -> io::Result<()> {
        while let Some(litter) = self.litter.first().cloned() {
            remove(&litter)?;
            remove_empty_above(&litter, &self.directory);
            self.litter.remove(&litter);
        }
        Ok(())
    }

    /// Marks every publication as published if its files are completely behind the gate. `lies` checks whether a file
    /// with these bytes is in its place. Drops the other publications and returns their files.
    pub(super) fn take_over(
        &mut self,
        mut lies: impl FnMut(&Path, u64, Digest) -> bool,
    ) -> io::Result<Vec<Arc<Path>>> {
        let by_themselves = |(path, publication): (&Arc<Path>, &Publication)| {
            let fragments = publication
                .needs
                .iter()
                .filter(|need| !self.is_judged(need));
            let mut files = fragments
                .map(|need| (&need.path, need.size, need.digest))
                .chain([(path, publication.size, publication.digest)]);
            (self.held(publication).is_none() && files.all(|(path, size, it)| lies(path, size, it)))
                .then(|| path.clone())
        };
        let mut complete: HashSet<Arc<Path>> =
            self.publications.iter().filter_map(by_themselves).collect();
        // A publication that depends on an incomplete one is incomplete, too.
        let mut open: Vec<Arc<Path>> = self.publications.keys().cloned().collect();
        open.retain(|path| !complete.contains(path));
        let mut left = open.clone();
        while let Some(path) = open.pop() {
            for resting in self.resting_on(&path) {
                if complete.remove(&resting) {
                    left.push(resting.clone());
                    open.push(resting);
                }
            }
        }
        let complete: BTreeSet<Arc<Path>> = complete.into_iter().collect();
        for root in complete {
            // All files already lie there, so no file is renamed and no error can occur.
            let _ = self.put(&root, &mut Copies::new());
        }
        for path in &left {
            self.revoke(path)?;
        }
        Ok(left)
    }

    /// Returns the places of all files that belong behind the gate.
    pub(super) fn places(&self) -> HashSet<PathBuf> {
        self.lying.keys().map(|path| self.place(path)).collect()
    }
}

/// Gives a copy its final name. An empty directory at that place is removed.
fn name(copy: Temporary, place: &Path) -> io::Result<()> {
    match copy.persist(place) {
        Ok(()) => Ok(()),
        Err(refused) if std::fs::remove_dir(place).is_ok() => {
            refused.file.persist(place).map_err(|again| again.error)
        }
        Err(refused) => Err(refused.error),
    }
}

/// Returns all paths reachable through `before`. Each comes after the paths that `before` returns for it.
fn each_after(start: Vec<Arc<Path>>, before: impl Fn(&Path) -> Vec<Arc<Path>>) -> Vec<Arc<Path>> {
    let mut order = Vec::new();
    let mut seen: HashSet<Arc<Path>> = HashSet::new();
    let mut open: Vec<(Arc<Path>, bool)> = start.into_iter().map(|it| (it, false)).collect();
    while let Some((path, is_next)) = open.pop() {
        if is_next {
            order.push(path);
        } else if seen.insert(path.clone()) {
            let first = before(&path);
            open.push((path, true));
            open.extend(first.into_iter().map(|it| (it, false)));
        }
    }
    order
}
