//! The built-in types and their lexical rules.

use std::sync::OnceLock;

use super::number::{in_bounds, is_decimal, is_float, is_integer};
use crate::edition::Edition;
use crate::pattern::Pattern;

macro_rules! builtins {
    ($($variant:ident $name:literal)*) => {
        /// A built-in type of XML Schema.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Builtin { $(#[doc = concat!("`xs:", $name, "`")] $variant,)* }

        impl Builtin {
            /// All supported built-in types.
            pub const ALL: &'static [Builtin] = &[$(Builtin::$variant,)*];

            /// Returns its name without prefix.
            pub fn name(self) -> &'static str {
                match self { $(Builtin::$variant => $name,)* }
            }
        }
    };
}

builtins! {
    AnySimple "anySimpleType" String "string" NormalizedString "normalizedString" Token "token"
    Language "language" NmToken "NMTOKEN" Name "Name" NcName "NCName" AnyUri "anyURI"
    Boolean "boolean" Decimal "decimal" Integer "integer" NonNegative "nonNegativeInteger"
    Positive "positiveInteger" NonPositive "nonPositiveInteger" Negative "negativeInteger"
    Long "long" Int "int" Short "short" Byte "byte" UnsignedLong "unsignedLong"
    UnsignedInt "unsignedInt" UnsignedShort "unsignedShort" UnsignedByte "unsignedByte"
    Float "float" Double "double" DateTime "dateTime" Date "date" Time "time"
    HexBinary "hexBinary" Base64 "base64Binary"
}

/// Order of the values of a type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// As text.
    Text,
    /// As decimal numbers of any length.
    Decimal,
    /// As floating-point numbers.
    Float,
    /// `true` = `1`, `false` = `0`.
    Boolean,
}

impl Builtin {
    /// Returns the type with this local name.
    pub fn find(name: &str) -> Option<Builtin> {
        Self::ALL
            .iter()
            .copied()
            .find(|builtin| builtin.name() == name)
    }

    /// Returns the order of its values.
    pub fn order(self) -> Order {
        use Builtin::{Boolean, Decimal, Double, Float, Integer};
        match self {
            Float | Double => Order::Float,
            Boolean => Order::Boolean,
            Decimal | Integer => Order::Decimal,
            _ if self.range().is_some() => Order::Decimal,
            _ => Order::Text,
        }
    }

    /// Checks whether white space around the value (and, for `token`, in it) is dropped.
    pub fn collapses(self) -> bool {
        !matches!(
            self,
            Self::AnySimple | Self::String | Self::NormalizedString
        )
    }

    /// Returns the smallest and largest value of an integer type. An empty text means no limit.
    pub fn range(self) -> Option<(&'static str, &'static str)> {
        Some(match self {
            Self::NonNegative => ("0", ""),
            Self::Positive => ("1", ""),
            Self::NonPositive => ("", "0"),
            Self::Negative => ("", "-1"),
            Self::Long => ("-9223372036854775808", "9223372036854775807"),
            Self::Int => ("-2147483648", "2147483647"),
            Self::Short => ("-32768", "32767"),
            Self::Byte => ("-128", "127"),
            Self::UnsignedLong => ("0", "18446744073709551615"),
            Self::UnsignedInt => ("0", "4294967295"),
            Self::UnsignedShort => ("0", "65535"),
            Self::UnsignedByte => ("0", "255"),
            _ => return None,
        })
    }

    /// Checks whether `text` is a value. White space to be dropped must already be gone.
    pub fn accepts(self, text: &str, edition: Edition) -> bool {
        match self {
            Self::AnySimple
            | Self::String
            | Self::NormalizedString
            | Self::Token
            | Self::AnyUri => true,
            Self::Boolean => matches!(text, "true" | "false" | "1" | "0"),
            Self::Decimal => is_decimal(text),
            Self::Float | Self::Double => is_float(text, edition),
            Self::DateTime | Self::Date => self.matches(text) && is_in_calendar(text),
            _ if self.pattern().is_some() => self.matches(text),
            _ => is_integer(text) && self.range().is_none_or(|range| in_bounds(text, range)),
        }
    }

    /// Returns the pattern of the values of a type that has one.
    fn pattern(self) -> Option<&'static str> {
        Some(match self {
            Self::Language => "[a-zA-Z]{1,8}(-[a-zA-Z0-9]{1,8})*",
            Self::NmToken => r"\c+",
            Self::Name => r"\i\c*",
            Self::NcName => r"[\i-[:]][\c-[:]]*",
            Self::DateTime => concat!(
                r"-?([1-9][0-9]{3,}|0([1-9][0-9]{2}|0[1-9][0-9]|00[1-9]))",
                r"-(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01])",
                r"T(([01][0-9]|2[0-3])(:[0-5][0-9]){2}(\.[0-9]+)?|24:00:00(\.0+)?)",
                r"(Z|[+\-]((0[0-9]|1[0-3]):[0-5][0-9]|14:00))?",
            ),
            Self::Date => concat!(
                r"-?([1-9][0-9]{3,}|0([1-9][0-9]{2}|0[1-9][0-9]|00[1-9]))",
                r"-(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01])",
                r"(Z|[+\-]((0[0-9]|1[0-3]):[0-5][0-9]|14:00))?",
            ),
            Self::Time => concat!(
                r"(([01][0-9]|2[0-3])(:[0-5][0-9]){2}(\.[0-9]+)?|24:00:00(\.0+)?)",
                r"(Z|[+\-]((0[0-9]|1[0-3]):[0-5][0-9]|14:00))?",
            ),
            Self::HexBinary => "([0-9a-fA-F]{2})*",
            Self::Base64 => {
                "(( *[A-Za-z0-9+/]){4})*( *[A-Za-z0-9+/] *[A-Za-z0-9+/]( *=| *[A-Za-z0-9+/]) *=)? *"
            }
            _ => return None,
        })
    }

    fn matches(self, text: &str) -> bool {
        static COMPILED: [OnceLock<Option<Pattern>>; Builtin::ALL.len()] =
            [const { OnceLock::new() }; Builtin::ALL.len()];
        let slot = COMPILED.get(self as usize);
        let compiled = slot.map(|slot| slot.get_or_init(|| Pattern::new(self.pattern()?).ok()));
        compiled.is_some_and(|it| it.as_ref().is_some_and(|pattern| pattern.matches(text)))
    }
}

/// Checks that the month of a date has the day, if the date has the form of one.
fn is_in_calendar(text: &str) -> bool {
    let mut parts = text.trim_start_matches('-').split('-');
    let (Some(year), Some(month), Some(day)) = (parts.next(), parts.next(), parts.next()) else {
        return false;
    };
    match (month, day.get(..2)) {
        ("02", Some("29")) => {
            // The calendar repeats every 400 years, so the last four digits decide.
            let year = year
                .len()
                .checked_sub(4)
                .and_then(|at| year[at..].parse().ok());
            year.is_some_and(|year: u32| {
                year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
            })
        }
        ("02", Some("30" | "31")) | ("04" | "06" | "09" | "11", Some("31")) => false,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn accepts(builtin: Builtin, text: &str) -> bool {
        builtin.accepts(text, Edition::V1_0)
    }

    #[test]
    fn date_times_follow_calendar_and_clock() {
        for good in [
            "2024-02-29T12:00:00",
            "2020-03-20T12:00:00Z",
            "2020-01-01T24:00:00",
            "2020-01-01T00:00:00.25+01:00",
            "-0001-12-31T23:59:59-14:00",
            "12020-01-01T00:00:00",
        ] {
            assert!(accepts(Builtin::DateTime, good), "{good}");
        }
        for bad in [
            "2023-02-29T12:00:00",
            "2020-03-20",
            "2020-13-01T00:00:00",
            "2020-01-01T24:00:01",
            "2020-01-01T00:00",
            "0000-01-01T00:00:00",
            "2020-01-01T00:00:00+15:00",
            "2020-01-01T00:00:00.",
            "20-01-01T00:00:00",
            "2020-01-01 00:00:00",
            "2020-01-01T00:00:00+ä1:0",
            "",
        ] {
            assert!(!accepts(Builtin::DateTime, bad), "{bad}");
        }
        for (builtin, good, bad) in [
            (Builtin::Date, "2020-01-31Z", "2020-04-31"),
            (Builtin::Time, "23:59:59.5-02:30", "23:60:00"),
            (Builtin::Language, "en-GB", "en-"),
            (Builtin::NmToken, "-1", ""),
            (Builtin::Name, "a:ä", "1a"),
            (Builtin::NcName, "a.b", "a:b"),
            (Builtin::HexBinary, "0aF1", "0aF"),
            (Builtin::Base64, "TWF u TQ = =", "TWFuTQ="),
        ] {
            assert!(accepts(builtin, good), "{good}");
            assert!(!accepts(builtin, bad), "{bad}");
        }
    }
}
