//! Reading `face.bin`: every claim of the file is checked before anything is made of it.

use super::FaceError;
use glam::{Vec2, Vec3};

/// Made by `assets/derive_face.py` from the MakeHuman base mesh and its targets (CC0).
pub(super) static FACE_BIN: &[u8] = include_bytes!("../../assets/face.bin");

const MAGIC: &[u8; 8] = b"SBFACE1\0";

/// A part of the face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// Skin, with the mouth's bag, eye sockets and nostrils.
    Skin,
    /// The subject's left eyeball.
    LeftEye,
    /// The subject's right eyeball.
    RightEye,
    /// Upper teeth.
    UpperTeeth,
    /// Lower teeth.
    LowerTeeth,
    /// Tongue.
    Tongue,
}

const PARTS: [Part; 6] =
    [Part::Skin, Part::LeftEye, Part::RightEye, Part::UpperTeeth, Part::LowerTeeth, Part::Tongue];

/// What a target changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Expression,
    Ethnicity,
    Universal,
    Detail,
}

const KINDS: [Kind; 4] = [Kind::Expression, Kind::Ethnicity, Kind::Universal, Kind::Detail];

/// Displacements of some vertices.
#[derive(Clone, Debug)]
pub(super) struct Target {
    pub name: String,
    pub kind: Kind,
    /// Vertex and displacement, mm, ascending.
    pub deltas: Vec<(u32, Vec3)>,
}

/// A way in which faces differ, from -1 to 1.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub name: String,
    /// Target towards -1; without one the axis runs from 0 to 1.
    pub low: Option<usize>,
    /// Target towards 1.
    pub high: usize,
}

/// The file's content.
#[derive(Clone, Debug)]
pub(super) struct Asset {
    pub vertices: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub quads: Vec<[u32; 4]>,
    pub uv_quads: Vec<[u32; 4]>,
    /// Indexed [quad].
    pub parts: Vec<Part>,
    pub targets: Vec<Target>,
    pub axes: Vec<Axis>,
    pub curves: Vec<(String, Vec<u32>)>,
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

type Read<T> = Result<T, FaceError>;

impl<'a> Reader<'a> {
    fn bad<T>(&self, problem: impl Into<String>) -> Read<T> {
        Err(FaceError::Asset { at: self.at, problem: problem.into() })
    }
    fn slice(&mut self, n: usize) -> Read<&'a [u8]> {
        match self.bytes[self.at..].get(..n) {
            None => self.bad(format!("{n} bytes are wanted, {} are left", self.bytes.len() - self.at)),
            Some(out) => {
                self.at += n;
                Ok(out)
            }
        }
    }
    fn take<const N: usize>(&mut self) -> Read<[u8; N]> {
        Ok(self.slice(N)?.try_into().expect("N bytes"))
    }
    fn u8(&mut self) -> Read<u8> {
        Ok(self.take::<1>()?[0])
    }
    fn u16(&mut self) -> Read<u16> {
        Ok(u16::from_le_bytes(self.take()?))
    }
    fn f32(&mut self) -> Read<f32> {
        let v = f32::from_le_bytes(self.take()?);
        if v.is_finite() { Ok(v) } else { self.bad(format!("{v} is not finite")) }
    }
    /// A number of items of at least `size` bytes each, which must be there.
    fn count(&mut self, size: usize) -> Read<usize> {
        let n = u32::from_le_bytes(self.take()?) as usize;
        if n.saturating_mul(size) > self.bytes.len() {
            return self.bad(format!("{n} items of {size} bytes do not fit into {} bytes", self.bytes.len()));
        }
        Ok(n)
    }
    fn index(&mut self, n: usize, what: &str) -> Read<u32> {
        let i = u32::from(self.u16()?);
        if (i as usize) < n { Ok(i) } else { self.bad(format!("{what} {i} of {n}")) }
    }
    fn quad(&mut self, n: usize, what: &str) -> Read<[u32; 4]> {
        let mut q = [0; 4];
        for v in &mut q {
            *v = self.index(n, what)?;
        }
        let twice = (0..4).any(|i| (0..i).any(|j| q[i] == q[j]));
        if twice { self.bad(format!("a quad names a {what} twice: {q:?}")) } else { Ok(q) }
    }
    fn name(&mut self) -> Read<String> {
        let n = usize::from(self.u8()?);
        let text = self.slice(n)?;
        if n == 0 || !text.iter().all(u8::is_ascii_graphic) {
            return self.bad("a name is empty or not ASCII");
        }
        Ok(text.iter().map(|&b| char::from(b)).collect())
    }
}

impl Asset {
    /// Reads the file's bytes.
    pub fn parse(bytes: &[u8]) -> Read<Asset> {
        let mut r = Reader { bytes, at: 0 };
        if r.slice(8)? != MAGIC {
            return r.bad("it does not begin with SBFACE1");
        }
        let (vertices, uvs, quads) = (r.count(12)?, r.count(8)?, r.count(17)?);
        let (targets, axes, curves) = (r.count(5)?, r.count(6)?, r.count(4)?);
        let quantum = r.f32()?;
        if !(quantum > 0.0 && quantum < 1.0) {
            return r.bad(format!("a quantum of {quantum} mm"));
        }
        let mut out = Asset {
            vertices: Vec::with_capacity(vertices),
            uvs: Vec::with_capacity(uvs),
            quads: Vec::with_capacity(quads),
            uv_quads: Vec::with_capacity(quads),
            parts: Vec::with_capacity(quads),
            targets: Vec::with_capacity(targets),
            axes: Vec::with_capacity(axes),
            curves: Vec::with_capacity(curves),
        };
        for _ in 0..vertices {
            out.vertices.push(Vec3::new(r.f32()?, r.f32()?, r.f32()?));
        }
        for i in 0..uvs {
            let uv = Vec2::new(r.f32()?, r.f32()?);
            if uv.clamp(Vec2::ZERO, Vec2::ONE) != uv {
                return r.bad(format!("uv {i} is {uv}, outside its map of 0..1"));
            }
            out.uvs.push(uv);
        }
        for _ in 0..quads {
            out.quads.push(r.quad(vertices, "vertex")?);
            out.uv_quads.push(r.quad(uvs, "uv")?);
            match PARTS.get(usize::from(r.u8()?)) {
                Some(&part) => out.parts.push(part),
                None => return r.bad("an unknown part of the face"),
            }
        }
        check_manifold(&r, &out.quads)?;
        check_manifold(&r, &out.uv_quads)?;
        for _ in 0..targets {
            let name = r.name()?;
            let Some(&kind) = KINDS.get(usize::from(r.u8()?)) else {
                return r.bad(format!("target {name} has an unknown kind"));
            };
            if out.targets.iter().any(|t| t.name == name) {
                return r.bad(format!("target {name} is there twice"));
            }
            let n = usize::from(r.u16()?);
            let mut deltas: Vec<(u32, Vec3)> = Vec::with_capacity(n.min(vertices));
            for _ in 0..n {
                let i = r.index(vertices, "vertex")?;
                if deltas.last().is_some_and(|d| d.0 >= i) {
                    return r.bad(format!("vertices of target {name} do not ascend at {i}"));
                }
                let mut d = [0.0; 3];
                for v in &mut d {
                    *v = f32::from(i16::from_le_bytes(r.take()?)) * quantum;
                }
                deltas.push((i, Vec3::from_array(d)));
            }
            out.targets.push(Target { name, kind, deltas });
        }
        for _ in 0..axes {
            let name = r.name()?;
            let (low, high) = (r.u16()?, r.u16()?);
            let known = |i: u16| out.targets.get(usize::from(i)).is_some_and(|t| t.kind == Kind::Detail);
            if !known(high) || !(low == u16::MAX || known(low)) {
                return r.bad(format!("axis {name} runs to a target that is none"));
            }
            let low = (low != u16::MAX).then_some(usize::from(low));
            out.axes.push(Axis { name, low, high: usize::from(high) });
        }
        for _ in 0..curves {
            let name = r.name()?;
            let n = usize::from(r.u16()?);
            let curve: Read<Vec<u32>> = (0..n).map(|_| r.index(vertices, "vertex")).collect();
            out.curves.push((name, curve?));
        }
        if r.at != bytes.len() {
            return r.bad("the file goes on after its end");
        }
        Ok(out)
    }
}

/// Subdivision needs every directed edge at most once: two faces an edge, wound alike.
fn check_manifold(r: &Reader<'_>, quads: &[[u32; 4]]) -> Read<()> {
    let mut edges: Vec<(u32, u32)> =
        quads.iter().flat_map(|q| (0..4).map(move |k| (q[k], q[(k + 1) % 4]))).collect();
    edges.sort_unstable();
    match edges.windows(2).find(|w| w[0] == w[1]) {
        Some(w) => r.bad(format!("the edge from {} to {} belongs to several quads", w[0].0, w[0].1)),
        None => Ok(()),
    }
}
