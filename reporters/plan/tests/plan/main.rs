//! Tests of the plan of a map.

mod support;

mod drawing;
mod hostile;
mod locating;
mod real_maps;
