//! Registry of required bundles, joined or not. It survives restarts. Every change begins a new epoch.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_messages::JobId;
use qcbus_types::{
    Action, Epoch, Judged, Member, Origin, RequiredBundle, RequiredSet, Requirement, VersionDigest,
};

use super::bundles::Bundle;
use super::files::Priority;
use super::jobs::{JobStage, Task, TaskState};
use super::{Actions, State};

/// The requirements by kind of file. They are computed again with every epoch.
pub(super) type Requirements = BTreeMap<FileKind, Arc<[Requirement]>>;

impl State {
    /// Returns the current epoch of the required bundles.
    pub fn epoch(&self) -> Epoch {
        self.epoch
    }

    /// Adds a bundle from the journal. Unwanted children are removed as soon as the wanted children are known.
    pub fn remember_member(&mut self, member: Member) {
        let bundle = Bundle {
            version_digest: member
                .catalogue
                .as_ref()
                .map(|it| VersionDigest::of(&member.version, it, None)),
            version: member.version,
            catalogue: member.catalogue,
            origin: Some(member.origin),
            away_since: Some(self.now),
            note: "it has not joined since the broker was started".to_owned(),
            ..Bundle::default()
        };
        self.bundles.insert(member.name, bundle);
        self.begin_epoch();
    }

    /// Adds all child bundles to the registry. They stay as long as they are children, even if they never joined.
    pub(super) fn enrol_children(&mut self, actions: &mut Actions) {
        let children = self.children.iter();
        let wanted: BTreeSet<String> = children
            .filter(|(_, child)| child.spec.judges())
            .map(|(name, _)| name.clone())
            .collect();
        self.follow_shadows(actions);
        let struck: Vec<String> = self
            .bundles
            .iter()
            .filter(|(name, it)| it.origin == Some(Origin::Supervised) && !wanted.contains(*name))
            .filter(|(_, it)| it.session.is_none())
            .map(|(name, _)| name.clone())
            .collect();
        for name in struck {
            self.drop_bundle(&name, actions);
        }
        for name in wanted {
            self.let_leave(&name);
            let bundle = self.bundles.entry(name.clone()).or_insert_with(|| Bundle {
                away_since: Some(self.now.max(self.settings.collect)),
                note: "it has never joined".to_owned(),
                ..Bundle::default()
            });
            // A bundle that has not joined would be started from the current manifest.
            if let (None, Some(catalogue)) = (bundle.session, &bundle.catalogue) {
                let child = self.children.get(&name).map(|it| it.spec.digest());
                bundle.version_digest = Some(VersionDigest::of(&bundle.version, catalogue, child));
            }
            if bundle.origin.replace(Origin::Supervised).is_none() {
                actions.extend(bundle.as_member(&name).map(Action::Enrol));
            }
        }
        self.begin_epoch();
    }

    /// Lets a draining process be replaced by the next one of its name, which is wanted again.
    fn let_leave(&mut self, name: &str) {
        let now = self.now;
        let Some(bundle) = self.bundles.get_mut(name).filter(|it| it.draining) else {
            return;
        };
        bundle.draining = false;
        bundle.ready = false;
        bundle.away_since = Some(now);
        let (session, launch) = (bundle.session.take(), bundle.launch);
        self.take_back(name, false);
        if let Some(session) = session {
            self.sessions.remove(&session);
            self.retire(session, launch);
        }
    }

    /// Registers a bundle with its catalogue. From now on it is required until it leaves.
    pub(super) fn enrol(&mut self, name: &str, actions: &mut Actions) {
        let supervised = self.children.contains_key(name);
        let Some(bundle) = self.bundles.get(name) else {
            return;
        };
        let Some(catalogue) = &bundle.catalogue else {
            return;
        };
        let version_digest = self.version_digest_of(name, bundle, catalogue);
        let is_shadow = self.is_shadow(name);
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        if is_shadow {
            bundle.version_digest = Some(version_digest);
            return self.shadow_is_ready(name, version_digest, actions);
        }
        let origin = if supervised {
            Origin::Supervised
        } else {
            Origin::Joined
        };
        let known = bundle.version_digest.replace(version_digest) == Some(version_digest)
            && bundle.origin == Some(origin);
        if bundle.draining {
            return;
        }
        bundle.origin = Some(origin);
        if !known {
            actions.extend(bundle.as_member(name).map(Action::Enrol));
            self.begin_epoch();
        }
        // This also applies to a bundle that returns, because jobs that finished without it are not settled.
        self.reseat = true;
    }

    /// Removes a bundle from the registry.
    pub(super) fn strike(&mut self, name: &str, actions: &mut Actions) {
        let Some(bundle) = self.bundles.remove(name) else {
            return;
        };
        if bundle.origin.is_some() {
            let name = name.to_owned();
            actions.push(Action::Strike { name });
            self.begin_epoch();
        }
    }

    /// Removes a bundle from the registry on request of a user.
    ///
    /// # Errors
    /// Returns the reason for the user if this is not possible.
    pub(super) fn remove_bundle(
        &mut self,
        name: &str,
        actions: &mut Actions,
    ) -> Result<String, String> {
        if self.children.contains_key(name) {
            return Err(format!(
                "{name} comes from a manifest or with qcbus; remove the manifest, or start qcbus \
                 with --no-standard-bundles"
            ));
        }
        let Some(bundle) = self.bundles.get(name) else {
            return Err(format!("bundle {name} not found; see `qcbus bundle list`"));
        };
        if bundle.session.is_some() {
            self.drain_peer(name, actions);
            return Ok(format!("{name} was asked to finish and leave"));
        }
        self.drop_bundle(name, actions);
        Ok(format!("{name} is no longer required"))
    }

    /// Begins a new epoch, because the required bundles or the demand on them has changed.
    pub(super) fn begin_epoch(&mut self) {
        self.epoch = self.epoch.next();
        let kinds = FileKind::ALL.into_iter();
        self.requirements = kinds
            .map(|kind| (kind, self.requirements_for(kind).into()))
            .collect();
        self.reseat = true;
    }

    /// Returns the required bundles for files of a kind with their checkers, by name.
    fn requirements_for(&self, kind: FileKind) -> Vec<Requirement> {
        let mut requirements: BTreeMap<String, Requirement> = BTreeMap::new();
        for (name, bundle) in &self.bundles {
            if let Some(requirement) = self.requirement_of(name, bundle, kind) {
                requirements.insert(name.clone(), requirement);
            }
        }
        for name in self.missing_by_name() {
            let requirement = Requirement {
                name: name.clone(),
                version: String::new(),
                catalogue: None,
                version_digest: None,
                demanded: Arc::default(),
            };
            requirements.entry(name).or_insert(requirement);
        }
        requirements.into_values().collect()
    }

    fn requirement_of(&self, name: &str, bundle: &Bundle, kind: FileKind) -> Option<Requirement> {
        // A draining bundle is no longer in the registry, and a shadow never is.
        bundle.origin?;
        self.place_of(name, bundle, kind)
    }

    /// Returns the requirement that a bundle would have for files of a kind.
    pub(super) fn place_of(
        &self,
        name: &str,
        bundle: &Bundle,
        kind: FileKind,
    ) -> Option<Requirement> {
        let alias = bundle.catalogue.as_ref().map_or("", |it| it.alias.as_str());
        if !self.demand.wants_bundle(name, alias) {
            return None;
        }
        let mut demanded = Vec::new();
        if let Some(catalogue) = &bundle.catalogue {
            demanded = self.demand.checkers(name, catalogue, kind);
            if demanded.is_empty() || !catalogue.kinds.contains(&kind) {
                return None;
            }
        }
        Some(Requirement {
            name: name.to_owned(),
            version: bundle.version.clone(),
            catalogue: bundle.catalogue.clone(),
            version_digest: bundle.version_digest,
            demanded: demanded.into(),
        })
    }

    /// Returns the bundles that the configuration names and that were never seen. A named shadow is not required.
    pub(super) fn missing_by_name(&self) -> Vec<String> {
        let means = |named: &str, name: &str, alias: &str| self.demand.means(named, name, alias);
        let is_shadow = |named: &str| {
            let mut children = self.children.iter();
            children.any(|(name, it)| it.spec.shadow && means(named, name, ""))
        };
        let seen = |named: &str| {
            let mut bundles = self.bundles.iter();
            bundles.any(|(name, bundle)| {
                let alias = bundle.catalogue.as_ref().map_or("", |it| it.alias.as_str());
                // Draining bundles and shadows do not count.
                let judges = bundle.catalogue.is_some() && bundle.origin.is_some();
                judges && means(named, name, alias)
            })
        };
        let named = self.demand.named().into_iter();
        named
            .filter(|named| !is_shadow(named) && !seen(named))
            .collect()
    }

    pub(super) fn requirements(&self, kind: FileKind) -> Arc<[Requirement]> {
        self.requirements.get(&kind).cloned().unwrap_or_default()
    }

    /// Checks whether a verdict was given under the current configuration by the bundles that are required now.
    pub(super) fn stands(&self, kind: FileKind, judged: &Judged) -> bool {
        let requirements = self.requirements(kind);
        let same = |(requirement, required_bundle): (&Requirement, &RequiredBundle)| {
            requirement.name == required_bundle.name
                && self.is_served_by(requirement, required_bundle.version_digest)
        };
        judged.config == self.config
            && judged.rests_on.is_some()
            && requirements.len() == judged.required_set.0.len()
            && requirements.iter().zip(&judged.required_set.0).all(same)
    }

    /// Checks whether a requirement is met. Either the bundle answered with its current version
    /// digest, or it is missing and waiting for it is useless.
    fn is_served_by(
        &self,
        requirement: &Requirement,
        version_digest: Option<VersionDigest>,
    ) -> bool {
        match version_digest {
            Some(version_digest) => requirement.version_digest == Some(version_digest),
            None => self.hopeless(&requirement.name).is_some(),
        }
    }

    /// Returns the required set of a job.
    pub(super) fn required_set(tasks: &BTreeMap<String, Task>) -> Arc<RequiredSet> {
        let required_bundle = |(name, task): (&String, &Task)| RequiredBundle {
            name: name.clone(),
            version_digest: task.version_digest.filter(|_| !task.missing),
        };
        Arc::new(RequiredSet(tasks.iter().map(required_bundle).collect()))
    }

    /// Queues every file with a verdict from another configuration or another required set.
    pub(super) fn requeue_outdated(&mut self) {
        if !self.may_judge() {
            return;
        }
        let outdated = |judged: &Arc<Judged>, kind| !self.stands(kind, judged);
        let files = self.files.iter();
        let ids: Vec<(u32, Priority)> = files
            .filter(|(_, it)| {
                it.judged
                    .as_ref()
                    .is_some_and(|judged| outdated(judged, it.kind))
            })
            .map(|(id, it)| (id, self.priority_of(&it.path)))
            .collect();
        for (id, priority) in ids {
            self.files.enqueue(id, priority, self.now);
        }
    }

    /// Applies a change of the registry. Active jobs get the current required set, and verdicts of
    /// other required sets become outdated.
    pub(super) fn follow_registry(&mut self, actions: &mut Actions) {
        if !std::mem::take(&mut self.reseat) {
            return;
        }
        for id in self.under_way() {
            self.reseat(id, actions);
        }
        self.requeue_outdated();
        self.fail_missing();
    }

    /// Gives a job the current required set. Answers of bundles that remain in it are kept.
    pub(super) fn reseat(&mut self, id: JobId, actions: &mut Actions) {
        let Some(job) = self.jobs.get(&id) else {
            return;
        };
        let (requirements, unreadable) = (self.requirements_of(job), job.unreadable.clone());
        let gone: Vec<String> = job
            .tasks
            .keys()
            .filter(|name| {
                requirements
                    .iter()
                    .all(|requirement| requirement.name != **name)
            })
            .cloned()
            .collect();
        let anew: Vec<&Requirement> = requirements
            .iter()
            .filter(|requirement| {
                let task = job.tasks.get(&requirement.name);
                task.is_none_or(|task| self.must_judge_anew(requirement, task))
            })
            .collect();
        for name in gone
            .iter()
            .chain(anew.iter().map(|requirement| &requirement.name))
        {
            self.cancel_task(id, name, actions);
        }
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        let is_on_demand = job.on_demand.is_some();
        job.epoch = self.epoch;
        for requirement in &anew {
            let task = Task::of(requirement, unreadable.as_deref());
            let queued = task.state == TaskState::Queued;
            job.tasks.insert(requirement.name.clone(), task);
            if let Some(bundle) = self.bundles.get_mut(&requirement.name).filter(|_| queued) {
                bundle.expect(id, is_on_demand);
            }
        }
        if job.tasks.values().any(|task| !task.is_over()) {
            job.stage = JobStage::Checking;
            if job.is_slim {
                // A bundle must read its documents, but they have left the bus.
                return self.begin_anew(id, actions);
            }
        }
        // All jobs are adapted before any task is sent or any result is stored.
        self.finish_if_over(id);
    }

    fn must_judge_anew(&self, requirement: &Requirement, task: &Task) -> bool {
        match task.state {
            TaskState::Queued | TaskState::Sent { .. } => {
                task.version_digest != requirement.version_digest
                    || task.demanded != requirement.demanded
            }
            TaskState::Done | TaskState::Failed(_) => {
                let version_digest = task.version_digest.filter(|_| !task.missing);
                task.demanded != requirement.demanded
                    || !self.is_served_by(requirement, version_digest)
            }
        }
    }
}
