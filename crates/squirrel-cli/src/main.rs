//! The binary `squirrel`.
fn main() {}
