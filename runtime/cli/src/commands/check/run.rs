//! What carries a run, and who may end it before it is through.

use std::io;

use qcbus_broker::OperatorSignal;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::mpsc::Receiver;

use crate::commands::stops;

/// A run.
pub(super) struct Run {
    pub runtime: Runtime,
    /// Listened to from the beginning: no signal is lost between asking a broker and being one.
    pub stops: Receiver<OperatorSignal>,
}

impl Run {
    pub fn new() -> io::Result<Run> {
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let stops = runtime.block_on(async { stops::listen(stops::Hangup::stops()?) })?;
        Ok(Run { runtime, stops })
    }

    /// What becomes of some work; `None`: somebody wanted the run to stop, and nobody waits for the work any more.
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
