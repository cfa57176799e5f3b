//! The macro behind the thin views: a node with one accessor per attribute.

/// Declares a view over an element: a `Copy` struct around its node, and one documented accessor
/// per attribute that reads it when asked. What is written after the colon is the reader (see
/// the `value` module), what follows it the attribute's name.
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
            /// The view over `node`, whatever element that is.
            pub fn of(node: qcbus_document::Node<'a>) -> $view<'a> {
                $view { node }
            }

            /// The element itself.
            pub fn node(&self) -> qcbus_document::Node<'a> {
                self.node
            }

            $(
                $(#[$doc])*
                pub fn $method(&self) -> $crate::view::reading!($reader) {
                    $crate::value::$reader(self.node, $attribute)
                }
            )*
        }
    };
}

/// What a reader returns.
macro_rules! reading {
    (text) => { Option<&'a str> };
    (number) => { Option<f64> };
    (integer) => { Option<i64> };
    (flag) => { Option<bool> };
    (contact) => { Option<$crate::value::ContactPoint> };
    (direction) => { Option<$crate::value::Direction> };
    (layer) => { $crate::value::LayerKind };
}

/// Declares a method that lists children of one name as views.
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

pub(crate) use {children, reading, view};
