//! NumPy arrays: one in a `.npy` file, several by name in a `.npz` file.

use crate::atomic::atomic_write;
use crate::error::{FormatError, IoError, Parsed, Result};
use crate::read::read_all;
use std::collections::BTreeMap;
use std::io::{Cursor, Read as _};
use std::path::{Path, PathBuf};

/// Bytes that a byte of an archive can unfold to (deflate's limit).
const MAX_UNFOLDING: u64 = 1033;

const REMEDY: &str = "save a float32 array with numpy.save";

pub(crate) fn fault(problem: String) -> FormatError {
    FormatError::new("header", problem, REMEDY)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Floats of so many bytes.
    Float(usize),
    /// Texts of so many characters of four bytes.
    Text(usize),
    /// Unsigned integers of 32 bits.
    Index,
}

/// An array of format 1 to 3, as its bytes stand in the file.
pub(crate) struct Array<'a> {
    kind: Kind,
    big_endian: bool,
    by_column: bool,
    pub shape: Vec<usize>,
    body: &'a [u8],
}

impl<'a> Array<'a> {
    /// Reads the header; the body has the bytes that it claims.
    pub fn parse(bytes: &'a [u8]) -> Parsed<Array<'a>> {
        if bytes.len() < 12 || &bytes[..6] != b"\x93NUMPY" {
            return Err(fault("this is no NumPy array".into()));
        }
        let (length, start): (usize, usize) = match bytes[6] {
            1 => (usize::from(u16::from_le_bytes([bytes[8], bytes[9]])), 10),
            2 | 3 => (u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize, 12),
            v => return Err(fault(format!("format version {v} is unknown"))),
        };
        let header =
            bytes.get(start..start.saturating_add(length)).ok_or_else(|| fault("it is truncated".into()))?;
        let header = String::from_utf8_lossy(header);
        let value = |key: &str| -> Parsed<&str> {
            let at = header.find(&format!("'{key}'")).ok_or_else(|| fault(format!("it has no {key:?}")))?;
            let rest = &header[at + key.len() + 2..];
            Ok(rest.trim_start().strip_prefix(':').unwrap_or(rest).trim_start())
        };
        let descr: String = value("descr")?.chars().take_while(|c| *c != ',').collect();
        let inner = descr.trim().trim_matches('\'');
        let (order, kind) = inner.split_at_checked(1).unwrap_or_default();
        let kind = match (kind.get(..1), kind.get(1..).and_then(|n| n.parse::<usize>().ok())) {
            (Some("f"), Some(n @ (4 | 8))) => Kind::Float(n),
            (Some("U"), Some(n @ 1..=1024)) => Kind::Text(n),
            (Some("u"), Some(4)) => Kind::Index,
            _ => return Err(fault(format!("values are {descr}, not floats of 32 or 64 bits"))),
        };
        if !matches!(order, "<" | ">") {
            return Err(fault(format!("values are {descr}; their byte order is neither < nor >")));
        }
        let shape = value("shape")?;
        let inner = shape.strip_prefix('(').and_then(|s| s.split(')').next()).unwrap_or_default();
        let numbers = inner.split(',').map(str::trim).filter(|n| !n.is_empty());
        let shape: Vec<usize> = numbers
            .map(|n| n.parse().map_err(|_| fault(format!("shape ({inner}) is none"))))
            .collect::<Parsed<_>>()?;
        let size = match kind {
            Kind::Float(n) => n,
            Kind::Text(n) => 4 * n,
            Kind::Index => 4,
        };
        let due = shape.iter().try_fold(size, |a, &n| a.checked_mul(n));
        let body = &bytes[start + length..];
        if due != Some(body.len()) {
            let problem = format!("{} bytes of values where ({inner}) of {size} bytes are due", body.len());
            return Err(FormatError::at_byte(
                start + length,
                problem,
                "it is truncated or damaged: write it again",
            ));
        }
        let by_column = value("fortran_order")?.starts_with("True");
        Ok(Array { kind, big_endian: order == ">", by_column, shape, body })
    }

    /// The shape as NumPy prints it.
    pub fn shown_shape(&self) -> String {
        format!("({})", self.shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))
    }

    /// The values, the last axis running fastest.
    pub fn floats(&self) -> Parsed<Vec<f32>> {
        let Kind::Float(size) = self.kind else {
            return Err(fault("values are texts or integers, not floats of 32 or 64 bits".into()));
        };
        let number = |b: &[u8]| -> f32 {
            let mut a = [0u8; 8];
            a[..size].copy_from_slice(b);
            if self.big_endian {
                a[..size].reverse();
            }
            if size == 4 {
                f32::from_le_bytes([a[0], a[1], a[2], a[3]])
            } else {
                f64::from_le_bytes(a) as f32
            }
        };
        let all: Vec<f32> = self.body.chunks_exact(size).map(number).collect();
        if !self.by_column || self.shape.len() < 2 {
            return Ok(all);
        }
        // The first axis runs fastest in the file.
        let mut out = Vec::with_capacity(all.len());
        let mut at = vec![0usize; self.shape.len()];
        for _ in 0..all.len() {
            let (mut place, mut stride) = (0, 1);
            for (&i, &n) in at.iter().zip(&self.shape) {
                place += i * stride;
                stride *= n;
            }
            out.push(all[place]);
            for (i, &n) in at.iter_mut().zip(&self.shape).rev() {
                *i += 1;
                if *i < n {
                    break;
                }
                *i = 0;
            }
        }
        Ok(out)
    }

    /// Unsigned integers, the last axis running fastest in the file as well.
    pub fn indices(&self) -> Parsed<Vec<u32>> {
        if self.kind != Kind::Index || self.by_column {
            return Err(fault("values are no unsigned integers of 32 bits in C order".into()));
        }
        let number = |b: &[u8]| {
            let b = [b[0], b[1], b[2], b[3]];
            if self.big_endian { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) }
        };
        Ok(self.body.chunks_exact(4).map(number).collect())
    }

    /// Texts of an array with one axis, without the zeros behind them.
    pub fn texts(&self) -> Parsed<Vec<String>> {
        let (Kind::Text(length), [_]) = (self.kind, &self.shape[..]) else {
            return Err(fault(format!("shape {} of numbers is no list of texts", self.shown_shape())));
        };
        let letter = |b: &[u8]| {
            let code = [b[0], b[1], b[2], b[3]];
            let code = if self.big_endian { u32::from_be_bytes(code) } else { u32::from_le_bytes(code) };
            char::from_u32(code).ok_or_else(|| fault(format!("{code} is no character")))
        };
        let text = |b: &[u8]| b.chunks_exact(4).map(letter).collect::<Parsed<String>>();
        let all = self.body.chunks_exact(4 * length).map(text);
        all.map(|t| t.map(|t| t.trim_end_matches('\0').to_owned())).collect()
    }
}

/// The header of a file of format 1 whose values, of type `descr`, come in C order; the values follow it at a multiple of
/// 64 bytes, as NumPy has it.
pub(crate) fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let sides: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let dict = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({}), }}", sides.trim_end());
    let length = (10 + dict.len() + 1).next_multiple_of(64) - 10;
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((length as u16).to_le_bytes());
    out.extend(format!("{dict:<width$}\n", width = length - 1).bytes());
    out
}

/// Writes floats of 32 bits as a `.npy` file of this shape, the last axis running fastest, atomically.
///
/// # Errors
/// If the shape is not that of the values, or the file cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f32]) -> Result<()> {
    if shape.iter().product::<usize>() != values.len() {
        let n = values.len();
        return Err(IoError::new(path, format!("not written: {n} values are not of shape {shape:?}")));
    }
    atomic_write(path, |w| {
        w.write_all(&header("<f4", shape))?;
        values.iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))
    })
}

/// Arrays by name, as `numpy.savez` and `numpy.savez_compressed` write them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Npz {
    path: PathBuf,
    arrays: BTreeMap<String, Vec<u8>>,
}

impl Npz {
    /// Reads a `.npz` file.
    ///
    /// # Errors
    /// If the file cannot be read or is no such archive.
    pub fn read(path: &Path) -> Result<Npz> {
        Npz::parse(path, &read_all(path)?)
    }

    /// Unfolds an archive; `path` is for messages only. No member takes more memory than its packed bytes can hold.
    ///
    /// # Errors
    /// If it is no zip archive, is truncated or damaged, or packed otherwise than stored or deflated.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Npz> {
        let broken = |e: &dyn std::fmt::Display| {
            let remedy = "it is truncated, damaged or another format: write it again with numpy.savez";
            IoError::new(path, format!("not a readable NumPy archive ({e}); {remedy}"))
        };
        let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(&e))?;
        let mut arrays = BTreeMap::new();
        for i in 0..zip.len() {
            let member = zip.by_index(i).map_err(|e| broken(&e))?;
            let name = member.name().map_err(|e| broken(&e))?.into_owned();
            let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else { continue };
            let packed = member.compressed_size().min(bytes.len() as u64);
            let (claimed, most) = (member.size(), packed * MAX_UNFOLDING);
            if claimed > most {
                return Err(broken(&format!("{packed} bytes of {name} cannot unfold to {claimed}")));
            }
            let mut out = Vec::new();
            member.take(most).read_to_end(&mut out).map_err(|e| broken(&e))?;
            arrays.insert(name, out);
        }
        Ok(Npz { path: path.to_owned(), arrays })
    }

    fn get<T>(&self, name: &str, of: impl FnOnce(Array<'_>) -> Parsed<T>) -> Result<T> {
        let Some(bytes) = self.arrays.get(name) else {
            let known: Vec<&str> = self.arrays.keys().map(String::as_str).collect();
            let problem = format!("there is no array {name:?} among {}; write it too", known.join(", "));
            return Err(IoError::new(&self.path, problem));
        };
        let named = |e: FormatError| FormatError { place: format!("array {name}, {}", e.place), ..e };
        Array::parse(bytes).and_then(of).map_err(|e| named(e).in_file(&self.path))
    }

    /// Shape and values of an array of floats, the last axis running fastest.
    ///
    /// # Errors
    /// If there is no such array, or it is damaged or of another type.
    pub fn floats(&self, name: &str) -> Result<(Vec<usize>, Vec<f32>)> {
        self.get(name, |array| Ok((array.shape.clone(), array.floats()?)))
    }

    /// The texts of an array with one axis.
    ///
    /// # Errors
    /// As [`Npz::floats`].
    pub fn texts(&self, name: &str) -> Result<Vec<String>> {
        self.get(name, |array| array.texts())
    }
}

#[cfg(test)]
mod tests;
