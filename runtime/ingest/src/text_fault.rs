//! Faults of a file, before the offset of its text in the image is known.

/// Kind of a fault. It becomes the fault code of the image.
pub(crate) use qcbus_document::FaultCode as Code;

/// A fault at a place of one file's text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TextFault {
    pub code: Code,
    /// Offset into the decoded text of the file.
    pub offset: usize,
    /// Message for people: the value found and the value allowed.
    pub text: String,
}

impl TextFault {
    pub fn new(code: Code, offset: usize, text: impl Into<String>) -> TextFault {
        TextFault {
            code,
            offset,
            text: text.into(),
        }
    }
}
