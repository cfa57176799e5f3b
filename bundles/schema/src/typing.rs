//! Which types a schema gives the elements and attributes of a document: for rules about values,
//! which go by type and not by the place of an element.

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
    /// By the node's index: the number of its complex type, or [`UNKNOWN`].
    types: Vec<u32>,
}

/// The element is not declared where it stands, or its type is no complex one.
const UNKNOWN: u32 = u32::MAX;

impl Typing {
    /// Walks the document once. Versions without a schema of their own are read by the newest before
    /// them; `None` where no schema describes such files at all.
    pub fn of(document: &Document<'_>, kind: FileKind, version: Version) -> Option<Typing> {
        let schema = select(kind, version).ok()?.schema;
        let mut types = vec![UNKNOWN; document.len() as usize];
        let root = document.root()?;
        let declared = schema.root(root.name())?;
        set(&mut types, root, complex(declared.ty));
        // Which type a name stands for depends on the type around it, and files repeat few pairs.
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

    /// The name of the element's type, `AbsoluteSpeed`; `None` where the schema declares no such
    /// element.
    pub fn class(&self, node: Node<'_>) -> Option<&'static str> {
        self.complex(node)?.name.as_deref()
    }

    /// The type of an attribute's value; `None` where the schema declares no such attribute.
    pub fn value(&self, attribute: Attribute<'_>) -> Option<ValueType> {
        value_of(self.schema, self.complex(attribute.node())?, attribute)
    }

    /// Whether an element must have the attribute.
    pub fn demands(&self, node: Node<'_>, attribute: &str) -> bool {
        let name = self.schema.names.find(attribute);
        let declared = name.zip(self.complex(node));
        declared.is_some_and(|(name, complex)| {
            let mut attributes = complex.attributes.iter();
            attributes.any(|one| one.name == name && one.required)
        })
    }

    /// The schema that gives the types.
    pub(crate) fn schema(&self) -> &'static Schema {
        self.schema
    }

    /// The number of an element's complex type, which tells the types of one schema apart.
    pub(crate) fn number(&self, node: Node<'_>) -> Option<u32> {
        Some(get(&self.types, node)).filter(|number| *number != UNKNOWN)
    }

    /// Whether the type of the element around it has this child, be it of a complex type or not.
    pub(crate) fn declares(&self, node: Node<'_>) -> bool {
        let around = node.parent().and_then(|parent| self.complex(parent));
        around.is_some_and(|around| has_child(self.schema, around, node.name()))
    }

    fn complex(&self, node: Node<'_>) -> Option<&'static ComplexType> {
        let number = get(&self.types, node);
        self.schema.complex.get(number as usize)
    }
}

/// The types that one schema gives to a few elements of a document, each found on the way down from the root.
pub(crate) struct FewTypes {
    schema: &'static Schema,
    names: NameMap,
}

impl FewTypes {
    /// `None` where no schema describes such files, or it has another root.
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

    /// As [`Typing::value`].
    pub(crate) fn value(&self, attribute: Attribute<'_>) -> Option<ValueType> {
        value_of(self.schema, self.complex(attribute.node())?, attribute)
    }

    /// As [`Typing::declares`].
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

/// What a type says of a child of this name.
fn child<'s>(schema: &'s Schema, around: u32, name: &str) -> Option<&'s ElementDecl> {
    let name = schema.names.find(name)?;
    let content: &Content = &schema.complex.get(around as usize)?.content;
    content.children().iter().find(|child| child.name == name)
}

impl ElementDecl {
    /// The type of an element: the alternative that its attributes choose, the declared one where none does.
    fn chosen(&self, node: Node<'_>, scope: &Scope<'_, '_>) -> TypeRef {
        let mut alternatives = self.alternatives.iter();
        let chosen = alternatives.find(|one| {
            let test = one.test.as_ref();
            test.is_none_or(|test| test.holds(node, scope))
        });
        chosen.map_or(self.ty, |one| one.ty)
    }
}

/// Something that a type may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Member<'a> {
    /// A child of this name.
    Child(&'a str),
    /// An attribute of this name.
    Attribute(&'a str),
    /// An attribute that may say this word.
    Word(&'a str, &'a str),
    /// An attribute that may be an expression.
    Expression(&'a str),
}

/// The first version after `version` in which the type of this name has something; `None` when it
/// never has, as far as is known.
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
    /// The schema's name for it, `Double`.
    pub fn name(&self) -> Option<&'static str> {
        self.simple.name.as_deref()
    }

    /// Whether a value may be an expression of OpenSCENARIO.
    pub fn takes_expressions(&self) -> bool {
        let Variety::Union(members) = &self.simple.variety else {
            return false;
        };
        let mut members = members
            .iter()
            .filter_map(|member| self.schema.simple.get(*member as usize));
        members.any(|member| member.name.as_deref() == Some("expression"))
    }

    /// The words that are allowed, when it is an enumeration: its own, or those of the first of its
    /// alternatives that is one.
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
