//! Encoding of messages as bytes. This is the only file that uses bincode.

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Maximum size of an encoded message in bytes. A result with its issues is the largest message.
pub const MAX_MESSAGE: usize = 64 << 20;

/// Maximum size of an encoded message from a bundle or reporter, in bytes. Their messages are
/// small, and findings come in batches. Decoding takes up to four times as much memory.
pub const MAX_FROM_PEER: usize = 4 << 20;

/// Reason why bytes cannot be decoded to a message, or a message cannot be encoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CodecError {
    /// The bytes are not a valid message.
    #[error("not a valid message: {0}")]
    Malformed(String),
    /// Bytes were left over after the message.
    #[error("{0} bytes were left over after the message")]
    TrailingBytes(usize),
    /// The message is larger than [`MAX_MESSAGE`].
    #[error("the message has {0} bytes; at most {MAX_MESSAGE} are allowed")]
    TooLarge(usize),
    /// The message cannot be encoded.
    #[error("cannot encode the message: {0}")]
    Unencodable(String),
}

type Config = Configuration<LittleEndian, Fixint, Limit<MAX_MESSAGE>>;

/// The limit also bounds the memory that the decoder reserves for a hostile length prefix.
const CONFIG: Config = bincode::config::legacy().with_limit::<MAX_MESSAGE>();

/// Encodes a message.
///
/// # Errors
/// [`CodecError::TooLarge`] above [`MAX_MESSAGE`], [`CodecError::Unencodable`] when serde fails.
pub fn encode<T: Serialize>(message: &T) -> Result<Vec<u8>, CodecError> {
    let bytes = bincode::serde::encode_to_vec(message, CONFIG)
        .map_err(|error| CodecError::Unencodable(error.to_string()))?;
    if bytes.len() > MAX_MESSAGE {
        return Err(CodecError::TooLarge(bytes.len()));
    }
    Ok(bytes)
}

/// Decodes one message that fills `bytes` entirely. It never panics and never reserves more memory
/// than the limit.
///
/// # Errors
/// [`CodecError::Malformed`] or [`CodecError::TrailingBytes`].
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    if bytes.len() > MAX_MESSAGE {
        return Err(CodecError::TooLarge(bytes.len()));
    }
    let (message, used) = bincode::serde::decode_from_slice(bytes, CONFIG)
        .map_err(|error| CodecError::Malformed(error.to_string()))?;
    if used != bytes.len() {
        return Err(CodecError::TrailingBytes(bytes.len() - used));
    }
    Ok(message)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{DocId, FromPeer, JobId, PROTOCOL_VERSION, ToPeer};

    #[test]
    fn message_decodes_to_what_was_encoded() {
        let message = FromPeer::Heartbeat {
            job: Some(JobId(7)),
            checker: None,
        };
        let bytes = encode(&message).unwrap();
        assert_eq!(decode::<FromPeer>(&bytes), Ok(message));
    }

    #[test]
    fn moved_message_requires_new_protocol_version() {
        // A message inserted before the last one changes its number, so old peers misread it.
        let drain = encode(&ToPeer::Drain).unwrap();
        let leaving = encode(&FromPeer::Leaving).unwrap();
        let numbers = (drain.first().copied(), leaving.first().copied());
        assert_eq!((PROTOCOL_VERSION, numbers), (7, (Some(6), Some(8))));
    }

    #[test]
    fn trailing_bytes_are_refused() {
        let mut bytes = encode(&FromPeer::NeedDocument { doc: DocId(1) }).unwrap();
        bytes.push(0);
        assert_eq!(
            decode::<FromPeer>(&bytes),
            Err(CodecError::TrailingBytes(1))
        );
    }

    #[test]
    fn hostile_length_is_refused_before_memory_is_reserved() {
        // The third variant, number 2, is `Job`; the bytes after it declare 2^60 documents.
        let mut bytes = vec![2, 0, 0, 0];
        bytes.extend([0; 8 + 8 + 32 + 4]);
        bytes.extend((1_u64 << 60).to_le_bytes());
        assert!(matches!(
            decode::<ToPeer>(&bytes),
            Err(CodecError::Malformed(_))
        ));
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..512)) {
            let _ = decode::<FromPeer>(&bytes);
            let _ = decode::<ToPeer>(&bytes);
        }
    }
}
