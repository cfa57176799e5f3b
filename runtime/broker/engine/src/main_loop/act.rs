//! Execution of the actions of the state machine.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_environment::{now, reached, spawn_blocking};
use qcbus_messages::control::Response;
use qcbus_messages::path_text::to_text;
use qcbus_messages::{JobId, ToPeer};
use qcbus_publish::journal::Entry;
use qcbus_publish::writers::Order;
use qcbus_types::{
    Action, Delivery, Event, FinishedJob, Judged, Notice, PrepareFailure, RequestId, SessionId,
};

use super::{Announcement, Broker, Ready, Told};
use crate::intake::Within;

impl Broker {
    /// Executes an action. Returns `false` for the action to stop.
    pub(super) fn act(&mut self, action: Action) -> bool {
        match action {
            Action::Stop => return false,
            Action::Prepare { job, path, waited } => self.prepare(job, path, waited),
            Action::ReleaseParts { job } => self.intake.release_parts(job),
            Action::Release { job } => self.intake.release(job),
            Action::PublishAgain { job, doc } => {
                let intake = self.intake.clone();
                spawn_blocking(move || intake.publish_again(job, doc));
            }
            Action::Spawn { launch, spec } => self.children.spawn(launch, &spec),
            Action::Kill { launch } => self.children.kill(launch),
            Action::KillStaleChildren { joined } => self.kill_stale_children(joined),
            Action::Store(job) => self.order_store(job),
            Action::Pool(job) => self.pool_on_demand(job),
            Action::Withdraw { ref path, .. } => {
                if let Some(watcher) = &self.watcher {
                    watcher.forget(path.clone());
                }
                self.order(action);
            }
            Action::Restamp { .. }
            | Action::CloseGate { .. }
            | Action::OpenGate { .. }
            | Action::Delivered { .. }
            | Action::Voided { .. } => self.order(action),
            Action::Send { .. }
            | Action::Accept { .. }
            | Action::Refuse { .. }
            | Action::Disconnect { .. }
            | Action::Void { .. }
            | Action::Deliver { .. } => self.act_on_peer(action),
            Action::Answer {
                request_id,
                response,
            } => self.answer(request_id, response),
            Action::Depend { files } => {
                if let Some(watcher) = &self.watcher {
                    watcher.depend(files);
                }
            }
            Action::Undepend { paths } => {
                if let Some(watcher) = &self.watcher {
                    watcher.undepend(paths);
                }
            }
            Action::Enrol(member) => self.remember_at_once(Entry::Enrolled(member)),
            Action::Strike { name } => self.remember_at_once(Entry::Struck { name }),
            Action::Judged {
                path,
                judged,
                fresh,
            } => self.announce(path, judged, fresh),
            Action::ForgetTrials { shadow, file } => self.forget_trials(shadow, file),
            Action::Notice(notice) => (self.tell)(Told::Notice(notice)),
        }
        true
    }

    /// Answers a request. The error is ignored, because a client that has disconnected needs no answer.
    fn answer(&mut self, request_id: RequestId, response: Response) {
        if let Some(answer) = self.request_ids.remove(&request_id) {
            let _ = answer.send(response);
        }
    }

    /// Hands an action about one file on the disk or in the journal to its writer. The writer keeps the order.
    fn order(&mut self, action: Action) {
        let (path, order) = match action {
            Action::Withdraw { path, reporters } => {
                (path.clone(), Order::Withdraw { path, reporters })
            }
            Action::Restamp { path, judged } => (path.clone(), Order::Restamp { path, judged }),
            Action::CloseGate { path } => (path.clone(), Order::CloseGate { path }),
            Action::OpenGate { path, judged } => (path.clone(), Order::OpenGate { path, judged }),
            Action::Delivered {
                reporter,
                path,
                job,
            } => {
                let at = path.clone();
                let entry = Entry::Delivered {
                    path,
                    reporter,
                    job,
                };
                (at, Order::Record(entry))
            }
            Action::Voided { reporter, path } => {
                self.left.remove(&(reporter.clone(), path.clone()));
                let at = path.clone();
                (at, Order::Record(Entry::Voided { path, reporter }))
            }
            _ => return,
        };
        self.writers.order(&path, order);
    }

    fn order_store(&mut self, job: Box<FinishedJob>) {
        let root = self.intake.root(job.job);
        let config = self.in_force.judging.clone();
        let path = job.path.clone();
        reached("checked", &path);
        self.untrimmed = true;
        self.writers
            .order(&path, Order::Store { job, config, root });
    }

    /// Pools an on-demand check outside the writers, so that the client does not wait for other results.
    fn pool_on_demand(&mut self, mut job: Box<FinishedJob>) {
        let root = self.intake.root(job.job);
        let config = self.in_force.config.clone();
        let (store, events) = (self.store.clone(), self.inbox.events_in.clone());
        let shadow = self.state.tried_out(job.job).map(str::to_owned);
        spawn_blocking(move || {
            let (config, document) = (config.as_deref(), root.as_deref());
            let outcome = match shadow {
                Some(shadow) => store.pool_trial(&shadow, &mut job, config, document),
                None => store.pool_on_demand(&mut job, config, document),
            };
            drop(root);
            // The error is ignored: after the end of the loop the outcome is not needed.
            let _ = events.send(Event::Pooled {
                job: job.job,
                outcome,
            });
        });
    }

    fn forget_trials(&self, shadow: String, file: Option<Arc<Path>>) {
        let store = self.store.clone();
        spawn_blocking(move || {
            if let Some(results) = &store.trials {
                results.forget(&shadow, file.as_deref());
            }
        });
    }

    /// Executes an action about one peer.
    fn act_on_peer(&mut self, action: Action) {
        match action {
            Action::Send { session, message } => {
                if let Some(peer) = self.sessions.peers.get(&session) {
                    self.host.send(*peer, &message);
                }
            }
            Action::Accept { session } => self.accept(session),
            Action::Refuse { session, reason } => {
                tracing::debug!("a peer was refused: {reason}");
                if let Some(peer) = self.sessions.remove(session) {
                    self.host.refuse(peer, &reason);
                }
            }
            Action::Disconnect { session } => {
                if let Some(peer) = self.sessions.remove(session) {
                    self.host.disconnect(peer);
                }
            }
            Action::Void {
                session,
                reporter,
                path,
            } => self.void(session, &reporter, &path),
            Action::Deliver {
                session,
                reporter,
                delivery,
            } => {
                self.untrimmed = true;
                self.deliver(session, reporter, delivery);
            }
            _ => {}
        }
    }

    fn announce(&mut self, path: Arc<Path>, judged: Arc<Judged>, fresh: bool) {
        reached("judged", &path);
        (self.tell)(Told::Verdict(Announcement {
            path,
            judged,
            fresh,
        }));
    }

    /// Records a registry change in the journal before any bundle judges under it. This is rare, so the loop can wait
    /// for it. If the journal cannot be written now, a writer retries until it can.
    fn remember_at_once(&mut self, entry: Entry) {
        if !self.journal_is_behind {
            let Err(why) = self.store.record(std::slice::from_ref(&entry)) else {
                return;
            };
            self.say(Notice::Storing(why));
            // Later entries must not overtake the waiting ones.
            self.journal_is_behind = true;
        }
        self.writers.order(Path::new(""), Order::Record(entry));
    }

    pub(super) fn accept(&mut self, session: SessionId) {
        if let Some(peer) = self.sessions.peers.get(&session) {
            let welcome = ToPeer::Welcome {
                generation: self.host.generation(),
                config: self.in_force.digest,
            };
            self.host.accept(*peer, &welcome);
        }
    }

    pub(super) fn prepare(&self, job: JobId, path: Arc<Path>, waited: Duration) {
        // The clock of the state machine may stand still, but the real clock does not. Thus this
        // time is never too early.
        let begin = now();
        let asked = begin.checked_sub(waited).unwrap_or(begin);
        let (intake, events) = (self.intake.clone(), self.inbox.events_in.clone());
        let io_watchdog = self.looks.io_watchdog();
        // An on-demand check watches no files.
        let within = match self.state.is_on_demand(job) {
            true => Within::Beside,
            false => Within::Watched,
        };
        spawn_blocking(move || {
            reached("taken", &path);
            let attendance = io_watchdog.attend(job.0);
            let mut result = intake.prepare(job, &path, asked, within);
            if attendance.was_given_up() {
                // The job has ended meanwhile.
                return intake.release(job);
            }
            // This overrides any result, because a disk that does not respond must not count as a missing file.
            if let Some((at, why)) = attendance.moment() {
                let reason = format!("read {}: {why}", to_text(&at));
                result = Err(PrepareFailure::Moment(reason));
            }
            // The error is ignored: after the end of the loop the result is not needed.
            let _ = events.send(Event::Prepared { job, result });
        });
    }

    pub(super) fn deliver(&self, session: SessionId, reporter: String, delivery: Delivery) {
        let job = delivery.job;
        let document = self.intake.recent_root(job);
        let (store, config) = (self.store.clone(), self.in_force.config.clone());
        let deliveries = self.inbox.deliveries_in.clone();
        spawn_blocking(move || {
            let message = qcbus_publish::deliveries::message(
                &reporter,
                &delivery,
                document,
                &store.places,
                config.as_ref(),
            );
            let message = message.map(|message| Box::new(ToPeer::Result(Box::new(message))));
            // The error is ignored: after the end of the loop the message is not needed.
            let _ = deliveries.send(Ready {
                session,
                job,
                message,
            });
        });
    }

    /// Tells a reporter that a file was removed.
    fn void(&mut self, session: SessionId, reporter: &str, path: &Arc<Path>) {
        let config = self.in_force.config.as_ref();
        let left = self.left.get(&(reporter.to_owned(), path.clone()));
        let left = left.map(PathBuf::as_path);
        let gone =
            qcbus_publish::deliveries::withdrawn(reporter, path, left, &self.store.places, config);
        if let Some(peer) = self.sessions.peers.get(&session) {
            self.host.send(*peer, &ToPeer::Withdrawn(gone));
        }
    }

    pub(super) fn delivery(&mut self, ready: Ready) -> bool {
        let Ready {
            session,
            job,
            message,
        } = ready;
        match message {
            Ok(_) if !self.state.awaits_result(session, job) => true,
            Ok(message) => {
                if let Some(peer) = self.sessions.peers.get(&session) {
                    self.host.send(*peer, &message);
                }
                true
            }
            Err(why) => self.handle(Event::Undeliverable { session, job, why }),
        }
    }
}
