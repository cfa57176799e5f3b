//! The threads that write. What concerns one path is done by one thread, in order, so that a
//! result can never be withdrawn by an order that is older than the result.

use std::collections::VecDeque;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use qcbus_bus::Held;
use qcbus_formats::config::Config;
use tokio::sync::mpsc::UnboundedSender;

use crate::core::{Event, FinishedJob, StoreOutcome};
use crate::journal::Entry;
use crate::store::Store;

/// An order for a writer.
#[derive(Debug)]
pub enum Order {
    /// Pool and write a result.
    Store {
        /// The job.
        job: Box<FinishedJob>,
        /// The configuration that it was checked under.
        config: Option<Arc<Config>>,
        /// The root's image.
        root: Option<Held>,
    },
    /// Remove the result of a file that has gone.
    Withdraw {
        /// The file.
        path: Arc<Path>,
        /// Who is to take back a report about it.
        reporters: Vec<String>,
    },
    /// Remember something.
    Record(Entry),
}

/// The writers. They end when this is dropped and everything ordered is done.
#[derive(Debug)]
pub struct Writers {
    lanes: Vec<Sender<Order>>,
    threads: Vec<std::thread::JoinHandle<()>>,
}

impl Writers {
    /// Starts `count` writers. What storing gives is told to `events`, what a person should know
    /// to `notices`.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(
        count: usize,
        store: &Arc<Store>,
        events: &UnboundedSender<Event>,
        notices: &UnboundedSender<String>,
    ) -> std::io::Result<Writers> {
        let mut writers = Writers {
            lanes: Vec::new(),
            threads: Vec::new(),
        };
        for number in 0..count.max(1) {
            let (sender, receiver) = channel();
            let mut lane = Lane {
                store: store.clone(),
                events: events.clone(),
                notices: notices.clone(),
                waiting: VecDeque::new(),
            };
            let thread = std::thread::Builder::new().name(format!("write-{number}"));
            writers
                .threads
                .push(thread.spawn(move || lane.run(&receiver))?);
            writers.lanes.push(sender);
        }
        Ok(writers)
    }

    /// Gives an order that concerns `path`.
    pub fn order(&self, path: &Path, order: Order) {
        let hash = BuildHasherDefault::<DefaultHasher>::new().hash_one(path);
        let lane = usize::try_from(hash % self.lanes.len() as u64).unwrap_or(0);
        if let Some(lane) = self.lanes.get(lane) {
            // A writer only ends after its sender, so somebody is there.
            let _ = lane.send(order);
        }
    }

    /// Waits until everything ordered is done, or cannot be.
    pub fn finish(mut self) {
        self.lanes.clear();
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

struct Lane {
    store: Arc<Store>,
    events: UnboundedSender<Event>,
    notices: UnboundedSender<String>,
    /// Orders that failed and are tried again, with everything that came after them.
    waiting: VecDeque<Order>,
}

/// Pause before a failed order is tried again.
const RETRY: Duration = Duration::from_secs(1);

impl Lane {
    fn run(&mut self, orders: &Receiver<Order>) {
        let mut retry_at = None::<Instant>;
        loop {
            let order = match retry_at {
                None => match orders.recv() {
                    Ok(order) => Some(order),
                    Err(_) => break,
                },
                Some(at) => match orders.recv_timeout(at.saturating_duration_since(Instant::now()))
                {
                    Ok(order) => Some(order),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => break,
                },
            };
            self.waiting.extend(order);
            if retry_at.is_none_or(|at| at <= Instant::now()) {
                retry_at = (!self.work()).then(|| Instant::now() + RETRY);
            }
        }
        self.work();
    }

    /// Does what waits, up to the first order that fails.
    fn work(&mut self) -> bool {
        while let Some(mut order) = self.waiting.pop_front() {
            let done = match &mut order {
                Order::Store { job, config, root } => {
                    let root = root.as_deref();
                    let outcome = self.store.store(job, config.as_deref(), root);
                    self.tell(job, outcome);
                    Ok(())
                }
                Order::Withdraw { path, reporters } => self.store.withdraw(path, reporters),
                Order::Record(_) => self.record(&order),
            };
            if let Err(why) = done {
                let _ = self.notices.send(format!("{why}; it is tried again"));
                self.waiting.push_front(order);
                return false;
            }
        }
        true
    }

    fn tell(&self, job: &FinishedJob, outcome: StoreOutcome) {
        // After the end of the loop nobody waits for this.
        let _ = self.events.send(Event::Stored {
            job: job.job,
            outcome,
        });
    }

    fn record(&self, order: &Order) -> Result<(), String> {
        match order {
            Order::Record(entry) => self.store.record(std::slice::from_ref(entry)),
            Order::Store { .. } | Order::Withdraw { .. } => Ok(()),
        }
    }
}
