//! The body of a PLY: numbers one after the other, as text or binary.

use crate::error::{FormatError, Parsed};
use crate::ply::{Column, Element, Header, Number, REMEDY};

/// Reads one element, keeping the columns that `want` names.
pub(crate) fn read_element(
    h: &Header,
    source: &mut dyn Source,
    want: &impl Fn(&str, &str) -> bool,
) -> Parsed<Element> {
    let mut columns: Vec<(String, Option<Column>)> = h
        .properties
        .iter()
        .map(|p| {
            let column = want(&h.name, &p.name).then(|| match p.list {
                None => Column::Scalar(Vec::new()),
                Some(_) => Column::List(vec![0], Vec::new()),
            });
            (p.name.clone(), column)
        })
        .collect();
    for item in 0..if h.properties.is_empty() { 0 } else { h.count } {
        for (p, (_, column)) in h.properties.iter().zip(&mut columns) {
            let place = || format!("element {} {item}, property {}", h.name, p.name);
            match p.list {
                None => {
                    let v = source.number(p.item, &place)?;
                    if let Some(Column::Scalar(values)) = column {
                        values.push(v);
                    }
                }
                Some(count) => {
                    let n = source.number(count, &place)?;
                    if n < 0.0 {
                        return Err(FormatError::new(place(), format!("list length {n}"), REMEDY));
                    }
                    for _ in 0..n as u64 {
                        let v = source.number(p.item, &place)?;
                        if let Some(Column::List(_, values)) = column {
                            values.push(v);
                        }
                    }
                    if let Some(Column::List(offsets, values)) = column {
                        let end = u32::try_from(values.len()).map_err(|_| {
                            FormatError::new(place(), "over 2^32 list values", "split the file")
                        })?;
                        offsets.push(end);
                    }
                }
            }
        }
    }
    let count = if h.properties.is_empty() { 0 } else { h.count as usize };
    Ok(Element { name: h.name.clone(), count, columns })
}

pub(crate) trait Source {
    /// The next number; `place` says what it belongs to.
    fn number(&mut self, kind: Number, place: &dyn Fn() -> String) -> Parsed<f64>;
    /// Refuses an element that cannot fit into the bytes that remain.
    fn check_claim(&self, h: &Header) -> Parsed<()>;
}

fn too_many(h: &Header, at: usize, remaining: usize) -> FormatError {
    FormatError::at_byte(
        at,
        format!("the header claims {} items of element {} but {remaining} bytes remain", h.count, h.name),
        "the file is truncated or its header is wrong: export it again",
    )
}

pub(crate) struct Binary<'a> {
    pub body: &'a [u8],
    pub start: usize,
    pub pos: usize,
    pub big: bool,
}

impl Source for Binary<'_> {
    fn number(&mut self, kind: Number, place: &dyn Fn() -> String) -> Parsed<f64> {
        let Some(b) = self.body.get(self.pos..self.pos + kind.size()) else {
            return Err(FormatError::new(
                place(),
                format!("the file ends at byte {}", self.start + self.body.len()),
                "it is truncated: fetch it again",
            ));
        };
        self.pos += kind.size();
        Ok(kind.decode(b, self.big))
    }

    fn check_claim(&self, h: &Header) -> Parsed<()> {
        let least: usize = h.properties.iter().map(|p| p.list.unwrap_or(p.item).size()).sum();
        let remaining = self.body.len() - self.pos;
        if u128::from(h.count) * least as u128 > remaining as u128 {
            return Err(too_many(h, self.start + self.pos, remaining));
        }
        Ok(())
    }
}

pub(crate) struct Text<'a> {
    pub body: &'a [u8],
    pub start: usize,
    pub pos: usize,
}

impl Source for Text<'_> {
    fn number(&mut self, kind: Number, place: &dyn Fn() -> String) -> Parsed<f64> {
        let rest = &self.body[self.pos..];
        let begin = rest.iter().position(|b| !b.is_ascii_whitespace());
        let Some(begin) = begin else {
            return Err(FormatError::new(
                place(),
                "the file ends before it",
                "it is truncated: fetch it again",
            ));
        };
        let len = rest[begin..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - begin);
        let token = &rest[begin..begin + len];
        self.pos += begin + len;
        std::str::from_utf8(token).ok().and_then(|t| kind.parse_text(t)).ok_or_else(|| {
            let token = String::from_utf8_lossy(&token[..len.min(40)]);
            FormatError::new(
                format!("byte {} ({})", self.start + self.pos - len, place()),
                format!("{token:?} is not a number of its type"),
                REMEDY,
            )
        })
    }

    fn check_claim(&self, h: &Header) -> Parsed<()> {
        let remaining = self.body.len() - self.pos;
        // A digit and a separator each, but for the last.
        let least = u128::from(h.count) * h.properties.len() as u128 * 2;
        if least > remaining as u128 + 1 {
            return Err(too_many(h, self.start + self.pos, remaining));
        }
        Ok(())
    }
}
