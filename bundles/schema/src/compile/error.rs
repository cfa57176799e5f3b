//! Compile errors for unsupported or invalid schemas.

use qcbus_document::{Node, Position};

use crate::assertion::XPathProblem;
use crate::pattern::PatternError;

/// Reason and position of a compile error.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("compile {position}: {problem}")]
pub struct CompileError {
    /// Position of the error.
    pub position: SourcePosition,
    /// Reason for the error.
    pub problem: Problem,
}

/// Row and column in an XSD file, with the construct at this position.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourcePosition {
    /// The file. Empty if the problem concerns the schema as a whole.
    pub path: String,
    /// Row from 1.
    pub row: u32,
    /// Column from 1.
    pub column: u32,
    /// The construct, e.g. `xs:element name="road"`. Empty if the file is not XML.
    pub construct: String,
}

impl std::fmt::Display for SourcePosition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.path.is_empty() {
            return f.write_str("the schema");
        }
        match (self.row, self.construct.as_str()) {
            (0, _) => f.write_str(&self.path),
            (row, "") => write!(f, "{}:{row}:{}", self.path, self.column),
            (row, construct) => write!(f, "{}:{row}:{}: <{construct}>", self.path, self.column),
        }
    }
}

/// Reason for a compile error.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// The document is not a schema.
    #[error("the root element is not xs:schema")]
    NotASchema,
    /// The file is not well-formed XML.
    #[error("the file is not well-formed: {0}")]
    NotWellFormed(String),
    /// The schema has no global element.
    #[error("no global element is declared")]
    NoRoot,
    /// A construct outside the subset.
    #[error("this construct is not supported here")]
    Unsupported,
    /// An attribute outside the subset.
    #[error("the attribute {0} is not supported here")]
    Attribute(String),
    /// An attribute value outside the subset.
    #[error("the value `{1}` of the attribute {0} is not supported")]
    Value(&'static str, String),
    /// An attribute value outside the subset, where only one value is supported.
    #[error("the value `{1}` of the attribute {0} is not supported, only `{2}`")]
    Only(&'static str, String, &'static str),
    /// A built-in type outside the subset.
    #[error("the built-in type `{0}` is not supported")]
    Builtin(String),
    /// An included file that is missing in the input.
    #[error("`{0}` is missing; all files of a schema must be in one directory")]
    NotGiven(String),
    /// A required attribute is missing.
    #[error("the attribute {0} is missing")]
    NoAttribute(&'static str),
    /// A reference to a missing component.
    #[error("the {0} `{1}` is not declared")]
    Missing(&'static str, String),
    /// Two components with the same name.
    #[error("`{0}` is declared twice")]
    Twice(String),
    /// A definition that refers to itself.
    #[error("the definition refers to itself")]
    Circular,
    /// A condition that would be evaluated again at every depth.
    #[error(
        "a condition with // is not supported on the type `{0}`, because its elements can contain themselves"
    )]
    EndlessCondition(String),
    /// Nesting deeper than the limit.
    #[error("definitions are nested too deeply")]
    TooDeep,
    /// Larger than the limit.
    #[error("more than {1} {0}")]
    TooLarge(&'static str, usize),
    /// Two children with the same name and different types.
    #[error("the child `{0}` has two different types in one content model")]
    Inconsistent(String),
    /// An invalid pattern.
    #[error("failed to {0}")]
    Pattern(#[from] PatternError),
    /// An unsupported XPath expression.
    #[error("failed to {0}")]
    XPath(#[from] XPathProblem),
    /// An inconsistent declaration in the schema.
    #[error("{0}")]
    Invalid(&'static str),
}

impl CompileError {
    pub(crate) fn at(node: Node<'_>, problem: impl Into<Problem>) -> Self {
        let at = node.position();
        let label = [
            "name",
            "ref",
            "base",
            "test",
            "xpath",
            "value",
            "schemaLocation",
        ]
        .into_iter()
        .find_map(|name| node.attr(name).map(|value| (name, value)));
        let prefix = node.prefix();
        let colon = if prefix.is_empty() { "" } else { ":" };
        let construct = match label {
            Some((name, value)) => format!("{prefix}{colon}{} {name}=\"{value}\"", node.name()),
            None => format!("{prefix}{colon}{}", node.name()),
        };
        let position = SourcePosition {
            path: at.path.to_owned(),
            row: at.row,
            column: at.column,
            construct,
        };
        Self {
            position,
            problem: problem.into(),
        }
    }

    /// Creates an error for a file that is not well-formed XML.
    pub(crate) fn ill_formed(at: Position<'_>, fault: &str) -> Self {
        let position = SourcePosition {
            path: at.path.to_owned(),
            row: at.row,
            column: at.column,
            construct: String::new(),
        };
        let problem = Problem::NotWellFormed(fault.to_owned());
        Self { position, problem }
    }

    /// Creates an error for a file as a whole.
    pub(crate) fn somewhere_in(path: &str, problem: Problem) -> Self {
        let position = SourcePosition {
            path: path.to_owned(),
            row: 0,
            column: 0,
            construct: String::new(),
        };
        Self { position, problem }
    }
}

/// Returns the error at a construct as a result.
pub(crate) fn refuse<T>(node: Node<'_>, problem: impl Into<Problem>) -> Result<T, CompileError> {
    Err(CompileError::at(node, problem))
}

/// Checks that a construct has only the listed attributes, or foreign ones with a prefix.
pub(crate) fn only_attributes(node: Node<'_>, known: &[&str]) -> Result<(), CompileError> {
    for attribute in node.attributes() {
        let name = attribute.name();
        let foreign = name.contains(':') && !name.starts_with("vc:");
        if name != "id" && !foreign && name != "xmlns" && !known.contains(&name) {
            return refuse(node, Problem::Attribute(name.to_owned()));
        }
    }
    Ok(())
}

/// Returns the children of a construct without annotations.
pub(crate) fn parts<'d>(node: Node<'d>) -> impl Iterator<Item = Node<'d>> {
    node.children().filter(|child| !child.is("annotation"))
}

/// Returns a required attribute.
pub(crate) fn required<'d>(node: Node<'d>, name: &'static str) -> Result<&'d str, CompileError> {
    node.attr(name)
        .ok_or_else(|| CompileError::at(node, Problem::NoAttribute(name)))
}
