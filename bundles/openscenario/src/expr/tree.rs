//! Syntax tree of an expression.

use super::Value;
use super::arithmetic::{OfOne, OfTwo};
use super::words::{Function, Operator};

/// An expression or a part of one.
pub(super) struct Node<'t> {
    /// Start: byte offset into the text.
    pub at: usize,
    pub kind: NodeKind<'t>,
}

pub(super) enum NodeKind<'t> {
    /// A number as written, valid by the grammar.
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
    /// Operands joined by operators of one precedence, evaluated from left to right. The list keeps
    /// `1+1+1+…` flat, however long it is.
    Chain(Box<Node<'t>>, Vec<Link<'t>>),
    /// A function of one argument.
    Call1(&'static Function, OfOne, Box<Node<'t>>),
    /// A function of two arguments.
    Call2(&'static Function, OfTwo, Box<[Node<'t>; 2]>),
}

/// An operator and its right operand.
pub(super) struct Link<'t> {
    /// Position of the operator.
    pub at: usize,
    pub operator: &'static Operator,
    pub operand: Node<'t>,
}
