//! Documents made from tables: every one is valid, and every construct of a schema turns up.
//!
//! For property tests, and for base documents that other validators are compared over.

use std::fmt::Write;

use crate::assertion::{Assertion, Expr, Path};
use crate::constraint::{Constraint, ConstraintKind, Constraints, Step};
use crate::model::{Content, ElementDecl, Model, Schema, TypeRef};
use crate::names::NameId;
use crate::simple::{Builtin, Facets, SimpleType, Variety};

/// A small generator of numbers, the same on every machine (xorshift64*).
#[derive(Clone, Debug)]
pub struct Dice(u64);

impl Dice {
    /// Dice that fall the same way for the same seed.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// A number below `limit`, or 0.
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let high = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33;
        usize::try_from(high).unwrap_or(0) % limit.max(1)
    }

    fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }
}

/// A document valid against `schema`, with roughly `size` elements; `None` if the tables allow none
/// that the generator could find.
pub fn document(schema: &Schema, root: usize, seed: u64, size: usize) -> Option<String> {
    let declared = schema.roots.get(root)?;
    let costs = Costs::of(schema);
    (0..20).find_map(|turn| draft(schema, declared, &costs, seed + 1_000_003 * turn, size))
}

fn draft(
    schema: &Schema,
    declared: &ElementDecl,
    costs: &Costs,
    seed: u64,
    size: usize,
) -> Option<String> {
    let mut generator = Generator {
        schema,
        costs,
        dice: Dice::new(seed),
        left: size,
    };
    let mut tree = generator.element(declared, 0)?;
    if !settle_keys(&mut tree, schema) {
        return None;
    }
    let mut text = String::new();
    tree.write(&mut text, 0);
    Some(text)
}

#[derive(Clone, Debug)]
struct Tree<'s> {
    declared: &'s ElementDecl,
    name: &'s str,
    /// Name, value, and whether it is required.
    attributes: Vec<(NameId, &'s str, String, bool)>,
    text: String,
    children: Vec<Tree<'s>>,
}

impl Tree<'_> {
    fn write(&self, out: &mut String, depth: usize) {
        // Writing to a String cannot fail.
        let _ = write!(out, "{:1$}<{2}", "", depth, self.name);
        for (_, name, value, _) in &self.attributes {
            let _ = write!(out, " {name}=\"{}\"", escaped(value));
        }
        if self.children.is_empty() && self.text.is_empty() {
            out.push_str("/>\n");
            return;
        }
        out.push('>');
        out.push_str(&escaped(&self.text));
        if !self.children.is_empty() {
            out.push('\n');
            self.children
                .iter()
                .for_each(|child| child.write(out, depth + 1));
            let _ = write!(out, "{:1$}", "", depth);
        }
        let _ = writeln!(out, "</{}>", self.name);
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}

/// Elements that the smallest element of each complex type needs; `MAX` if there is no end.
struct Costs(Vec<u32>);

const ENDLESS: u32 = u32::MAX / 4;

impl Costs {
    fn of(schema: &Schema) -> Self {
        let mut costs = Self(vec![ENDLESS; schema.complex.len()]);
        loop {
            let mut changed = false;
            for index in 0..schema.complex.len() {
                let cost = costs.content(&schema.complex[index].content);
                changed |= cost < costs.0[index];
                costs.0[index] = costs.0[index].min(cost);
            }
            if !changed {
                return costs;
            }
        }
    }

    fn content(&self, content: &Content) -> u32 {
        match content {
            Content::Empty | Content::Text(_) => 1,
            Content::Children(model) => self
                .ways(model)
                .first()
                .map_or(ENDLESS, |(cost, _)| cost.saturating_add(1)),
            Content::All(all) => {
                let needed = all
                    .members
                    .iter()
                    .enumerate()
                    .filter(|(bit, _)| all.required & (1 << bit) != 0);
                needed
                    .fold(1, |sum: u32, (_, member)| {
                        sum.saturating_add(self.element(member))
                    })
                    .min(ENDLESS)
            }
        }
    }

    fn element(&self, element: &ElementDecl) -> u32 {
        match element.ty {
            TypeRef::Complex(id) => self.0.get(id as usize).copied().unwrap_or(ENDLESS),
            _ => 1,
        }
    }

    /// For each state, the least cost to an end and the edge to take (`None` to end here).
    fn ways(&self, model: &Model) -> Vec<(u32, Option<usize>)> {
        let mut ways: Vec<(u32, Option<usize>)> = model
            .states
            .iter()
            .map(|state| (if state.accepts { 0 } else { ENDLESS }, None))
            .collect();
        loop {
            let mut changed = false;
            for state in 0..model.states.len() {
                for (index, edge) in model
                    .edges(u16::try_from(state).unwrap_or(0))
                    .iter()
                    .enumerate()
                {
                    let child = model
                        .children
                        .get(usize::from(edge.child))
                        .map_or(ENDLESS, |child| self.element(child));
                    let cost = ways[usize::from(edge.to)]
                        .0
                        .saturating_add(child)
                        .min(ENDLESS);
                    if cost < ways[state].0 {
                        ways[state] = (cost, Some(index));
                        changed = true;
                    }
                }
            }
            if !changed {
                return ways;
            }
        }
    }
}

struct Generator<'s, 'c> {
    schema: &'s Schema,
    costs: &'c Costs,
    dice: Dice,
    left: usize,
}

/// Attempts to fulfil the assertions of one element.
const ATTEMPTS: usize = 60;

impl<'s> Generator<'s, '_> {
    fn element(&mut self, declared: &'s ElementDecl, depth: usize) -> Option<Tree<'s>> {
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
            // Ingest resolves OpenDRIVE's includes, and these would name no file.
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
            return pattern.example();
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

/// Gives the attribute the value that a type alternative asks for.
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

/// Whether an assertion holds for a tree; the same rules as for documents, over other data.
fn holds(expr: &Expr, tree: &Tree<'_>) -> bool {
    match expr {
        Expr::And(parts) => parts.iter().all(|part| holds(part, tree)),
        Expr::Or(parts) => parts.iter().any(|part| holds(part, tree)),
        Expr::Not(inner) => !holds(inner, tree),
        Expr::If(parts) => holds(
            if holds(&parts[0], tree) {
                &parts[1]
            } else {
                &parts[2]
            },
            tree,
        ),
        Expr::Path(path) => !items(path, tree).is_empty(),
        Expr::Bool(value) => *value,
        Expr::Compare(relation, sides) => compare(relation.symbol(), &sides[0], &sides[1], tree),
        _ => false,
    }
}

fn compare(symbol: &str, left: &Expr, right: &Expr, tree: &Tree<'_>) -> bool {
    let count = |side: &Expr| match side {
        Expr::Number(number) => Some(*number),
        Expr::Count(path) => Some(items(path, tree).len() as f64),
        Expr::CountDistinct(path) => {
            let mut values = items(path, tree);
            values.sort();
            values.dedup();
            Some(values.len() as f64)
        }
        _ => None,
    };
    let by = |a: f64, b: f64| match symbol {
        "=" => a == b,
        "!=" => a != b,
        "<" => a < b,
        "<=" => a <= b,
        ">" => a > b,
        _ => a >= b,
    };
    match (left, right) {
        (Expr::Path(path), Expr::Text(text)) => items(path, tree)
            .iter()
            .any(|value| (*value == **text) == (symbol == "=")),
        (Expr::Path(path), Expr::Number(number)) => items(path, tree)
            .iter()
            .any(|value| value.trim().parse().is_ok_and(|value| by(value, *number))),
        _ => count(left).zip(count(right)).is_some_and(|(a, b)| by(a, b)),
    }
}

/// The attribute values (or a blank per element) a path leads to.
fn items(path: &Path, tree: &Tree<'_>) -> Vec<String> {
    let mut at = vec![tree];
    for step in &path.steps {
        let mut next = Vec::new();
        let mut open: Vec<&Tree<'_>> = at.iter().flat_map(|tree| &tree.children).collect();
        while let Some(tree) = open.pop() {
            if tree.declared.name == step.name {
                next.push(tree);
            }
            if step.deep {
                open.extend(&tree.children);
            }
        }
        at = next;
    }
    let value = |tree: &&Tree<'_>| match path.attribute {
        None => Some(String::new()),
        Some(name) => tree
            .attributes
            .iter()
            .find(|have| have.0 == name)
            .map(|have| have.2.clone()),
    };
    at.iter().filter_map(value).collect()
}

/// Makes keys unique and references lead somewhere; false if a required reference has nothing to
/// lead to.
fn settle_keys<'s>(tree: &mut Tree<'s>, schema: &'s Schema) -> bool {
    let mut settled = true;
    for child in &mut tree.children {
        settled &= settle_keys(child, schema);
    }
    let Some(constraints) = tree.declared.constraints.as_deref() else {
        return settled;
    };
    let mut next = 1_000;
    for constraint in &constraints.list {
        if !matches!(constraint.kind, ConstraintKind::Reference(_)) {
            unique(tree, constraint, &mut next, schema);
        }
    }
    for constraint in &constraints.list {
        if let ConstraintKind::Reference(to) = constraint.kind {
            settled &= refer(tree, constraint, constraints, to);
        }
    }
    settled
}

fn unique<'s>(tree: &mut Tree<'s>, constraint: &Constraint, next: &mut u32, schema: &'s Schema) {
    let mut seen = std::collections::HashSet::new();
    let key = constraint.kind == ConstraintKind::Key;
    for path in &constraint.paths {
        select(tree, path, &mut |found| {
            let Some(at) = found
                .attributes
                .iter()
                .position(|have| have.0 == constraint.field)
            else {
                if key {
                    *next += 1;
                    let name = schema.names.text(constraint.field);
                    found
                        .attributes
                        .push((constraint.field, name, next.to_string(), true));
                }
                return true;
            };
            let value = &mut found.attributes[at].2;
            if value != "0" && value.parse::<f64>().is_ok() || value.parse::<f64>().is_err() {
                *next += 1;
                *value = if value.starts_with('-') {
                    format!("-{next}")
                } else {
                    next.to_string()
                };
            }
            seen.insert(value.clone())
        });
    }
}

fn refer(tree: &mut Tree<'_>, constraint: &Constraint, all: &Constraints, to: u16) -> bool {
    let Some(key) = all.list.get(usize::from(to)) else {
        return false;
    };
    let mut values = Vec::new();
    for path in &key.paths {
        select(tree, path, &mut |found| {
            values.extend(
                found
                    .attributes
                    .iter()
                    .find(|have| have.0 == key.field)
                    .map(|have| have.2.clone()),
            );
            true
        });
    }
    let mut turn = 0;
    let mut settled = true;
    for path in &constraint.paths {
        select(tree, path, &mut |found| {
            let Some(at) = found
                .attributes
                .iter()
                .position(|have| have.0 == constraint.field)
            else {
                return true;
            };
            if values.is_empty() {
                if found.attributes[at].3 {
                    settled = false;
                    return true;
                }
                found.attributes.remove(at);
                return true;
            }
            found.attributes[at]
                .2
                .clone_from(&values[turn % values.len()]);
            turn += 1;
            true
        });
    }
    settled
}

/// Calls `keep` for the elements of a path and takes out those it does not want to keep.
fn select<'s>(tree: &mut Tree<'s>, path: &[Step], keep: &mut dyn FnMut(&mut Tree<'s>) -> bool) {
    let Some((step, rest)) = path.split_first() else {
        return;
    };
    tree.children.retain_mut(|child| {
        let fits = match step {
            Step::Any => true,
            Step::Child(name) => child.declared.name == *name,
        };
        match (fits, rest.is_empty()) {
            (false, _) => true,
            (true, true) => keep(child),
            (true, false) => {
                select(child, rest, keep);
                true
            }
        }
    });
}
