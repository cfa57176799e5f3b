//! The document image: one parsed file as one flat, relocatable block of bytes that any process
//! reads in place.
//!
//! The broker's ingest drives an [`ImageBuilder`] that writes directly into a loaned buffer. All
//! other code [opens](Document::open) the finished bytes as a [`Document`] and walks [`Node`]s.
//! Opening costs the same for one kilobyte and for one gigabyte, because it decodes and copies
//! nothing. Every accessor is bounds-checked. An invalid image leads to an error or to "absent",
//! never to a panic, an endless loop or undefined behaviour. [`Document::validate`] checks whether
//! the image also describes its text *correctly*.
//!
//! This crate knows neither XML syntax nor files. Ingest decides whether a file is well-formed.

mod attribute;
mod builder;
mod document;
mod fault;
mod image;
mod kind;
mod layout;
mod lines;
mod node;
mod position;
mod source;
mod validate;
mod value;
mod xpath;

pub use attribute::{Attribute, Attributes, ValueError};
pub use builder::{BuildError, Capacities, ImageBuilder};
pub use document::{Document, ImageError};
pub use fault::{Fault, FaultCode, FaultGroup};
pub use image::Image;
pub use kind::{FileKind, SUFFIXES, Suffix};
pub use node::{Ancestors, Children, ChildrenNamed, Descendants, Elements, Named, Node};
pub use position::{Position, Source};
pub use value::NumberKind;
pub use xpath::{XPathError, XPaths};
