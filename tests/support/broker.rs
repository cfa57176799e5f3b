//! A broker as a process: start, requests, kill.

use std::process::{Child, Command, Stdio};

use rustix::process::Signal;

use super::processes::signal_pid;

/// A running `qcbus serve`.
#[derive(Debug)]
pub struct Broker {
    child: Child,
}

impl Broker {
    /// Starts the broker and appends its log to `log`.
    pub fn start(command: &mut Command, log: &std::path::Path) -> Broker {
        let log = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(log)
            .unwrap();
        let child = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .unwrap();
        Broker { child }
    }

    /// Returns the process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Checks whether the broker is running.
    pub fn is_alive(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    /// Kills the broker, as in a crash.
    pub fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Sends a signal to the broker.
    pub fn signal(&self, signal: Signal) {
        signal_pid(i32::try_from(self.child.id()).unwrap(), signal);
    }

    /// Waits until the broker ends.
    pub fn wait(&mut self) -> std::process::ExitStatus {
        super::watchdog::until("the broker ends", || self.child.try_wait().unwrap())
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        self.kill();
    }
}
