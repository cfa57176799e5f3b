//! Values of parameters: every type is written as text in a configuration.

/// What the value of a parameter can be.
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
    /// Yes or no.
    Flag(bool),
    /// Any text, also an empty one.
    Text(String),
}

impl ParamType {
    /// The value that a configured text stands for; `None` when it is none of this type. Space
    /// around numbers and flags counts for nothing.
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

    /// What a value of this type must be, to stand behind "must be".
    pub fn expected(self) -> &'static str {
        match self {
            ParamType::Number => "a finite number, written such as 0.05",
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
