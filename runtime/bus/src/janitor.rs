//! Janitor: cleans up after dead processes, outside the broker's loop.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use iceoryx2::prelude::Config;

use crate::generation::{Generation, sweep};
use crate::instance::Instance;
use crate::ports::{clean_dead_nodes, generation_config};
use crate::runtime_files::RuntimeFiles;

const EVERY: Duration = Duration::from_millis(250);
/// Maximum wait for a clean-up at a stop. It takes milliseconds, and must not block the stop.
const STOP_WITHIN: Duration = Duration::from_secs(2);

/// A thread that removes the remains of older generations once, and those of dead peers repeatedly.
/// It also restores files that were removed from the runtime directory.
pub(crate) struct Janitor {
    stop: Option<Sender<()>>,
    stopped: Receiver<()>,
    thread: Option<JoinHandle<()>>,
}

impl Janitor {
    pub(crate) fn start(
        instance: &Instance,
        generation: &Generation,
        runtime_files: Arc<RuntimeFiles>,
    ) -> std::io::Result<Janitor> {
        let config = generation_config(&generation.root).map_err(std::io::Error::other)?;
        let (stop, asked) = channel();
        let (done, stopped) = channel();
        let (instance, generation) = (instance.clone(), generation.clone());
        let thread = Builder::new()
            .name("bus-janitor".to_owned())
            .spawn(move || {
                sweep(&instance, Some(&generation));
                clean_until_asked(&config, &runtime_files, &asked);
                let _ = done.send(());
            })?;
        Ok(Janitor {
            stop: Some(stop),
            stopped,
            thread: Some(thread),
        })
    }
}

fn clean_until_asked(config: &Config, runtime_files: &RuntimeFiles, asked: &Receiver<()>) {
    while let Err(RecvTimeoutError::Timeout) = asked.recv_timeout(EVERY) {
        runtime_files.look_after();
        clean_dead_nodes(config);
    }
}

impl Drop for Janitor {
    fn drop(&mut self) {
        drop(self.stop.take());
        let in_time = self.stopped.recv_timeout(STOP_WITHIN).is_ok();
        if let Some(thread) = self.thread.take()
            && in_time
        {
            let _ = thread.join();
        }
    }
}
