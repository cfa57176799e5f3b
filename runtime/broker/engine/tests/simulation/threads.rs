//! Threads of which one runs at a time: the resuming thread selects the next one. They stop at the
//! broker's wait points and at the steps that it names.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::time::Duration;

use qcbus_environment::Signal;

use super::Simulation;

/// Current thread and its simulation.
#[derive(Clone)]
pub struct Here {
    pub simulation: Arc<Simulation>,
    /// `None` for the thread that resumes the others.
    pub task: Option<Arc<SimulatedThread>>,
}

thread_local! {
    static HERE: RefCell<Option<Here>> = const { RefCell::new(None) };
}

/// Returns the simulation of the current thread, if any.
pub fn here() -> Option<Here> {
    HERE.with_borrow(Clone::clone)
}

/// Assigns the current thread to a simulation, or to none.
pub fn enter(here: Option<Here>) {
    let environment = here
        .clone()
        .map(|it| Arc::new(it) as Arc<dyn qcbus_environment::Simulation>);
    qcbus_environment::enter(environment);
    HERE.set(here);
}

/// Condition that a thread waits for.
#[derive(Clone)]
pub enum State {
    /// Waits until it is resumed.
    Ready,
    /// Waits for a signal or a time.
    Asleep(Signal, Option<Duration>),
    /// Waits until the step count exceeds this number, or for a time.
    AtRest(usize, Duration),
    Ended,
}

/// A simulated thread.
pub struct SimulatedThread {
    pub name: String,
    pub state: Mutex<State>,
    /// Whether the thread may run.
    has_control: Mutex<bool>,
    changed: Condvar,
    /// Whether the thread must end where it stands, as in a killed process.
    killed: AtomicBool,
    /// Message of a panic in the thread's own code.
    pub panic: Mutex<Option<String>>,
}

/// Panic payload that ends a killed thread.
struct Killed;

impl SimulatedThread {
    fn hand_over(&self, mine: bool) {
        *self.has_control.lock().unwrap() = mine;
        self.changed.notify_all();
    }

    fn await_control(&self, mine: bool) {
        let has_control = self.has_control.lock().unwrap();
        drop(
            self.changed
                .wait_while(has_control, |it| *it != mine)
                .unwrap(),
        );
    }

    /// Lets the thread run until its next stop. Only the thread that has control may call this.
    pub fn resume(&self) {
        self.hand_over(true);
        self.await_control(false);
    }

    pub fn kill(&self) {
        self.killed.store(true, Ordering::Relaxed);
        while !self.has_ended() {
            self.resume();
        }
    }

    pub fn has_ended(&self) -> bool {
        matches!(*self.state.lock().unwrap(), State::Ended)
    }

    /// Stops until the thread is resumed.
    pub fn stop(&self, state: State) {
        // A killed thread drops its values without an interruption by others.
        if std::thread::panicking() {
            return;
        }
        *self.state.lock().unwrap() = state;
        self.hand_over(false);
        self.await_control(true);
        if self.killed.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Killed));
        }
    }

    fn run(
        self: &Arc<SimulatedThread>,
        simulation: Arc<Simulation>,
        body: Box<dyn FnOnce() + Send>,
    ) {
        self.await_control(true);
        enter(Some(Here {
            simulation,
            task: Some(self.clone()),
        }));
        if self.killed.load(Ordering::Relaxed) {
            // The body is dropped before the thread counts as ended, because it may hold a lock.
            drop(body);
        } else if let Err(payload) = catch_unwind(AssertUnwindSafe(body))
            && !payload.is::<Killed>()
        {
            let text = payload.downcast_ref::<String>().cloned();
            let text = text.or_else(|| payload.downcast_ref::<&str>().map(ToString::to_string));
            *self.panic.lock().unwrap() = Some(text.unwrap_or_default());
        }
        enter(None);
        *self.state.lock().unwrap() = State::Ended;
        self.hand_over(false);
    }
}

type Work = Box<dyn FnOnce() + Send>;

/// Threads of the system that are reused.
#[derive(Default)]
pub struct Crew {
    idle: Mutex<Vec<mpsc::Sender<Work>>>,
}

impl Crew {
    /// Starts a thread that runs `body` once it is resumed.
    pub fn start(
        self: &Arc<Crew>,
        simulation: &Arc<Simulation>,
        name: String,
        body: Box<dyn FnOnce() + Send>,
    ) -> Arc<SimulatedThread> {
        let task = Arc::new(SimulatedThread {
            name,
            state: Mutex::new(State::Ready),
            has_control: Mutex::new(false),
            changed: Condvar::new(),
            killed: AtomicBool::new(false),
            panic: Mutex::new(None),
        });
        let (its, simulation) = (task.clone(), simulation.clone());
        self.work(Box::new(move || its.run(simulation, body)));
        task
    }

    fn work(self: &Arc<Crew>, work: Work) {
        let idle = self.idle.lock().unwrap().pop();
        let refused = match idle {
            Some(worker) => worker.send(work).err().map(|it| it.0),
            None => Some(work),
        };
        let Some(work) = refused else { return };
        let (sender, receiver) = mpsc::channel::<Work>();
        sender.send(work).unwrap();
        let crew = Arc::downgrade(self);
        std::thread::spawn(move || {
            while let Ok(work) = receiver.recv() {
                work();
                let Some(crew) = crew.upgrade() else { return };
                crew.idle.lock().unwrap().push(sender.clone());
            }
        });
    }
}

/// Number of steps so far, for threads that wait for any step.
#[derive(Default)]
pub struct Steps(AtomicUsize);

impl Steps {
    pub fn count(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }

    pub fn next(&self) -> usize {
        self.0.fetch_add(1, Ordering::Relaxed) + 1
    }
}
