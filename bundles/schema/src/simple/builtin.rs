//! The built-in types and their lexical rules.

use super::number::{in_bounds, is_decimal, is_float, is_integer};
use crate::model::Edition;

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
            Self::Language => is_language(text),
            Self::NmToken => !text.is_empty() && text.chars().all(is_name_char),
            Self::Name => is_name(text),
            Self::NcName => is_name(text) && !text.contains(':'),
            Self::Boolean => matches!(text, "true" | "false" | "1" | "0"),
            Self::Decimal => is_decimal(text),
            Self::Float | Self::Double => is_float(text, edition),
            Self::DateTime => super::time::is_date_time(text),
            Self::Date => super::time::is_date(text),
            Self::Time => super::time::is_time(text),
            Self::HexBinary => {
                text.len().is_multiple_of(2) && text.bytes().all(|byte| byte.is_ascii_hexdigit())
            }
            Self::Base64 => is_base64(text),
            _ => is_integer(text) && self.range().is_none_or(|range| in_bounds(text, range)),
        }
    }
}

fn is_language(text: &str) -> bool {
    text.split('-').enumerate().all(|(index, part)| {
        let letters = if index == 0 {
            part.bytes().all(|byte| byte.is_ascii_alphabetic())
        } else {
            part.bytes().all(|byte| byte.is_ascii_alphanumeric())
        };
        letters && (1..=8).contains(&part.len())
    })
}

fn is_base64(text: &str) -> bool {
    let mut digits = 0usize;
    let mut padding = 0usize;
    for byte in text.bytes() {
        match byte {
            b' ' => continue,
            b'=' => padding += 1,
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'+' | b'/' if padding == 0 => {}
            _ => return false,
        }
        digits += 1;
    }
    padding <= 2 && digits.is_multiple_of(4)
}

fn is_name(text: &str) -> bool {
    text.chars().next().is_some_and(is_name_start) && text.chars().all(is_name_char)
}

/// Checks for XML 1.0, fifth edition, production `NameStartChar`.
pub(crate) fn is_name_start(c: char) -> bool {
    matches!(c, ':' | '_' | 'A'..='Z' | 'a'..='z' | '\u{C0}'..='\u{D6}' | '\u{D8}'..='\u{F6}'
        | '\u{F8}'..='\u{2FF}' | '\u{370}'..='\u{37D}' | '\u{37F}'..='\u{1FFF}'
        | '\u{200C}'..='\u{200D}' | '\u{2070}'..='\u{218F}' | '\u{2C00}'..='\u{2FEF}'
        | '\u{3001}'..='\u{D7FF}' | '\u{F900}'..='\u{FDCF}' | '\u{FDF0}'..='\u{FFFD}'
        | '\u{10000}'..='\u{EFFFF}')
}

/// Checks for XML 1.0, fifth edition, production `NameChar`.
pub(crate) fn is_name_char(c: char) -> bool {
    is_name_start(c)
        || matches!(c, '-' | '.' | '0'..='9' | '\u{B7}' | '\u{300}'..='\u{36F}'
            | '\u{203F}'..='\u{2040}')
}
