//! A model with parts: the roads of a file.

use qcbus_document::Node;
use qcbus_sdk::{Model, Subject, Unbuilt};

/// The roads of a file. Each road is a part.
pub struct Roads<'d>(pub Vec<Node<'d>>);

impl Model for Roads<'static> {
    type Of<'d> = Roads<'d>;
    type Part = usize;

    fn build<'d>(subject: &'d Subject<'d>) -> Result<Roads<'d>, Unbuilt> {
        Ok(Roads(subject.root().elements("road").collect()))
    }

    fn parts(roads: &Roads<'_>) -> Vec<usize> {
        (0..roads.0.len()).collect()
    }
}
