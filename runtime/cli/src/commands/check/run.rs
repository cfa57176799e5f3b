//! Runtime of a `check` run and the signals that can stop it early.

use std::io;

use qcbus_broker::OperatorSignal;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::mpsc::Receiver;

use crate::commands::stops;

/// Runtime and stop signals of one run.
pub(super) struct Run {
    pub runtime: Runtime,
    /// Signals are received from the start. No signal is lost between asking a broker and starting
    /// one.
    pub stops: Receiver<OperatorSignal>,
}

impl Run {
    pub fn new() -> io::Result<Run> {
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let stops = runtime.block_on(async { stops::listen(stops::Hangup::stops()?) })?;
        Ok(Run { runtime, stops })
    }

    /// Returns the result of some work. Returns `None` if a signal stops the run; the work is then
    /// no longer awaited.
    pub fn unless_stopped<T: Send + 'static>(
        &mut self,
        work: impl FnOnce() -> Result<T, String> + Send + 'static,
    ) -> Option<Result<T, String>> {
        let (runtime, stops) = (&self.runtime, &mut self.stops);
        runtime.block_on(async {
            tokio::select! {
                done = tokio::task::spawn_blocking(work) => {
                    Some(done.unwrap_or_else(|error| Err(error.to_string())))
                }
                _ = stops.recv() => None,
            }
        })
    }
}
