//! Cost of one evaluation of the equations.
fn main() {}
