//! Data for `qcbus status`.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::Verdict;
use qcbus_messages::control::{self, FileCounts, PeerStatus, QueueStatus, Status};
use qcbus_types::Notice;

use super::State;
use super::bundles::Bundle;
use super::children::ChildState;
use super::files::{Priority, Stage};

/// Number of verdicts in the last seconds.
#[derive(Debug, Default)]
pub(super) struct Rate {
    times: VecDeque<(Duration, u64)>,
}

const RATE_WINDOW: Duration = Duration::from_secs(10);

impl Rate {
    /// Counts one verdict. Buckets of a tenth of a second keep the memory independent of the rate.
    pub fn note(&mut self, now: Duration) {
        let bucket = Duration::from_millis(u64::try_from(now.as_millis() / 100 * 100).unwrap_or(0));
        match self.times.back_mut() {
            Some((at, count)) if *at == bucket => *count += 1,
            _ => self.times.push_back((bucket, 1)),
        }
        while self
            .times
            .front()
            .is_some_and(|(at, _)| now.saturating_sub(*at) > RATE_WINDOW)
        {
            self.times.pop_front();
        }
    }

    fn per_second(&self, now: Duration) -> f64 {
        let recent = self
            .times
            .iter()
            .filter(|(at, _)| now.saturating_sub(*at) <= RATE_WINDOW);
        let (mut total, mut first) = (0, now);
        for (at, count) in recent {
            total += count;
            first = first.min(*at);
        }
        let span = now.saturating_sub(first).max(Duration::from_millis(100));
        total as f64 / span.as_secs_f64()
    }
}

/// Summary of the state for a simulation of the broker.
#[derive(Debug, Default)]
pub struct Summary {
    /// Whether no work is waiting or under way.
    pub quiet: bool,
    /// Acceptances that must not be behind the gate.
    pub unpublished: Vec<Arc<Path>>,
    /// Bundles in the registry.
    pub required: Vec<String>,
}

impl State {
    /// Returns the summary for a simulation.
    pub fn summary(&self) -> Summary {
        let unpublished = self.files.iter().filter(|(_, it)| it.unpublished);
        let members = self.bundles.iter().filter(|(_, it)| it.origin.is_some());
        Summary {
            quiet: self.files.is_quiet() && self.jobs.is_empty() && self.scanned,
            unpublished: unpublished.map(|(_, it)| it.path.clone()).collect(),
            required: members.map(|(name, _)| name.clone()).collect(),
        }
    }

    /// Returns the part of the status that the state machine knows. The engine adds the rest.
    pub fn status(&self) -> Status {
        Status {
            generation: self.settings.generation,
            config: self.config.to_string(),
            files: self.file_counts(),
            queue: self.queue_status(),
            peers: self.peer_status(),
            epoch: self.epoch.0,
            notices: {
                let told =
                    |(notice, at): &(Notice, Duration)| told(notice, self.now.saturating_sub(*at));
                self.notices.iter().map(told).collect()
            },
            ..Status::default()
        }
    }

    /// Returns the reasons why no file can be accepted, regardless of its content.
    pub fn hindrances(&self) -> Vec<String> {
        let missing = self.missing_by_name().into_iter();
        let missing = missing.filter_map(|name| self.hopeless(&name));
        let is_unseated = |kind: &FileKind| {
            let files = self.files.iter();
            let mut there = files.filter(|(_, it)| it.present && it.on_demand.is_none());
            self.requirements(*kind).is_empty() && there.any(|(_, it)| it.kind == *kind)
        };
        let unseated = FileKind::ALL.into_iter().filter(is_unseated);
        let unseated =
            unseated.map(|kind| format!("no bundle is required for .{} files", kind.as_str()));
        missing.chain(unseated).collect()
    }

    /// Returns the present files, sorted by path.
    pub fn present_files(&self) -> Vec<Arc<Path>> {
        let files = self.files.iter();
        let present = files.filter(|(_, entry)| entry.present && entry.on_demand.is_none());
        let mut paths: Vec<Arc<Path>> = present.map(|(_, entry)| entry.path.clone()).collect();
        paths.sort();
        paths
    }

    /// Adds a notice for `status` that comes from outside the state machine.
    pub fn remark(&mut self, notice: Notice) {
        self.notice(notice, &mut Vec::new());
    }

    /// Removes all notices of this kind, because they are no longer valid.
    pub fn is_over(&mut self, of_this_kind: impl Fn(&Notice) -> bool) {
        self.notices.retain(|(notice, _)| !of_this_kind(notice));
    }

    fn file_counts(&self) -> FileCounts {
        let mut counts = FileCounts::default();
        let files = self.files.iter();
        for (_, entry) in files.filter(|(_, entry)| entry.present && entry.on_demand.is_none()) {
            counts.total += 1;
            let idle = matches!(
                entry.stage(),
                Stage::Idle | Stage::Waiting(Priority::Background, _)
            );
            let Some(judged) = entry.judged.as_ref().filter(|_| idle) else {
                continue;
            };
            counts.judged += 1;
            match judged.verdict {
                Verdict::Accepted => counts.accepted += 1,
                Verdict::Rejected => counts.rejected += 1,
                Verdict::Undetermined => counts.undetermined += 1,
            }
        }
        counts
    }

    fn queue_status(&self) -> QueueStatus {
        let counts = self.files.counts();
        let rate = self.rate.per_second(self.now);
        let active = counts.active.saturating_sub(self.trials.under_way() as u64);
        let left = (counts.fresh + counts.background + active) as f64;
        let estimated = if left == 0.0 {
            Some(0.0)
        } else {
            (rate > 0.0).then(|| left / rate)
        };
        QueueStatus {
            waiting: counts.fresh,
            background: counts.background,
            active,
            oldest_waiting_s: self.files.oldest_wait(self.now).as_secs_f64(),
            rate,
            estimated_s: estimated,
        }
    }

    fn peer_status(&self) -> Vec<PeerStatus> {
        let bundles = self
            .bundles
            .iter()
            .map(|(name, bundle)| self.bundle_status(name, bundle));
        let known = |it: &&super::reporters::Reporter| {
            it.session.is_some() || self.children.contains_key(&it.name)
        };
        let reporters = self.reporters.iter().filter(known).map(|it| PeerStatus {
            name: it.name.clone(),
            role: "reporter".to_owned(),
            version: it.version.clone(),
            pid: it.pid,
            state: if it.session.is_none() {
                "down"
            } else if it.active.is_empty() {
                "ready"
            } else {
                "busy"
            }
            .to_owned(),
            checkers: 0,
            active: it.active.len() as u64,
            threads: 0,
            done: it.done,
            restarts: self.restarts(&it.name),
            note: it.remark(self.now),
            unreported: it.unreported(),
            ..PeerStatus::default()
        });
        let starting = self.children.iter().filter(|(name, _)| {
            let reporter = self.reporter_named(name).is_some();
            !self.bundles.contains_key(*name) && !reporter
        });
        let starting = starting.map(|(name, child)| PeerStatus {
            name: name.clone(),
            role: format!("{:?}", child.spec.role).to_lowercase(),
            state: match child.state {
                ChildState::GaveUp(_) => "gave up",
                ChildState::Ended => "down",
                _ => "starting",
            }
            .to_owned(),
            restarts: child.restarts.into(),
            ..PeerStatus::default()
        });
        bundles.chain(reporters).chain(starting).collect()
    }

    fn bundle_status(&self, name: &str, bundle: &Bundle) -> PeerStatus {
        let waiting = bundle.queue.len() + bundle.quarantine.len();
        let silent = !bundle.active.is_empty()
            && self.now.saturating_sub(bundle.heard) > Duration::from_secs(3);
        let state = if self.child_gave_up(name) && bundle.session.is_none() {
            "gave up"
        } else if bundle.session.is_none() {
            "down"
        } else if bundle.draining {
            "draining"
        } else if !bundle.ready {
            "starting"
        } else if silent {
            "silent"
        } else if bundle.active.is_empty() {
            "ready"
        } else {
            "busy"
        };
        let note = if bundle.note.is_empty() && self.is_slowest(name, waiting) {
            format!("slow: {waiting} jobs wait only for this bundle")
        } else {
            bundle.note.clone()
        };
        PeerStatus {
            name: name.to_owned(),
            role: "bundle".to_owned(),
            version: bundle.version.clone(),
            pid: bundle.pid,
            state: state.to_owned(),
            checkers: bundle
                .catalogue
                .as_ref()
                .map_or(0, |it| it.checkers.len() as u64),
            active: bundle.active.len() as u64,
            threads: bundle.threads.into(),
            done: bundle.done,
            restarts: self.restarts(name),
            note,
            unreported: 0,
            sandbox: None,
            trials: self.trial_counts(name),
        }
    }

    /// Checks whether a bundle is shown as slow. This is so if jobs accumulate at it and at no other bundle.
    fn is_slowest(&self, name: &str, waiting: usize) -> bool {
        let others = self.bundles.iter().filter(|(other, _)| *other != name);
        waiting >= 4 && others.map(|(_, it)| it.queue.len()).max().unwrap_or(0) * 4 <= waiting
    }

    fn restarts(&self, name: &str) -> u64 {
        self.children
            .get(name)
            .map_or(0, |child| child.restarts)
            .into()
    }
}

fn told(notice: &Notice, ago: Duration) -> control::NoticeStatus {
    control::NoticeStatus {
        ago_s: ago.as_secs(),
        kind: notice.kind().to_owned(),
        about: notice.about().map(str::to_owned),
        text: notice.to_string(),
    }
}
