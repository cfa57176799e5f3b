//! Faults that ingest finds in a file's bytes, before any rule checks its meaning.

use crate::layout::FaultRecord;

/// A fault of the file itself, at an offset of the image's text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault<'a> {
    /// Kind of fault.
    pub code: FaultCode,
    /// Offset in the image's text (see [`crate::Document::position`]).
    pub offset: u32,
    /// Text for people: found and allowed content.
    pub text: &'a str,
}

/// Subject of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FaultGroup {
    /// The text breaks the grammar of XML.
    NotWellFormed,
    /// The text follows the grammar of XML, but not that of its namespaces.
    Namespaces,
    /// A document type declaration with more than a name. qcbus refuses it, because it can include
    /// files and expand to a huge size.
    Doctype,
    /// The bytes and their declared encoding.
    Encoding,
    /// `<include>` of OpenDRIVE.
    Include,
    /// The file exceeds a limit that protects the machine.
    Limit,
    /// gzip and zip around the XML.
    Archive,
}

macro_rules! fault_codes {
    ($($(#[$doc:meta])* $code:ident = $number:literal, $name:literal, $group:ident, $partial:literal;)*) => {
        /// Kinds of faults; numbers and names are stable.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u32)]
        pub enum FaultCode {
            $($(#[$doc])* $code = $number,)*
        }

        impl FaultCode {
            /// All codes in the order of their numbers.
            pub const ALL: &'static [FaultCode] = &[$(FaultCode::$code,)*];

            /// Returns the stable name, in kebab case.
            pub fn as_str(self) -> &'static str {
                match self { $(FaultCode::$code => $name,)* }
            }

            /// Returns the subject of the fault.
            pub fn group(self) -> FaultGroup {
                match self { $(FaultCode::$code => FaultGroup::$group,)* }
            }

            /// Checks whether the tree may lack or misplace parts of the file. Rules about its
            /// meaning would then give wrong results and must be skipped.
            pub fn makes_partial(self) -> bool {
                match self { $(FaultCode::$code => $partial,)* }
            }

            fn of_number(number: u32) -> Option<FaultCode> {
                match number { $($number => Some(FaultCode::$code),)* _ => None }
            }
        }
    };
}

fault_codes! {
    /// A violation of the grammar without a code of its own.
    Syntax = 1, "syntax", NotWellFormed, true;
    /// An end tag that does not match the open element, or without an open element.
    MismatchedTag = 2, "mismatched-tag", NotWellFormed, true;
    /// A second element at the top level.
    SecondRoot = 3, "second-root", NotWellFormed, true;
    /// Character data before or after the root element.
    TextOutsideRoot = 4, "text-outside-root", NotWellFormed, true;
    /// A name with forbidden characters.
    BadName = 5, "bad-name", NotWellFormed, true;
    /// A character that XML 1.0 forbids everywhere, such as NUL.
    BadCharacter = 6, "bad-character", NotWellFormed, true;
    /// Two attributes of one element with the same name.
    DuplicateAttribute = 7, "duplicate-attribute", NotWellFormed, true;
    /// No space between two attributes.
    MissingSpace = 8, "missing-space", NotWellFormed, true;
    /// The text ends within an element, a tag, a comment or a CDATA section.
    Unclosed = 9, "unclosed", NotWellFormed, true;
    /// There is no element.
    NoRoot = 10, "no-root", NotWellFormed, true;
    /// The file is empty or contains only white space.
    Empty = 11, "empty", NotWellFormed, true;
    /// An attribute without value or quotes, or with `<` in its value.
    BadAttribute = 12, "bad-attribute", NotWellFormed, true;
    /// `&…` that is neither a predefined entity nor a reference to an allowed character.
    BadReference = 13, "bad-reference", NotWellFormed, true;
    /// `--` within a comment, or a comment that ends in `--->`.
    BadComment = 14, "bad-comment", NotWellFormed, true;
    /// An XML declaration that is misplaced or misspelt, or a processing instruction named `xml`.
    BadDeclaration = 15, "bad-declaration", NotWellFormed, true;
    /// `]]>` in character data.
    BadText = 16, "bad-text", NotWellFormed, true;
    /// A prefix that no `xmlns:` binds.
    UnboundPrefix = 17, "unbound-prefix", Namespaces, true;

    /// A document type declaration with more than a name, or in a forbidden position.
    Doctype = 32, "doctype", Doctype, true;

    /// Bytes that are invalid in the expected encoding.
    EncodingMalformed = 48, "encoding-malformed", Encoding, true;
    /// The declaration names an encoding that does not match the bytes.
    EncodingMismatch = 49, "encoding-mismatch", Encoding, false;
    /// The declaration names an unknown encoding.
    EncodingUnknown = 50, "encoding-unknown", Encoding, true;
    /// An encoding other than UTF-8, transcoded without loss.
    EncodingTranscoded = 51, "encoding-transcoded", Encoding, false;

    /// The file of an `<include>` does not exist or cannot be read.
    IncludeMissing = 64, "include-missing", Include, true;
    /// An `<include>` that leads back to a file that includes it.
    IncludeCycle = 65, "include-cycle", Include, true;
    /// An `<include>` of a file outside the folder that qcbus was given.
    IncludeEscapes = 66, "include-escapes", Include, true;
    /// The root of the included file is not the element that includes it.
    IncludeParentMismatch = 67, "include-parent-mismatch", Include, true;
    /// More includes than allowed.
    IncludeLimit = 68, "include-limit", Include, true;
    /// An `<include>` without a usable `file`.
    IncludeMalformed = 69, "include-malformed", Include, true;

    /// Elements nested deeper than allowed.
    DepthLimit = 80, "depth-limit", Limit, true;
    /// A file larger than allowed.
    SizeLimit = 81, "size-limit", Limit, true;
    /// More distinct names than an image can hold.
    NameLimit = 82, "name-limit", Limit, true;
    /// An image larger than allowed.
    ImageLimit = 83, "image-limit", Limit, true;
    /// More faults than are kept; the rest was not listed.
    FaultLimit = 84, "fault-limit", Limit, true;
    /// Unpacked data larger than allowed.
    UnpackedLimit = 85, "unpacked-limit", Limit, true;
    /// The compression ratio is so high that the file looks like a zip bomb.
    RatioLimit = 86, "ratio-limit", Limit, true;

    /// A gzip stream that ends early.
    GzipTruncated = 96, "gzip-truncated", Archive, true;
    /// A gzip stream that is damaged, or missing although the name suggests one.
    GzipMalformed = 97, "gzip-malformed", Archive, true;
    /// A zip archive that ends early.
    ArchiveTruncated = 98, "archive-truncated", Archive, true;
    /// A zip archive that is damaged, encrypted, or missing although the name suggests one.
    ArchiveMalformed = 99, "archive-malformed", Archive, true;
    /// A required member is missing.
    ArchiveMemberMissing = 100, "archive-member-missing", Archive, true;
    /// A member with a name that leads out of the archive.
    ArchiveEscapes = 101, "archive-escapes", Archive, true;
    /// More members than allowed.
    ArchiveLimit = 102, "archive-limit", Archive, true;
    /// Two members with the same name.
    ArchiveDuplicate = 103, "archive-duplicate", Archive, true;
    /// A member whose name would be a plain relative path with `/` instead of its backslashes.
    ArchiveBackslash = 104, "archive-backslash", Archive, true;
}

impl FaultCode {
    /// Returns the number that an image stores for it.
    pub(crate) fn number(self) -> u32 {
        self as u32
    }

    pub(crate) fn of_record(record: &FaultRecord) -> Option<FaultCode> {
        FaultCode::of_number(record.code.get())
    }
}

impl std::fmt::Display for FaultCode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}
