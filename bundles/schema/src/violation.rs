//! Violations that the validator reports, as data and as text.

use qcbus_document::{Attribute, Node};

/// Kind of violation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Code {
    /// The schema does not declare the root element.
    UnknownRoot,
    /// An element that its parent does not declare.
    UnexpectedElement,
    /// An element that its parent declares, but at another place.
    MisplacedElement,
    /// An element that occurs more often than its parent allows.
    RepeatedElement,
    /// A missing required child.
    MissingElement,
    /// An attribute that its element does not declare.
    UnexpectedAttribute,
    /// A missing required attribute.
    MissingAttribute,
    /// An attribute value that is not of the attribute's type.
    InvalidValue,
    /// Text of an element that is not of the element's type.
    InvalidText,
    /// Text where only elements are allowed.
    UnexpectedText,
    /// The type of the element cannot be determined.
    UnknownType,
    /// A condition of the schema does not hold.
    ConditionFailed,
    /// A key value that occurs twice.
    DuplicateKey,
    /// A selected element without a key value.
    MissingKey,
    /// A reference to a key value that does not exist.
    DanglingReference,
}

impl Code {
    /// Describes the violations of an element, or of an attribute (its element's name, `/@` and its
    /// own name), in words.
    pub fn about(self, subject: &str) -> String {
        match self {
            Code::UnknownRoot => format!("`{subject}` as the root element"),
            Code::UnexpectedElement => format!("`{subject}` where it is not allowed"),
            Code::MisplacedElement => format!("`{subject}` in the wrong place"),
            Code::RepeatedElement => format!("`{subject}` more often than allowed"),
            Code::MissingElement => format!("missing elements in or before `{subject}`"),
            Code::UnexpectedAttribute => format!("the unknown attribute `{subject}`"),
            Code::MissingAttribute => format!("missing attributes of `{subject}`"),
            Code::InvalidValue => format!("invalid values of `{subject}`"),
            Code::InvalidText => format!("invalid text of `{subject}`"),
            Code::UnexpectedText => format!("text in `{subject}`"),
            Code::UnknownType => format!("`{subject}` with an unknown type"),
            Code::ConditionFailed => format!("conditions that `{subject}` violates"),
            Code::DuplicateKey => format!("`{subject}` with a duplicate key"),
            Code::MissingKey => format!("`{subject}` without its key"),
            Code::DanglingReference => format!("`{subject}` with an undefined target"),
        }
    }

    /// Returns the name used in results and in the recorded verdicts.
    pub fn as_str(self) -> &'static str {
        match self {
            Code::UnknownRoot => "unknown-root",
            Code::UnexpectedElement => "unexpected-element",
            Code::MisplacedElement => "misplaced-element",
            Code::RepeatedElement => "repeated-element",
            Code::MissingElement => "missing-element",
            Code::UnexpectedAttribute => "unexpected-attribute",
            Code::MissingAttribute => "missing-attribute",
            Code::InvalidValue => "invalid-value",
            Code::InvalidText => "invalid-text",
            Code::UnexpectedText => "unexpected-text",
            Code::UnknownType => "unknown-type",
            Code::ConditionFailed => "condition-failed",
            Code::DuplicateKey => "duplicate-key",
            Code::MissingKey => "missing-key",
            Code::DanglingReference => "dangling-reference",
        }
    }
}

/// More about a violation than its [`Code`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// Nothing more.
    #[default]
    None,
    /// Name of the missing attribute.
    Missing(String),
    /// A number is expected.
    Number,
    /// The missing elements come later.
    Later,
    /// The missing elements belong before this one, into its parent.
    Before,
}

/// One violation of a schema.
#[derive(Clone, Debug)]
pub struct Violation<'a> {
    /// Kind of violation.
    pub code: Code,
    /// The element concerned.
    pub node: Node<'a>,
    /// The attribute concerned.
    pub attribute: Option<Attribute<'a>>,
    /// More about the kind of violation.
    pub detail: Detail,
    /// Reason why the schema is wrong and not the file, if that is known.
    pub known_schema_defect: Option<&'static str>,
    /// The whole message.
    pub text: String,
}

impl<'a> Violation<'a> {
    /// Returns the offset, in the image's text, of the attribute or element concerned.
    pub fn offset(&self) -> u32 {
        self.attribute
            .as_ref()
            .map_or_else(|| self.node.offset(), Attribute::offset)
    }
}

/// Violations of one kind that were counted but not listed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rest {
    /// Kind of violation.
    pub code: Code,
    /// Element or attribute concerned, e.g. `width/@a`.
    pub subject: String,
    /// Number of unlisted violations.
    pub count: u64,
    /// Whether the schema is wrong in all violations of this kind, and not the file.
    pub known_schema_defect: bool,
}

/// The result of validating one document.
#[derive(Clone, Debug, Default)]
pub struct Report<'a> {
    /// The violations in the order of discovery. An element's own violations come first, then those
    /// of its children. Missing children and dangling references follow at its end.
    pub violations: Vec<Violation<'a>>,
    /// Number of unlisted violations, by kind.
    pub rest: Vec<Rest>,
}

impl Report<'_> {
    /// Subject of violations that are counted together because there are too many kinds.
    pub(crate) const VARIOUS: &'static str = "various";

    /// Checks whether the document is valid.
    pub fn is_valid(&self) -> bool {
        self.violations.is_empty() && self.rest.is_empty()
    }

    /// Returns the number of violations, listed or not.
    pub fn total(&self) -> u64 {
        self.violations.len() as u64 + self.rest.iter().map(|rest| rest.count).sum::<u64>()
    }
}

/// Limits on the number of listed violations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Violations listed per kind (code, element and attribute or child).
    pub per_kind: u32,
    /// Violations listed in all.
    pub total: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            per_kind: 20,
            total: 1_000,
        }
    }
}
