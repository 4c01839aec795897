//! rangecam
fn main() {}
