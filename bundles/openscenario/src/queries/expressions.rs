//! Expressions and uses of parameters in a scenario.

use qcbus_document::{Attribute, Node};

use crate::expr::{self, Evaluated};
use crate::queries::scenario::{Scenario, is_plain};
use crate::types::data_type::DataType;
use crate::types::declaration::operand;
use crate::types::reading::{self, Expected};
use crate::types::scope::ContextId;

impl<'d> Scenario<'d> {
    /// Returns the attributes of the document that are written as expressions, in document order,
    /// even if faulty. Attributes that the schema declares as text are left out.
    pub fn written_expressions(&self) -> impl Iterator<Item = Attribute<'d>> {
        self.substituted(0).filter(|attribute| {
            let is_text = || {
                matches!(
                    self.expected(*attribute, 0),
                    Expected::Words(_) | Expected::Type(DataType::String | DataType::DateTime)
                )
            };
            reading::Form::of(attribute.value()) == reading::Form::Expression && !is_text()
        })
    }

    /// Returns every expression of the document that has a value, in document order. Attributes
    /// that the schema declares as text are left out.
    pub fn expressions(&self) -> impl Iterator<Item = (Attribute<'d>, Evaluated)> {
        self.written_expressions().filter_map(|attribute| {
            let context = &self.contexts[0];
            let lookup = |name: &str| operand(context.get(attribute.node(), name));
            let evaluated = expr::evaluate(attribute.value(), self.version, &lookup).ok()?;
            Some((attribute, evaluated))
        })
    }

    /// Returns every use of a parameter in the document: the attribute and the parameter's name.
    pub fn parameter_uses(&self) -> impl Iterator<Item = (Attribute<'d>, &'d str)> {
        self.substituted(0).flat_map(|attribute| {
            let raw = attribute.value();
            let names: Vec<&'d str> = match reading::Form::of(raw) {
                reading::Form::Parameter(name) | reading::Form::Embedded(_, name) => vec![name],
                reading::Form::Expression => {
                    expr::names(raw).into_iter().map(|(name, _)| name).collect()
                }
                reading::Form::Literal | reading::Form::Ros(_) => Vec::new(),
            };
            names.into_iter().map(move |name| (attribute, name))
        })
    }

    /// Returns the attributes of the document that contain a `$`, in document order.
    pub fn with_dollar(&self) -> &[Attribute<'d>] {
        self.with_dollar
            .get_or_init(|| with_dollar(self.contexts[0].top).collect())
    }

    /// Returns the attributes of the document, or of an entry, that are not literals.
    pub(super) fn substituted(&self, context: ContextId) -> impl Iterator<Item = Attribute<'d>> {
        let (document, entry) = match context {
            0 => (self.with_dollar(), None),
            _ => (&[][..], Some(with_dollar(self.context(context).top))),
        };
        let all = document.iter().copied().chain(entry.into_iter().flatten());
        all.filter(|attribute| {
            reading::Form::of(attribute.value()) != reading::Form::Literal && !is_plain(*attribute)
        })
    }
}

fn with_dollar<'d>(top: Node<'d>) -> impl Iterator<Item = Attribute<'d>> {
    let all = std::iter::once(top).chain(top.descendants());
    all.flat_map(|node| node.attributes())
        .filter(|attribute| attribute.value().contains('$'))
}
