//! Report modules of ASAM's framework: such a module reads a result and writes report files.

use std::ffi::OsString;
use std::path::Path;

use qcbus_formats::xqar::Param;
use qcbus_messages::Exit;

use crate::hosted::{Hosted, parse};
use crate::messages::{Bytes, Document, Request};
use crate::results::Paths;
use crate::runners::Runners;

/// A report module that is run for every result.
#[derive(Debug)]
pub struct ReportModule {
    hosted: Hosted,
    runners: Runners,
}

/// A written report file: its name relative to the module's own directory, and its content.
pub type ReportFile = (String, Vec<u8>);

impl ReportModule {
    /// Starts the runner of the module. `program` has the words after the program name that select
    /// the adapter. Returns the `arguments` that are not for the adapter.
    ///
    /// # Errors
    /// The exit code and the reason as text for the user.
    pub fn start(
        program: &[&str],
        arguments: impl IntoIterator<Item = OsString>,
    ) -> Result<(ReportModule, Vec<OsString>), (Exit, String)> {
        let arguments: Vec<OsString> = arguments.into_iter().collect();
        let asked = parse(arguments.clone()).map_err(|error| (Exit::Usage, error.to_string()))?;
        let hosted = asked.hosted;
        let name = &hosted.name;
        let runners = Runners::start(1, &hosted, program, &arguments)
            .map_err(|error| (Exit::Internal, format!("`{name}` cannot be run: {error}")))?;
        Ok((ReportModule { hosted, runners }, asked.rest))
    }

    /// Returns the name under which the module joins.
    pub fn name(&self) -> &str {
        &self.hosted.name
    }

    /// Runs the module on a result with the parameters of a configuration.
    ///
    /// # Errors
    /// The reason for a missing report, as text for the user.
    pub fn report(&self, result: &Path, params: &[Param]) -> Result<Vec<ReportFile>, String> {
        let bytes = std::fs::read(result)
            .map_err(|error| format!("cannot read {}: {error}", result.display()))?;
        let name = &self.hosted.name;
        let mut applications = vec![name.clone()];
        applications.extend(self.hosted.application.clone());
        let params = params.iter().map(|it| (it.name.clone(), it.value.clone()));
        let request = Request {
            files: vec![Document {
                path: result.to_path_buf(),
                bytes: Bytes::Here(bytes.len() as u64),
                packed: None,
            }],
            config: None,
            applications,
            report: Some(params.collect()),
        };
        let answered = self.runners.ask(&request, &[&bytes]);
        // The parent of this process starts a new one.
        let answered = answered.unwrap_or_else(|error| {
            tracing::error!(module = name, %error, "the runner has ended");
            std::process::exit(i32::from(Exit::Internal.code()))
        });
        let (ran, body) =
            answered.map_err(|why| format!("the report module `{name}` did not run: {why}"))?;
        if let Some(fault) = &ran.fault {
            return Err(Paths::of(&ran).sentence(name, fault, &ran.said));
        }
        let mut rest = &body[..];
        let files = ran.reports.into_iter().map(|(file, length)| {
            let length = usize::try_from(length)
                .unwrap_or(usize::MAX)
                .min(rest.len());
            let (own, others) = rest.split_at(length);
            rest = others;
            (file, own.to_vec())
        });
        Ok(files.collect())
    }
}
