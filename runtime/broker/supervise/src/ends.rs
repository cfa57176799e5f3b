//! Ends of children.

use qcbus_bus::Process;
use qcbus_types::{ChildEnd, Event, Launch};
use tokio::process::Child;
use tokio::sync::mpsc::UnboundedSender;

use super::Started;
use crate::final_output::FinalOutput;

/// Waits for the end of a child, stores its final output, and then reports the end.
pub(super) async fn watch(
    launch: Launch,
    name: String,
    mut started: Started,
    words: FinalOutput,
    events: UnboundedSender<Event>,
) {
    let ended = started.child.wait().await;
    words.take_down(launch, name, started.heard).await;
    let end = match ended {
        Ok(status) => end_of(status),
        Err(error) => ChildEnd::Failed(format!("its exit status cannot be read: {error}")),
    };
    // The broker may have stopped meanwhile.
    let _ = events.send(Event::Exited { launch, end });
}

fn end_of(status: std::process::ExitStatus) -> ChildEnd {
    use std::os::unix::process::ExitStatusExt;
    let manifest = "see its manifest";
    match (status.code(), status.signal()) {
        // The shell returns these exit codes if it cannot start a command.
        (Some(code @ 127), _) => ChildEnd::NotStarted(format!(
            "its command was not found (exit code {code}); {manifest}"
        )),
        (Some(code @ 126), _) => ChildEnd::NotStarted(format!(
            "its command cannot be run (exit code {code}); {manifest}"
        )),
        (Some(0), _) => ChildEnd::Done("it ended with exit code 0".to_owned()),
        (Some(code), _) => ChildEnd::Failed(format!("it ended with exit code {code}")),
        (None, Some(signal)) => ChildEnd::Failed(format!("it was killed by signal {signal}")),
        (None, None) => ChildEnd::Failed("it ended".to_owned()),
    }
}

/// Kills a child that is not needed after all.
pub(super) fn kill_early(child: &Child) {
    // The child is not reaped yet, so the id certainly belongs to it. The runtime reaps it.
    let process = child.id().and_then(|id| Process::open(id, None));
    process.iter().for_each(Process::kill);
}
