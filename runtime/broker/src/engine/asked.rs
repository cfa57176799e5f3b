//! What commands ask, and what a change of configuration or manifests sets off.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::control::{Request, Response, Status, Unseen};
use qcbus_messages::path_text::to_text;
use tokio::sync::oneshot;

use super::Broker;
use super::start::in_force;
use crate::control::Asked;
use crate::core::{Event, Notice, Stamp, Ticket};
use crate::gate::Gate;
use crate::reload::{Fingerprint, LoadError, differences};
use crate::stamp::{stamp_of, stamp_through_links};

/// Most that is told of what could not be looked at.
const UNSEEN_SHOWN: usize = 100;

impl Broker {
    pub(super) fn asked(&mut self, asked: Asked) -> bool {
        match asked.request {
            Request::Status => {
                let status = self.status();
                let _ = asked.answer.send(Response::Status(Box::new(status)));
                true
            }
            Request::Wait { file, timeout_ms } => self.wait(&file, timeout_ms, asked.answer),
            Request::Down => {
                self.downs.push(asked.answer);
                self.notify_stopping();
                self.handle(Event::Drain)
            }
            Request::Reload => {
                let response = match self.reload() {
                    Ok(changes) => Response::Reloaded {
                        changes,
                        notices: self.loaded.notices.clone(),
                    },
                    Err(error) => Response::Failed {
                        reason: format!(
                            "nothing was changed, what was in force stays in force: {error}"
                        ),
                    },
                };
                let _ = asked.answer.send(response);
                true
            }
            Request::RemoveBundle { name } => {
                let ticket = self.ticket(asked.answer);
                self.handle(Event::RemoveBundle { ticket, name })
            }
        }
    }

    /// Keeps what somebody waits for until the state machine answers.
    fn ticket(&mut self, answer: oneshot::Sender<Response>) -> Ticket {
        self.next_ticket += 1;
        let ticket = Ticket(self.next_ticket);
        self.tickets.insert(ticket, answer);
        ticket
    }

    pub(super) fn wait(
        &mut self,
        file: &Path,
        timeout_ms: Option<u64>,
        answer: oneshot::Sender<Response>,
    ) -> bool {
        let file = &*self.as_watched(file);
        let ticket = self.ticket(answer);
        self.look_at_inputs(file);
        let stamp: Option<Stamp> = stamp_of(file).ok().flatten();
        let unwatched = self.why_unwatched(file, stamp);
        if let (Some(stamp), None, Some(watcher)) = (stamp, &unwatched, &self.watcher) {
            // The watcher may not have come to it, and must tell when it goes.
            watcher.learn(file.into(), stamp);
        }
        let timeout = timeout_ms.map(Duration::from_millis);
        self.handle(Event::Wait {
            ticket,
            path: file.into(),
            stamp,
            unwatched,
            timeout,
        })
    }

    /// A link from elsewhere to a watched file means that file.
    fn as_watched<'f>(&self, file: &'f Path) -> Cow<'f, Path> {
        if self.store.places.contains(file) {
            return Cow::Borrowed(file);
        }
        let real = file.canonicalize().ok();
        let watched = real.filter(|real| self.store.places.contains(real));
        watched.map_or(Cow::Borrowed(file), Cow::Owned)
    }

    /// A client that asks must not be told what was true a moment ago: changes of dependencies
    /// that the watcher has not come to yet are seen here.
    pub(super) fn look_at_inputs(&mut self, file: &Path) {
        for input in self.state.inputs_of(file).into_iter().skip(1) {
            let stamp = stamp_through_links(&input.path);
            if stamp == input.content.stamp() {
                continue;
            }
            let path = input.path;
            let event = match stamp {
                Some(stamp) => Event::Touched { path, stamp },
                None => Event::Vanished { path },
            };
            self.handle(event);
        }
    }

    pub(super) fn why_unwatched(&self, file: &Path, stamp: Option<Stamp>) -> Option<String> {
        let shown = to_text(file);
        if qcbus_document::FileKind::of_path(file).is_none() {
            Some(format!(
                "{shown} is no file that qcbus checks ({})",
                qcbus_document::Suffix::list()
            ))
        } else if !self.store.places.contains(file) {
            Some(format!("{shown} lies outside the watched directories"))
        } else if stamp.is_some() && crate::watch::is_left_alone(&self.options.roots, file) {
            Some(format!("{shown} is ignored (by its name or a .qcignore)"))
        } else if stamp.is_some() && !crate::watch::is_looked_at(&self.options.roots, file) {
            Some(format!(
                "{shown} lies behind a symbolic link to a directory, and such links are not followed"
            ))
        } else {
            None
        }
    }

    /// Reads configuration and manifests again and applies them as a whole, or not at all.
    pub(super) fn reload(&mut self) -> Result<Vec<String>, LoadError> {
        let loaded = self.sources.load()?;
        self.sources.still_has(&self.loaded, &loaded)?;
        let changes = differences(&self.loaded, &loaded);
        let in_force = Arc::new(in_force(&self.sources, &loaded)?);
        let children = (loaded.children != self.loaded.children).then(|| loaded.children.clone());
        for notice in loaded
            .notices
            .iter()
            .filter(|it| !self.loaded.notices.contains(it))
            .cloned()
            .collect::<Vec<_>>()
        {
            self.say(Notice::Loading(notice));
        }
        self.loaded = loaded;
        if in_force.digest != self.in_force.digest {
            self.host.set_config(in_force.digest, &in_force.encoded);
            self.in_force = in_force.clone();
            self.intake.search_in(in_force.search.clone());
            self.handle(Event::Configured {
                digest: in_force.digest,
                demand: in_force.demand(),
            });
        }
        if let Some(specs) = children {
            self.handle(Event::Children { specs });
        }
        Ok(changes)
    }

    pub(super) fn reload_if_changed(&mut self, fingerprint: &mut Fingerprint) {
        let now = self.sources.fingerprint(&self.loaded);
        if now == *fingerprint {
            return;
        }
        *fingerprint = now;
        match self.reload() {
            Ok(changes) if changes.is_empty() => {}
            Ok(changes) => {
                self.say(Notice::Loading(format!("reloaded: {}", changes.join("; "))));
            }
            Err(error) => self.say(Notice::Loading(format!(
                "not reloaded, what was in force stays in force: {error}"
            ))),
        }
    }

    pub(super) fn status(&self) -> Status {
        let mut status = self.state.status();
        for peer in &mut status.peers {
            peer.sandbox = self.children.sandbox_of(peer);
        }
        Status {
            instance: self.options.instance.name().to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            pid: std::process::id(),
            uptime_s: self.started.elapsed().as_secs(),
            watching: self.options.roots.clone(),
            watch_mode: self.watch_mode.clone(),
            out: self.options.out.clone(),
            unseen: self.all_unseen(),
            bundles_d: self.options.bundles_d.clone(),
            gate: self.store.gate.as_ref().map(Gate::status),
            ..status
        }
    }
    fn all_unseen(&self) -> Vec<Unseen> {
        let unseen = |(path, why): (&PathBuf, &String)| Unseen {
            path: path.clone(),
            why: why.clone(),
        };
        // Whoever asks wants to see where to look, and no answer of any length.
        self.unseen.iter().take(UNSEEN_SHOWN).map(unseen).collect()
    }
}
