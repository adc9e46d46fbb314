//! Placeholder.
/// Entry point.
pub fn main() {}
