//! Loop of a simulation. It has the same sources and actions as [`Broker::run`]. The simulation
//! selects the next of the ready sources. Configuration and manifests do not change.

use std::sync::Arc;
use std::time::Duration;

use qcbus_broker::{Broker, Options, Source, StartError, Told, Turn};
use qcbus_publish::directory_lock::LockError;
use qcbus_publish::gate::GateError;
use qcbus_publish::journal::JournalError;
use qcbus_types::{Event, Notice};

use super::backend::Simulated;
use super::world::Serving;
use super::{Simulation, Turns};

/// Interval of the loop's timer.
const TICK: Duration = Duration::from_millis(50);

/// Runs a broker from its start until it is killed.
pub fn simulate(
    simulation: &Arc<Simulation>,
    options: &Options,
    tell: impl FnMut(Told) + Clone + Send + 'static,
) {
    let backend = Simulated(simulation.clone());
    loop {
        match Broker::start_on(&backend, options.clone(), Box::new(tell.clone())) {
            Ok(broker) => return run(broker, simulation),
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

/// A source of the loop that has an input.
#[derive(Clone, Copy)]
enum Ready {
    Bus,
    Inbox(Source),
    Tick,
}

fn run(mut broker: Broker, simulation: &Simulation) {
    let turns = Turns::begin(Serving {
        store: broker.store(),
        intake: broker.intake(),
    });
    broker.begin();
    let mut next_tick = turns.now();
    loop {
        let mut sources = Vec::new();
        if !simulation.world().peers.words.is_empty() {
            sources.push(Ready::Bus);
        }
        sources.extend(broker.sources().into_iter().map(Ready::Inbox));
        if turns.now() >= next_tick {
            sources.push(Ready::Tick);
        }
        if sources.is_empty() {
            turns.rest(next_tick);
            continue;
        }
        let turn = match sources[turns.choose(sources.len())] {
            Ready::Bus => broker.take_from_bus(),
            Ready::Inbox(source) => broker.take(source),
            Ready::Tick => {
                next_tick = turns.now() + TICK;
                Some(Turn::Tick)
            }
        };
        if let Some(turn) = turn {
            if let Some(line) = said(&turn) {
                turns.say(|| format!("loop: {line}"));
            }
            broker.turn(turn);
        }
        turns.is_over(broker.state().summary());
    }
}

fn said(turn: &Turn) -> Option<String> {
    Some(match turn {
        Turn::Bus(event) => format!("{event:.60?}"),
        Turn::Event(Event::Prepared { job, result }) => {
            let how = result.as_ref().map(|it| it.racy);
            format!("job {} was read, racy: {how:?}", job.0)
        }
        Turn::Event(Event::Stored { job, outcome }) => format!("job {}: {outcome:.40?}", job.0),
        Turn::Event(event) => format!("{event:?}"),
        Turn::Seen(seen) => format!("{seen:?}"),
        Turn::Asked(asked) => format!("{:?}", asked.request),
        Turn::Looked(_) => "a probe returns".to_owned(),
        Turn::Notice(notice) => format!("{notice:?}"),
        Turn::Delivery(_) | Turn::Signal(_) | Turn::Tick => return None,
    })
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
