//! Signals: the first one asks for a drain, the second one ends the process at once. SIGHUP makes a
//! long-running broker read its configuration again.

use std::io;

use qcbus_broker::OperatorSignal;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc;

/// Handler of SIGHUP, which a closed terminal sends, too.
pub struct Hangup {
    /// `None` if the signal is ignored.
    signal: Option<Signal>,
    reloads: bool,
}

impl Hangup {
    /// Returns the handler of a process that runs without a terminal. Must be called within a tokio
    /// runtime.
    pub fn reloads() -> io::Result<Hangup> {
        let signal = Some(signal(SignalKind::hangup())?);
        let reloads = true;
        Ok(Hangup { signal, reloads })
    }

    /// Returns the handler of a process that ends with its terminal, unless `nohup` has started it.
    /// Must be called within a tokio runtime.
    pub fn stops() -> io::Result<Hangup> {
        let is_ignored = std::fs::read_to_string("/proc/self/status")
            .is_ok_and(|status| ignores(&status, SignalKind::hangup()));
        let signal = match is_ignored {
            true => None,
            false => Some(signal(SignalKind::hangup())?),
        };
        let reloads = false;
        Ok(Hangup { signal, reloads })
    }

    async fn comes(&mut self) {
        match &mut self.signal {
            Some(signal) => drop(signal.recv().await),
            None => std::future::pending().await,
        }
    }
}

/// Checks whether a process ignores a signal, according to its status in `/proc`: bit 0 is signal
/// 1.
fn ignores(status: &str, kind: SignalKind) -> bool {
    let mut lines = status.lines();
    let mask = lines.find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|it| u64::from_str_radix(it.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (kind.as_raw_value() - 1) & 1 == 1)
}

/// Forwards the requests of SIGINT, SIGTERM and SIGHUP. Must be called within a tokio runtime.
pub fn listen(mut hangup: Hangup) -> io::Result<mpsc::Receiver<OperatorSignal>> {
    let (sender, receiver) = mpsc::channel(4);
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::spawn(async move {
        let mut asked = false;
        loop {
            let reloads = tokio::select! {
                _ = interrupt.recv() => false,
                _ = terminate.recv() => false,
                () = hangup.comes() => hangup.reloads,
            };
            let wanted = match (reloads, asked) {
                (true, _) => OperatorSignal::Reload,
                (false, false) => OperatorSignal::Drain,
                (false, true) => OperatorSignal::Quit,
            };
            asked |= !reloads;
            if sender.send(wanted).await.is_err() {
                return;
            }
        }
    });
    Ok(receiver)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signal_is_read_from_the_mask() {
        let hangup = SignalKind::hangup();
        assert!(ignores("Name:\tx\nSigIgn:\t0000000000001001\n", hangup));
        assert!(!ignores("SigIgn:\t0000000000001000\n", hangup));
        assert!(!ignores("", hangup));
    }
}
