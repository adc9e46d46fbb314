//! The PLY container: header, and the columns that a caller asks for, in ASCII or binary of either order.

use crate::error::{FormatError, Parsed};
use crate::ply_body::{Binary, Source, Text, read_element};

pub(crate) const REMEDY: &str = "the file is damaged or not a PLY: export it again";

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn parse(name: &str) -> Option<Number> {
        Some(match name {
            "char" | "int8" => Number::I8,
            "uchar" | "uint8" => Number::U8,
            "short" | "int16" => Number::I16,
            "ushort" | "uint16" => Number::U16,
            "int" | "int32" => Number::I32,
            "uint" | "uint32" => Number::U32,
            "float" | "float32" => Number::F32,
            "double" | "float64" => Number::F64,
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::F64 => 8,
        }
    }

    /// Exact for every type.
    pub fn decode(self, b: &[u8], big: bool) -> f64 {
        let mut a = [0u8; 8];
        let n = self.size();
        a[..n].copy_from_slice(&b[..n]);
        if big {
            a[..n].reverse();
        }
        let [b0, b1, b2, b3, ..] = a;
        match self {
            Number::I8 => f64::from(b0 as i8),
            Number::U8 => f64::from(b0),
            Number::I16 => f64::from(i16::from_le_bytes([b0, b1])),
            Number::U16 => f64::from(u16::from_le_bytes([b0, b1])),
            Number::I32 => f64::from(i32::from_le_bytes([b0, b1, b2, b3])),
            Number::U32 => f64::from(u32::from_le_bytes([b0, b1, b2, b3])),
            Number::F32 => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
            Number::F64 => f64::from_le_bytes(a),
        }
    }

    pub fn parse_text(self, t: &str) -> Option<f64> {
        match self {
            // Straight to f32, so that no value is rounded twice.
            Number::F32 => t.parse::<f32>().ok().map(f64::from),
            Number::F64 => t.parse().ok(),
            _ => t.parse::<i64>().ok().map(|v| v as f64),
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Property {
    pub name: String,
    /// The type of a list's length, for a list.
    pub list: Option<Number>,
    pub item: Number,
}

#[derive(Clone, Debug)]
pub(crate) struct Header {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

/// Values of one property over all items of an element.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Column {
    Scalar(Vec<f64>),
    /// Start of each item's values, and their total as the last entry; the values.
    List(Vec<u32>, Vec<f64>),
}

#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub name: String,
    pub count: usize,
    pub columns: Vec<(String, Option<Column>)>,
}

impl Element {
    pub fn has(&self, name: &str) -> bool {
        self.columns.iter().any(|c| c.0 == name)
    }

    pub fn scalar(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find_map(|(n, c)| match c {
            Some(Column::Scalar(v)) if n == name => Some(v.as_slice()),
            _ => None,
        })
    }

    pub fn list(&self, names: &[&str]) -> Option<(&[u32], &[f64])> {
        self.columns.iter().find_map(|(n, c)| match c {
            Some(Column::List(o, v)) if names.contains(&n.as_str()) => Some((o.as_slice(), v.as_slice())),
            _ => None,
        })
    }
}

#[derive(Debug)]
pub(crate) struct Ply {
    pub comments: Vec<String>,
    pub elements: Vec<Element>,
}

impl Ply {
    pub fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|e| e.name == name)
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

/// Parses header and body, keeping the properties that `want(element, property)` names.
pub(crate) fn parse_ply(bytes: &[u8], want: impl Fn(&str, &str) -> bool) -> Parsed<Ply> {
    let (encoding, comments, headers, start) = parse_header(bytes)?;
    let body = &bytes[start..];
    let mut source: Box<dyn Source> = match encoding {
        Encoding::Ascii => Box::new(Text { body, start, pos: 0 }),
        _ => Box::new(Binary { body, start, pos: 0, big: encoding == Encoding::Big }),
    };
    let mut elements = Vec::with_capacity(headers.len());
    for h in headers {
        source.check_claim(&h)?;
        elements.push(read_element(&h, source.as_mut(), &want)?);
    }
    Ok(Ply { comments, elements })
}

fn parse_header(bytes: &[u8]) -> Parsed<(Encoding, Vec<String>, Vec<Header>, usize)> {
    let bad = |line: usize, fault: String| FormatError::new(format!("line {line}"), fault, REMEDY);
    let (mut pos, mut number) = (0, 0);
    let (mut encoding, mut comments, mut headers) = (None, Vec::new(), Vec::<Header>::new());
    loop {
        number += 1;
        let Some(end) = bytes[pos..].iter().position(|&b| b == b'\n') else {
            return Err(bad(number, "the header has no end_header".into()));
        };
        let line = String::from_utf8_lossy(&bytes[pos..pos + end]);
        pos += end + 1;
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        if number == 1 && words != ["ply"] {
            return Err(bad(1, "the magic is not \"ply\"".into()));
        }
        match words.as_slice() {
            ["ply"] if number == 1 => {}
            ["format", kind, "1.0"] => {
                encoding = Some(match *kind {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    other => return Err(bad(number, format!("unknown format {other:?}"))),
                });
            }
            ["comment" | "obj_info", rest @ ..] => comments.push(rest.join(" ")),
            ["element", name, count] => {
                let count = count
                    .parse()
                    .map_err(|_| bad(number, format!("element count {count:?} is not a number")))?;
                headers.push(Header { name: (*name).into(), count, properties: Vec::new() });
            }
            ["property", rest @ ..] => {
                let property =
                    parse_property(rest).ok_or_else(|| bad(number, format!("cannot read {line:?}")))?;
                let Some(h) = headers.last_mut() else {
                    return Err(bad(number, "a property stands before any element".into()));
                };
                h.properties.push(property);
            }
            ["end_header"] => {
                let encoding = encoding.ok_or_else(|| bad(number, "the header has no format line".into()))?;
                return Ok((encoding, comments, headers, pos));
            }
            [] => {}
            _ => return Err(bad(number, format!("cannot read {:?}", line.trim_end()))),
        }
    }
}

fn parse_property(words: &[&str]) -> Option<Property> {
    let (name, list, item) = match words {
        ["list", count, item, name] => (name, Some(Number::parse(count)?), item),
        [item, name] => (name, None, item),
        _ => return None,
    };
    if matches!(list, Some(Number::F32 | Number::F64)) {
        return None;
    }
    Some(Property { name: (*name).into(), list, item: Number::parse(item)? })
}

#[cfg(test)]
mod tests;
