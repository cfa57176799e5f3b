//! The writer threads. One thread handles all orders for a path, in sequence. An order can never
//! withdraw a result that is newer than the order.

use std::collections::{BTreeMap, BTreeSet, HashSet, VecDeque};
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::path::Path;
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use qcbus_bus::MappedImage;
use qcbus_environment::{Receiver, Sender, channel, now, place, thread};
use qcbus_formats::config::Config;
use qcbus_messages::path_text::to_text;
use qcbus_types::{Event, FinishedJob, Judged, Notice, StoreOutcome};
use tokio::sync::mpsc::UnboundedSender;

use crate::journal::Entry;
use crate::store::{Store, StoreFailure};

/// An order for a writer.
#[derive(Debug)]
pub enum Order {
    /// Pools and writes a result.
    Store {
        /// The job.
        job: Box<FinishedJob>,
        /// Configuration of the check.
        config: Option<Arc<Config>>,
        /// Image of the root.
        root: Option<MappedImage>,
    },
    /// Removes the result of a removed file.
    Withdraw {
        /// The file.
        path: Arc<Path>,
        /// Reporters that must withdraw a report about it.
        reporters: Vec<String>,
    },
    /// Records a verdict with new stamps.
    Restamp {
        /// The file.
        path: Arc<Path>,
        /// Its verdict.
        judged: Arc<Judged>,
    },
    /// Removes a file from behind the gate, with everything that depends on it.
    CloseGate {
        /// The file.
        path: Arc<Path>,
    },
    /// Publishes a file with an acceptance that still holds.
    OpenGate {
        /// The file.
        path: Arc<Path>,
        /// Its verdict.
        judged: Arc<Judged>,
    },
    /// Publishes an accepted file if it is not published yet, and the files that waited for it.
    Follow {
        /// The file.
        path: Arc<Path>,
    },
    /// Records an entry in the journal.
    Record(Entry),
}

/// The writer threads. They end when this value is dropped and all orders are done.
#[derive(Debug)]
pub struct Writers {
    writers: Vec<Sender<Order>>,
    troubles: Troubles,
    threads: Vec<thread::JoinHandle>,
}

impl Writers {
    /// Starts `count` writers. Results of storing are sent to `events`, messages for the user to
    /// `notices`.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn start(
        count: usize,
        store: &Arc<Store>,
        events: &UnboundedSender<Event>,
        notices: &UnboundedSender<Notice>,
    ) -> std::io::Result<Writers> {
        let mut writers = Writers {
            writers: Vec::new(),
            troubles: Troubles::default(),
            threads: Vec::new(),
        };
        for number in 0..count.max(1) {
            let (sender, receiver) = channel();
            let mut writer = Writer {
                number,
                troubles: writers.troubles.clone(),
                store: store.clone(),
                events: events.clone(),
                notices: notices.clone(),
                waiting: VecDeque::new(),
                held_up: HashSet::new(),
                stopped: false,
                told: false,
                troubled: false,
            };
            let thread = thread::Builder::new().name(format!("write-{number}"));
            writers
                .threads
                .push(thread.spawn(move || writer.run(&receiver))?);
            writers.writers.push(sender);
        }
        Ok(writers)
    }

    /// Returns the current failures to write, each once.
    pub fn troubles(&self) -> BTreeSet<String> {
        let troubles = self.troubles.lock().unwrap_or_else(PoisonError::into_inner);
        troubles.values().cloned().collect()
    }

    /// Sends an order that concerns `path`.
    pub fn order(&self, path: &Path, order: Order) {
        let hash = BuildHasherDefault::<DefaultHasher>::new().hash_one(place(path));
        let writer = usize::try_from(hash % self.writers.len() as u64).unwrap_or(0);
        if let Some(writer) = self.writers.get(writer) {
            // A writer ends only after its sender is dropped, so the receiver exists.
            let _ = writer.send(order);
        }
    }

    /// Waits until all orders are done or have failed, but not longer than `limit`. Returns the
    /// writers that still hang. They end with the process.
    pub fn finish(mut self, limit: Duration) -> Vec<String> {
        self.writers.clear();
        let end = Instant::now() + limit;
        let mut hung = Vec::new();
        for (number, thread) in self.threads.drain(..).enumerate() {
            // Most threads have no orders left and end immediately.
            let mut pause = Duration::from_micros(50);
            while !thread.is_finished() && Instant::now() < end {
                std::thread::sleep(pause);
                pause = (2 * pause).min(Duration::from_millis(1));
            }
            if thread.is_finished() {
                let _ = thread.join();
            } else {
                hung.push(format!("write-{number}"));
            }
        }
        hung
    }
}

impl Order {
    /// Returns the file of the order, or `None` if it is about a bundle.
    fn path(&self) -> Option<&Arc<Path>> {
        match self {
            Order::Store { job, .. } => Some(&job.path),
            Order::Withdraw { path, .. }
            | Order::Restamp { path, .. }
            | Order::CloseGate { path }
            | Order::OpenGate { path, .. }
            | Order::Follow { path } => Some(path),
            Order::Record(entry) => entry.path(),
        }
    }
}

/// Current failure of each writer, by its number.
type Troubles = Arc<Mutex<BTreeMap<usize, String>>>;

struct Writer {
    number: usize,
    troubles: Troubles,
    store: Arc<Store>,
    events: UnboundedSender<Event>,
    notices: UnboundedSender<Notice>,
    /// Failed orders that are tried again, and all later orders for the same files, in sequence.
    waiting: VecDeque<Order>,
    /// Files of the waiting orders.
    held_up: HashSet<Arc<Path>>,
    /// Whether the journal cannot be written, which concerns every file.
    stopped: bool,
    /// Whether a failure was reported since the last try. There may be thousands of them.
    told: bool,
    /// Whether `troubles` contains a failure of this writer.
    troubled: bool,
}

/// Pause before a failed order is tried again.
const RETRY: Duration = Duration::from_secs(1);

impl Writer {
    fn run(&mut self, orders: &Receiver<Order>) {
        let mut retry_at = None::<Instant>;
        loop {
            let order = match retry_at {
                None => match orders.recv() {
                    Ok(order) => Some(order),
                    Err(_) => break,
                },
                Some(at) => match orders.recv_timeout(at.saturating_duration_since(now())) {
                    Ok(order) => Some(order),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => break,
                },
            };
            if let Some(order) = order {
                self.take(order);
            }
            if retry_at.is_some_and(|at| at <= now()) {
                self.retry();
                retry_at = None;
            }
            if self.waiting.is_empty() {
                retry_at = None;
                if std::mem::take(&mut self.troubled) {
                    self.report_failure(None);
                }
            } else {
                retry_at = retry_at.or_else(|| Some(now() + RETRY));
            }
        }
        self.retry();
    }

    /// Executes an order now, or queues it behind those that must be done first.
    fn take(&mut self, mut order: Order) {
        let held_up = order.path().is_some_and(|path| self.held_up.contains(path));
        if !self.stopped && !held_up {
            match self.carry_out(&mut order) {
                Ok(None) => return,
                Ok(Some(next)) => return self.take(next),
                Err(failure) => self.hold_up(&failure),
            }
        }
        self.withdraw_early(&order);
        self.held_up.extend(order.path().cloned());
        self.waiting.push_back(order);
    }

    /// Removes a file from the gate immediately, even if the order must wait for a disk or the journal. The order
    /// removes the file again later, because an earlier order may have published it again.
    fn withdraw_early(&mut self, order: &Order) {
        if let Order::CloseGate { path } | Order::Withdraw { path, .. } = order
            && let Err(failure) = self.store.close_gate(path)
        {
            self.hold_up(&failure);
        }
    }

    fn report_failure(&self, what: Option<String>) {
        let mut troubles = self.troubles.lock().unwrap_or_else(PoisonError::into_inner);
        match what {
            Some(what) => troubles.insert(self.number, what),
            None => troubles.remove(&self.number),
        };
    }

    fn hold_up(&mut self, failure: &StoreFailure) {
        self.troubled = true;
        self.report_failure(Some(failure.what.clone()));
        self.stopped |= failure.concerns_all;
        if !self.told {
            self.told = true;
            let _ = self
                .notices
                .send(Notice::Storing(format!("{}; it is retried", failure.what)));
        }
    }

    fn retry(&mut self) {
        self.held_up.clear();
        self.stopped = false;
        self.told = false;
        for order in std::mem::take(&mut self.waiting) {
            self.take(order);
        }
    }

    /// Executes an order. Returns the next order, if there is one.
    fn carry_out(&self, order: &mut Order) -> Result<Option<Order>, StoreFailure> {
        match order {
            Order::Store { job, config, root } => {
                let root = root.as_deref();
                let outcome = self.store.store(job, config.as_deref(), root);
                let published = matches!(&outcome, StoreOutcome::Stored(it) if it.is_accepted());
                let path = job.path.clone();
                self.tell(job, outcome);
                return Ok(published.then_some(Order::Follow { path }));
            }
            Order::Withdraw { path, reporters } => {
                self.store.withdraw(path, reporters)?;
                let path = path.clone();
                // After the end of the loop the reporters are not informed. The journal contains them.
                let _ = self.events.send(Event::Withdrawn { path });
            }
            Order::Restamp { path, judged } => {
                let entry = Entry::Judged {
                    path: path.clone(),
                    judged: judged.clone(),
                    history: None,
                    written: None,
                };
                self.store.record(&[entry]).map_err(StoreFailure::of_all)?;
                return self.open_gate(path, judged);
            }
            Order::CloseGate { path } => self.store.close_gate(path)?,
            Order::OpenGate { path, judged } => return self.open_gate(path, judged),
            Order::Follow { path } => self.store.follow(path)?,
            Order::Record(entry) => {
                let recorded = self.store.record(std::slice::from_ref(entry));
                recorded.map_err(StoreFailure::of_all)?;
                if let Entry::Voided { path, .. } = entry {
                    // The report may have been the last file in its directory.
                    self.store.tidy_above(path);
                }
            }
        }
        Ok(None)
    }

    fn open_gate(&self, path: &Arc<Path>, judged: &Judged) -> Result<Option<Order>, StoreFailure> {
        self.store.open_gate(path, judged)?;
        let path = path.clone();
        let _ = self.events.send(Event::Opened { path: path.clone() });
        Ok(judged.is_accepted().then_some(Order::Follow { path }))
    }

    fn tell(&self, job: &FinishedJob, outcome: StoreOutcome) {
        if let StoreOutcome::Stored(judged) = &outcome
            && !judged.is_written()
            && self.store.retries
        {
            let (path, why) = (to_text(&job.path), judged.why.join("; "));
            let _ = self.notices.send(Notice::Storing(format!(
                "{path} stays undetermined until it changes or qcbus is restarted: {why}"
            )));
        }
        // After the end of the loop there is no receiver.
        let _ = self.events.send(Event::Stored {
            job: job.job,
            outcome,
        });
    }
}
