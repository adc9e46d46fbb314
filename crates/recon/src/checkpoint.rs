//! What a sequence carries from frame to frame besides the frames themselves, so that it can go on later.
//!
//! Little-endian: magic `SBTRACK1`, then frame, columns, vertices, nodes and seeds (u32 each), then first, rest and
//! present places of the vertices and the nodes' maps and shifts (f64), then the seeds (f32).

use glam::{DMat3, DVec3, Vec3};

const MAGIC: &[u8; 8] = b"SBTRACK1";
const HEADER: usize = 8 + 5 * 4;

/// The template and the seeds bound to it, as they are after a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Index of the frame after which this is so.
    pub frame: u32,
    /// Vertices in a row of the template.
    pub(crate) columns: u32,
    /// Vertices in the first frame, mm.
    pub(crate) first: Vec<DVec3>,
    /// Vertices at rest, with all detail found so far, mm.
    pub(crate) rest: Vec<DVec3>,
    /// Vertices now, mm.
    pub(crate) points: Vec<DVec3>,
    /// Maps of the graph's nodes.
    pub(crate) linear: Vec<DMat3>,
    /// Shifts of the graph's nodes, mm.
    pub(crate) offset: Vec<DVec3>,
    /// Interior seeds in the first frame, mm.
    pub(crate) seeds: Vec<Vec3>,
}

impl Checkpoint {
    /// As bytes, the same on every machine.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        let counts = [self.first.len(), self.linear.len(), self.seeds.len()].map(|n| n as u32);
        for v in [self.frame, self.columns].into_iter().chain(counts) {
            out.extend(v.to_le_bytes());
        }
        for places in [&self.first, &self.rest, &self.points] {
            out.extend(places.iter().flat_map(|p| p.to_array()).flat_map(f64::to_le_bytes));
        }
        out.extend(self.linear.iter().flat_map(|m| m.to_cols_array()).flat_map(f64::to_le_bytes));
        out.extend(self.offset.iter().flat_map(|p| p.to_array()).flat_map(f64::to_le_bytes));
        out.extend(self.seeds.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes));
        out
    }

    /// From bytes, bit for bit.
    ///
    /// # Errors
    /// If they are not those of a checkpoint, are too few or too many, or hold a number that is not finite.
    pub fn from_bytes(bytes: &[u8]) -> Result<Checkpoint, String> {
        let (Some(head), true) = (bytes.get(..HEADER), bytes.starts_with(MAGIC)) else {
            return Err("this is not a sequence's checkpoint".into());
        };
        let word = |i: usize| u32::from_le_bytes(head[8 + 4 * i..12 + 4 * i].try_into().expect("four bytes"));
        let [frame, columns, vertices, nodes, seeds] = [0, 1, 2, 3, 4].map(word);
        // In 128 bits nothing overflows; counts are believed only if the bytes are as many as they say.
        let size = |n: u32, each: u128| u128::from(n) * each;
        let wanted = HEADER as u128 + size(vertices, 72) + size(nodes, 96) + size(seeds, 12);
        if bytes.len() as u128 != wanted {
            return Err(format!("{} bytes where {wanted} are announced", bytes.len()));
        }
        if columns < 2 || vertices % columns != 0 || vertices / columns < 2 {
            return Err(format!("{vertices} vertices are no sheet of {columns} columns"));
        }
        let numbers = (3 * 3 * vertices as usize) + 12 * nodes as usize;
        let (doubles, floats) = bytes[HEADER..].split_at(8 * numbers);
        let doubles: Vec<f64> =
            doubles.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect();
        let floats: Vec<f32> =
            floats.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("four bytes"))).collect();
        if !doubles.iter().all(|v| v.is_finite()) || !floats.iter().all(|v| v.is_finite()) {
            return Err("a number is not finite".into());
        }
        let (vertices, nodes) = (3 * vertices as usize, 9 * nodes as usize);
        let (first, rest_of) = doubles.split_at(vertices);
        let (rest, rest_of) = rest_of.split_at(vertices);
        let (points, rest_of) = rest_of.split_at(vertices);
        let (linear, offset) = rest_of.split_at(nodes);
        let places = |v: &[f64]| v.chunks_exact(3).map(DVec3::from_slice).collect();
        Ok(Checkpoint {
            frame,
            columns,
            first: places(first),
            rest: places(rest),
            points: places(points),
            linear: linear.chunks_exact(9).map(DMat3::from_cols_slice).collect(),
            offset: places(offset),
            seeds: floats.chunks_exact(3).map(Vec3::from_slice).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> Checkpoint {
        let places = |k: f64| (0..6).map(|i| DVec3::new(f64::from(i), k, -k)).collect::<Vec<_>>();
        Checkpoint {
            frame: 7,
            columns: 3,
            first: places(0.1),
            rest: places(0.2),
            points: places(0.3),
            linear: vec![DMat3::from_rotation_x(0.3), DMat3::IDENTITY],
            offset: vec![DVec3::X, DVec3::NEG_Y],
            seeds: vec![Vec3::new(1.0, 2.0, 3.0)],
        }
    }

    #[test]
    fn bytes_come_back() {
        let c = some();
        assert_eq!(Checkpoint::from_bytes(&c.to_bytes()).unwrap(), c);
    }

    #[test]
    fn every_truncation_and_every_lie_is_an_error() {
        let good = some().to_bytes();
        for n in 0..good.len() {
            assert!(Checkpoint::from_bytes(&good[..n]).is_err(), "{n} bytes");
        }
        let with = |at: usize, bytes: &[u8]| {
            let mut b = good.clone();
            b[at..at + bytes.len()].copy_from_slice(bytes);
            Checkpoint::from_bytes(&b).unwrap_err()
        };
        assert!(with(0, b"X").contains("not a sequence's"));
        assert!(with(12, &[4]).contains("no sheet of 4 columns"));
        assert!(with(12, &[0]).contains("no sheet of 0 columns"));
        for count in [16, 20, 24] {
            assert!(with(count, &[0xff; 4]).contains("are announced"));
        }
        assert!(with(HEADER, &f64::NAN.to_le_bytes()).contains("not finite"));
        let end = good.len() - 4;
        assert!(with(end, &f32::INFINITY.to_le_bytes()).contains("not finite"));
    }

    proptest::proptest! {
        #[test]
        fn any_bytes_are_an_answer(
            noise in proptest::collection::vec(proptest::num::u8::ANY, 1..64),
            at in 0usize..400,
        ) {
            let mut bytes = some().to_bytes();
            for (k, b) in noise.iter().enumerate() {
                let i = (at + 13 * k) % bytes.len();
                bytes[i] ^= b;
            }
            if let Ok(c) = Checkpoint::from_bytes(&bytes) {
                assert_eq!(c.to_bytes(), bytes);
            }
        }
    }
}
