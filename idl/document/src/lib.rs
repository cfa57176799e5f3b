//! The document image: one parsed file as one flat, relocatable block of bytes that any process
//! reads in place.
//!
//! The broker's ingest drives an [`ImageBuilder`] that writes straight into a loaned buffer;
//! everybody else [opens](Document::open) the finished bytes as a [`Document`] and walks
//! [`Node`]s. Opening costs the same for one kilobyte and for one gigabyte: nothing is decoded,
//! nothing is copied. Every accessor is bounds-checked: bytes that are no sound image lead to an
//! error or to "absent", never to a panic, an endless loop or undefined behaviour. Whether they
//! also tell the *truth* about the text they carry is what [`Document::validate`] answers.
//!
//! This crate knows neither XML syntax nor files: what is well-formed is ingest's knowledge.

mod attribute;
mod builder;
mod document;
mod fault;
#[doc(hidden)]
pub mod fuzzing;
mod image;
mod kind;
mod layout;
mod lines;
mod node;
mod source;
mod validate;
mod value;
mod xpath;

pub use attribute::{Attribute, Attributes};
pub use builder::{BuildError, Capacities, ImageBuilder};
pub use document::{Document, Elements, ImageError};
pub use fault::{Fault, FaultCode, FaultGroup};
pub use image::Image;
pub use kind::{FileKind, SUFFIXES, Suffix};
pub use node::{Ancestors, Children, ChildrenNamed, Descendants, DescendantsNamed, Named, Node};
pub use source::{Position, Source};
pub use value::{NumberKind, ValueError};
pub use xpath::{XPathError, XPaths};
