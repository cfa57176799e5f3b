//! What the validator reports, as data and as text.

use qcbus_document::{Attribute, Node};

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Code {
    /// The root element is none the schema declares.
    UnknownRoot,
    /// An element that its parent does not know.
    UnexpectedElement,
    /// An element that its parent knows, but at another place.
    MisplacedElement,
    /// An element that its parent knows, but not that often.
    RepeatedElement,
    /// A child that must be there.
    MissingElement,
    /// An attribute that its element does not know.
    UnexpectedAttribute,
    /// An attribute that must be there.
    MissingAttribute,
    /// An attribute value that is not of the attribute's type.
    InvalidValue,
    /// Text of an element that is not of the element's type.
    InvalidText,
    /// Text where only elements may stand.
    UnexpectedText,
    /// No type can be told for the element.
    UnknownType,
    /// A condition of the schema does not hold.
    ConditionFailed,
    /// A key value that occurs twice.
    DuplicateKey,
    /// A selected element without its key value.
    MissingKey,
    /// A reference to a key value that does not occur.
    DanglingReference,
}

impl Code {
    /// What is so with an element or, after its name and `/@`, an attribute, in words.
    pub fn about(self, subject: &str) -> String {
        match self {
            Code::UnknownRoot => format!("`{subject}` as the root element"),
            Code::UnexpectedElement => format!("`{subject}` where it is not known"),
            Code::MisplacedElement => format!("`{subject}` in the wrong place"),
            Code::RepeatedElement => format!("`{subject}` more often than allowed"),
            Code::MissingElement => format!("what is missing in or before `{subject}`"),
            Code::UnexpectedAttribute => format!("the unknown attribute `{subject}`"),
            Code::MissingAttribute => format!("missing attributes of `{subject}`"),
            Code::InvalidValue => format!("values of `{subject}` that do not fit"),
            Code::InvalidText => format!("text of `{subject}` that does not fit"),
            Code::UnexpectedText => format!("text in `{subject}`"),
            Code::UnknownType => format!("`{subject}` of no known type"),
            Code::ConditionFailed => format!("conditions that `{subject}` breaks"),
            Code::DuplicateKey => format!("`{subject}` with a key that occurs twice"),
            Code::MissingKey => format!("`{subject}` without its key"),
            Code::DanglingReference => format!("`{subject}` that refers to nothing"),
        }
    }

    /// The name used in results and in the recorded verdicts.
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

/// One violation of a schema.
#[derive(Clone, Debug)]
pub struct Violation<'a> {
    /// What is wrong.
    pub code: Code,
    /// The element it is about.
    pub node: Node<'a>,
    /// The attribute it is about.
    pub attribute: Option<Attribute<'a>>,
    /// What was found: a name or a value; empty if the violation is that something is missing.
    pub found: String,
    /// What would have been right: names or values.
    pub expected: Vec<String>,
    /// The name or value probably meant.
    pub suggestion: Option<String>,
    /// Why this is the schema's fault and not the file's, if it is known to be.
    pub known_schema_defect: Option<&'static str>,
    /// The whole message.
    pub text: String,
}

impl<'a> Violation<'a> {
    /// Offset, in the image's text, of the attribute or element it is about.
    pub fn offset(&self) -> u32 {
        self.attribute
            .as_ref()
            .map_or_else(|| self.node.offset(), Attribute::offset)
    }
}

/// Violations of one kind that were counted but not listed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rest {
    /// Their code.
    pub code: Code,
    /// What they are about, e.g. `width/@a`.
    pub subject: String,
    /// How many more there are.
    pub count: u64,
    /// Whether all of this kind are the schema's fault and not the file's.
    pub known_schema_defect: bool,
}

/// The result of validating one document.
#[derive(Clone, Debug, Default)]
pub struct Report<'a> {
    /// The violations in the order of their discovery: an element's own first, then those of its
    /// children, what it lacks and which references dangle when it ends.
    pub violations: Vec<Violation<'a>>,
    /// How many more there were, by kind.
    pub rest: Vec<Rest>,
}

impl Report<'_> {
    /// The subject of what is counted together because there are too many kinds of it.
    pub(crate) const VARIOUS: &'static str = "various";

    /// Whether the document is valid.
    pub fn is_valid(&self) -> bool {
        self.violations.is_empty() && self.rest.is_empty()
    }

    /// How many violations there are, listed or not.
    pub fn total(&self) -> u64 {
        self.violations.len() as u64 + self.rest.iter().map(|rest| rest.count).sum::<u64>()
    }
}

/// How much is listed.
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
