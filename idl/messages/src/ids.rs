//! Identifiers used on both sides of the bus.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Version of the messages in this crate. Peers of another version are refused by name. Raise it
/// with every change of a message, because old messages would be decoded as different ones, and with
/// every change of the format in which services on the bus are described.
pub const PROTOCOL_VERSION: u32 = 7;

/// One check of one file's bytes under one configuration; unique within a broker generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct JobId(pub u64);

/// One published document image; unique within a broker generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct DocId(pub u64);

/// A SHA-256 digest, the same that `sha256sum` prints.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
pub struct Digest(pub [u8; 32]);

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

impl std::str::FromStr for Digest {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || format!("`{text}` is not a SHA-256 digest of 64 hexadecimal digits");
        if text.len() != 64 || !text.is_ascii() {
            return Err(wrong());
        }
        let mut digest = [0; 32];
        for (byte, pair) in digest.iter_mut().zip(text.as_bytes().chunks(2)) {
            let pair = std::str::from_utf8(pair).map_err(|_| wrong())?;
            *byte = u8::from_str_radix(pair, 16).map_err(|_| wrong())?;
        }
        Ok(Digest(digest))
    }
}

/// Role of a document in the job that contains it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DocumentRole {
    /// The file that is checked.
    Root,
    /// The road network that the root's `LogicFile` names.
    Map,
    /// A catalog from one of the root's catalog directories.
    Catalog,
    /// A scenario that the root refers to, or `main.xosc` of a modular scenario's archive.
    Scenario,
    /// The members of an archive that contains a scenario of the job: an element `Archive` with a
    /// `Member` for each, which has `name`, `size` in bytes and `crc32`.
    Listing,
    /// The root after modular expansion. Its text consists of the files it was made from, so all
    /// positions in it are in these files.
    Expanded,
    /// A file that only has to exist, such as the grid of a road surface. Its bytes are hashed, but
    /// bundles do not get them.
    Attachment,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digest_parses_back_from_its_text() {
        let digest = Digest(std::array::from_fn(|i| i as u8 * 7));
        assert_eq!(digest.to_string().parse(), Ok(digest));
        assert!("xyz".parse::<Digest>().is_err());
        assert!("ä".repeat(32).parse::<Digest>().is_err());
    }
}
