//! Versions of a standard, and the ranges of versions that a rule applies to.

use std::fmt;
use std::str::FromStr;

/// A version of a standard, such as 1.7. Files name only the first two numbers, and the third is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Version {
    /// First number.
    pub major: u16,
    /// Second number.
    pub minor: u16,
    /// Third number.
    pub patch: u16,
}

impl Version {
    /// Returns the version of a file with these two numbers.
    pub const fn new(major: u16, minor: u16) -> Version {
        Version {
            major,
            minor,
            patch: 0,
        }
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.major, self.minor)?;
        if self.patch == 0 {
            Ok(())
        } else {
            write!(f, ".{}", self.patch)
        }
    }
}

/// Reason why a text is not a valid version or range of versions.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected a version range such as `1.7.0..`, `1.4.0..1.8.0`, `..=1.6.0` or nothing, found `{0}`"
)]
pub struct VersionError(String);

impl FromStr for Version {
    type Err = VersionError;

    fn from_str(text: &str) -> Result<Version, VersionError> {
        let wrong = || VersionError(text.to_owned());
        let mut numbers = [0_u16; 3];
        let mut count = 0;
        for part in text.split('.') {
            let slot = numbers.get_mut(count).ok_or_else(wrong)?;
            *slot = part.parse().map_err(|_| wrong())?;
            count += 1;
        }
        let [major, minor, patch] = numbers;
        if count < 2 {
            Err(wrong())
        } else {
            Ok(Version {
                major,
                minor,
                patch,
            })
        }
    }
}

/// The versions that a rule applies to, in the notation of Rust ranges: `1.7.0..`, `1.4.0..1.8.0`
/// (1.8.0 excluded), `..=1.6.0`. The empty text means every version and also documents that name
/// none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct VersionRange {
    from: Option<Version>,
    to: Option<Version>,
    includes_to: bool,
}

impl VersionRange {
    /// Returns whether the range includes every document, even one without a version.
    pub fn is_everything(&self) -> bool {
        self.from.is_none() && self.to.is_none()
    }

    /// Returns the first version of the range, if it has a start.
    pub fn first(&self) -> Option<Version> {
        self.from
    }

    /// Returns whether `version` is before the start.
    pub fn is_before(&self, version: Version) -> bool {
        self.from.is_some_and(|from| version < from)
    }

    /// Returns whether `version` is in the range.
    pub fn contains(&self, version: Version) -> bool {
        let below_end = match self.to {
            None => true,
            Some(to) if self.includes_to => version <= to,
            Some(to) => version < to,
        };
        below_end && !self.is_before(version)
    }
}

impl FromStr for VersionRange {
    type Err = VersionError;

    fn from_str(text: &str) -> Result<VersionRange, VersionError> {
        let text = text.trim();
        if text.is_empty() {
            return Ok(VersionRange::default());
        }
        let (from, to) = text
            .split_once("..")
            .ok_or_else(|| VersionError(text.to_owned()))?;
        let (to, includes_to) = match to.strip_prefix('=') {
            Some(to) => (to, true),
            None => (to, false),
        };
        let bound = |side: &str| match side.trim() {
            "" => Ok(None),
            version => version
                .parse()
                .map(Some)
                .map_err(|_| VersionError(text.to_owned())),
        };
        let range = VersionRange {
            from: bound(from)?,
            to: bound(to)?,
            includes_to,
        };
        if range.is_everything() || (includes_to && range.to.is_none()) {
            return Err(VersionError(text.to_owned()));
        }
        Ok(range)
    }
}

impl fmt::Display for VersionRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = if self.includes_to { "up to" } else { "before" };
        match (self.from, self.to) {
            (None, None) => f.write_str("every version"),
            (Some(from), None) => write!(f, "{from} and later"),
            (None, Some(to)) => write!(f, "versions {end} {to}"),
            (Some(from), Some(to)) => write!(f, "{from} {end} {to}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(text: &str) -> VersionRange {
        text.parse().unwrap()
    }

    #[test]
    fn version_range_ends_are_open_closed_or_absent() {
        assert!(range("1.7.0..").contains(Version::new(1, 7)));
        assert!(!range("1.7.0..").contains(Version::new(1, 6)));
        assert!(!range("1.4.0..1.8.0").contains(Version::new(1, 8)));
        assert!(range("1.4.0..=1.8.0").contains(Version::new(1, 8)));
        assert!(range("..=1.6.0").contains(Version::new(0, 9)));
        assert!(range("").contains(Version::new(9, 9)));
        assert!(range("1.10.0..").is_before(Version::new(1, 9)));
    }

    #[test]
    fn malformed_version_range_is_refused() {
        for text in [
            "..",
            "..=",
            "1.7",
            "a..",
            "1..",
            "1.2.3.4..",
            "1.7.0..=",
            "-1.0.0..",
        ] {
            assert!(text.parse::<VersionRange>().is_err(), "{text}");
        }
    }

    #[test]
    fn version_ranges_are_shown_in_words() {
        assert_eq!(range("1.7.0..").to_string(), "1.7 and later");
        assert_eq!(range("1.4.0..1.8.1").to_string(), "1.4 before 1.8.1");
    }
}
