//! The glove-driven deformation loop.
fn main() {}
