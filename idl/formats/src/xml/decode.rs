//! Decoding of bytes to text: byte order marks and encoding declarations.

use super::XmlError;

/// Decodes a file's text by its byte order mark, else by its declaration, else as UTF-8.
pub(super) fn decode(bytes: &[u8]) -> Result<String, XmlError> {
    let encoding = match encoding_rs::Encoding::for_bom(bytes) {
        Some((encoding, _)) => encoding,
        None => declared(bytes)?,
    };
    let (text, _, malformed) = encoding.decode(bytes);
    if malformed {
        return Err(invalid(bytes, encoding.name()));
    }
    Ok(text.into_owned())
}

/// Returns the encoding in `<?xml … encoding="…"?>`. The declaration itself is plain ASCII.
fn declared(bytes: &[u8]) -> Result<&'static encoding_rs::Encoding, XmlError> {
    let head = &bytes[..bytes.len().min(200)];
    let Some(end) = head.windows(2).position(|pair| pair == b"?>") else {
        return Ok(encoding_rs::UTF_8);
    };
    let Ok(declaration) = std::str::from_utf8(&head[..end]) else {
        return Ok(encoding_rs::UTF_8);
    };
    let label = declaration
        .strip_prefix("<?xml")
        .and_then(|rest| rest.split_once("encoding"))
        .and_then(|(_, rest)| rest.trim_start().strip_prefix('='))
        .map(str::trim_start)
        .and_then(|rest| rest.split(['"', '\'']).nth(1));
    match label {
        None => Ok(encoding_rs::UTF_8),
        // The declaration was read as ASCII, so the file cannot be UTF-16, even if it declares it.
        Some(label) if label.to_ascii_lowercase().starts_with("utf-16") => Ok(encoding_rs::UTF_8),
        Some(label) => encoding_rs::Encoding::for_label(label.as_bytes()).ok_or_else(|| XmlError {
            row: 1,
            column: 1,
            text: format!("the encoding `{label}` is unknown"),
            hint: "save the file as UTF-8",
        }),
    }
}

/// Returns the error for invalid bytes, with the position of the first one if the file is UTF-8.
fn invalid(bytes: &[u8], encoding: &str) -> XmlError {
    let (row, column, what) = match std::str::from_utf8(bytes) {
        Err(error) if encoding == "UTF-8" => {
            let (valid, rest) = bytes.split_at(error.valid_up_to());
            let valid = String::from_utf8_lossy(valid);
            let (row, column) = super::tree::row_column(&valid, valid.len());
            let byte = rest.first().copied().unwrap_or_default();
            (
                row,
                column,
                format!("the byte 0x{byte:02X} is not valid UTF-8"),
            )
        }
        _ => (1, 1, format!("the file is not valid {encoding}")),
    };
    let hint = "declare the encoding in the first line, such as <?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>, \
                or save the file as UTF-8";
    XmlError {
        row,
        column,
        text: what,
        hint,
    }
}
