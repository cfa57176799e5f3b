//! Form of an OpenSCENARIO document.

use qcbus_document::Document;

/// The three forms of a document. The elements after the file header distinguish them.
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
    /// Returns the form of a document.
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
