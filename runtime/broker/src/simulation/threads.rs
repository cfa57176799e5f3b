//! Threads of which one runs at a time: who is next is said by whoever resumes it. They stop where
//! the broker waits for something, and at the steps that it names.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::time::Duration;

use super::Simulation;

/// Who runs here, and in which simulation.
#[derive(Clone)]
pub struct Here {
    pub simulation: Arc<Simulation>,
    /// None: whoever resumes the others.
    pub task: Option<Arc<Task>>,
}

thread_local! {
    static HERE: RefCell<Option<Here>> = const { RefCell::new(None) };
}

/// The simulation that this thread belongs to, if any.
pub fn here() -> Option<Here> {
    HERE.with_borrow(Clone::clone)
}

/// From now on this thread belongs to it, or to none.
pub fn enter(here: Option<Here>) {
    HERE.set(here);
}

/// Something has come for whoever waits for it.
pub type Signal = Arc<AtomicBool>;

/// What a thread waits for.
#[derive(Clone)]
pub enum State {
    /// For its turn.
    Ready,
    /// For a signal, or for a time.
    Asleep(Signal, Option<Duration>),
    /// For anything to happen after so many steps of others, or for a time.
    AtRest(usize, Duration),
    Ended,
}

/// One thread.
pub struct Task {
    pub name: String,
    pub state: Mutex<State>,
    /// Whether it is its turn.
    has_control: Mutex<bool>,
    changed: Condvar,
    /// It is to end where it stands, as a process does that is killed.
    killed: AtomicBool,
    /// It has ended with a panic of its own.
    pub panic: Mutex<Option<String>>,
}

/// How a thread leaves that is killed.
struct Killed;

impl Task {
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

    /// Lets it run until it stops the next time. To be called by who has the turn.
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

    /// Stops here until it is resumed.
    pub fn stop(&self, state: State) {
        // One that is killed puts away what it has in hands without others in between.
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

    fn run(self: &Arc<Task>, simulation: Arc<Simulation>, body: Box<dyn FnOnce() + Send>) {
        self.await_control(true);
        enter(Some(Here {
            simulation,
            task: Some(self.clone()),
        }));
        if self.killed.load(Ordering::Relaxed) {
            // Before it has ended for others: what it holds may be a lock.
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

/// Threads of the system that are used again and again.
#[derive(Default)]
pub struct Crew {
    idle: Mutex<Vec<mpsc::Sender<Work>>>,
}

impl Crew {
    /// A thread that does this once it is resumed.
    pub fn start(
        self: &Arc<Crew>,
        simulation: &Arc<Simulation>,
        name: String,
        body: Box<dyn FnOnce() + Send>,
    ) -> Arc<Task> {
        let task = Arc::new(Task {
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

/// How many steps there were, for those who wait for any.
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
