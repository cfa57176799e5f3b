//! What the parser makes of an expression.

use super::Value;
use super::arithmetic::{OfOne, OfTwo};
use super::words::{Function, Operator};

/// An expression or a part of one.
pub(super) struct Node<'t> {
    /// Where it begins: byte offset into the text.
    pub at: usize,
    pub kind: NodeKind<'t>,
}

pub(super) enum NodeKind<'t> {
    /// A number as written, in agreement with the grammar.
    Number(&'t str),
    /// `true`, `false`.
    Constant(Value),
    /// `pi`
    Pi,
    /// A parameter's name without its `$`.
    Parameter(&'t str),
    /// `-` before its operand.
    Minus(Box<Node<'t>>),
    /// `not` before its operand.
    Not(Box<Node<'t>>),
    /// Operands joined by operators of one precedence, to be taken from left to right. As a list
    /// `1+1+1+…` is not deep, however long.
    Chain(Box<Node<'t>>, Vec<Link<'t>>),
    /// A function of one argument.
    Call1(&'static Function, OfOne, Box<Node<'t>>),
    /// A function of two arguments.
    Call2(&'static Function, OfTwo, Box<[Node<'t>; 2]>),
}

/// An operator and what follows it.
pub(super) struct Link<'t> {
    /// Where the operator stands.
    pub at: usize,
    pub operator: &'static Operator,
    pub operand: Node<'t>,
}
