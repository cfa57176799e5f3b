//! Commands that ask a running broker: `down`, `wait`, `reload`.

use qcbus_control::{AskError, ask_broker};
use qcbus_messages::Exit;
use qcbus_messages::control::{FileVerdict, Request, Response};
use qcbus_messages::path_text::to_text;
use qcbus_messages::shown;

use super::settings::{instance, named};
use crate::args::{InstanceArgs, WaitArgs};
use crate::talk;

/// Asks the broker of an instance. A failure has already been printed.
pub fn ask(args: &InstanceArgs, request: &Request) -> Result<Response, Exit> {
    let instance = instance(args).map_err(|why| {
        talk::fail(&why);
        Exit::Usage
    })?;
    ask_broker(instance.dir(), request).map_err(|error| {
        talk::fail(&error.to_string());
        exit_of(&error)
    })
}

/// Returns the exit code of a command that gets no answer.
pub fn exit_of(error: &AskError) -> Exit {
    match error {
        AskError::NoBroker { .. } | AskError::Forbidden { .. } | AskError::Left(_) => {
            Exit::NoBroker
        }
        AskError::Unreachable { .. } | AskError::NoAnswer(_) => Exit::Internal,
    }
}

/// `qcbus down`.
pub fn down(args: &InstanceArgs) -> Exit {
    match ask(args, &Request::Down) {
        Ok(Response::Stopped) => {
            talk::say("stopped");
            Exit::Accepted
        }
        Ok(other) => unexpected(&other),
        Err(exit) => exit,
    }
}

/// `qcbus reload`.
pub fn reload(args: &InstanceArgs) -> Exit {
    match ask(args, &Request::Reload) {
        Ok(Response::Reloaded { changes, notices }) => {
            for notice in notices {
                talk::say(&format!("note: {notice}"));
            }
            if changes.is_empty() {
                talk::print("nothing changed\n");
            } else {
                for change in changes {
                    talk::print(&format!("{}\n", shown::line(&change)));
                }
            }
            Exit::Accepted
        }
        Ok(other) => unexpected(&other),
        Err(exit) => exit,
    }
}

/// `qcbus wait`.
pub fn wait(args: &WaitArgs) -> Exit {
    let file = named(&args.file);
    let timeout_ms = args
        .timeout
        .map(|it| u64::try_from(it.as_millis()).unwrap_or(u64::MAX));
    let request = match args.reports {
        true => Request::WaitReported { file, timeout_ms },
        false => Request::Wait { file, timeout_ms },
    };
    match ask(&args.instance, &request) {
        Ok(Response::Verdict(verdict)) => tell(args, &verdict),
        Ok(Response::TimedOut) => {
            talk::fail(&format!(
                "no verdict on {} in time{}",
                to_text(&args.file),
                why_no_verdict(args)
            ));
            Exit::Undetermined
        }
        Ok(Response::Unreported { verdict, reporters }) => {
            tell(args, &verdict);
            let (file, why) = (to_text(&args.file), reporters.join("; "));
            talk::fail(&format!(
                "not all reports on {file} were finished in time: {why}"
            ));
            Exit::Undetermined
        }
        Ok(Response::Unanswered { reason }) => {
            let file = to_text(&args.file);
            talk::fail(&format!("no verdict on {file}: {reason}"));
            Exit::Undetermined
        }
        Ok(Response::Unwatched { reason }) => {
            talk::fail(&reason);
            Exit::Usage
        }
        Ok(other) => unexpected(&other),
        Err(exit) => exit,
    }
}

/// Returns the reason why the broker has no verdict on a file. It comes from the status of the file
/// or of a directory above it.
fn why_no_verdict(args: &WaitArgs) -> String {
    let file = named(&args.file);
    if let Ok(Response::Status(status)) = ask(&args.instance, &Request::Status) {
        let unfinished = status.unfinished.into_iter().map(|it| (it.path, it.why));
        let unseen = status.unseen.into_iter().map(|it| (it.path, it.why));
        let known = unfinished.chain(unseen);
        let known = known.filter(|(path, _)| file.starts_with(path));
        if let Some((path, why)) = known.max_by_key(|(path, _)| path.as_os_str().len()) {
            let (at, why) = (to_text(&path), shown::line(&why));
            return match path {
                path if path == file => format!(": {why}"),
                path if status.watching.contains(&path) => {
                    format!(": the watched directory {at} {why}")
                }
                _ => format!(": {at}: {why}"),
            };
        }
    }
    match args.file.exists() {
        true => "; `qcbus status` shows the current work".to_owned(),
        false => ": the file does not exist".to_owned(),
    }
}

fn tell(args: &WaitArgs, verdict: &FileVerdict) -> Exit {
    if args.json {
        match serde_json::to_string(verdict) {
            Ok(text) => talk::print(&format!("{text}\n")),
            Err(error) => talk::fail(&error.to_string()),
        }
    } else if !args.quiet {
        talk::print(&format!(
            "{}: {} ({}, {}); {}\n",
            to_text(&args.file),
            verdict.verdict,
            count(verdict.errors, "error"),
            count(verdict.warnings, "warning"),
            if verdict.xqar.as_os_str().is_empty() {
                "no result".to_owned()
            } else {
                to_text(&verdict.xqar)
            }
        ));
        for why in &verdict.why {
            talk::print(&format!("  {}\n", shown::line(why)));
        }
    }
    Exit::of_verdicts([verdict.verdict])
}

fn count(number: u64, of: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {of}{plural}")
}

fn unexpected(response: &Response) -> Exit {
    match response {
        Response::Failed { reason } => talk::fail(reason),
        other => talk::fail(&format!("unexpected answer from the broker: {other:?}")),
    }
    match response {
        Response::Failed { .. } => Exit::Usage,
        _ => Exit::Internal,
    }
}
