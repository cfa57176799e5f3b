//! Clients of a random world with on-demand checks.

use std::collections::BTreeMap;

use qcbus_messages::control::{Checked, FileVerdict, Response};
use qcbus_messages::{JobId, Verdict};
use qcbus_types::{FinishedJob, OnDemand, OnDemandOutcome, VersionDigest};

use super::super::*;
use super::things::*;
use super::trials::found_in;
use super::world::World;

/// A client that has asked and has no answer yet.
pub struct Client {
    file: u8,
    /// Required bundles for the file, each with the version digest of the process started under that name.
    required_set: Vec<(String, Option<VersionDigest>)>,
    config: Digest,
    /// All inputs that were present since it asked.
    seen: Vec<Vec<Input>>,
}

/// All clients, and their work.
#[derive(Default)]
pub struct Clients {
    pub open: BTreeMap<RequestId, Client>,
    pub answers: BTreeMap<RequestId, Response>,
    pub pooling: Vec<FinishedJob>,
    /// Pooled outcomes that the state machine has not received.
    pub pooled: Vec<(JobId, OnDemandOutcome)>,
    /// Job of each result.
    found: BTreeMap<JobId, FinishedJob>,
}

impl World {
    /// Lets a client ask for a file. `known` means that the file and the child exist.
    pub fn somebody_asks(&mut self, file: u8, known: bool) {
        if known {
            self.child_is_there();
        }
        if known && !self.there.contains_key(&path_of(file)) {
            self.write(file);
        }
        self.ask(file);
    }

    pub fn child_is_there(&mut self) {
        if self.manifest.is_none() {
            self.manifest(Some(1));
        }
        self.pass(Duration::ZERO);
        while !self.launched.is_empty() {
            self.child_joins();
        }
    }

    /// Lets a client ask for the findings of the child in a file.
    pub fn ask(&mut self, file: u8) -> RequestId {
        self.ask_by(file, &[CHILD])
    }

    pub fn ask_by(&mut self, file: u8, bundles: &[&str]) -> RequestId {
        self.request_ids += 1;
        let request_id = RequestId(self.request_ids);
        let version_digest = self.manifest.map(|version| {
            let started = child(version).digest();
            VersionDigest::of(&version.to_string(), &catalogue(CHILD), Some(started))
        });
        let client = Client {
            file,
            required_set: bundles
                .iter()
                .map(|it| ((*it).to_owned(), version_digest))
                .collect(),
            config: digest(self.reconfigured.into()),
            seen: Vec::new(),
        };
        self.clients.open.insert(request_id, client);
        let bundles = bundles.iter().map(|it| (*it).to_owned()).collect();
        self.event(Event::Check {
            path: path_of(file),
            on_demand: OnDemand {
                request_id,
                bundles,
            },
        });
        request_id
    }

    /// Lets a client leave before its answer.
    pub fn client_leaves(&mut self, n: u8) {
        let count = self.clients.open.len();
        if count > 0 {
            let request_id = self.clients.open.keys().nth(usize::from(n) % count);
            let request_id = *request_id.unwrap();
            self.clients.open.remove(&request_id);
            self.event(Event::ClientLeft { request_id });
        }
    }

    /// Records the inputs that are present while clients wait. Only these may be checked for them.
    pub fn clients_look(&mut self) {
        let mut open = std::mem::take(&mut self.clients.open);
        for client in open.values_mut() {
            let now = self.inputs(client.file);
            if client.seen.last() != Some(&now) {
                client.seen.push(now);
            }
        }
        self.clients.open = open;
    }

    /// Asserts that files of on-demand checks are not known elsewhere.
    pub fn clients_leave_no_trace(&self) {
        let files = self.state.present_files();
        assert!(files.iter().all(|path| file_of(path) < 8), "{files:?}");
        let total = self.state.status().files.total;
        assert_eq!(total, files.len() as u64, "each file counts once");
        let at_bundles = self.state.jobs.values().filter(|job| {
            let at_work = job.stage.is_before_storing();
            at_work && job.on_demand.is_some() && !job.is_trial()
        });
        for on_demand in at_bundles.filter_map(|job| job.on_demand.as_ref()) {
            let open = self.clients.open.contains_key(&on_demand.request_id);
            assert!(open, "no bundle works for a client that has left");
        }
    }

    /// Asserts that a file of on-demand checks is only read and pooled. The same applies to a result for a client.
    pub fn is_for_clients_alone(&self, action: &Action) {
        let (paths, what): (Vec<_>, _) = match action {
            Action::Depend { files } => (files.iter().map(|it| &it.0).collect(), "watched"),
            Action::Undepend { paths } => (paths.iter().collect(), "watched"),
            Action::Store(job) => {
                let on_demand = &self.state.jobs[&job.job].on_demand;
                assert!(
                    on_demand.is_none(),
                    "a result for a client must not be stored"
                );
                (vec![&job.path], "stored")
            }
            Action::Restamp { path, .. } | Action::Withdraw { path, .. } => {
                (vec![path], "in the journal")
            }
            Action::Judged { path, .. } => (vec![path], "judged"),
            Action::OpenGate { path, .. } | Action::CloseGate { path } => {
                (vec![path], "at the gate")
            }
            _ => return,
        };
        let theirs = paths.iter().find(|path| file_of(path) >= 8);
        assert_eq!(
            theirs, None,
            "a file that only clients know must not be {what}"
        );
    }

    pub fn is_to_be_pooled(&mut self, job: FinishedJob) {
        let on_demand = &self.state.jobs[&job.job].on_demand;
        assert!(on_demand.is_some(), "only results for clients are pooled");
        self.clients.pooling.push(job);
    }

    /// Pools a result for a client, or fails to. The state machine is not yet notified.
    pub fn pool(&mut self, n: u8, well: bool) {
        if self.clients.pooling.is_empty() {
            return;
        }
        let at = usize::from(n) % self.clients.pooling.len();
        let job = self.clients.pooling.remove(at);
        let (id, prepared) = (job.job, job.prepared.as_ref().unwrap());
        let is_trial = self.state.jobs.get(&id).is_some_and(|it| it.is_trial());
        let outcome = if !well {
            OnDemandOutcome::Failed("full".to_owned())
        } else if prepared.inputs != self.inputs(file_of(&job.path)) {
            OnDemandOutcome::Stale
        } else if is_trial {
            OnDemandOutcome::Tried(found_in(&job))
        } else if job.epoch != self.state.epoch() {
            OnDemandOutcome::Outdated
        } else {
            let checked = checked(&job);
            self.clients.found.insert(id, job);
            OnDemandOutcome::Pooled(Box::new(checked))
        };
        self.clients.pooled.push((id, outcome));
    }

    /// Notifies the state machine of a pooled result.
    pub fn tell_pooled(&mut self) {
        if !self.clients.pooled.is_empty() {
            let (job, outcome) = self.clients.pooled.remove(0);
            self.event(Event::Pooled { job, outcome });
        }
    }

    /// Returns whether this was an answer to one of these clients.
    pub fn client_is_answered(&mut self, request_id: RequestId, response: &Response) -> bool {
        let once = !self.clients.answers.contains_key(&request_id);
        assert!(once, "each request is answered once");
        let Some(client) = self.clients.open.remove(&request_id) else {
            return false;
        };
        match response {
            Response::Checked(checked) => self.must_be_true(&client, checked),
            Response::Elsewhere { .. } => {}
            other => panic!("invalid answer to a client that requests a check: {other:?}"),
        }
        self.clients.answers.insert(request_id, response.clone());
        true
    }

    /// Asserts that the answer is about inputs present since the client asked, and about the
    /// findings of exactly the bundles that it named.
    fn must_be_true(&self, client: &Client, checked: &Checked) {
        let job = JobId(checked.result.parse().unwrap());
        let job = &self.clients.found[&job];
        assert_eq!(job.path, path_of(client.file));
        let read = &job.prepared.as_ref().unwrap().inputs;
        assert!(client.seen.contains(read), "{read:?}: {:?}", client.seen);
        assert_eq!(
            named(&job.required_set),
            client.required_set,
            "exactly the requested bundles, with the same version digests"
        );
        let names = job.bundles.iter().map(|it| &it.name);
        assert!(names.eq(client.required_set.iter().map(|it| &it.0)));
        assert_eq!(job.config, client.config);
    }

    /// Returns whether the check context changes, or may change.
    pub fn brings_another_context(&self, event: &Event) -> bool {
        match event {
            Event::Children { .. } => true,
            Event::Configured { digest, .. } => *digest != self.state.config,
            _ => false,
        }
    }

    /// Asserts that no client is left that asked under an earlier check context.
    pub fn context_differs(&self) {
        let open: Vec<&RequestId> = self.clients.open.keys().collect();
        assert!(
            open.is_empty(),
            "no request of an earlier check context may be open: {open:?}"
        );
    }

    /// Asserts that all clients have left or have their answers, and that no trace of them remains.
    pub fn clients_are_content(&self) {
        let open: Vec<&RequestId> = self.clients.open.keys().collect();
        assert!(
            open.is_empty(),
            "every request must be answered, still open: {open:?}"
        );
        assert!(self.state.on_demand_checks.is_empty());
        let on_demand_checks = self
            .state
            .files
            .iter()
            .filter(|it| it.1.on_demand.is_some());
        assert_eq!(on_demand_checks.count(), 0);
    }
}

/// Returns a result that identifies its job.
fn checked(job: &FinishedJob) -> Checked {
    let failed = job.bundles.iter().any(|it| it.failure.is_some());
    Checked {
        verdict: FileVerdict {
            file: job.path.to_path_buf(),
            verdict: match failed {
                true => Verdict::Undetermined,
                false => Verdict::Accepted,
            },
            digest: String::new(),
            xqar: "".into(),
            errors: 0,
            warnings: 0,
            information: 0,
            why: Vec::new(),
        },
        result: job.job.0.to_string(),
        rests_on: Vec::new(),
    }
}
