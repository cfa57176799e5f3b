//! Requests of commands, and the effects of a changed configuration or manifest.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_configuration::{Fingerprint, InForce, LoadError, OwnProgram, command_of, differences};
use qcbus_control::Asked;
use qcbus_document::FileKind;
use qcbus_messages::control::{BundleReadiness, CheckContext, Request, Response};
use qcbus_messages::path_text::to_text;
use qcbus_types::{Event, Notice, OnDemand, RequestId, Stamp, Until};
use tokio::sync::oneshot;

use super::looks::{Around, Look, LookedUp, Seen};
use super::{Broker, Told};
use crate::check_context::{check_context, differs};

impl Broker {
    pub(super) fn asked(&mut self, asked: Asked) -> bool {
        let only_tells = matches!(
            asked.request,
            Request::Status
                | Request::Wait { .. }
                | Request::WaitReported { .. }
                | Request::Check { .. }
                | Request::Bundle { .. }
                | Request::Trials { .. }
                | Request::Offers { .. }
        );
        if only_tells && asked.answer.is_closed() {
            // The client has already disconnected.
            return true;
        }
        match asked.request {
            Request::Status => {
                let status = Box::new(self.status());
                answer(asked.answer, Response::Status(status))
            }
            Request::Wait { file, timeout_ms } => {
                self.wait_for(file, timeout_ms, false, asked.answer)
            }
            Request::WaitReported { file, timeout_ms } => {
                self.wait_for(file, timeout_ms, true, asked.answer)
            }
            Request::Check {
                file,
                check_context,
            } => self.check(&file, &check_context, asked.answer),
            Request::Down => {
                self.downs.push(asked.answer);
                self.notify_stopping();
                self.handle(Event::Drain)
            }
            Request::Reload => {
                let response = self.reload_for_a_client();
                answer(asked.answer, response)
            }
            Request::RemoveBundle { name } => {
                let request_id = self.request_id(asked.answer);
                self.handle(Event::RemoveBundle { request_id, name })
            }
            Request::Bundle { name } => {
                let bundle = self.standing(&name).map(Box::new);
                answer(asked.answer, Response::Bundle { bundle })
            }
            Request::Trials { name } => {
                let (counts, trials) = self.state.trials(&name).unzip();
                let trials = trials.unwrap_or_default();
                answer(asked.answer, Response::Trials { counts, trials })
            }
            Request::Offers { without } => {
                let mut offers = self.state.offers();
                offers.retain(|it| !without.contains(&it.name));
                answer(asked.answer, Response::Offers { offers })
            }
        }
    }

    fn wait_for(
        &mut self,
        file: PathBuf,
        timeout_ms: Option<u64>,
        reports: bool,
        answer: oneshot::Sender<Response>,
    ) -> bool {
        let timeout = timeout_ms.map(Duration::from_millis);
        self.look_at(Look {
            file,
            until: Until { timeout, reports },
            answer,
            is_led: false,
        })
    }

    fn reload_for_a_client(&mut self) -> Response {
        match self.reload() {
            Ok(changes) => Response::Reloaded {
                changes,
                notices: self.loaded.notices.clone(),
            },
            Err(error) => Response::Failed {
                reason: format!("reload failed, the previous settings stay in force: {error}"),
            },
        }
    }

    /// Returns the readiness of a bundle with the data of its current manifest.
    fn standing(&self, name: &str) -> Option<BundleReadiness> {
        let mut standing = self.state.readiness(name)?;
        standing.said = self.children.final_output(name);
        if let Some(spec) = self.loaded.children.iter().find(|it| it.name == name) {
            standing.command = command_of(&spec.command).map(str::to_owned);
            standing.spec = spec.digest();
        }
        Some(standing)
    }

    /// Handles an on-demand check. The client must have the same check context.
    fn check(
        &mut self,
        file: &Path,
        asked: &CheckContext,
        answer: oneshot::Sender<Response>,
    ) -> bool {
        let ours = check_context(&self.options, self.in_force.digest, &self.loaded.children);
        if let Some(why) = differs(&ours, asked) {
            let reason = why.to_owned();
            let _ = answer.send(Response::Elsewhere { reason });
            return true;
        }
        let request_id = self.request_id(answer);
        let bundles = asked.bundles.keys().cloned().collect();
        self.handle(Event::Check {
            path: file.into(),
            on_demand: OnDemand {
                request_id,
                bundles,
            },
        })
    }

    /// Removes clients that have disconnected without their answer.
    pub(super) fn forget_clients(&mut self) {
        self.downs.retain(|it| !it.is_closed());
        let left = self.request_ids.iter().filter(|(_, it)| it.is_closed());
        let left: Vec<RequestId> = left.map(|(request_id, _)| *request_id).collect();
        for request_id in left {
            self.request_ids.remove(&request_id);
            self.handle(Event::ClientLeft { request_id });
        }
    }

    /// Keeps the channel of a client until the state machine answers. Returns its request id.
    fn request_id(&mut self, answer: oneshot::Sender<Response>) -> RequestId {
        self.next_request_id += 1;
        let request_id = RequestId(self.next_request_id);
        self.request_ids.insert(request_id, answer);
        request_id
    }

    /// Handles the wait of a client for a file after its lookup.
    pub(super) fn wait(&mut self, look: Look, seen: LookedUp) -> bool {
        let LookedUp {
            file,
            stamp,
            inputs,
            lost,
            unwatched,
            hidden,
        } = seen;
        self.take_in(inputs);
        if !lost.is_empty() {
            self.handle(Event::OutputsLost { lost });
        }
        if let (Some(reason), None) = (hidden, &unwatched) {
            // The error is ignored, because a client that has disconnected needs no answer.
            let _ = look.answer.send(Response::Unanswered { reason });
            return true;
        }
        let (file, until) = (&*file, look.until);
        let mut at_rest = stamp;
        let request_id = self.request_id(look.answer);
        if let (None, Some(watcher)) = (&unwatched, &self.watcher) {
            match stamp {
                // The watcher may not have seen the file yet, and must report its removal.
                Some(stamp) if self.state.is_settled(file, stamp) || self.is_nobody_watching() => {
                    watcher.learn(file.into(), stamp);
                }
                // The file may still be written to. If it returns before the watcher notices its
                // absence, no other event would follow.
                Some(_) | None => {
                    at_rest = None;
                    watcher.look(file.into());
                }
            }
        }
        if stamp.is_some() && at_rest.is_none() {
            // The file exists, regardless of the progress of the first scan.
            self.handle(Event::Present { path: file.into() });
        }
        self.handle(Event::Wait {
            request_id,
            path: file.into(),
            stamp: at_rest,
            unwatched,
            until,
        })
    }

    /// Processes changes of dependencies that the watcher has not reported yet, so that a client
    /// never gets an outdated verdict.
    pub(super) fn take_in(&mut self, moved: Vec<(Arc<Path>, Option<Stamp>)>) {
        // A file that is being written gets its verdict when it has settled. Meanwhile no verdict
        // rests on the last one.
        let is_settling =
            |path: &Path| FileKind::of_path(path).is_some() && self.unfinished.contains_key(path);
        let moved: Vec<_> = moved
            .into_iter()
            .filter(|(path, stamp)| stamp.is_none() || !is_settling(path))
            .collect();
        for (path, stamp) in moved {
            let is_watched = self.options.roots.iter().any(|it| path.starts_with(it));
            let watcher = self.watcher.as_ref().filter(|_| is_watched);
            let event = match (stamp, watcher) {
                (Some(stamp), _) => Event::Touched {
                    path: path.clone(),
                    stamp,
                },
                // The watcher decides whether the file was removed or its whole watched directory is missing.
                (None, Some(_)) => Event::Unfinished {
                    path: path.clone(),
                    stamp,
                },
                (None, None) => Event::Vanished { path: path.clone() },
            };
            // The file may have a verdict of its own, which belongs to other bytes now.
            if let Some(watcher) = watcher {
                watcher.look(path);
            }
            self.handle(event);
        }
    }

    /// Reads configuration and manifests again and applies all or none of them.
    pub(super) fn reload(&mut self) -> Result<Vec<String>, LoadError> {
        let loaded = self.load_anew();
        self.not_in_force = loaded.as_ref().err().map(ToString::to_string);
        loaded
    }

    fn load_anew(&mut self) -> Result<Vec<String>, LoadError> {
        let loaded = self.sources.load()?;
        self.sources.still_has(&self.loaded, &loaded)?;
        let changes = differences(&self.loaded, &loaded);
        let in_force = Arc::new(InForce::of(&self.sources, &loaded)?);
        let children = (loaded.children != self.loaded.children).then(|| loaded.children.clone());
        let before = std::mem::replace(&mut self.loaded, loaded).notices;
        self.forget_older_attempts();
        let new = |it: &&String| !before.contains(it);
        for notice in self.loaded.notices.iter().filter(new) {
            (self.tell)(Told::Notice(Notice::Loading(notice.clone())));
        }
        if in_force.digest != self.in_force.digest {
            self.host.set_config(in_force.digest, &in_force.encoded);
            self.in_force = in_force.clone();
            self.intake.search_in(in_force.search.clone());
            self.handle(Event::Configured {
                digest: in_force.digest,
                demand: in_force.demand(),
            });
        } else {
            // The shadows that are left out of pooling may have changed.
            self.in_force = in_force;
        }
        if let Some(specs) = children {
            self.handle(Event::Children { specs });
        }
        Ok(changes)
    }

    /// Removes the notices about former configurations and manifests. The notices about the current ones remain.
    fn forget_older_attempts(&mut self) {
        self.state.is_over(|it| matches!(it, Notice::Loading(_)));
        for notice in &self.loaded.notices {
            self.state.remark(Notice::Loading(notice.clone()));
        }
    }

    /// Starts a probe of configuration, manifests and programs, unless one is running. They may be
    /// on a disk that does not respond, and the loop must not wait for it.
    pub(super) fn look_for_changes(&mut self) {
        if self.looks.changes.is_some() {
            return;
        }
        let (sources, read) = (self.sources.clone(), self.loaded.read.clone());
        let (lock, store) = (self.state_directory.lock.clone(), self.store.clone());
        // If no thread can be started now, the next try follows in a second.
        let look = move || {
            store.gate.iter().for_each(|it| it.keep_its_file());
            let around = Around {
                replaced: OwnProgram::this().replaced(),
                state_is_gone: lock.is_some_and(|it| !it.is_in_place()),
                scratch: sources.adapter.scratch_status(),
            };
            Seen::Sources(sources.fingerprint(&read), around)
        };
        self.looks.changes = self.probe(look).ok();
    }

    /// Notes whether the state directory was removed or replaced.
    pub(super) fn look_at_state(&mut self, is_gone: bool) {
        let was_gone = std::mem::replace(&mut self.state_directory.is_gone, is_gone);
        if let Some(text) = self.said_of_state().filter(|_| !was_gone) {
            self.say(Notice::Storing(text));
        }
    }

    pub(super) fn said_of_state(&self) -> Option<String> {
        let directory = &self.state_directory;
        let lock = directory.lock.as_ref().filter(|_| directory.is_gone)?;
        Some(format!(
            "the state directory {} was removed or replaced: new verdicts are lost when this broker ends, and \
             their files are judged again; restart the broker",
            to_text(lock.directory())
        ))
    }

    /// Handles the stamps that a probe has read of all configuration files in force.
    pub(super) fn reload_if_changed(&mut self, now: Fingerprint) {
        self.looks.changes = None;
        if now == self.fingerprint {
            return;
        }
        self.fingerprint = now;
        self.reload_and_say();
    }

    /// Reads configuration and manifests again for a service manager. A stopping broker does not need them.
    pub(super) fn reload_on_signal(&mut self) {
        if !self.state.draining() {
            tracing::info!("SIGHUP: reloading configuration and manifests");
            self.reload_and_say();
        }
    }

    /// Reloads and reports the outcome in the log and in the status, because no client waits for an answer.
    fn reload_and_say(&mut self) {
        match self.reload() {
            Ok(changes) if changes.is_empty() => {}
            Ok(changes) => {
                self.say(Notice::Loading(format!("reloaded: {}", changes.join("; "))));
            }
            Err(error) => {
                self.forget_older_attempts();
                self.say(Notice::Loading(format!(
                    "not reloaded, the previous settings stay in force: {error}"
                )));
            }
        }
    }
}

/// Answers at once. A failed send is ignored, because the client has disconnected.
fn answer(client: oneshot::Sender<Response>, response: Response) -> bool {
    let _ = client.send(response);
    true
}
