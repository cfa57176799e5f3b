//! Validation of the attributes of one element against its type.

use qcbus_document::{Attribute, Node};

use super::names::AttributeName;
use super::types::Kind;
use super::{Walk, wording};
use crate::model::{AttributeUse, ComplexType};
use crate::names::NameId;
use crate::similar::closest;
use crate::simple::{Order, Variety, XML_SPACE, same_value};
use crate::violation::Code;
use crate::work::steps;

/// Attributes of a type that occurred so far. Types have at most 512 attributes.
#[derive(Default)]
struct Seen {
    bits: [u64; 8],
    required: u16,
}

impl Seen {
    /// Marks an attribute. Returns `false` if it was already marked.
    fn mark(&mut self, index: usize, required: bool) -> bool {
        let Some(word) = self.bits.get_mut(index / 64) else {
            return false;
        };
        let bit = 1u64 << (index % 64);
        let fresh = *word & bit == 0;
        *word |= bit;
        self.required += u16::from(fresh && required);
        fresh
    }

    fn has(&self, index: usize) -> bool {
        self.bits
            .get(index / 64)
            .is_some_and(|word| word & (1 << (index % 64)) != 0)
    }
}

impl<'a, 's> Walk<'a, 's> {
    pub(super) fn attributes(&mut self, node: Node<'a>, kind: Kind<'s>) {
        let (id, declared, required): (usize, &'s [AttributeUse], u16) = match kind {
            Kind::Simple(_) => (usize::MAX, &[], 0),
            Kind::Complex(id, ty) => (id as usize, &ty.attributes, ty.required),
        };
        let mut seen = Seen::default();
        // Files use one order of attributes, mostly that of the schema. So the search starts after
        // the last attribute found.
        let mut guess = 0;
        for attribute in node.attributes() {
            steps(1);
            match self.names.attribute(attribute) {
                AttributeName::Namespace => {}
                AttributeName::Prefixed => self.prefixed(node, id, attribute, declared),
                AttributeName::Plain(name) => match position(declared, guess, name) {
                    Some(index) => {
                        guess = index + 1;
                        if seen.mark(index, declared[index].required) {
                            self.value(node, attribute, &declared[index], id);
                        }
                    }
                    None => self.unexpected(node, id, attribute, declared),
                },
            }
        }
        if seen.required < required {
            self.missing(node, id, declared, &seen);
        }
    }

    fn value(
        &mut self,
        node: Node<'a>,
        attribute: Attribute<'a>,
        declared: &'s AttributeUse,
        id: usize,
    ) {
        let value = attribute.value();
        let Some(ty) = self.schema.simple.get(declared.value as usize) else {
            return;
        };
        let fits = ty.accepts(value, self.schema)
            && declared.fixed.as_ref().is_none_or(|fixed| {
                let order = match ty.variety {
                    Variety::Atomic(builtin) => builtin.order(),
                    _ => Order::Text,
                };
                let value = if order == Order::Text {
                    value
                } else {
                    value.trim_matches(XML_SPACE)
                };
                same_value(order, fixed, value)
            });
        if !fits {
            let key = (id, u32::from(declared.name.0));
            self.reporter
                .add_at(Code::InvalidValue, key, node, Some(attribute), || {
                    wording::invalid_value(node, attribute, declared, ty, self.schema)
                });
        }
    }

    fn prefixed(
        &mut self,
        node: Node<'a>,
        id: usize,
        attribute: Attribute<'a>,
        declared: &'s [AttributeUse],
    ) {
        let (prefix, local) = attribute
            .name()
            .split_once(':')
            .unwrap_or(("", attribute.name()));
        let known = matches!(
            local,
            "type" | "nil" | "schemaLocation" | "noNamespaceSchemaLocation"
        );
        if !known {
            self.unexpected(node, id, attribute, declared);
        } else if !self.bindings.is_xsi(node, prefix) {
            let key = (id, u32::from(attribute.name_number()));
            self.reporter.add_at(
                Code::UnexpectedAttribute,
                key,
                node,
                Some(attribute),
                || wording::unbound_prefix(node, attribute, prefix),
            );
        }
    }

    fn unexpected(
        &mut self,
        node: Node<'a>,
        id: usize,
        attribute: Attribute<'a>,
        declared: &'s [AttributeUse],
    ) {
        if self.overlay.allows_attribute(attribute.name()) {
            return;
        }
        let key = (id, u32::from(attribute.name_number()));
        self.reporter.add_at(
            Code::UnexpectedAttribute,
            key,
            node,
            Some(attribute),
            || wording::unexpected_attribute(node, attribute, declared, self.schema),
        );
    }

    fn missing(&mut self, node: Node<'a>, id: usize, declared: &'s [AttributeUse], seen: &Seen) {
        for (index, one) in declared.iter().enumerate() {
            if one.required && !seen.has(index) && !self.was_meant(node, one, declared) {
                let key = (id, u32::from(one.name.0));
                self.reporter.add(Code::MissingAttribute, key, node, || {
                    wording::missing_attribute(node, one, self.schema)
                });
            }
        }
    }
}

impl<'a, 's> Walk<'a, 's> {
    /// Checks whether a reported unknown attribute is probably the missing one misspelt.
    fn was_meant(
        &self,
        node: Node<'a>,
        missing: &AttributeUse,
        declared: &'s [AttributeUse],
    ) -> bool {
        let name = self.schema.names.text(missing.name);
        let mut some = node.attributes().take(wording::MAX_ATTRIBUTES);
        some.any(|one| {
            steps(1);
            let AttributeName::Plain(written) = self.names.attribute(one) else {
                return false;
            };
            position(declared, 0, written).is_none()
                && (wording::is_short_for(one.name(), name)
                    || closest(one.name(), std::iter::once(name)).is_some())
        })
    }
}

/// Returns the index of the declaration of `name`. The search starts at `guess` and wraps.
#[inline]
fn position(declared: &[AttributeUse], guess: usize, name: NameId) -> Option<usize> {
    let guess = guess.min(declared.len());
    steps(usize::from(declared.get(guess).is_none_or(|one| one.name != name)) * declared.len());
    let (before, after) = declared.split_at(guess);
    let late = after
        .iter()
        .position(|one| one.name == name)
        .map(|index| index + guess);
    late.or_else(|| before.iter().position(|one| one.name == name))
}

impl ComplexType {
    /// Returns the declaration of an attribute.
    pub(crate) fn attribute(&self, name: NameId) -> Option<&AttributeUse> {
        self.attributes.iter().find(|one| one.name == name)
    }
}
