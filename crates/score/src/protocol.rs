//! The published protocol and the mark that every result carries.

/// Version of the protocol; a published version never changes.
pub const PROTOCOL_VERSION: u32 = 1;

/// The protocol's text.
pub const PROTOCOL: &str = include_str!("../PROTOCOL.md");

/// Version and first 16 hexadecimal digits of the BLAKE3 hash of [`PROTOCOL`]: `v1 0123456789abcdef`.
pub fn protocol_id() -> String {
    let hash = blake3::hash(PROTOCOL.as_bytes()).to_hex();
    format!("v{PROTOCOL_VERSION} {}", &hash.as_str()[..16])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A change of the text of a published version is refused here: publish a new version instead.
    #[test]
    fn published_text_is_unchanged() {
        assert_eq!(protocol_id(), "v1 97ed827689beb984");
    }

    #[test]
    fn every_metric_is_described() {
        for m in crate::METRICS {
            let stem = m.id.split('.').next().unwrap();
            assert!(PROTOCOL.contains(&format!("**{stem}")), "{} is not in the protocol", m.id);
        }
    }
}
