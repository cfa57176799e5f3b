//! Documents generated from tables. Each one is valid, and together they use every construct.
//!
//! They are for property tests, and they are base documents for comparisons with other validators.

mod condition;
mod costs;
mod dice;
mod element;
mod keys;

use std::fmt::Write;

use crate::model::{ElementDecl, Schema};
use crate::names::NameId;
use costs::Costs;
pub use dice::Dice;
use element::Generator;

/// Generates a document that is valid against `schema`, with about `size` elements. Returns `None`
/// if the generator finds no valid document.
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
    if !keys::settle(&mut tree, schema) {
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
