//! Loop of a simulation. It has the same sources and actions as [`Broker::run`]. The simulation
//! selects the next of the ready sources. Configuration and manifests do not change.

use super::{Broker, StartError, TICK, Told};
use crate::core::{Event, Notice};
use crate::directory_lock::LockError;
use crate::gate::GateError;
use crate::journal::JournalError;
use crate::options::Options;
use crate::simulation::{Serving, Turns};

#[derive(Debug, Clone, Copy)]
enum Source {
    Bus,
    Events,
    Seen,
    Asked,
    Looked,
    Notices,
    Deliveries,
    Tick,
}

/// Runs a broker from its start until it is killed.
pub fn simulate(options: &Options, tell: impl FnMut(Told) + Clone + Send + 'static) {
    loop {
        match Broker::start(options.clone(), tell.clone()) {
            Ok(broker) => return broker.run_simulated(),
            // Another test of this process may be starting a program, which briefly inherits the open descriptors.
            Err(error) if is_held(&error) => std::thread::yield_now(),
            Err(error) => panic!("cannot start a simulated broker: {error}"),
        }
    }
}

fn is_held(error: &StartError) -> bool {
    let lock = match error {
        StartError::Journal(JournalError::State(lock))
        | StartError::Results(lock)
        | StartError::Gate(GateError::Lock(lock)) => lock,
        _ => return false,
    };
    matches!(lock, LockError::Taken { .. })
}

impl Broker {
    fn run_simulated(mut self) {
        let turns = Turns::begin(Serving {
            store: self.store.clone(),
            intake: self.intake.clone(),
        });
        let specs = self.loaded.children.clone();
        self.handle(Event::Children { specs });
        let mut next_tick = turns.now();
        loop {
            let sources = self.sources_with_something(turns.now() >= next_tick);
            if sources.is_empty() {
                turns.rest(next_tick);
                continue;
            }
            let source = sources[turns.choose(sources.len())];
            if matches!(source, Source::Tick) {
                next_tick = turns.now() + TICK;
            }
            self.turn(source, &turns);
            turns.is_over(self.state.summary());
        }
    }

    fn sources_with_something(&self, tick: bool) -> Vec<Source> {
        let all = [
            (self.host.has_words(), Source::Bus),
            (!self.inbox.events.is_empty(), Source::Events),
            (!self.inbox.seen.is_empty(), Source::Seen),
            (!self.inbox.asked.is_empty(), Source::Asked),
            (!self.inbox.looked.is_empty(), Source::Looked),
            (!self.inbox.notices.is_empty(), Source::Notices),
            (!self.inbox.deliveries.is_empty(), Source::Deliveries),
            (tick, Source::Tick),
        ];
        let there = all.into_iter().filter(|(there, _)| *there);
        there.map(|(_, source)| source).collect()
    }

    fn turn(&mut self, source: Source, turns: &Turns) {
        match source {
            Source::Bus => {
                if let Some(event) = self.host.take() {
                    turns.say(|| format!("loop: {event:.60?}"));
                    self.bus_event(event);
                }
            }
            Source::Events => {
                if let Ok(event) = self.inbox.events.try_recv() {
                    turns.say(|| format!("loop: {}", said(&event)));
                    self.own_event(event);
                }
            }
            Source::Seen => {
                if let Ok(seen) = self.inbox.seen.try_recv() {
                    turns.say(|| format!("loop: {seen:?}"));
                    self.seen(seen);
                }
            }
            Source::Asked => {
                if let Ok(asked) = self.inbox.asked.try_recv() {
                    turns.say(|| format!("loop: {:?}", asked.request));
                    self.asked(asked);
                }
            }
            Source::Looked => {
                if let Ok(looked) = self.inbox.looked.try_recv() {
                    turns.say(|| "loop: a probe returns".to_owned());
                    self.looked(looked);
                }
            }
            Source::Notices => {
                if let Ok(notice) = self.inbox.notices.try_recv() {
                    turns.say(|| format!("loop: {notice:?}"));
                    self.say(notice);
                }
            }
            Source::Deliveries => {
                if let Ok(ready) = self.inbox.deliveries.try_recv() {
                    self.delivery(ready);
                }
            }
            Source::Tick => {
                self.handle(Event::Tick);
            }
        }
    }
}

fn said(event: &Event) -> String {
    match event {
        Event::Prepared { job, result } => {
            let how = result.as_ref().map(|it| it.racy);
            format!("job {} was read, racy: {how:?}", job.0)
        }
        Event::Stored { job, outcome } => format!("job {}: {outcome:.40?}", job.0),
        other => format!("{other:?}"),
    }
}

/// Returns a notice as one line.
pub fn line_of(told: &Told) -> Option<String> {
    match told {
        Told::Verdict(it) => Some(format!(
            "  {} is {:?}, job {}, fresh: {}",
            it.path.display(),
            it.judged.verdict,
            it.judged.job.0,
            it.fresh
        )),
        Told::Notice(Notice::HeldBack(_)) | Told::Scanned { .. } => None,
        Told::Notice(notice) => Some(format!("  notice: {notice:?}")),
    }
}
