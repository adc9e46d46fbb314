//! A cursor over bytes that checks every claim against what is there, before anything is allocated.

use crate::error::{FormatError, Parsed};
use glam::Vec3;

const TRUNCATED: &str = "the file is truncated or its header is wrong: fetch or export it again";

pub(crate) struct Cursor<'a> {
    data: &'a [u8],
    pos: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(data: &'a [u8]) -> Cursor<'a> {
        Cursor { data, pos: 0 }
    }

    pub fn pos(&self) -> usize {
        self.pos
    }

    pub fn remaining(&self) -> usize {
        self.data.len() - self.pos
    }

    pub fn seek(&mut self, pos: usize, what: &str) -> Parsed<()> {
        if pos > self.data.len() {
            return Err(FormatError::at_byte(
                pos,
                format!("{what} would start there but the file has {} bytes", self.data.len()),
                TRUNCATED,
            ));
        }
        self.pos = pos;
        Ok(())
    }

    /// `count` items of `size` bytes; the product may exceed any integer without harm.
    pub fn take(&mut self, count: u64, size: usize, what: &str) -> Parsed<&'a [u8]> {
        let want = u128::from(count) * size as u128;
        if want > self.remaining() as u128 {
            return Err(FormatError::at_byte(
                self.pos,
                format!("{what} needs {want} bytes but {} remain", self.remaining()),
                TRUNCATED,
            ));
        }
        let out = &self.data[self.pos..self.pos + want as usize];
        self.pos += out.len();
        Ok(out)
    }

    pub fn u32(&mut self, what: &str) -> Parsed<u32> {
        let b = self.take(1, 4, what)?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }

    pub fn f32(&mut self, what: &str) -> Parsed<f32> {
        Ok(f32::from_bits(self.u32(what)?))
    }

    pub fn u16s(&mut self, count: u64, what: &str) -> Parsed<Vec<u16>> {
        Ok(self.take(count, 2, what)?.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect())
    }

    pub fn u32s(&mut self, count: u64, what: &str) -> Parsed<Vec<u32>> {
        Ok(self.take(count, 4, what)?.chunks_exact(4).map(le_u32).collect())
    }

    pub fn f32s(&mut self, count: u64, what: &str) -> Parsed<Vec<f32>> {
        Ok(self.take(count, 4, what)?.chunks_exact(4).map(le_f32).collect())
    }

    /// Appends `count` points of `stride` floats each, of which the first three count.
    pub fn points(&mut self, count: u64, stride: usize, what: &str, out: &mut Vec<Vec3>) -> Parsed<()> {
        let bytes = self.take(count, 4 * stride, what)?;
        out.extend(
            bytes.chunks_exact(4 * stride).map(|b| Vec3::new(le_f32(b), le_f32(&b[4..]), le_f32(&b[8..]))),
        );
        Ok(())
    }
}

fn le_u32(b: &[u8]) -> u32 {
    u32::from_le_bytes([b[0], b[1], b[2], b[3]])
}

fn le_f32(b: &[u8]) -> f32 {
    f32::from_bits(le_u32(b))
}
