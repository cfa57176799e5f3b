//! Waits for an added or changed bundle and reports why it is not ready. The broker names the
//! command of the process, so that an earlier process is not mistaken for it.

use std::path::Path;
use std::time::{Duration, Instant};

use qcbus_control::ask_broker;
use qcbus_messages::control::{BundleReadiness, Readiness, Request, Response, Runs};
use qcbus_messages::{Exit, shown};

use super::manifests::{Home, Refusal};
use crate::talk;

/// Pause between two requests to the broker.
const PAUSE: Duration = Duration::from_millis(50);

/// Returns the state of a bundle; `None` if there is none of this name.
pub fn readiness(broker: &Path, name: &str) -> Result<Option<Box<BundleReadiness>>, Refusal> {
    let request = Request::Bundle {
        name: name.to_owned(),
    };
    match ask_broker(broker, &request) {
        Ok(Response::Bundle { bundle }) => Ok(bundle),
        Ok(Response::Failed { reason }) => Err((Exit::Internal, reason)),
        Ok(other) => Err((Exit::Internal, format!("unexpected answer: {other:?}"))),
        Err(error) => Err((Exit::NoBroker, error.to_string())),
    }
}

/// Waits until the process of this command is ready.
///
/// # Errors
/// Returns the reason why it is not ready, for the user.
pub fn wait(home: &Home, name: &str, command: &str, limit: Duration) -> Result<Runs, Refusal> {
    let Some(broker) = home.broker() else {
        return Err((Exit::NoBroker, "no broker runs".to_owned()));
    };
    let begin = Instant::now();
    loop {
        let bundle = readiness(broker, name)?;
        let ours = bundle.filter(|it| it.command.as_deref() == Some(command));
        let Some(bundle) = ours else {
            let why = "another process has changed its manifest in the meantime".to_owned();
            return Err((Exit::Undetermined, why));
        };
        match (bundle.readiness, bundle.runs) {
            (Readiness::Ready, Some(runs)) => return Ok(runs),
            (Readiness::Failing { why }, _) => {
                return Err((Exit::Usage, failing(name, &why, &bundle.said)));
            }
            (Readiness::Coming { joined }, _) if begin.elapsed() >= limit => {
                let seconds = limit.as_secs_f64();
                let what = if joined {
                    "it connected, but did not report what it checks"
                } else {
                    "it did not connect"
                };
                return Err((Exit::Undetermined, format!("{what} within {seconds} s")));
            }
            _ => std::thread::sleep(PAUSE),
        }
    }
}

/// Returns the reason why a bundle is not ready, and prints the last lines of its output.
fn failing(name: &str, why: &str, said: &[String]) -> String {
    let why = shown::line(why);
    if said.is_empty() {
        return format!("{why}; its output is in the broker's log");
    }
    let lines = said.iter().map(|it| format!("\n  {}", shown::line(it)));
    let lines: String = lines.collect();
    talk::say_lines(&format!(
        "last output of `{name}` (the full output is in the broker's log):{lines}"
    ));
    why.into_owned()
}

/// Returns the message for a bundle that is ready; `was` follows the list of kinds.
pub fn ready(name: &str, runs: &Runs, was: &str, notices: &[String]) -> String {
    let kinds: Vec<&str> = runs.kinds.iter().map(|it| it.as_str()).collect();
    let mut text = format!(
        "{name}: ready, {} ({}){was}",
        counted(runs.checkers),
        kinds.join(", ")
    );
    if runs.shadow {
        text.push_str("; it is a shadow and does not affect verdicts (`qcbus bundle trials ");
        text.push_str(name);
        text.push_str("` shows what it would change)");
    }
    if runs.demanded == 0 {
        text.push_str(
            "; but none of its checkers runs: the configuration in force does not name the bundle, or they are \
             off by default",
        );
    }
    let text = shown::line(&text).to_string();
    let about = format!("`{name}`");
    let about = notices.iter().filter(|it| it.contains(&about));
    let lines = about.map(|it| format!("\n{}", shown::line(it)));
    std::iter::once(text).chain(lines).collect()
}

/// Formats a number of checkers.
pub fn counted(checkers: u64) -> String {
    match checkers {
        1 => "1 checker".to_owned(),
        several => format!("{several} checkers"),
    }
}

/// Formats a number of files.
pub fn files(number: u64) -> String {
    match number {
        1 => "1 file".to_owned(),
        several => format!("{several} files"),
    }
}
