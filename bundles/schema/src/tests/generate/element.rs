//! Generation of one element with its content.

use super::condition::holds;
use super::costs::Costs;
use super::{Dice, Tree};
use crate::assertion::{Assertion, Expr};
use crate::model::{Content, ElementDecl, Model, Schema, TypeRef};
use crate::simple::{Builtin, Facets, SimpleType, Variety};

/// Generator of a number of elements. After that it keeps required content short.
pub(super) struct Generator<'s, 'c> {
    pub(super) schema: &'s Schema,
    pub(super) costs: &'c Costs,
    pub(super) dice: Dice,
    /// Number of elements that are still wanted.
    pub(super) left: usize,
}

/// Texts of which one matches each pattern of the shipped tables.
const TEXTS: [&str; 6] = ["DE", "DEU", "$a", "${1 + $a}", "1.25", ""];

/// Maximum number of attempts to fulfil the assertions of one element.
const ATTEMPTS: usize = 60;

impl<'s> Generator<'s, '_> {
    pub(super) fn element(&mut self, declared: &'s ElementDecl, depth: usize) -> Option<Tree<'s>> {
        if depth > 60 {
            return None;
        }
        self.left = self.left.saturating_sub(1);
        (0..ATTEMPTS).find_map(|_| self.attempt(declared, depth))
    }

    fn attempt(&mut self, declared: &'s ElementDecl, depth: usize) -> Option<Tree<'s>> {
        let (test, ty) = self.choose_type(declared);
        let name = self.schema.names.text(declared.name);
        let mut tree = Tree {
            declared,
            name,
            attributes: Vec::new(),
            text: String::new(),
            children: Vec::new(),
        };
        let id = match ty {
            TypeRef::Any => return Some(tree),
            TypeRef::Simple(id) => {
                tree.text = self.value(id)?;
                return Some(tree);
            }
            TypeRef::Complex(id) => id,
        };
        let complex = self.schema.complex.get(id as usize)?;
        for attribute in &complex.attributes {
            if attribute.required || self.dice.chance(50) {
                let fixed = attribute.fixed.as_ref().map(|fixed| fixed.to_string());
                let value = fixed.or_else(|| self.value(attribute.value))?;
                let name = self.schema.names.text(attribute.name);
                tree.attributes
                    .push((attribute.name, name, value, attribute.required));
            }
        }
        if let Some(Expr::Compare(_, sides)) = test.map(|test| &test.root) {
            force(&mut tree, sides, self.schema);
        }
        match &complex.content {
            Content::Empty => {}
            Content::Text(id) => tree.text = self.value(*id)?,
            Content::Children(model) => tree.children = self.children(model, depth)?,
            Content::All(all) => {
                for (bit, member) in all.members.iter().enumerate() {
                    let needed = all.required & (1 << bit) != 0;
                    if needed || (self.left > 0 && self.dice.chance(40)) {
                        tree.children.extend(self.element(member, depth + 1));
                    }
                }
            }
        }
        let chosen = |test: Option<&Assertion>| test.is_none_or(|test| holds(&test.root, &tree));
        let first = declared
            .alternatives
            .iter()
            .find(|one| chosen(one.test.as_ref()));
        let right_type = first.map_or(declared.ty, |one| one.ty) == ty && !complex.is_abstract;
        (right_type && complex.assertions.iter().all(|one| holds(&one.root, &tree))).then_some(tree)
    }

    fn choose_type(&mut self, declared: &'s ElementDecl) -> (Option<&'s Assertion>, TypeRef) {
        let index = self.dice.below(declared.alternatives.len());
        match declared.alternatives.get(index) {
            Some(chosen) => (chosen.test.as_ref(), chosen.ty),
            None => (None, declared.ty),
        }
    }

    fn children(&mut self, model: &'s Model, depth: usize) -> Option<Vec<Tree<'s>>> {
        let ways = self.costs.ways(model);
        let mut all = Vec::new();
        let mut state = 0u16;
        for _ in 0..200 {
            let edges = model.edges(state);
            let accepts = model.states.get(usize::from(state))?.accepts;
            let stop = edges.is_empty() || (accepts && (self.left == 0 || self.dice.chance(12)));
            if stop {
                return accepts.then_some(all);
            }
            let index = if self.left == 0 || self.dice.chance(20) {
                match ways.get(usize::from(state))?.1 {
                    Some(index) => index,
                    None => return Some(all),
                }
            } else {
                self.dice.below(edges.len())
            };
            let edge = edges.get(index)?;
            // Ingest resolves OpenDRIVE's includes, and a generated one would name a missing file.
            if self.schema.names.text(edge.name) == "include" {
                continue;
            }
            all.push(self.element(model.children.get(usize::from(edge.child))?, depth + 1)?);
            state = edge.to;
        }
        None
    }

    fn value(&mut self, id: u32) -> Option<String> {
        let ty = self.schema.simple.get(id as usize)?;
        let candidate = self.candidate(ty)?;
        ty.accepts(&candidate, self.schema).then_some(candidate)
    }

    fn candidate(&mut self, ty: &'s SimpleType) -> Option<String> {
        if let Some(values) = &ty.facets.enumeration {
            return values
                .get(self.dice.below(values.len()))
                .map(|value| value.to_string());
        }
        if let Some(pattern) = ty.facets.patterns.first() {
            return TEXTS
                .iter()
                .find(|text| pattern.matches(text))
                .map(|text| (*text).to_owned());
        }
        match &ty.variety {
            Variety::Union(members) => {
                let member = *members.get(self.dice.below(members.len()))?;
                self.value(member)
            }
            Variety::List(item) => {
                let count = 1 + self.dice.below(3);
                let items: Option<Vec<String>> = (0..count).map(|_| self.value(*item)).collect();
                items.map(|items| items.join(" "))
            }
            Variety::Atomic(builtin) => Some(self.atomic(*builtin, &ty.facets)),
        }
    }

    fn atomic(&mut self, builtin: Builtin, facets: &Facets) -> String {
        let number = self.dice.below(90) + 1;
        let float = [
            format!("{number}.25"),
            format!("{number}"),
            "1.0e+00".to_owned(),
            format!("0.{number}"),
        ];
        let low = facets.lowest.as_ref().map(|bound| bound.value);
        let high = facets.highest.as_ref().map(|bound| bound.value);
        match builtin {
            Builtin::Boolean => ["true", "false", "1", "0"][self.dice.below(4)].to_owned(),
            Builtin::Float | Builtin::Double | Builtin::Decimal
                if low.is_some() || high.is_some() =>
            {
                let low = low.unwrap_or_else(|| high.unwrap_or(0.0) - 10.0);
                let high = high.unwrap_or(low + 10.0);
                format!("{}", low + (high - low) * 0.5)
            }
            Builtin::Float | Builtin::Double => float[self.dice.below(4)].clone(),
            Builtin::Decimal => format!("{number}.5"),
            Builtin::Negative | Builtin::NonPositive => format!("-{number}"),
            Builtin::DateTime => format!("2024-05-{:02}T12:00:00", number % 28 + 1),
            Builtin::Date => format!("2024-05-{:02}", number % 28 + 1),
            Builtin::Time => format!("12:00:{:02}", number % 60),
            Builtin::Language => "en-GB".to_owned(),
            Builtin::HexBinary => format!("{number:04x}"),
            Builtin::Base64 => "TWFw".to_owned(),
            _ if builtin.range().is_some() || builtin == Builtin::Integer => number.to_string(),
            _ => ["a", "b_1", "north", "x"][self.dice.below(4)].to_owned(),
        }
    }
}

/// Sets the attribute to the value that a type alternative requires.
fn force<'s>(tree: &mut Tree<'s>, sides: &[Expr; 2], schema: &'s Schema) {
    let [Expr::Path(path), Expr::Text(value)] = sides else {
        return;
    };
    let Some(attribute) = path.attribute.filter(|_| path.steps.is_empty()) else {
        return;
    };
    match tree.attributes.iter_mut().find(|have| have.0 == attribute) {
        Some(have) => have.2 = value.to_string(),
        None => tree.attributes.push((
            attribute,
            schema.names.text(attribute),
            value.to_string(),
            true,
        )),
    }
}
