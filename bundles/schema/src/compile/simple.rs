//! Simple types.

use std::collections::{HashMap, HashSet};

use qcbus_document::Node;

use super::Compiler;
use super::error::{CompileError, Problem, only_attributes, parts, refuse, required};
use crate::model::TypeRef;
use crate::pattern::Pattern;
use crate::simple::{
    Bound, Builtin, Facets, Order, SimpleType, Variety, float_value, is_decimal, is_float,
    is_integer,
};

/// Types that are already compiled.
#[derive(Default)]
pub(super) struct Known<'d> {
    builtins: HashMap<Builtin, u32>,
    nodes: HashMap<Node<'d>, u32>,
    open: HashSet<Node<'d>>,
}

/// Maximum number of values of one enumeration. Published schemas stay below 300.
const MAX_VALUES: usize = 20_000;

impl<'d> Compiler<'d, '_> {
    /// Returns the number of a built-in type.
    pub(super) fn builtin(&mut self, node: Node<'d>, local: &str) -> Result<u32, CompileError> {
        let Some(builtin) = Builtin::find(local) else {
            return refuse(node, Problem::Builtin(local.to_owned()));
        };
        if let Some(&id) = self.simple.builtins.get(&builtin) {
            return Ok(id);
        }
        let id = self.push_simple(SimpleType::builtin(builtin));
        self.simple.builtins.insert(builtin, id);
        Ok(id)
    }

    /// Returns the number of the type that an `xs:simpleType` defines.
    pub(super) fn simple_of(&mut self, node: Node<'d>) -> Result<u32, CompileError> {
        if let Some(&id) = self.simple.nodes.get(&node) {
            return Ok(id);
        }
        if !self.simple.open.insert(node) {
            return refuse(node, Problem::Circular);
        }
        let id = self.deeper(node, |this| this.define_simple(node))?;
        self.simple.open.remove(&node);
        self.simple.nodes.insert(node, id);
        Ok(id)
    }

    fn push_simple(&mut self, simple: SimpleType) -> u32 {
        self.schema.simple.push(simple);
        u32::try_from(self.schema.simple.len() - 1).unwrap_or(u32::MAX)
    }

    fn define_simple(&mut self, node: Node<'d>) -> Result<u32, CompileError> {
        only_attributes(node, &["name", "final"])?;
        let mut bodies = parts(node);
        let (Some(body), None) = (bodies.next(), bodies.next()) else {
            return refuse(
                node,
                Problem::Invalid("a simple type needs exactly one definition"),
            );
        };
        let plain =
            node.attr("name").is_none() && body.is("restriction") && parts(body).next().is_none();
        if let (true, Some(base)) = (plain, body.attr("base")) {
            // This restriction adds nothing, so the result is the base type.
            only_attributes(body, &["base"])?;
            return self.simple_named(body, base);
        }
        let mut defined = match body.name() {
            "restriction" => self.restriction(body)?,
            "union" => self.union(body)?,
            "list" => self.list(body)?,
            _ => return refuse(body, Problem::Unsupported),
        };
        defined.name = node.attr("name").map(Into::into);
        Ok(self.push_simple(defined))
    }

    /// Returns the number of a type that must be simple.
    pub(super) fn simple_named(&mut self, node: Node<'d>, name: &str) -> Result<u32, CompileError> {
        match self.type_ref(node, name)? {
            TypeRef::Simple(id) => Ok(id),
            _ => refuse(node, Problem::Missing("simple type", name.to_owned())),
        }
    }

    fn union(&mut self, node: Node<'d>) -> Result<SimpleType, CompileError> {
        only_attributes(node, &["memberTypes"])?;
        let mut members = Vec::new();
        for name in node.attr("memberTypes").unwrap_or("").split_whitespace() {
            members.push(self.simple_named(node, name)?);
        }
        for part in parts(node) {
            members.push(self.anonymous(part)?);
        }
        if members.is_empty() {
            return refuse(
                node,
                Problem::Invalid("a union needs at least one member type"),
            );
        }
        Ok(SimpleType {
            name: None,
            variety: Variety::Union(members),
            facets: Facets::default(),
        })
    }

    fn list(&mut self, node: Node<'d>) -> Result<SimpleType, CompileError> {
        only_attributes(node, &["itemType"])?;
        let item = match (node.attr("itemType"), parts(node).next()) {
            (Some(name), None) => self.simple_named(node, name)?,
            (None, Some(part)) => self.anonymous(part)?,
            _ => {
                return refuse(node, Problem::Invalid("a list needs exactly one item type"));
            }
        };
        Ok(SimpleType {
            name: None,
            variety: Variety::List(item),
            facets: Facets::default(),
        })
    }

    fn anonymous(&mut self, node: Node<'d>) -> Result<u32, CompileError> {
        if node.is("simpleType") {
            self.simple_of(node)
        } else {
            refuse(node, Problem::Unsupported)
        }
    }

    fn restriction(&mut self, node: Node<'d>) -> Result<SimpleType, CompileError> {
        only_attributes(node, &["base"])?;
        let inner = parts(node).find(|part| part.is("simpleType"));
        let base = match (node.attr("base"), inner) {
            (Some(name), None) => self.simple_named(node, name)?,
            (None, Some(inner)) => self.anonymous(inner)?,
            _ => {
                return refuse(
                    node,
                    Problem::Invalid("a restriction needs exactly one base"),
                );
            }
        };
        let mut simple = self.schema.simple[base as usize].clone();
        let mut own = Own::default();
        for facet in parts(node).filter(|part| !part.is("simpleType")) {
            only_attributes(facet, &["value", "fixed"])?;
            read_facet(facet, &simple, &mut own)?;
        }
        own.merge_into(&mut simple.facets);
        Ok(simple)
    }
}

/// Facets of one restriction step.
#[derive(Default)]
struct Own {
    facets: Facets,
    values: Vec<Box<str>>,
    /// Patterns of one step are alternatives. Patterns of different steps must all match.
    pattern: Option<Pattern>,
}

impl Own {
    fn merge_into(self, facets: &mut Facets) {
        if !self.values.is_empty() {
            facets.enumeration = Some(self.values);
        }
        facets.patterns.extend(self.pattern);
        let own = self.facets;
        facets.lowest = own.lowest.or(facets.lowest.take());
        facets.highest = own.highest.or(facets.highest.take());
        facets.min_length = own.min_length.or(facets.min_length);
        facets.max_length = own.max_length.or(facets.max_length);
        facets.total_digits = own.total_digits.or(facets.total_digits);
        facets.fraction_digits = own.fraction_digits.or(facets.fraction_digits);
        facets.collapse |= own.collapse;
    }
}

fn read_facet(node: Node<'_>, base: &SimpleType, own: &mut Own) -> Result<(), CompileError> {
    let value = required(node, "value")?;
    let unsupported = || CompileError::at(node, Problem::Unsupported);
    match node.name() {
        "enumeration" if own.values.len() >= MAX_VALUES => {
            return refuse(node, Problem::TooLarge("values", MAX_VALUES));
        }
        "enumeration" => own.values.push(value.into()),
        "pattern" => {
            let both = own
                .pattern
                .as_ref()
                .map(|before| format!("{}|{value}", before.source()));
            let pattern = Pattern::new(both.as_deref().unwrap_or(value));
            own.pattern = Some(pattern.map_err(|error| CompileError::at(node, error))?);
        }
        "minInclusive" | "minExclusive" => own.facets.lowest = Some(bound(node, base, value)?),
        "maxInclusive" | "maxExclusive" => own.facets.highest = Some(bound(node, base, value)?),
        "minLength" => own.facets.min_length = Some(count(node, value)?),
        "maxLength" => own.facets.max_length = Some(count(node, value)?),
        "length" => {
            own.facets.min_length = Some(count(node, value)?);
            own.facets.max_length = own.facets.min_length;
        }
        "totalDigits" | "fractionDigits" => read_digits(node, base, value, own)?,
        "whiteSpace" if value == "collapse" => own.facets.collapse = true,
        "whiteSpace" if value == "preserve" => {}
        _ => return Err(unsupported()),
    }
    let is_atomic = matches!(base.variety, Variety::Atomic(_));
    let anywhere = matches!(node.name(), "enumeration" | "pattern");
    let on_list = matches!(base.variety, Variety::List(_))
        && node.name().to_ascii_lowercase().ends_with("length");
    if is_atomic || anywhere || on_list {
        Ok(())
    } else {
        Err(unsupported())
    }
}

fn read_digits(
    node: Node<'_>,
    base: &SimpleType,
    value: &str,
    own: &mut Own,
) -> Result<(), CompileError> {
    let decimal =
        matches!(base.variety, Variety::Atomic(builtin) if builtin.order() == Order::Decimal);
    if !decimal {
        return refuse(node, Problem::Unsupported);
    }
    let count = Some(count(node, value)?);
    if node.is("totalDigits") {
        own.facets.total_digits = count;
    } else {
        own.facets.fraction_digits = count;
    }
    Ok(())
}

fn bound(node: Node<'_>, base: &SimpleType, text: &str) -> Result<Bound, CompileError> {
    let order = match base.variety {
        Variety::Atomic(builtin) => builtin.order(),
        _ => Order::Text,
    };
    let edition = crate::edition::Edition::V1_0;
    let fits = match order {
        Order::Decimal => is_integer(text) || is_decimal(text),
        Order::Float => is_float(text, edition),
        _ => return refuse(node, Problem::Unsupported),
    };
    let value = float_value(text).filter(|_| fits);
    let value =
        value.ok_or_else(|| CompileError::at(node, Problem::Value("value", text.to_owned())))?;
    Ok(Bound {
        text: text.into(),
        value,
        exclusive: node.name().ends_with("Exclusive"),
    })
}

fn count(node: Node<'_>, text: &str) -> Result<u32, CompileError> {
    text.trim()
        .parse()
        .map_err(|_| CompileError::at(node, Problem::Value("value", text.to_owned())))
}
