//! USD text layers (`.usda`): strands as linear `BasisCurves`, envelopes as `Mesh`, sequences as value clips.
//!
//! A sequence is a folder of layers, one a frame, beside a small index that names them: memory does not grow with the
//! number of frames, a viewer loads the frames it shows, and strands may come, go and change their number of points
//! from frame to frame. Between frames values are held; USD would otherwise blend arrays of equal length, and so one
//! strand into another. The index is opened in any program that reads USD; so is each frame alone.
//!
//! Millimetres (`metersPerUnit` 0.001), +y up, one time code a frame. Numbers survive bit for bit.

use crate::atomic::atomic_write;
use crate::error::{IoError, Result};
use glam::Vec3;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use strandbench_types::{StrandSet, TriMesh};

/// Frames of a sequence are numbered below this.
pub const MAX_FRAMES: u32 = 1_000_000;

/// The frame that a layer shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At {
    /// Number of the frame, the time code of its values.
    pub frame: u32,
    /// Frames a second.
    pub rate_hz: f64,
}

/// What the layers of a sequence hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Strands ([`write_strands`]).
    Strands {
        /// Whether they name their strands, in every frame.
        ids: bool,
    },
    /// A mesh ([`write_mesh`]).
    Mesh,
}

/// Where the layer of a frame belongs, beside an index: `strands.usda` has `strands/strands.000007.usda`.
pub fn frame_path(index: &Path, frame: u32) -> PathBuf {
    let stem = index.file_stem().unwrap_or_default().to_string_lossy();
    index.with_extension("").join(format!("{stem}.{frame:06}.usda"))
}

/// Writes strands, atomically: the prim `/Strands`, a linear `BasisCurves` with `points`, `curveVertexCounts`,
/// `widths` (diameters, one a point) and `extent`; with `ids`, one a strand, also `primvars:strandId`. With `at` the
/// values are time samples of that frame, else they hold for all time.
///
/// # Errors
/// If the strands are not valid, `ids` are not as many, there are more than 2^31 points, the frame is not below
/// [`MAX_FRAMES`] or its rate not positive, or the file cannot be written.
pub fn write_strands(path: &Path, strands: &StrandSet, ids: Option<&[u64]>, at: Option<At>) -> Result<()> {
    strands.validate().map_err(|e| refuse(path, e))?;
    countable(path, strands.points.len())?;
    if let Some(ids) = ids.filter(|ids| ids.len() != strands.len()) {
        let fault = format!("{} identities for {} strands; give one a strand", ids.len(), strands.len());
        return Err(refuse(path, fault));
    }
    checked(path, at)?;
    let runs: Vec<_> = (0..strands.len()).map(|s| strands.range(s)).collect();
    atomic_write(path, |w| {
        open(w, at, Content::Strands { ids: ids.is_some() })?;
        let mut out = Values { w, frame: at.map(|a| a.frame) };
        out.array("int[] curveVertexCounts", runs.len(), |w, s| write!(w, "{}", runs[s].len()))?;
        out.array("point3f[] points", runs.len(), |w, s| points(w, strands.strand(s)))?;
        out.array("float[] widths", runs.len(), |w, s| {
            separated(w, &strands.radii_mm[runs[s].clone()], |w, r| write!(w, "{:?}", 2.0 * r))
        })?;
        let thickest = strands.radii_mm.iter().fold(0.0, |m: f32, &r| m.max(r));
        out.extent(&strands.points, thickest)?;
        if let Some(ids) = ids {
            out.array("uint64[] primvars:strandId", ids.len(), |w, s| write!(w, "{}", ids[s]))?;
        }
        writeln!(w, "}}")
    })
}

/// Writes a mesh, atomically: the prim `/Envelope`, a `Mesh` of triangles without subdivision. `at` as in
/// [`write_strands`].
///
/// # Errors
/// If the mesh is not valid or has more than 2^31 vertices or corners, the frame is not below [`MAX_FRAMES`] or its
/// rate not positive, or the file cannot be written.
pub fn write_mesh(path: &Path, mesh: &TriMesh, at: Option<At>) -> Result<()> {
    mesh.validate().map_err(|e| refuse(path, e))?;
    countable(path, mesh.vertices.len().max(3 * mesh.triangles.len()))?;
    checked(path, at)?;
    let faces = mesh.triangles.len();
    atomic_write(path, |w| {
        open(w, at, Content::Mesh)?;
        let mut out = Values { w, frame: at.map(|a| a.frame) };
        out.array("int[] faceVertexCounts", faces, |w, _| write!(w, "3"))?;
        out.array("int[] faceVertexIndices", faces, |w, f| {
            let [a, b, c] = mesh.triangles[f];
            write!(w, "{a}, {b}, {c}")
        })?;
        out.array("point3f[] points", mesh.vertices.len(), |w, v| points(w, &mesh.vertices[v..=v]))?;
        out.extent(&mesh.vertices, 0.0)?;
        writeln!(w, "}}")
    })
}

/// Writes the index of a sequence, atomically, once the layers of its frames `first` to `last` are there
/// ([`frame_path`]). It takes about a hundred bytes a frame.
///
/// # Errors
/// If the layer of a frame is missing (named), the index's name is not letters, digits, `-`, `_` and `.`, a frame is
/// not below [`MAX_FRAMES`], the rate is not positive, or the file cannot be written.
pub fn write_index(index: &Path, content: Content, first: u32, last: u32, rate_hz: f64) -> Result<()> {
    let stem = index.file_stem().unwrap_or_default().to_string_lossy();
    let name = index.file_name().unwrap_or_default().to_string_lossy();
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if !name.chars().all(plain) || index.extension().is_none_or(|e| e != "usda") {
        let fault =
            format!("the name {name:?} cannot stand in the layer; use letters, digits, - _ and .usda");
        return Err(refuse(index, fault));
    }
    if first > last {
        return Err(refuse(index, format!("frames {first} to {last} are none; write a frame first")));
    }
    for frame in [first, last] {
        checked(index, Some(At { frame, rate_hz }))?;
    }
    if let Some(missing) = (first..=last).map(|f| frame_path(index, f)).find(|p| !p.is_file()) {
        let fault = "this frame of the sequence is not there; write it, empty if there is no answer";
        return Err(IoError::new(&missing, fault));
    }
    let prim = prim(content);
    atomic_write(index, |w| {
        header(w, prim, Some((first, last, rate_hz)))?;
        write!(
            w,
            "def {} \"{prim}\" (\n    clips = {{\n        dictionary default = {{\n            \
             asset manifestAssetPath = @./{name}@\n            string primPath = \"/{prim}\"\n",
            schema(content)
        )?;
        let frames: Vec<u32> = (first..=last).collect();
        list(w, "asset[] assetPaths", &frames, |w, f| write!(w, "@./{stem}/{stem}.{f:06}.usda@"))?;
        list(w, "double2[] active", &frames, |w, f| write!(w, "({f}, {})", f - first))?;
        // Stage time to a layer's own: until the next frame a layer stands at its one sample.
        list(w, "double2[] times", &frames, |w, f| {
            write!(w, "({f}, {f})")?;
            if *f < last { write!(w, ", ({}, {f})", f + 1) } else { Ok(()) }
        })?;
        w.write_all(b"        }\n    }\n)\n{\n")?;
        declarations(w, content)?;
        let timed: &[&str] = match content {
            Content::Strands { .. } => &["int[] curveVertexCounts"],
            Content::Mesh => &["int[] faceVertexCounts", "int[] faceVertexIndices"],
        };
        for attribute in timed.iter().chain(&["point3f[] points", "float3[] extent"]) {
            writeln!(w, "    {attribute}")?;
        }
        writeln!(w, "}}")
    })
}

fn refuse(path: &Path, fault: impl std::fmt::Display) -> IoError {
    IoError::new(path, format!("not written: {fault}"))
}

/// USD counts with 32 bits and a sign.
fn countable(path: &Path, n: usize) -> Result<()> {
    match i32::try_from(n) {
        Ok(_) => Ok(()),
        Err(_) => Err(refuse(path, format!("{n} points are more than USD can count (2^31); thin them out"))),
    }
}

fn checked(path: &Path, at: Option<At>) -> Result<()> {
    let Some(At { frame, rate_hz }) = at else { return Ok(()) };
    if frame >= MAX_FRAMES {
        return Err(refuse(path, format!("frame {frame} is not below {MAX_FRAMES}; number from 0")));
    }
    if !(rate_hz > 0.0 && rate_hz.is_finite()) {
        return Err(refuse(path, format!("{rate_hz} frames a second; give a positive number")));
    }
    Ok(())
}

fn prim(content: Content) -> &'static str {
    match content {
        Content::Strands { .. } => "Strands",
        Content::Mesh => "Envelope",
    }
}

fn schema(content: Content) -> &'static str {
    match content {
        Content::Strands { .. } => "BasisCurves",
        Content::Mesh => "Mesh",
    }
}

fn header(w: &mut dyn Write, prim: &str, times: Option<(u32, u32, f64)>) -> io::Result<()> {
    write!(w, "#usda 1.0\n(\n    defaultPrim = \"{prim}\"\n    metersPerUnit = 0.001\n    upAxis = \"Y\"\n")?;
    if let Some((first, last, rate_hz)) = times {
        write!(
            w,
            "    startTimeCode = {first}\n    endTimeCode = {last}\n    timeCodesPerSecond = {rate_hz}\n    \
             framesPerSecond = {rate_hz}\n"
        )?;
    }
    w.write_all(b")\n\n")
}

fn open(w: &mut dyn Write, at: Option<At>, content: Content) -> io::Result<()> {
    let prim = prim(content);
    header(w, prim, at.map(|a| (a.frame, a.frame, a.rate_hz)))?;
    write!(w, "def {} \"{prim}\"\n{{\n", schema(content))?;
    declarations(w, content)
}

/// What holds in every frame.
fn declarations(w: &mut dyn Write, content: Content) -> io::Result<()> {
    match content {
        Content::Strands { ids } => {
            w.write_all(
                b"    uniform token type = \"linear\"\n    uniform token wrap = \"nonperiodic\"\n    \
                float[] widths (\n        interpolation = \"vertex\"\n    )\n",
            )?;
            if ids {
                w.write_all(
                    b"    uint64[] primvars:strandId (\n        interpolation = \"uniform\"\n    )\n",
                )?;
            }
            Ok(())
        }
        Content::Mesh => w.write_all(
            b"    uniform token subdivisionScheme = \"none\"\n    uniform token orientation = \"rightHanded\"\n",
        ),
    }
}

/// An entry of the index, with a line for each frame.
fn list(
    w: &mut dyn Write,
    entry: &str,
    frames: &[u32],
    mut each: impl FnMut(&mut dyn Write, &u32) -> io::Result<()>,
) -> io::Result<()> {
    write!(w, "            {entry} = [")?;
    for (i, f) in frames.iter().enumerate() {
        w.write_all(if i == 0 { b"\n                " } else { b",\n                " })?;
        each(w, f)?;
    }
    w.write_all(b"]\n")
}

fn separated<T>(
    w: &mut dyn Write,
    items: &[T],
    mut each: impl FnMut(&mut dyn Write, &T) -> io::Result<()>,
) -> io::Result<()> {
    for (i, item) in items.iter().enumerate() {
        if i > 0 {
            w.write_all(b", ")?;
        }
        each(w, item)?;
    }
    Ok(())
}

/// Shortest decimals that give the same bits again.
fn points(w: &mut dyn Write, points: &[Vec3]) -> io::Result<()> {
    separated(w, points, |w, p| write!(w, "({:?}, {:?}, {:?})", p.x, p.y, p.z))
}

/// Attributes with values, of one frame or for all time.
struct Values<'a> {
    w: &'a mut dyn Write,
    frame: Option<u32>,
}

impl Values<'_> {
    /// An array of `n` items, each on a line of its own.
    fn array(
        &mut self,
        attribute: &str,
        n: usize,
        mut item: impl FnMut(&mut dyn Write, usize) -> io::Result<()>,
    ) -> io::Result<()> {
        let w = &mut *self.w;
        match self.frame {
            Some(frame) => write!(w, "    {attribute}.timeSamples = {{\n        {frame}: [")?,
            None => write!(w, "    {attribute} = [")?,
        }
        for i in 0..n {
            w.write_all(if i == 0 { b"\n" } else { b",\n" })?;
            item(w, i)?;
        }
        w.write_all(if self.frame.is_some() { b"]\n    }\n" } else { b"]\n" })
    }

    /// The box round all points, wider by `margin_mm`; none without points.
    fn extent(&mut self, all: &[Vec3], margin_mm: f32) -> io::Result<()> {
        let Some(&first) = all.first() else { return Ok(()) };
        let (lo, hi) = all.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p)));
        let corners = [lo - margin_mm, hi + margin_mm];
        self.array("float3[] extent", 2, |w, i| points(w, &corners[i..=i]))
    }
}
