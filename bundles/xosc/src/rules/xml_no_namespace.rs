use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    let Some(root) = document.root() else { return };
    if named(root, found) {
        return;
    }
    let mut open: Vec<Node<'_>> = root.children().collect();
    while let Some(node) = open.pop() {
        // One finding for an element and all elements in it.
        if named(node, found) {
            return;
        }
        open.extend(node.children());
    }
}

/// Reports an element whose name has a namespace. Returns whether it has one.
fn named(node: Node<'_>, found: &mut Sink<'_>) -> bool {
    let (prefix, name) = (node.prefix(), node.name());
    let text = if !prefix.is_empty() {
        format!(
            "the element is named `{prefix}:{name}`, but OpenSCENARIO has no namespace: readers look for `{name}` \
             and do not find it; remove the prefix"
        )
    } else if let Some(namespace) = node.attr("xmlns").filter(|it| !it.trim().is_empty()) {
        format!(
            "the namespace `{namespace}` applies to <{name}> and all elements in it, but OpenSCENARIO has no \
             namespace: readers that know namespaces do not find the elements; remove `xmlns`"
        )
    } else {
        return false;
    };
    found.issue(node, text);
    true
}
