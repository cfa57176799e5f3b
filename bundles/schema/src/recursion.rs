//! Detection of conditions over all descendants (`//`) of elements that can contain themselves.
//! Each nesting level would walk all descendants again, so validation would not be linear. Such
//! schemas are rejected.

use std::collections::BTreeSet;

use crate::assertion::Assertion;
use crate::model::{ComplexType, Schema, TypeRef};

impl Schema {
    /// Returns the number of a type with such a condition, if there is one.
    pub(crate) fn endless_condition(&self) -> Option<u32> {
        let deep = |ty: &ComplexType| ty.assertions.iter().any(Assertion::is_deep);
        let numbered = (0u32..).zip(&self.complex);
        let mut candidates = numbered.filter(|(_, ty)| deep(ty)).map(|(id, _)| id);
        candidates.find(|id| self.contains_itself(*id))
    }

    fn contains_itself(&self, id: u32) -> bool {
        let (mut known, mut open) = (BTreeSet::new(), vec![id]);
        while let Some(at) = open.pop() {
            let Some(ty) = self.complex.get(at as usize) else {
                continue;
            };
            for child in ty.content.children() {
                let alternatives = child.alternatives.iter().map(|one| one.ty);
                for ty in alternatives.chain([child.ty]) {
                    let TypeRef::Complex(inner) = ty else {
                        continue;
                    };
                    for inner in self.with_derived(inner) {
                        if inner == id {
                            return true;
                        }
                        if known.insert(inner) {
                            open.push(inner);
                        }
                    }
                }
            }
        }
        false
    }

    /// Returns a type and all types that `xsi:type` may select in its place.
    fn with_derived(&self, id: u32) -> Vec<u32> {
        let numbered = (0u32..).zip(&self.complex);
        let derived = numbered
            .filter(|(_, ty)| ty.base == Some(id))
            .map(|(id, _)| id);
        let mut all = vec![id];
        let mut from_here: Vec<u32> = derived.collect();
        while let Some(one) = from_here.pop() {
            if all.contains(&one) {
                continue;
            }
            all.push(one);
            let further = (0u32..).zip(&self.complex);
            from_here.extend(
                further
                    .filter(|(_, ty)| ty.base == Some(one))
                    .map(|(id, _)| id),
            );
        }
        all
    }
}
