//! Writer of tables in text notation.

use std::fmt::{self, Write};

use super::HEADER;
use crate::constraint::{Constraint, ConstraintKind, Constraints, Step};
use crate::edition::Edition;
use crate::model::{ComplexType, Content, ElementDecl, Model, Schema, TypeRef};
use crate::simple::{Facets, SimpleType, Variety};

impl Schema {
    /// Writes the tables in the notation that [`Schema::from_notation`] reads.
    pub fn to_notation(&self) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = Writer {
            schema: self,
            out: &mut out,
        }
        .schema();
        out
    }
}

struct Writer<'s> {
    schema: &'s Schema,
    out: &'s mut String,
}

impl Writer<'_> {
    fn schema(&mut self) -> fmt::Result {
        let schema = self.schema;
        let edition = if schema.edition == Edition::V1_1 {
            "1.1"
        } else {
            "1.0"
        };
        writeln!(
            self.out,
            "{HEADER}\ntitle {}\nedition {edition}",
            schema.title
        )?;
        if let Some(namespace) = &schema.namespace {
            writeln!(self.out, "namespace {}", quoted(namespace))?;
        }
        for (number, simple) in schema.simple.iter().enumerate() {
            self.simple(number, simple)?;
        }
        for (number, complex) in schema.complex.iter().enumerate() {
            self.complex(number, complex)?;
        }
        schema
            .roots
            .iter()
            .try_for_each(|root| self.element("root", root, false))
    }

    fn simple(&mut self, number: usize, simple: &SimpleType) -> fmt::Result {
        write!(self.out, "simple {number}")?;
        if let Some(name) = &simple.name {
            write!(self.out, " {name}")?;
        }
        match &simple.variety {
            Variety::Atomic(builtin) => write!(self.out, " = {}", builtin.name())?,
            Variety::List(item) => write!(self.out, " = list s{item}")?,
            Variety::Union(members) => {
                self.out.push_str(" = union");
                members
                    .iter()
                    .try_for_each(|member| write!(self.out, " s{member}"))?;
            }
        }
        self.facets(&simple.facets)?;
        self.out.push('\n');
        Ok(())
    }

    fn facets(&mut self, facets: &Facets) -> fmt::Result {
        for (bound, sign) in [(&facets.lowest, '>'), (&facets.highest, '<')] {
            if let Some(bound) = bound {
                let equal = if bound.exclusive { "" } else { "=" };
                write!(self.out, " {sign}{equal} {}", bound.text)?;
            }
        }
        let counts = [
            ("min-length", facets.min_length),
            ("max-length", facets.max_length),
            ("total-digits", facets.total_digits),
            ("fraction-digits", facets.fraction_digits),
        ];
        for (word, count) in counts {
            if let Some(count) = count {
                write!(self.out, " {word} {count}")?;
            }
        }
        if facets.collapse {
            self.out.push_str(" collapse");
        }
        for pattern in &facets.patterns {
            write!(self.out, " pattern {}", quoted(pattern.source()))?;
        }
        if let Some(values) = &facets.enumeration {
            self.out.push_str(" enum");
            values
                .iter()
                .try_for_each(|value| write!(self.out, " {}", quoted(value)))?;
        }
        Ok(())
    }

    fn complex(&mut self, number: usize, complex: &ComplexType) -> fmt::Result {
        write!(self.out, "complex {number}")?;
        if let Some(name) = &complex.name {
            write!(self.out, " {name}")?;
        }
        if let Some(base) = complex.base {
            write!(self.out, " = c{base}")?;
        }
        for (word, set) in [("abstract", complex.is_abstract), ("mixed", complex.mixed)] {
            if set {
                write!(self.out, " +{word}")?;
            }
        }
        self.out.push('\n');
        for attribute in &complex.attributes {
            let mark = if attribute.required { " required" } else { "" };
            write!(
                self.out,
                " @ {} s{}{mark}",
                self.schema.names.text(attribute.name),
                attribute.value
            )?;
            if let Some(fixed) = &attribute.fixed {
                write!(self.out, " fixed {}", quoted(fixed))?;
            }
            self.out.push('\n');
        }
        self.content(&complex.content)?;
        for assertion in &complex.assertions {
            writeln!(
                self.out,
                " assert {}",
                assertion.notation(&self.schema.names)
            )?;
        }
        Ok(())
    }

    fn content(&mut self, content: &Content) -> fmt::Result {
        match content {
            Content::Empty => Ok(()),
            Content::Text(simple) => writeln!(self.out, " text s{simple}"),
            Content::Children(model) => self.model(model),
            Content::All(all) => {
                writeln!(
                    self.out,
                    " all{}",
                    if all.optional { " optional" } else { "" }
                )?;
                for (bit, member) in all.members.iter().enumerate() {
                    self.element(" child", member, all.required & (1 << bit) != 0)?;
                }
                Ok(())
            }
        }
    }

    fn model(&mut self, model: &Model) -> fmt::Result {
        model
            .children
            .iter()
            .try_for_each(|child| self.element(" child", child, false))?;
        for (number, state) in model.states.iter().enumerate() {
            write!(
                self.out,
                " state {number}{}",
                if state.accepts { " end" } else { "" }
            )?;
            for edge in model.edges(u16::try_from(number).unwrap_or(u16::MAX)) {
                write!(
                    self.out,
                    " {}>{}",
                    self.schema.names.text(edge.name),
                    edge.to
                )?;
            }
            if let Some(to) = state.wildcard {
                write!(self.out, " *>{to}")?;
            }
            self.out.push('\n');
        }
        Ok(())
    }

    fn element(&mut self, word: &str, element: &ElementDecl, required: bool) -> fmt::Result {
        write!(
            self.out,
            "{word} {} {}",
            self.schema.names.text(element.name),
            type_ref(element.ty)
        )?;
        for (word, set) in [("nillable", element.nillable), ("required", required)] {
            if set {
                write!(self.out, " {word}")?;
            }
        }
        self.out.push('\n');
        for alternative in &element.alternatives {
            let test = alternative
                .test
                .as_ref()
                .map_or("else".to_owned(), |test| test.notation(&self.schema.names));
            writeln!(self.out, "  when {} {test}", type_ref(alternative.ty))?;
        }
        element
            .constraints
            .iter()
            .try_for_each(|constraints| self.constraints(constraints))
    }

    fn constraints(&mut self, constraints: &Constraints) -> fmt::Result {
        for constraint in &constraints.list {
            match constraint.kind {
                ConstraintKind::Key => write!(self.out, "  key {}", constraint.name)?,
                ConstraintKind::Unique => write!(self.out, "  unique {}", constraint.name)?,
                ConstraintKind::Reference(to) => {
                    write!(self.out, "  keyref {} {to}", constraint.name)?;
                }
            }
            self.paths(constraint)?;
        }
        Ok(())
    }

    fn paths(&mut self, constraint: &Constraint) -> fmt::Result {
        write!(self.out, " @{}", self.schema.names.text(constraint.field))?;
        for path in &constraint.paths {
            self.out.push(' ');
            for (index, step) in path.iter().enumerate() {
                let slash = if index > 0 { "/" } else { "" };
                let name = match step {
                    Step::Child(name) => self.schema.names.text(*name),
                    Step::Any => "*",
                };
                write!(self.out, "{slash}{name}")?;
            }
            if path.is_empty() {
                self.out.push('.');
            }
        }
        self.out.push('\n');
        Ok(())
    }
}

fn type_ref(ty: TypeRef) -> String {
    match ty {
        TypeRef::Any => "any".to_owned(),
        TypeRef::Simple(number) => format!("s{number}"),
        TypeRef::Complex(number) => format!("c{number}"),
    }
}

fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            _ => out.push(c),
        }
    }
    out.push('"');
    out
}
