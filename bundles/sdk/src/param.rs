//! Parameters of rules: they are declared beside the rule, set in a configuration and shown in the
//! result.

use qcbus_formats::config::{
    LEVELS_OF_ASAM, LEVELS_OF_READERS, LEVELS_PARAM, ParamType, ParamValue,
};
use qcbus_formats::xqar;

/// A parameter of a rule, with its default value.
///
/// ```
/// use qcbus_sdk::Param;
/// const TOLERANCE: Param =
///     Param::number("tolerance", 0.01, "m", "largest gap between two geometries that is accepted");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Param {
    /// Name in configurations.
    pub name: &'static str,
    /// Value if the configuration does not set another one.
    pub default: Default,
    /// Unit of a number; may be empty.
    pub unit: &'static str,
    /// Effect of the parameter.
    pub description: &'static str,
}

/// Default of a [`Param`], which also determines its type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Default {
    /// A finite double.
    Number(f64),
    /// `true` or `false`.
    Flag(bool),
    /// Any text.
    Text(&'static str),
}

impl Param {
    /// Creates a parameter with a finite number.
    pub const fn number(
        name: &'static str,
        default: f64,
        unit: &'static str,
        description: &'static str,
    ) -> Param {
        Param {
            name,
            default: Default::Number(default),
            unit,
            description,
        }
    }

    /// Creates a parameter that is `true` or `false`.
    pub const fn flag(name: &'static str, default: bool, description: &'static str) -> Param {
        Param {
            name,
            default: Default::Flag(default),
            unit: "",
            description,
        }
    }

    /// Creates a parameter with a text.
    pub const fn text(
        name: &'static str,
        default: &'static str,
        description: &'static str,
    ) -> Param {
        Param {
            name,
            default: Default::Text(default),
            unit: "",
            description,
        }
    }

    /// Returns the type of its value.
    pub fn value_type(&self) -> ParamType {
        match self.default {
            Default::Number(_) => ParamType::Number,
            Default::Flag(_) => ParamType::Flag,
            Default::Text(_) => ParamType::Text,
        }
    }

    /// Returns the default as written in a configuration.
    pub fn default_text(&self) -> String {
        self.default_value().to_string()
    }

    fn default_value(&self) -> ParamValue {
        match self.default {
            Default::Number(number) => ParamValue::Number(number),
            Default::Flag(flag) => ParamValue::Flag(flag),
            Default::Text(text) => ParamValue::Text(text.to_owned()),
        }
    }

    fn read(&self, text: String) -> Result<ParamValue, ParamError> {
        let value_type = self.value_type();
        value_type.read(&text).ok_or(ParamError {
            name: self.name,
            value: text,
            expected: value_type.expected(),
        })
    }

    /// Returns meaning and unit in one sentence.
    pub fn meaning(&self) -> String {
        match self.unit {
            "" => self.description.to_owned(),
            unit => format!("{} [{unit}]", self.description),
        }
    }
}

/// Parameter of every checker: maximum number of its findings listed in a result.
pub const MAX_ISSUES: Param = Param::number(
    "qcbus.max_issues",
    1000.0,
    "",
    "maximum number of listed findings of this checker; further findings are only counted",
);

/// Parameter of every checker: whose levels its findings have. `readers`: what a simulator does with
/// the file. `asam`: what the standard demands.
pub const LEVELS: Param = Param::text(
    LEVELS_PARAM,
    LEVELS_OF_READERS,
    "levels of findings: `readers` for what harms readers of the file, `asam` for what the standard demands",
);

/// A configured value that is invalid for its parameter.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the parameter `{name}` is `{value}`, but must be {expected}")]
pub struct ParamError {
    name: &'static str,
    value: String,
    expected: &'static str,
}

/// Parameter values of one checker.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    values: Vec<(Param, ParamValue)>,
    /// Whether findings have the levels of ASAM.
    pub(crate) levels_of_asam: bool,
}

impl Values {
    /// Returns the value from `configured` for each parameter, else its default.
    ///
    /// # Errors
    /// [`ParamError`] if a configured text does not fit the parameter's type.
    pub fn resolve(
        params: &[Param],
        configured: impl Fn(&str) -> Option<String>,
    ) -> Result<Values, ParamError> {
        let values = params.iter().chain([&MAX_ISSUES]).map(|param| {
            let value = match configured(param.name) {
                Some(text) => param.read(text)?,
                None => param.default_value(),
            };
            Ok((*param, value))
        });
        let values = values.collect::<Result<_, ParamError>>()?;
        let levels_of_asam = match configured(LEVELS.name).as_deref().map(str::trim) {
            None | Some(LEVELS_OF_READERS) => false,
            Some(LEVELS_OF_ASAM) => true,
            Some(other) => {
                return Err(ParamError {
                    name: LEVELS.name,
                    value: other.to_owned(),
                    expected: "`readers` or `asam`",
                });
            }
        };
        Ok(Values {
            values,
            levels_of_asam,
        })
    }

    /// Returns the values for a result file: the declared parameters of the rule, and the number of
    /// listed findings if it was changed.
    pub fn listed(&self) -> Vec<xqar::Param> {
        let says_something = |(param, value): &&(Param, ParamValue)| {
            param.name != MAX_ISSUES.name || *value != param.default_value()
        };
        let listed = self.values.iter().filter(says_something);
        listed
            .map(|(param, value)| xqar::Param {
                name: param.name.to_owned(),
                value: value.to_string(),
            })
            .collect()
    }

    /// Returns a number. It is the parameter's default if the rule did not declare the parameter.
    pub fn number(&self, param: &Param) -> f64 {
        match (self.get(param), param.default) {
            (Some(ParamValue::Number(number)), _) | (_, Default::Number(number)) => number,
            _ => f64::NAN,
        }
    }

    /// Returns a flag. It is the parameter's default if the rule did not declare the parameter.
    pub fn flag(&self, param: &Param) -> bool {
        match (self.get(param), param.default) {
            (Some(ParamValue::Flag(flag)), _) | (_, Default::Flag(flag)) => flag,
            _ => false,
        }
    }

    /// Returns a text. It is the parameter's default if the rule did not declare the parameter.
    pub fn text(&self, param: &Param) -> String {
        self.get(param)
            .unwrap_or_else(|| param.default_value())
            .to_string()
    }

    /// Replaces the configured value with a text.
    pub(crate) fn set(&mut self, param: &Param, text: String) {
        let known = self
            .values
            .iter_mut()
            .find(|(known, _)| known.name == param.name);
        if let Some((_, value)) = known {
            *value = ParamValue::Text(text);
        }
    }

    fn get(&self, param: &Param) -> Option<ParamValue> {
        self.values
            .iter()
            .find(|(known, _)| known.name == param.name)
            .map(|(_, value)| value.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAP: Param = Param::number("gap", 0.5, "m", "a gap");
    const STRICT: Param = Param::flag("strict", false, "be strict");

    #[test]
    fn configured_value_wins_over_default() {
        let of = |name: &str| (name == "gap").then(|| " 2.5 ".to_owned());
        let values = Values::resolve(&[GAP, STRICT], of).unwrap();
        assert_eq!(values.number(&GAP), 2.5);
        assert!(!values.flag(&STRICT));
        let names: Vec<_> = values
            .listed()
            .into_iter()
            .map(|p| (p.name, p.value))
            .collect();
        assert_eq!(
            names,
            [
                ("gap".into(), "2.5".into()),
                ("strict".into(), "false".into())
            ]
        );
    }

    #[test]
    fn levels_are_those_of_readers_or_of_asam() {
        let resolve = |value: Option<&str>| {
            Values::resolve(&[], |name| {
                value.filter(|_| name == LEVELS.name).map(str::to_owned)
            })
        };
        for (value, of_asam) in [
            (None, false),
            (Some("readers"), false),
            (Some(" asam "), true),
        ] {
            assert_eq!(resolve(value).unwrap().levels_of_asam, of_asam, "{value:?}");
        }
        let error = resolve(Some("strict")).unwrap_err().to_string();
        assert_eq!(
            error,
            "the parameter `qcbus.levels` is `strict`, but must be `readers` or `asam`"
        );
    }

    #[test]
    fn value_of_wrong_type_is_error_naming_parameter() {
        for wrong in ["", "1 m", "nan", "inf"] {
            let error = Values::resolve(&[GAP], |_| Some(wrong.to_owned())).unwrap_err();
            assert!(error.to_string().contains("`gap`"), "{error}");
        }
    }
}
