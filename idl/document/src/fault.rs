//! What ingest found wrong with a file's bytes, before any rule looked at its meaning.

use crate::layout::FaultRecord;

/// A fault of the file itself, at a place in the image's text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault<'a> {
    /// What sort of fault.
    pub code: FaultCode,
    /// Where, as an offset of the image's text (see [`crate::Document::position`]).
    pub offset: u32,
    /// What was found and what is allowed, for people.
    pub text: &'a str,
}

/// What a fault is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FaultGroup {
    /// The text breaks XML's own grammar.
    NotWellFormed,
    /// The text follows XML's grammar, but not that of its namespaces.
    Namespaces,
    /// A document type declaration of more than a name, which qcbus refuses (it can pull in files and blow up).
    Doctype,
    /// Bytes and their declared encoding.
    Encoding,
    /// `<include>` of OpenDRIVE.
    Include,
    /// A bound that protects the machine was hit.
    Limit,
    /// gzip and zip around the XML.
    Archive,
}

macro_rules! fault_codes {
    ($($(#[$doc:meta])* $code:ident = $number:literal, $name:literal, $group:ident, $partial:literal;)*) => {
        /// The sorts of faults; numbers and names are stable.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u32)]
        pub enum FaultCode {
            $($(#[$doc])* $code = $number,)*
        }

        impl FaultCode {
            /// Every code, by number.
            pub const ALL: &'static [FaultCode] = &[$(FaultCode::$code,)*];

            /// The stable name, in kebab case.
            pub fn as_str(self) -> &'static str {
                match self { $(FaultCode::$code => $name,)* }
            }

            /// What the fault is about.
            pub fn group(self) -> FaultGroup {
                match self { $(FaultCode::$code => FaultGroup::$group,)* }
            }

            /// Whether the tree may lack or misplace parts of the file, so that rules about its
            /// meaning would talk nonsense and must be skipped.
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
    /// Breaks the grammar in a way no other code names.
    Syntax = 1, "syntax", NotWellFormed, true;
    /// An end tag that closes another element than the open one, or none at all.
    MismatchedTag = 2, "mismatched-tag", NotWellFormed, true;
    /// A second element at the top.
    SecondRoot = 3, "second-root", NotWellFormed, true;
    /// Character data before or after the root element.
    TextOutsideRoot = 4, "text-outside-root", NotWellFormed, true;
    /// A name with characters that names may not have.
    BadName = 5, "bad-name", NotWellFormed, true;
    /// A character that XML 1.0 forbids everywhere, such as NUL.
    BadCharacter = 6, "bad-character", NotWellFormed, true;
    /// Two attributes of one element with one name.
    DuplicateAttribute = 7, "duplicate-attribute", NotWellFormed, true;
    /// No space between two attributes.
    MissingSpace = 8, "missing-space", NotWellFormed, true;
    /// The text ends within an element, a tag, a comment or a CDATA section.
    Unclosed = 9, "unclosed", NotWellFormed, true;
    /// No element at all.
    NoRoot = 10, "no-root", NotWellFormed, true;
    /// No byte at all, or white space only.
    Empty = 11, "empty", NotWellFormed, true;
    /// An attribute without value or quotes, or with `<` in its value.
    BadAttribute = 12, "bad-attribute", NotWellFormed, true;
    /// `&…` that is no predefined entity and no reference to an allowed character.
    BadReference = 13, "bad-reference", NotWellFormed, true;
    /// `--` within a comment, or a comment that ends in `--->`.
    BadComment = 14, "bad-comment", NotWellFormed, true;
    /// An XML declaration that is misplaced or misspelt, or a processing instruction named `xml`.
    BadDeclaration = 15, "bad-declaration", NotWellFormed, true;
    /// `]]>` in character data.
    BadText = 16, "bad-text", NotWellFormed, true;
    /// A prefix that no `xmlns:` binds.
    UnboundPrefix = 17, "unbound-prefix", Namespaces, true;

    /// A document type declaration that says more than a name, or stands where none may.
    Doctype = 32, "doctype", Doctype, true;

    /// Bytes that do not decode in the encoding that they should have.
    EncodingMalformed = 48, "encoding-malformed", Encoding, true;
    /// The declaration names an encoding that the bytes do not have.
    EncodingMismatch = 49, "encoding-mismatch", Encoding, false;
    /// The declaration names an encoding that nobody knows.
    EncodingUnknown = 50, "encoding-unknown", Encoding, true;
    /// Another encoding than UTF-8, transcoded without loss.
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
    /// Packed so tightly that it looks like a bomb.
    RatioLimit = 86, "ratio-limit", Limit, true;

    /// A gzip stream that ends early.
    GzipTruncated = 96, "gzip-truncated", Archive, true;
    /// A gzip stream that is damaged, or none although the name says so.
    GzipMalformed = 97, "gzip-malformed", Archive, true;
    /// A zip archive that ends early.
    ArchiveTruncated = 98, "archive-truncated", Archive, true;
    /// A zip archive that is damaged, encrypted, or none although the name says so.
    ArchiveMalformed = 99, "archive-malformed", Archive, true;
    /// A member that should be there is not.
    ArchiveMemberMissing = 100, "archive-member-missing", Archive, true;
    /// A member whose name leads out of the archive.
    ArchiveEscapes = 101, "archive-escapes", Archive, true;
    /// More members than allowed.
    ArchiveLimit = 102, "archive-limit", Archive, true;
    /// Two members with one name.
    ArchiveDuplicate = 103, "archive-duplicate", Archive, true;
}

impl FaultCode {
    /// The number under which an image stores it.
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
