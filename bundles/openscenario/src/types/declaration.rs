//! Declared parameters.

use qcbus_document::Node;

use crate::expr::{self, Operand};
use crate::types::data_type::{DataType, Value};

/// A declared parameter.
#[derive(Debug, Clone)]
pub struct Declaration<'d> {
    /// The `ParameterDeclaration`.
    pub node: Node<'d>,
    /// Its name, without the `$` that old files write before it.
    pub name: &'d str,
    /// Its type, or `None` if `parameterType` is missing or no type.
    pub data_type: Option<DataType>,
    /// Its value.
    pub declared: Declared<'d>,
}

/// Result of a declaration.
#[derive(Debug, Clone, PartialEq)]
pub enum Declared<'d> {
    /// A value of its type.
    Value(Value<'d>),
    /// No usable value. The reason is reported at the declaration.
    Faulty,
}

/// Kind of a declaration, named by its element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Declares {
    /// `ParameterDeclaration`
    Parameter,
    /// `VariableDeclaration`
    Variable,
    /// `MonitorDeclaration`
    Monitor,
}

/// Returns the meaning of a declaration in an expression.
pub(crate) fn operand(declaration: Option<&Declaration<'_>>) -> Operand {
    let Some(declaration) = declaration else {
        return Operand::Undeclared;
    };
    match (&declaration.declared, declaration.data_type) {
        (Declared::Faulty, _) => Operand::Unresolved,
        (Declared::Value(Value::Integer(value)), _) => Operand::Value(expr::Value::Integer(*value)),
        (Declared::Value(Value::Double(value)), _) => Operand::Value(expr::Value::Double(*value)),
        (Declared::Value(Value::Boolean(value)), _) => Operand::Value(expr::Value::Boolean(*value)),
        (Declared::Value(Value::Text(_)), Some(DataType::DateTime)) => Operand::Text("dateTime"),
        (Declared::Value(Value::Text(_)), _) => Operand::Text("string"),
    }
}
