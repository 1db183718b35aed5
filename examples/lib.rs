//! Lessons, one a file: `cargo run --release -p squirrel-examples --example NAME`.
