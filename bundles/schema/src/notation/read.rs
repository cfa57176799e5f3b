//! Reader of tables in text notation.

use std::collections::HashMap;

use super::line::{Line, Parsed};
use super::{HEADER, NotationError};
use crate::assertion::Assertion;
use crate::constraint::{Constraint, ConstraintKind, Constraints, Step};
use crate::edition::Edition;
use crate::model::{
    AllModel, Alternative, AttributeUse, ComplexType, Content, Edge, ElementDecl, Model, Schema,
    State, TypeRef,
};
use crate::names::{NameId, Names};
use crate::pattern::Pattern;
use crate::simple::{Bound, Builtin, Facets, SimpleType, Variety, float_value};

impl Schema {
    /// Reads tables in the notation that [`Schema::to_notation`] writes.
    ///
    /// # Errors
    /// If a line is invalid or refers to something missing.
    pub fn from_notation(text: &str) -> Result<Schema, NotationError> {
        let mut lines = text.lines().enumerate();
        if lines.next().map(|(_, line)| line.trim_ascii()) != Some(HEADER) {
            return Err(NotationError {
                line: 1,
                what: format!("the first line is not `{HEADER}`"),
            });
        }
        let mut reader = Reader::default();
        for (index, line) in lines {
            reader
                .line(&mut Line::new(line))
                .map_err(|what| NotationError {
                    line: index + 1,
                    what,
                })?;
        }
        reader
            .finish()
            .map_err(|what| NotationError { line: 0, what })
    }
}

struct Reader {
    schema: Schema,
    /// Constraints of the element that was read last. They are merged when they are complete.
    constraints: Vec<Constraint>,
    /// Compiled patterns. Each distinct pattern is compiled once.
    patterns: HashMap<Box<str>, Pattern>,
    last: Last,
}

/// The element that `when` and `key` lines belong to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Last {
    Nothing,
    Child,
    Root,
}

impl Default for Reader {
    fn default() -> Self {
        Self {
            schema: Schema::new(""),
            constraints: Vec::new(),
            patterns: HashMap::new(),
            last: Last::Nothing,
        }
    }
}

impl Reader {
    fn line(&mut self, line: &mut Line<'_>) -> Parsed<()> {
        let Some(word) = line.next() else {
            return Ok(());
        };
        if !matches!(word, "when" | "key" | "unique" | "keyref") {
            self.close_element()?;
        }
        match word {
            "title" => self.schema.title = line.rest().into(),
            "edition" => {
                self.schema.edition = if line.rest() == "1.1" {
                    Edition::V1_1
                } else {
                    Edition::V1_0
                }
            }
            "namespace" => self.schema.namespace = Some(line.quoted()?.into()),
            "simple" => self.simple(line)?,
            "complex" => self.complex(line)?,
            "@" => self.attribute(line)?,
            "text" => {
                self.complex_mut()?.content = Content::Text(simple_number(line.word("a type")?)?);
            }
            "all" => {
                let optional = line.next() == Some("optional");
                self.complex_mut()?.content = Content::All(AllModel {
                    optional,
                    ..AllModel::default()
                });
            }
            "child" => self.child(line)?,
            "root" => {
                let (element, _) = self.element(line)?;
                self.schema.roots.push(element);
                self.last = Last::Root;
            }
            "state" => self.state(line)?,
            "assert" => {
                let assertion = Assertion::from_notation(line.rest(), &mut self.schema.names)?;
                self.complex_mut()?.assertions.push(assertion);
            }
            "when" => self.alternative(line)?,
            "key" | "unique" | "keyref" => self.constraint(word, line)?,
            "#" => {}
            other => return Err(format!("unknown statement `{other}`")),
        }
        Ok(())
    }

    fn name(&mut self, text: &str) -> Parsed<NameId> {
        self.schema
            .names
            .intern(text)
            .ok_or_else(|| "too many names".into())
    }

    fn complex_mut(&mut self) -> Parsed<&mut ComplexType> {
        self.schema
            .complex
            .last_mut()
            .ok_or_else(|| "no complex type precedes this line".into())
    }

    fn simple(&mut self, line: &mut Line<'_>) -> Parsed<()> {
        if line.number::<usize>("a number")? != self.schema.simple.len() {
            return Err("simple types must be numbered in order".into());
        }
        let mut word = line.word("`=`")?;
        let name = (word != "=").then_some(word);
        if name.is_some() {
            word = line.word("`=`")?;
        }
        if word != "=" {
            return Err("expected `=`".into());
        }
        let (variety, mut facet) = variety(line)?;
        let mut facets = Facets::default();
        while let Some(word) = facet {
            self.facet(word, line, &mut facets)?;
            facet = line.next();
        }
        self.schema.simple.push(SimpleType {
            name: name.map(Into::into),
            variety,
            facets,
        });
        Ok(())
    }

    fn facet(&mut self, word: &str, line: &mut Line<'_>, facets: &mut Facets) -> Parsed<()> {
        match word {
            ">" | ">=" => facets.lowest = Some(bound(line, word == ">")?),
            "<" | "<=" => facets.highest = Some(bound(line, word == "<")?),
            "min-length" => facets.min_length = Some(line.number(word)?),
            "max-length" => facets.max_length = Some(line.number(word)?),
            "total-digits" => facets.total_digits = Some(line.number(word)?),
            "fraction-digits" => facets.fraction_digits = Some(line.number(word)?),
            "collapse" => facets.collapse = true,
            "pattern" => {
                let source = line.quoted()?;
                let pattern = match self.patterns.get(&*source) {
                    Some(known) => known.clone(),
                    None => {
                        let fresh =
                            Pattern::new(&source).map_err(|error| format!("failed to {error}"))?;
                        self.patterns.insert(source.into(), fresh.clone());
                        fresh
                    }
                };
                facets.patterns.push(pattern);
            }
            "enum" => {
                let mut values = Vec::new();
                while line.at_quote() {
                    values.push(line.quoted()?.into());
                }
                facets.enumeration = Some(values);
            }
            other => return Err(format!("unknown restriction `{other}`")),
        }
        Ok(())
    }

    fn complex(&mut self, line: &mut Line<'_>) -> Parsed<()> {
        if line.number::<usize>("a number")? != self.schema.complex.len() {
            return Err("complex types must be numbered in order".into());
        }
        let mut ty = ComplexType {
            name: None,
            base: None,
            is_abstract: false,
            mixed: false,
            attributes: Vec::new(),
            required: 0,
            content: Content::Empty,
            assertions: Vec::new(),
        };
        while let Some(word) = line.next() {
            match word {
                "=" => ty.base = Some(complex_number(line.word("a base type")?)?),
                "+abstract" => ty.is_abstract = true,
                "+mixed" => ty.mixed = true,
                name if ty.name.is_none() => ty.name = Some(name.into()),
                other => return Err(format!("unexpected `{other}`")),
            }
        }
        self.schema.complex.push(ty);
        Ok(())
    }

    fn attribute(&mut self, line: &mut Line<'_>) -> Parsed<()> {
        let name = self.name(line.word("a name")?)?;
        let value = simple_number(line.word("a type")?)?;
        let mut attribute = AttributeUse {
            name,
            value,
            required: false,
            fixed: None,
        };
        while let Some(word) = line.next() {
            match word {
                "required" => attribute.required = true,
                "fixed" => attribute.fixed = Some(line.quoted()?.into()),
                other => return Err(format!("unexpected `{other}`")),
            }
        }
        let ty = self.complex_mut()?;
        ty.required += u16::from(attribute.required);
        ty.attributes.push(attribute);
        if ty.attributes.len() > 512 {
            Err("more than 512 attributes".into())
        } else {
            Ok(())
        }
    }

    fn element(&mut self, line: &mut Line<'_>) -> Parsed<(ElementDecl, bool)> {
        let name = self.name(line.word("a name")?)?;
        let ty = type_ref(line.word("a type")?)?;
        let mut element = ElementDecl {
            name,
            ty,
            nillable: false,
            alternatives: Vec::new(),
            constraints: None,
        };
        let mut required = false;
        while let Some(word) = line.next() {
            match word {
                "nillable" => element.nillable = true,
                "required" => required = true,
                other => return Err(format!("unexpected `{other}`")),
            }
        }
        Ok((element, required))
    }

    fn child(&mut self, line: &mut Line<'_>) -> Parsed<()> {
        let (element, required) = self.element(line)?;
        match &mut self.complex_mut()?.content {
            Content::All(all) if all.members.len() < 64 => {
                all.required |= u64::from(required) << all.members.len();
                all.members.push(element);
            }
            Content::All(_) => return Err("an `all` may have at most 64 members".into()),
            Content::Children(model) => model.children.push(element),
            content => {
                *content = Content::Children(Model {
                    children: vec![element],
                    ..Model::default()
                });
            }
        }
        self.last = Last::Child;
        Ok(())
    }

    fn state(&mut self, line: &mut Line<'_>) -> Parsed<()> {
        let number: usize = line.number("a number")?;
        let names = &mut self.schema.names;
        let Some(ty) = self.schema.complex.last_mut() else {
            return Err("no complex type precedes this line".into());
        };
        if matches!(ty.content, Content::Empty) {
            ty.content = Content::Children(Model::default());
        }
        let Content::Children(model) = &mut ty.content else {
            return Err("a state in a type without children".into());
        };
        if number != model.states.len() {
            return Err("states must be numbered in order".into());
        }
        let mut state = State {
            first: u32::try_from(model.edges.len()).unwrap_or(u32::MAX),
            ..State::default()
        };
        while let Some(word) = line.next() {
            match word.split_once('>') {
                None if word == "end" => state.accepts = true,
                None => return Err(format!("unexpected `{word}`")),
                Some(("*", to)) => state.wildcard = Some(state_number(to)?),
                Some((name, to)) => {
                    model.edges.push(edge(names, &model.children, name, to)?);
                    state.count += 1;
                }
            }
        }
        model.states.push(state);
        Ok(())
    }

    fn last_element(&mut self) -> Parsed<&mut ElementDecl> {
        let element = match self.last {
            Last::Nothing => None,
            Last::Root => self.schema.roots.last_mut(),
            Last::Child => match self.schema.complex.last_mut().map(|ty| &mut ty.content) {
                Some(Content::All(all)) => all.members.last_mut(),
                Some(Content::Children(model)) => model.children.last_mut(),
                _ => None,
            },
        };
        element.ok_or_else(|| "no element precedes this line".into())
    }

    fn alternative(&mut self, line: &mut Line<'_>) -> Parsed<()> {
        let ty = type_ref(line.word("a type")?)?;
        let test = match line.rest() {
            "else" => None,
            text => Some(Assertion::from_notation(text, &mut self.schema.names)?),
        };
        self.last_element()?
            .alternatives
            .push(Alternative { test, ty });
        Ok(())
    }

    fn constraint(&mut self, word: &str, line: &mut Line<'_>) -> Parsed<()> {
        let name = line.word("a name")?.into();
        let kind = match word {
            "key" => ConstraintKind::Key,
            "unique" => ConstraintKind::Unique,
            _ => ConstraintKind::Reference(line.number("a number")?),
        };
        let field = line
            .word("a field")?
            .strip_prefix('@')
            .ok_or("a field must begin with `@`")?;
        let field = self.name(field)?;
        let mut paths = Vec::new();
        while let Some(path) = line.next() {
            let steps = path
                .split('/')
                .filter(|step| *step != ".")
                .map(|step| match step {
                    "*" => Ok(Step::Any),
                    name => self.name(name).map(Step::Child),
                });
            paths.push(steps.collect::<Parsed<Vec<Step>>>()?);
        }
        self.constraints.push(Constraint {
            name,
            kind,
            paths,
            field,
        });
        Ok(())
    }

    fn close_element(&mut self) -> Parsed<()> {
        if self.constraints.is_empty() {
            return Ok(());
        }
        let list = std::mem::take(&mut self.constraints);
        let dangling = |one: &Constraint| matches!(one.kind, ConstraintKind::Reference(to) if usize::from(to) >= list.len());
        if list.iter().any(dangling) {
            return Err("a keyref refers to an undefined key".into());
        }
        let merged = Constraints::new(list).ok_or("selectors have too many steps")?;
        self.last_element()?.constraints = Some(Box::new(merged));
        Ok(())
    }

    fn finish(mut self) -> Parsed<Schema> {
        self.close_element()?;
        check(&self.schema)?;
        if let Some(id) = self.schema.endless_condition() {
            return Err(format!(
                "the complex type {id} has a condition with // and can contain itself"
            ));
        }
        Ok(self.schema)
    }
}

fn variety<'t>(line: &mut Line<'t>) -> Parsed<(Variety, Option<&'t str>)> {
    match line.word("a built-in type")? {
        "list" => Ok((
            Variety::List(simple_number(line.word("a type")?)?),
            line.next(),
        )),
        "union" => {
            let mut members = Vec::new();
            let mut next = line.next();
            while let Some(word) = next.filter(|word| word.starts_with('s') && *word != "s") {
                members.push(simple_number(word)?);
                next = line.next();
            }
            Ok((Variety::Union(members), next))
        }
        word => {
            let builtin =
                Builtin::find(word).ok_or_else(|| format!("unknown built-in type `{word}`"))?;
            Ok((Variety::Atomic(builtin), line.next()))
        }
    }
}

fn bound(line: &mut Line<'_>, exclusive: bool) -> Parsed<Bound> {
    let text = line.word("a bound")?;
    let value = float_value(text).ok_or_else(|| format!("expected a number, found `{text}`"))?;
    Ok(Bound {
        text: text.into(),
        value,
        exclusive,
    })
}

fn edge(names: &mut Names, children: &[ElementDecl], name: &str, to: &str) -> Parsed<Edge> {
    let id = names.find(name);
    let index = children.iter().position(|child| Some(child.name) == id);
    let (Some(name), Some(index)) = (id, index) else {
        return Err(format!("`{name}` is not a child of this type"));
    };
    let child = u16::try_from(index).map_err(|_| "too many children")?;
    Ok(Edge {
        name,
        child,
        to: state_number(to)?,
    })
}

fn state_number(text: &str) -> Parsed<u16> {
    text.parse()
        .map_err(|_| format!("expected a state, found `{text}`"))
}

fn simple_number(text: &str) -> Parsed<u32> {
    let number = text
        .strip_prefix('s')
        .and_then(|number| number.parse().ok());
    number.ok_or_else(|| format!("expected a simple type, found `{text}`"))
}

fn complex_number(text: &str) -> Parsed<u32> {
    let number = text
        .strip_prefix('c')
        .and_then(|number| number.parse().ok());
    number.ok_or_else(|| format!("expected a complex type, found `{text}`"))
}

fn type_ref(text: &str) -> Parsed<TypeRef> {
    match text.as_bytes().first() {
        _ if text == "any" => Ok(TypeRef::Any),
        Some(b's') => simple_number(text).map(TypeRef::Simple),
        _ => complex_number(text).map(TypeRef::Complex),
    }
}

/// Checks that every number is valid and that no simple type contains itself.
fn check(schema: &Schema) -> Parsed<()> {
    let is_simple = |number: u32| (number as usize) < schema.simple.len();
    let is_complex = |number: u32| (number as usize) < schema.complex.len();
    for (index, simple) in schema.simple.iter().enumerate() {
        // Members come before their list or union, so no union can contain itself.
        let before = |number: &u32| (*number as usize) < index;
        let sound = match &simple.variety {
            Variety::Atomic(_) => true,
            Variety::List(item) => before(item),
            Variety::Union(members) => members.iter().all(before),
        };
        if !sound {
            return Err(format!("simple type {index} refers to a later one"));
        }
    }
    let fits = |ty: TypeRef| match ty {
        TypeRef::Any => true,
        TypeRef::Simple(number) => is_simple(number),
        TypeRef::Complex(number) => is_complex(number),
    };
    let element_fits = |element: &ElementDecl| {
        fits(element.ty) && element.alternatives.iter().all(|other| fits(other.ty))
    };
    for (index, ty) in schema.complex.iter().enumerate() {
        let content = match &ty.content {
            Content::Empty => true,
            Content::Text(simple) => is_simple(*simple),
            Content::All(all) => all.members.iter().all(element_fits),
            Content::Children(model) => {
                model.children.iter().all(element_fits) && model_fits(model)
            }
        };
        let attributes = ty
            .attributes
            .iter()
            .all(|attribute| is_simple(attribute.value));
        if !content || !attributes || !ty.base.is_none_or(is_complex) {
            return Err(format!(
                "complex type {index} refers to something undefined"
            ));
        }
    }
    if schema.roots.is_empty() || !schema.roots.iter().all(element_fits) {
        return Err("a root element is missing or has no type".into());
    }
    Ok(())
}

fn model_fits(model: &Model) -> bool {
    let is_state = |number: u16| usize::from(number) < model.states.len();
    let edges = model.edges.iter().all(|edge| is_state(edge.to));
    edges
        && model
            .states
            .iter()
            .all(|state| state.wildcard.is_none_or(is_state))
        && !model.states.is_empty()
}
