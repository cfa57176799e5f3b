//! Values of parameters. A configuration contains all types as text.

/// Type of the value of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ParamType {
    /// A finite double.
    Number,
    /// `true` or `false`; `1` and `0` mean the same.
    Flag,
    /// Any text.
    Text,
}

/// The value of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum ParamValue {
    /// A finite double.
    Number(f64),
    /// A truth value.
    Flag(bool),
    /// Any text, possibly empty.
    Text(String),
}

impl ParamType {
    /// Parses a configured text; returns `None` when it is not of this type. White space around
    /// numbers and flags is ignored.
    pub fn read(self, text: &str) -> Option<ParamValue> {
        let trimmed = text.trim();
        match self {
            ParamType::Number => {
                let number = trimmed.parse().ok()?;
                f64::is_finite(number).then_some(ParamValue::Number(number))
            }
            ParamType::Flag => match trimmed {
                "true" | "1" => Some(ParamValue::Flag(true)),
                "false" | "0" => Some(ParamValue::Flag(false)),
                _ => None,
            },
            ParamType::Text => Some(ParamValue::Text(text.to_owned())),
        }
    }

    /// Returns the description of a valid value, to be appended to "must be".
    pub fn expected(self) -> &'static str {
        match self {
            ParamType::Number => "a finite number, such as 0.05",
            ParamType::Flag => "`true` or `false`",
            ParamType::Text => "a text",
        }
    }
}

impl std::fmt::Display for ParamValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ParamValue::Number(number) => write!(f, "{number}"),
            ParamValue::Flag(flag) => write!(f, "{flag}"),
            ParamValue::Text(text) => f.write_str(text),
        }
    }
}
