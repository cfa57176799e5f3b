//! The macro behind the thin views: a node with one accessor per attribute.

use qcbus_document::Node;

/// Declares a view over an element. The view is a `Copy` struct around the node. It has one
/// documented accessor per attribute, which reads the attribute on each call. The reader (see the
/// `value` module) follows the colon, then the attribute's name.
macro_rules! view {
    (
        $(#[$about:meta])*
        $view:ident {
            $( $(#[$doc:meta])* $method:ident: $reader:ident $attribute:literal, )*
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $view<'a> {
            node: qcbus_document::Node<'a>,
        }

        impl<'a> $view<'a> {
            /// Creates the view over `node`, regardless of the element.
            pub fn of(node: qcbus_document::Node<'a>) -> $view<'a> {
                $view { node }
            }

            /// Returns the element itself.
            pub fn node(&self) -> qcbus_document::Node<'a> {
                self.node
            }

            $(
                $(#[$doc])*
                pub fn $method(&self) -> $crate::types::view::reading!($reader) {
                    $crate::types::value::$reader(self.node, $attribute)
                }
            )*
        }
    };
}

/// Return type of a reader.
macro_rules! reading {
    (text) => { Option<&'a str> };
    (number) => { Option<f64> };
    (integer) => { Option<i64> };
    (flag) => { Option<bool> };
    (contact) => { Option<$crate::types::value::ContactPoint> };
    (layer) => { $crate::types::value::LayerKind };
}

/// Declares a method that returns the children with one name as views.
macro_rules! children {
    ( $( $(#[$doc:meta])* $method:ident: $view:ident $element:literal, )* ) => {
        $(
            $(#[$doc])*
            pub fn $method(&self) -> impl Iterator<Item = $view<'a>> + use<'a> {
                self.node.children_named($element).map($view::of)
            }
        )*
    };
}

/// Returns the children with a name of a list element, if the list exists.
pub(crate) fn listed<'a>(
    list: Option<Node<'a>>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a>> + use<'a> {
    list.into_iter()
        .flat_map(move |list| list.children_named(name))
}

pub(crate) use {children, reading, view};
