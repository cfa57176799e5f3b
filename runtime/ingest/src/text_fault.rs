//! What is wrong with a file, before it is known where its text will lie in the image.

/// The sort of a fault; becomes the fault code of the image.
pub(crate) use qcbus_document::FaultCode as Code;

/// Something wrong at a place of one file's text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TextFault {
    pub code: Code,
    /// Offset into the decoded text of the file.
    pub offset: usize,
    /// What was found and what is allowed, for a person to read.
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
