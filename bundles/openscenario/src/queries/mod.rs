//! The scenario and its elements, and everything that needs the whole scenario.

pub(crate) mod actors;
pub(crate) mod element;
pub(crate) mod entities;
pub(crate) mod expressions;
pub(crate) mod faults;
pub(crate) mod init;
pub(crate) mod network;
pub(crate) mod references;
pub(crate) mod scenario;
pub(crate) mod storyboard;
