//! What kind of document a file of OpenSCENARIO is.

use qcbus_document::Document;

/// The three forms of a document, told apart by what follows the file header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Entities and a storyboard.
    Scenario,
    /// Entries that scenarios refer to.
    Catalog,
    /// Values for the parameters of a scenario.
    Distribution,
    /// None of them, or several at once.
    Unclear,
}

impl Form {
    /// The form of a document.
    pub fn of(document: &Document<'_>) -> Form {
        let has = |name: &str| {
            document
                .root()
                .is_some_and(|root| root.child(name).is_some())
        };
        let forms = [
            (has("Storyboard") || has("Entities"), Form::Scenario),
            (has("Catalog"), Form::Catalog),
            (has("ParameterValueDistribution"), Form::Distribution),
        ];
        let mut found = forms.iter().filter(|(is, _)| *is);
        match (found.next(), found.next()) {
            (Some((_, form)), None) => *form,
            _ => Form::Unclear,
        }
    }
}
