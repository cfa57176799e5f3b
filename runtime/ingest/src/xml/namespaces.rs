//! Which prefixes are bound where. Rules match local names and never look; but a prefix that
//! nothing binds is an error to every other reader of the file.

use std::collections::HashMap;

/// The prefixes in force, with how many open elements bind each.
#[derive(Default)]
pub(crate) struct Prefixes<'t> {
    bound: HashMap<&'t str, u32>,
    order: Vec<&'t str>,
}

impl<'t> Prefixes<'t> {
    /// Takes note of an attribute when it is `xmlns:prefix`; says whether it is one.
    pub fn declare(&mut self, attribute: &'t str) -> bool {
        let Some(prefix) = attribute.strip_prefix("xmlns:") else {
            return false;
        };
        *self.bound.entry(prefix).or_insert(0) += 1;
        self.order.push(prefix);
        true
    }

    /// How many bindings are in force; given back to [`Prefixes::forget`] at the element's end.
    pub fn mark(&self) -> usize {
        self.order.len()
    }

    /// Ends every binding made after `mark`.
    #[inline]
    pub fn forget(&mut self, mark: usize) {
        while self.order.len() > mark {
            let Some(prefix) = self.order.pop() else {
                return;
            };
            if let Some(count) = self.bound.get_mut(prefix) {
                *count = count.saturating_sub(1);
            }
        }
    }

    /// The prefix of a name when nothing binds it.
    pub fn unbound<'n>(&self, name: &'n str) -> Option<&'n str> {
        let (prefix, _) = name.split_once(':')?;
        let known = matches!(prefix, "xml" | "xmlns")
            || self.bound.get(prefix).is_some_and(|&count| count > 0);
        (!known).then_some(prefix)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bindings_end_with_their_element() {
        let mut prefixes = Prefixes::default();
        assert_eq!(prefixes.unbound("x:a"), Some("x"));
        assert!(prefixes.declare("xmlns:x"));
        assert!(!prefixes.declare("xmlns"));
        let mark = prefixes.mark();
        assert!(prefixes.declare("xmlns:x"));
        prefixes.forget(mark);
        assert_eq!(prefixes.unbound("x:a"), None);
        prefixes.forget(0);
        assert_eq!(prefixes.unbound("x:a"), Some("x"));
        assert_eq!(prefixes.unbound("xml:space"), None);
        assert_eq!(prefixes.unbound("a"), None);
    }
}
