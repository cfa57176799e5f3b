//! Types that a schema gives to the elements and attributes of a document. Rules about values use
//! the type and not the place of an element.

use foldhash::HashMap;
use qcbus_document::{Attribute, Document, FileKind, Node};

use crate::assertion::Scope;
use crate::model::{ComplexType, Content, ElementDecl, Schema, TypeRef};
use crate::simple::{SimpleType, Variety};
use crate::validate::NameMap;
use crate::versions::{SHIPPED, Version, select};

/// The complex type of every element of one document.
#[derive(Debug, Clone)]
pub struct Typing {
    schema: &'static Schema,
    /// Number of the complex type for each node index, or [`UNKNOWN`].
    types: Vec<u32>,
}

/// The element is not declared at its place, or its type is not complex.
const UNKNOWN: u32 = u32::MAX;

impl Typing {
    /// Walks the document once and returns its types. A version without a schema uses the newest
    /// earlier schema. Returns `None` if no schema exists for such files.
    pub fn of(document: &Document<'_>, kind: FileKind, version: Version) -> Option<Typing> {
        let schema = select(kind, version).ok()?.schema;
        let mut types = vec![UNKNOWN; document.len() as usize];
        let root = document.root()?;
        let declared = schema.root(root.name())?;
        set(&mut types, root, complex(declared.ty));
        // The type of a name depends on the enclosing type. Files have few distinct pairs of them.
        let mut known: HashMap<(u32, u16), Option<&ElementDecl>> = HashMap::default();
        let names = NameMap::new(document, schema);
        let scope = Scope {
            document: *document,
            names: names.ids(),
        };
        for node in root.descendants() {
            let around = node.parent().map_or(UNKNOWN, |parent| get(&types, parent));
            if around == UNKNOWN {
                continue;
            }
            let found = *known
                .entry((around, node.name_number()))
                .or_insert_with(|| child(schema, around, node.name()));
            let found = found.map_or(UNKNOWN, |declared| complex(declared.chosen(node, &scope)));
            set(&mut types, node, found);
        }
        Some(Typing { schema, types })
    }

    /// Returns the name of the element's type, such as `AbsoluteSpeed`, or `None` if the schema
    /// does not declare the element.
    pub fn class(&self, node: Node<'_>) -> Option<&'static str> {
        self.complex(node)?.name.as_deref()
    }

    /// Returns the type of an attribute's value, or `None` if the attribute is not declared.
    pub fn value(&self, attribute: Attribute<'_>) -> Option<ValueType> {
        value_of(self.schema, self.complex(attribute.node())?, attribute)
    }

    /// Checks whether an element must have the attribute.
    pub fn demands(&self, node: Node<'_>, attribute: &str) -> bool {
        let name = self.schema.names.find(attribute);
        let declared = name.zip(self.complex(node));
        declared.is_some_and(|(name, complex)| {
            let mut attributes = complex.attributes.iter();
            attributes.any(|one| one.name == name && one.required)
        })
    }

    /// Returns the schema that defines the types.
    pub(crate) fn schema(&self) -> &'static Schema {
        self.schema
    }

    /// Returns the number of an element's complex type. It is unique in one schema.
    pub(crate) fn number(&self, node: Node<'_>) -> Option<u32> {
        Some(get(&self.types, node)).filter(|number| *number != UNKNOWN)
    }

    /// Checks whether the type of the parent element declares this child, with any kind of type.
    pub(crate) fn declares(&self, node: Node<'_>) -> bool {
        let around = node.parent().and_then(|parent| self.complex(parent));
        around.is_some_and(|around| has_child(self.schema, around, node.name()))
    }

    fn complex(&self, node: Node<'_>) -> Option<&'static ComplexType> {
        let number = get(&self.types, node);
        self.schema.complex.get(number as usize)
    }
}

/// Types that one schema gives to single elements of a document. Each is found on the path from the
/// root.
pub(crate) struct FewTypes {
    schema: &'static Schema,
    names: NameMap,
}

impl FewTypes {
    /// Returns `None` if no schema exists for such files, or if the document has another root.
    pub(crate) fn of(
        document: &Document<'_>,
        kind: FileKind,
        version: Version,
    ) -> Option<FewTypes> {
        let schema = select(kind, version).ok()?.schema;
        schema.root(document.root()?.name())?;
        let names = NameMap::new(document, schema);
        Some(FewTypes { schema, names })
    }

    /// Works like [`Typing::value`].
    pub(crate) fn value(&self, attribute: Attribute<'_>) -> Option<ValueType> {
        value_of(self.schema, self.complex(attribute.node())?, attribute)
    }

    /// Works like [`Typing::declares`].
    pub(crate) fn declares(&self, node: Node<'_>) -> bool {
        let around = node.parent().and_then(|parent| self.complex(parent));
        around.is_some_and(|around| has_child(self.schema, around, node.name()))
    }

    fn complex(&self, node: Node<'_>) -> Option<&'static ComplexType> {
        let mut way: Vec<Node<'_>> = std::iter::once(node).chain(node.ancestors()).collect();
        let mut number = complex(self.schema.root(way.pop()?.name())?.ty);
        let scope = Scope {
            document: node.document(),
            names: self.names.ids(),
        };
        while let Some(next) = way.pop().filter(|_| number != UNKNOWN) {
            let declared = child(self.schema, number, next.name());
            number = declared.map_or(UNKNOWN, |declared| complex(declared.chosen(next, &scope)));
        }
        self.schema.complex.get(number as usize)
    }
}

fn value_of(
    schema: &'static Schema,
    complex: &'static ComplexType,
    attribute: Attribute<'_>,
) -> Option<ValueType> {
    let name = schema.names.find(attribute.name())?;
    let declared = complex.attributes.iter().find(|one| one.name == name)?;
    let simple = schema.simple.get(declared.value as usize)?;
    Some(ValueType { schema, simple })
}

fn has_child(schema: &Schema, around: &ComplexType, name: &str) -> bool {
    let name = schema.names.find(name);
    let mut children = around.content.children().iter();
    name.is_some_and(|name| children.any(|child| child.name == name))
}

fn get(types: &[u32], node: Node<'_>) -> u32 {
    types.get(node.index() as usize).copied().unwrap_or(UNKNOWN)
}

fn set(types: &mut [u32], node: Node<'_>, found: u32) {
    if let Some(slot) = types.get_mut(node.index() as usize) {
        *slot = found;
    }
}

fn complex(ty: TypeRef) -> u32 {
    match ty {
        TypeRef::Complex(number) => number,
        TypeRef::Any | TypeRef::Simple(_) => UNKNOWN,
    }
}

/// Returns a type's declaration of the child with this name.
fn child<'s>(schema: &'s Schema, around: u32, name: &str) -> Option<&'s ElementDecl> {
    let name = schema.names.find(name)?;
    let content: &Content = &schema.complex.get(around as usize)?.content;
    content.children().iter().find(|child| child.name == name)
}

impl ElementDecl {
    /// Returns the type of an element: the alternative chosen by its attributes, otherwise the
    /// declared type.
    fn chosen(&self, node: Node<'_>, scope: &Scope<'_, '_>) -> TypeRef {
        let mut alternatives = self.alternatives.iter();
        let chosen = alternatives.find(|one| {
            let test = one.test.as_ref();
            test.is_none_or(|test| test.holds(node, scope))
        });
        chosen.map_or(self.ty, |one| one.ty)
    }
}

/// A possible member of a type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Member<'a> {
    /// A child of this name.
    Child(&'a str),
    /// An attribute of this name.
    Attribute(&'a str),
    /// An attribute that allows this word.
    Word(&'a str, &'a str),
    /// An attribute that may be an expression.
    Expression(&'a str),
}

/// Returns the first version after `version` in which the type of this name has a member. Returns
/// `None` if no known version has it.
pub fn came_with(
    kind: FileKind,
    version: Version,
    class: &str,
    member: Member<'_>,
) -> Option<Version> {
    let later = SHIPPED
        .iter()
        .filter(|one| one.kind == kind && one.version > version);
    let mut having = later.filter(|one| {
        one.schema()
            .is_ok_and(|schema| has(schema, class, member).unwrap_or(false))
    });
    having.next().map(|one| one.version)
}

fn has(schema: &'static Schema, class: &str, member: Member<'_>) -> Option<bool> {
    let mut types = schema.complex.iter();
    let complex = types.find(|complex| complex.name.as_deref() == Some(class))?;
    let attribute = |name: &str| {
        let name = schema.names.find(name)?;
        complex.attributes.iter().find(|one| one.name == name)
    };
    Some(match member {
        Member::Child(name) => {
            let name = schema.names.find(name)?;
            let mut children = complex.content.children().iter();
            children.any(|child| child.name == name)
        }
        Member::Attribute(name) => attribute(name).is_some(),
        Member::Word(name, word) => {
            let simple = schema.simple.get(attribute(name)?.value as usize)?;
            let words = ValueType { schema, simple }.words()?;
            words.iter().any(|one| **one == *word)
        }
        Member::Expression(name) => {
            let simple = schema.simple.get(attribute(name)?.value as usize)?;
            ValueType { schema, simple }.takes_expressions()
        }
    })
}

/// The type of an attribute's value.
#[derive(Debug, Clone, Copy)]
pub struct ValueType {
    schema: &'static Schema,
    simple: &'static SimpleType,
}

impl ValueType {
    /// Returns the name of the type in the schema, such as `Double`.
    pub fn name(&self) -> Option<&'static str> {
        self.simple.name.as_deref()
    }

    /// Checks whether a value may be an expression of OpenSCENARIO.
    pub fn takes_expressions(&self) -> bool {
        let Variety::Union(members) = &self.simple.variety else {
            return false;
        };
        let mut members = members
            .iter()
            .filter_map(|member| self.schema.simple.get(*member as usize));
        members.any(|member| member.name.as_deref() == Some("expression"))
    }

    /// Returns the allowed words of an enumeration. A union uses the first of its members that is
    /// an enumeration.
    pub fn words(&self) -> Option<&'static [Box<str>]> {
        let own = self.simple.facets.enumeration.as_deref();
        own.or_else(|| match &self.simple.variety {
            Variety::Union(members) => members.iter().find_map(|member| {
                let member = self.schema.simple.get(*member as usize)?;
                member.facets.enumeration.as_deref()
            }),
            Variety::Atomic(_) | Variety::List(_) => None,
        })
    }
}
