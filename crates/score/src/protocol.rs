//! The published protocol and the mark that every result carries.

/// Version of the protocol; a published version never changes.
pub const PROTOCOL_VERSION: u32 = 3;

/// The protocol's text.
pub const PROTOCOL: &str = include_str!("../PROTOCOL.md");

/// The text of version 2, as published.
pub const PROTOCOL_V2: &str = include_str!("../PROTOCOL-v2.md");

/// The text of version 1, as published.
pub const PROTOCOL_V1: &str = include_str!("../PROTOCOL-v1.md");

/// Version and first 16 hexadecimal digits of the BLAKE3 hash of [`PROTOCOL`]: `v1 0123456789abcdef`.
pub fn protocol_id() -> String {
    id(PROTOCOL_VERSION, PROTOCOL)
}

fn id(version: u32, text: &str) -> String {
    format!("v{version} {}", &blake3::hash(text.as_bytes()).to_hex().as_str()[..16])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A change of the text of a published version is refused here: publish a new version instead.
    #[test]
    fn published_text_is_unchanged() {
        assert_eq!(id(1, PROTOCOL_V1), "v1 97ed827689beb984");
        assert_eq!(id(2, PROTOCOL_V2), "v2 c2f9b1950c4a8d7b");
        assert_eq!(protocol_id(), "v3 675e4197096b8e5b");
    }

    #[test]
    fn every_metric_is_described() {
        for m in crate::METRICS.iter().chain(crate::strand_metrics()).chain(crate::motion_metrics()) {
            let stem = m.id.split('.').next().unwrap();
            assert!(PROTOCOL.contains(&format!("**{stem}")), "{} is not in the protocol", m.id);
        }
    }
}
