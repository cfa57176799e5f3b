//! Reads gzip: maps as `.xodrz` and `.xodr.gz`, recognized by their first bytes instead of their
//! names.

use std::io::{ErrorKind, Read};

use flate2::bufread::MultiGzDecoder;

use crate::limits::{Exceeded, Limits};

/// Content of a gzip stream.
pub(crate) struct Inflated {
    /// All bytes, or the bytes before the damage. Empty if a cap was exceeded.
    pub bytes: Vec<u8>,
    /// Reason why the stream could not be read to its end.
    pub trouble: Option<InflateError>,
}

/// Reason why a packed file could not be read to its end.
#[derive(Debug, thiserror::Error)]
pub(crate) enum InflateError {
    #[error("the gzip stream ends early; {read} bytes could be inflated")]
    Truncated { read: usize },
    #[error("the gzip stream is damaged after {read} inflated bytes: {reason}")]
    Damaged { read: usize, reason: String },
    #[error("inflating was stopped: {0}")]
    Exceeded(Exceeded),
}

/// Checks whether the bytes begin as a gzip stream.
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// Inflates every member of a gzip stream, within the caps on size and ratio. If a cap is exceeded,
/// all bytes are discarded, because the content of a zip bomb is useless. For a damaged stream,
/// everything before the damage is kept.
pub(crate) fn gunzip(packed: &[u8], limits: &Limits) -> Inflated {
    let cap = inflated_cap(packed.len() as u64, limits.max_unpacked, limits.max_ratio);
    let mut bytes = Vec::new();
    let mut decoder = MultiGzDecoder::new(packed);
    let read = decoder
        .by_ref()
        .take(cap.allowed.saturating_add(1))
        .read_to_end(&mut bytes);
    let exceeded = bytes.len() as u64 > cap.allowed;
    let trouble = match read {
        _ if exceeded => {
            bytes = Vec::new();
            Some(InflateError::Exceeded(Exceeded {
                found: cap.allowed + 1,
                ..cap
            }))
        }
        Ok(_) => None,
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
            Some(InflateError::Truncated { read: bytes.len() })
        }
        Err(error) => Some(InflateError::Damaged {
            read: bytes.len(),
            reason: error.to_string(),
        }),
    };
    Inflated { bytes, trouble }
}

/// Returns the smaller of the caps on size and on ratio for a stream of `packed` bytes. In the
/// [`Exceeded`], only the value found is missing.
pub(crate) fn inflated_cap(packed: u64, max_bytes: u64, max_ratio: u32) -> Exceeded {
    // Below a mebibyte a high ratio is harmless, and it is normal for much white space.
    let by_ratio = packed.saturating_mul(u64::from(max_ratio)).max(1 << 20);
    let (limit, what, allowed) = if by_ratio < max_bytes {
        (
            "max_ratio",
            "inflated bytes or more for such a small stream",
            by_ratio,
        )
    } else {
        ("max_unpacked", "inflated bytes or more", max_bytes)
    };
    Exceeded {
        limit,
        what,
        found: 0,
        allowed,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::*;

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn all_gzip_members_are_inflated() {
        let packed = [gzip(b"<OpenDRIVE>"), gzip(b"</OpenDRIVE>")].concat();
        let inflated = gunzip(&packed, &Limits::default());
        assert_eq!(inflated.bytes, b"<OpenDRIVE></OpenDRIVE>");
        assert!(inflated.trouble.is_none());
    }

    #[test]
    fn truncated_stream_keeps_its_readable_part() {
        let text: String = (0..20_000).map(|i| format!("<road id='{i}'/>")).collect();
        let packed = gzip(text.as_bytes());
        let inflated = gunzip(&packed[..packed.len() / 2], &Limits::default());
        assert!(inflated.bytes.len() > 1000);
        assert!(text.as_bytes().starts_with(&inflated.bytes));
        assert!(matches!(
            inflated.trouble,
            Some(InflateError::Truncated { .. })
        ));
    }

    #[test]
    fn gzip_bomb_is_stopped_by_ratio_and_size() {
        let packed = gzip(&vec![b' '; 4 << 20]);
        let inflated = gunzip(&packed, &Limits::default());
        assert!(inflated.bytes.is_empty());
        let text = inflated.trouble.unwrap().to_string();
        assert!(text.contains("raise the limit max_ratio"), "{text}");

        let limits = Limits {
            max_unpacked: 1 << 21,
            max_ratio: 2000,
            ..Limits::default()
        };
        let text = gunzip(&packed, &limits).trouble.unwrap().to_string();
        assert!(
            text.contains("2097152 are allowed; raise the limit max_unpacked"),
            "{text}"
        );
    }
}
