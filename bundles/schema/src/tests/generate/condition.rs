//! Evaluation of schema conditions for generated documents.

use super::Tree;
use crate::assertion::{Expr, Path};

/// Checks whether an assertion holds for a tree. The rules are the same as for documents.
pub(super) fn holds(expr: &Expr, tree: &Tree<'_>) -> bool {
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

/// Returns the attribute values that a path selects, or a blank for each selected element.
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
