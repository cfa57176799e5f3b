//! Orders of a broker to a bundle about the sandbox.

use std::process::Command;

use qcbus_formats::manifest::May;

/// Environment variable with the orders. Other programs ignore it.
const VARIABLE: &str = "QCBUS_SANDBOX";
const OFF: &str = "off";

/// Reason why a bundle cannot be confined as ordered.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SandboxError {
    /// The value of the variable is invalid for this version.
    #[error("{VARIABLE} is invalid: {0}")]
    Orders(String),
    /// The kernel refuses.
    #[error("{what}: {why}")]
    Kernel {
        /// The requested action.
        what: &'static str,
        /// The error of the kernel.
        why: String,
    },
}

impl SandboxError {
    pub(crate) fn kernel(what: &'static str, why: impl std::fmt::Display) -> SandboxError {
        let why = why.to_string();
        SandboxError::Kernel { what, why }
    }
}

/// Orders to a bundle about the sandbox.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Orders {
    /// The bundle must confine itself. Its manifest declares these additional permissions.
    On(May),
    /// The bundle must not confine itself (`--no-sandbox`).
    Off,
}

impl Orders {
    /// Returns the orders of the parent process. Without orders a bundle is confined and has no
    /// additional permissions.
    ///
    /// # Errors
    /// Returns [`SandboxError::Orders`] if the variable is invalid.
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
            .ok_or_else(|| wrong("it is not valid UTF-8".to_owned()))?;
        let may = serde_json::from_str(text).map_err(|error| wrong(error.to_string()))?;
        Ok(Orders::On(may))
    }

    /// Passes the orders to a process before its start.
    ///
    /// # Errors
    /// Returns [`SandboxError::Orders`] if a path is not valid text.
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
