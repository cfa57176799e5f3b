//! Tracks which namespace prefixes are bound. Rules match local names and ignore prefixes. An
//! unbound prefix is an error for every other reader of the file.

use std::collections::HashMap;

/// Bound prefixes, with the number of open elements that bind each.
#[derive(Default)]
pub(crate) struct Prefixes<'t> {
    bound: HashMap<&'t str, u32>,
    order: Vec<&'t str>,
}

impl<'t> Prefixes<'t> {
    /// Records an attribute if it is `xmlns:prefix`. Returns whether it is one.
    pub fn declare(&mut self, attribute: &'t str) -> bool {
        let Some(prefix) = attribute.strip_prefix("xmlns:") else {
            return false;
        };
        *self.bound.entry(prefix).or_insert(0) += 1;
        self.order.push(prefix);
        true
    }

    /// Returns the number of active bindings, for [`Prefixes::forget`] at the end of the element.
    pub fn mark(&self) -> usize {
        self.order.len()
    }

    /// Removes every binding made after `mark`.
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

    /// Returns the prefix of a name if it is not bound.
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
    fn namespace_bindings_end_with_their_element() {
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
