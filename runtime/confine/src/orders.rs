//! What a broker tells a bundle that it starts about the sandbox.

use std::process::Command;

use qcbus_formats::manifest::May;

/// The variable of the environment in which it stands. A child of another program than ours ignores it.
const VARIABLE: &str = "QCBUS_SANDBOX";
const OFF: &str = "off";

/// Why a bundle cannot be confined, or not as it was told.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SandboxError {
    /// The variable says something else than a broker of this version does.
    #[error("{VARIABLE} cannot be understood: {0}")]
    Orders(String),
    /// The kernel refuses.
    #[error("{what}: {why}")]
    Kernel {
        /// What was asked of it.
        what: &'static str,
        /// What it says.
        why: String,
    },
}

impl SandboxError {
    pub(crate) fn kernel(what: &'static str, why: impl std::fmt::Display) -> SandboxError {
        let why = why.to_string();
        SandboxError::Kernel { what, why }
    }
}

/// What a bundle is told about the sandbox.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Orders {
    /// Confine yourself; your manifest declares this besides.
    On(May),
    /// Do not (`--no-sandbox`).
    Off,
}

impl Orders {
    /// What the process that started this one says. Without a word a bundle is confined and may do nothing besides.
    ///
    /// # Errors
    /// [`SandboxError::Orders`].
    pub fn given() -> Result<Orders, SandboxError> {
        let Some(text) = std::env::var_os(VARIABLE) else {
            return Ok(Orders::On(May::default()));
        };
        if text == OFF {
            return Ok(Orders::Off);
        }
        let wrong = |why: String| SandboxError::Orders(why);
        let text = text
            .to_str()
            .ok_or_else(|| wrong("it is no text".to_owned()))?;
        let may = serde_json::from_str(text).map_err(|error| wrong(error.to_string()))?;
        Ok(Orders::On(may))
    }

    /// Tells them to a process that is to be started.
    ///
    /// # Errors
    /// [`SandboxError::Orders`] when a path is no text.
    pub fn give(&self, command: &mut Command) -> Result<(), SandboxError> {
        let text = match self {
            Orders::Off => OFF.to_owned(),
            Orders::On(may) => {
                serde_json::to_string(may).map_err(|it| SandboxError::Orders(it.to_string()))?
            }
        };
        command.env(VARIABLE, text);
        Ok(())
    }
}
