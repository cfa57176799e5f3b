//! The claims, and what lies behind the gate because of them. No bytes are read or written here:
//! files that have been written aside get their names, or lose them.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_messages::Digest;
use qcbus_messages::path_text::to_text;

use crate::outputs::Outputs;
use crate::result_paths::ResultPaths;
use qcbus_disk::{FileFingerprint, Temporary, remove, remove_empty_above};

/// A file that an acceptance rests on, besides the accepted one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Need {
    pub(super) path: Arc<Path>,
    pub(super) digest: Digest,
    /// In bytes.
    pub(super) size: u64,
    /// It gets a verdict of its own; otherwise it lies behind the gate for those who need it.
    pub(super) judged: bool,
}

/// An acceptance.
#[derive(Debug, Clone)]
pub(super) struct Publication {
    pub(super) digest: Digest,
    /// In bytes.
    pub(super) size: u64,
    pub(super) needs: Vec<Need>,
    /// Why it is never published as it is, if so: for a person.
    pub(super) refused: Option<String>,
    /// It lies behind the gate with everything that it rests on.
    pub(super) published: bool,
    /// It was said that it is held back.
    pub(super) told: bool,
    /// Tells this claim from others on the same file.
    pub(super) serial: u64,
}

impl Publication {
    /// Whether both say the same of the same bytes.
    pub(super) fn agrees(&self, other: &Publication) -> bool {
        (self.digest, &self.needs, &self.refused) == (other.digest, &other.needs, &other.refused)
    }
}

/// A file behind the gate.
#[derive(Debug)]
struct Lying {
    digest: Digest,
    /// The published files that it is there for, itself among them if it is one.
    users: BTreeSet<Arc<Path>>,
}

/// What is to be published in one step.
#[derive(Debug)]
pub(super) struct Plan {
    /// The accepted files with the numbers of their claims, each after those that it rests on.
    roots: Vec<(Arc<Path>, u64)>,
    /// The files that do not lie behind the gate yet.
    pub(super) lacking: Vec<(Arc<Path>, Digest)>,
}

/// What is to be done about a claim.
#[derive(Debug)]
pub(super) enum PublicationState {
    /// Nothing: there is none, or it is published.
    Settled,
    /// It can be published.
    Ready(Plan),
    /// It is held back.
    HeldBack {
        /// Why: for a person.
        why: String,
        /// It will stay so until another verdict comes.
        lasting: bool,
    },
}

/// Copies that have been written and have no names yet.
pub(super) type Copies = HashMap<Arc<Path>, (Digest, Temporary)>;

/// All claims.
#[derive(Debug)]
pub(super) struct Publications {
    directory: PathBuf,
    paths: ResultPaths,
    outputs: Outputs,
    publications: HashMap<Arc<Path>, Publication>,
    /// By file: the claims that rest on it.
    resting: HashMap<Arc<Path>, BTreeSet<Arc<Path>>>,
    lying: HashMap<Arc<Path>, Lying>,
    /// Files whose verdict is no acceptance.
    refused: HashSet<Arc<Path>>,
    /// Copies that nobody needs and that could not be removed.
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

    /// Where a file lies behind the gate.
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

    /// Whether nobody has removed or changed what lies behind the gate for a claim.
    pub(super) fn is_whole(&self, path: &Arc<Path>) -> bool {
        let Some(publication) = self.get(path) else {
            return true;
        };
        let files = self.files_of(path, publication).into_iter();
        let mut places = files.map(|(file, _)| self.place(&file));
        !places.any(|place| self.outputs.is_lost(&place))
    }

    /// Puts a claim in; there must be none of this file.
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

    /// The claims that rest on a file.
    pub(super) fn resting_on(&self, path: &Path) -> Vec<Arc<Path>> {
        let resting = self.resting.get(path).into_iter().flatten();
        resting.cloned().collect()
    }

    /// A file has another verdict than an acceptance.
    pub(super) fn refuse(&mut self, path: &Arc<Path>) {
        self.refused.insert(path.clone());
    }

    /// Nothing is known of a file any more.
    pub(super) fn forget(&mut self, path: &Path) {
        self.refused.remove(path);
    }

    /// What is to be done about a claim: it is published with those that it rests on and that are
    /// not published yet.
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
                    // One of the two is out of date and is judged anew. Until then nothing can satisfy
                    // both, however often it is tried.
                    Some((_, other)) if *other != digest => {
                        let file = to_text(&file);
                        let why = format!(
                            "it was accepted with other bytes of {file} than what it rests on"
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

    /// Why a claim cannot be published for its own sake, or for a claim that is not what it needs.
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
            format!("it rests on {shown}, which is not accepted")
        } else {
            format!("it waits for {shown} to be accepted")
        };
        PublicationState::HeldBack { why, lasting }
    }

    /// Whether a need must have a claim of its own.
    fn is_judged(&self, need: &Need) -> bool {
        need.judged
            || self.publications.contains_key(&need.path)
            || self.refused.contains(&need.path)
    }

    /// The files that lie behind the gate for the sake of one claim, the accepted one last.
    fn files_of(&self, path: &Arc<Path>, publication: &Publication) -> Vec<(Arc<Path>, Digest)> {
        let fragments = publication
            .needs
            .iter()
            .filter(|need| !self.is_judged(need));
        let fragments = fragments.map(|need| (need.path.clone(), need.digest));
        let own = (path.clone(), publication.digest);
        fragments.chain([own]).collect()
    }

    /// Publishes what was planned, unless the claims have changed meanwhile: then `false`, and
    /// nothing of it lies behind the gate.
    ///
    /// # Errors
    /// When a file cannot get or lose its name; what is published then is complete.
    pub(super) fn publish(&mut self, plan: &Plan, mut copies: Copies) -> io::Result<bool> {
        // Other bytes in these places are older: whatever is published with them goes first.
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
                // What was put there for it is needed by nobody; what rests on it, if files refer to
                // each other, is not complete.
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

    /// Gives the files of one claim their names, the accepted one last: with that it is published.
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

    /// Gives a copy its name; without one, the file lies there already.
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

    /// Takes a file from behind the gate: everything that rests on it goes first, then it goes
    /// itself, then what nobody needs any more. The claims stay.
    ///
    /// # Errors
    /// When something cannot be removed; what is still published then is complete.
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

    /// Closes, and drops the claim.
    ///
    /// # Errors
    /// As [`Publications::close`]; the claim stays then.
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

    /// A claim is not published any more: what lay there for it alone is litter.
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

    /// Takes for published whatever lies behind the gate completely. `lies` says whether a file with these
    /// bytes is in its place. Drops the other claims, and returns whose they were.
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
        // Whatever rests on what is not complete is not complete either.
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
            // All of it lies there, so that nothing is named.
            let _ = self.put(&root, &mut Copies::new());
        }
        for path in &left {
            self.revoke(path)?;
        }
        Ok(left)
    }

    /// Where everything lies that belongs behind the gate.
    pub(super) fn places(&self) -> HashSet<PathBuf> {
        self.lying.keys().map(|path| self.place(path)).collect()
    }
}

/// Gives a copy its name. A directory that was left empty is no hindrance.
fn name(copy: Temporary, place: &Path) -> io::Result<()> {
    match copy.persist(place) {
        Ok(()) => Ok(()),
        Err(refused) if std::fs::remove_dir(place).is_ok() => {
            refused.file.persist(place).map_err(|again| again.error)
        }
        Err(refused) => Err(refused.error),
    }
}

/// All paths that can be reached by `before`, each after those that `before` gives for it.
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
