//! Signals: the first asks politely, the second does not.

use qcbus_broker::Stop;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::mpsc;

/// Turns SIGINT and SIGTERM into wishes to stop. Must be called within a tokio runtime.
pub fn listen() -> std::io::Result<mpsc::Receiver<Stop>> {
    let (sender, receiver) = mpsc::channel(4);
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::spawn(async move {
        let mut asked = false;
        loop {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
            let stop = if asked { Stop::Quit } else { Stop::Drain };
            asked = true;
            if sender.send(stop).await.is_err() {
                return;
            }
        }
    });
    Ok(receiver)
}
