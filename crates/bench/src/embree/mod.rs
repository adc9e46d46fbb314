//! Embree 4, loaded at run time where it is installed, as the tracer to be compared with.

mod raw;

use glam::Vec3;
use libloading::Library;
use raw::{Functions, Handle, RayHit};
use std::ffi::{CString, c_void};
use std::path::{Path, PathBuf};
use strandbench_types::{StrandSet, TriMesh};

/// Why Embree cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum EmbreeError {
    /// It is not there or not an Embree.
    #[error(
        "{}: cannot be loaded as Embree 4 ({reason}); install it (PyPI package embreex, or libembree4 of the system) and name the file with --embree",
        path.display()
    )]
    Load {
        /// The library.
        path: PathBuf,
        /// What the loader says.
        reason: String,
    },
    /// Another major version.
    #[error("{}: is Embree {version}, whose interface differs; version 4 is needed", path.display())]
    Version {
        /// The library.
        path: PathBuf,
        /// Its version as major * 10000 + minor * 100 + patch.
        version: isize,
    },
    /// A call failed.
    #[error("Embree: {what} failed with error code {code}")]
    Call {
        /// What was tried.
        what: &'static str,
        /// `RTCError`.
        code: i32,
    },
}

/// How much effort Embree spends on its BVH.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// `RTC_BUILD_QUALITY_MEDIUM`, the default of Embree.
    Medium = 1,
    /// `RTC_BUILD_QUALITY_HIGH`, which Mitsuba asks for.
    High = 2,
}

/// The loaded library.
pub struct Embree {
    functions: Functions,
    path: PathBuf,
    version: isize,
}

impl Embree {
    /// Loads `path` (a file, or a bare name for the system's search).
    ///
    /// # Errors
    /// If it is missing, lacks a function, is not version 4 or was built without curves.
    pub fn load(path: &Path) -> Result<Embree, EmbreeError> {
        let fail = |reason: String| EmbreeError::Load { path: path.into(), reason };
        // SAFETY: loading runs the library's initialisers; the user named this file or has it installed.
        let library = unsafe { Library::new(path) }.map_err(|e| fail(e.to_string()))?;
        let functions = Functions::of(library).map_err(|e| fail(e.to_string()))?;
        let mut embree = Embree { functions, path: path.into(), version: 0 };
        let device = embree.device(1)?;
        // SAFETY: the device is live.
        let property = |p| unsafe { (embree.functions.device_property)(device, p) };
        let (version, curves) = (property(raw::PROPERTY_VERSION), property(raw::PROPERTY_CURVES));
        // SAFETY: made above, not used again.
        unsafe { (embree.functions.release_device)(device) };
        if version / 10_000 != 4 {
            return Err(EmbreeError::Version { path: path.into(), version });
        }
        if curves == 0 {
            return Err(fail("it was built without curves".into()));
        }
        embree.version = version;
        Ok(embree)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Version, as in "4.4.0".
    pub fn version(&self) -> String {
        format!("{}.{}.{}", self.version / 10_000, self.version / 100 % 100, self.version % 100)
    }

    fn device(&self, threads: usize) -> Result<Handle, EmbreeError> {
        let config = CString::new(format!("threads={threads}")).expect("no zero byte in a number");
        // SAFETY: the string outlives the call.
        let device = unsafe { (self.functions.new_device)(config.as_ptr()) };
        if device.is_null() {
            // SAFETY: a null device asks for the calling thread's own error.
            let code = unsafe { (self.functions.device_error)(std::ptr::null_mut()) };
            return Err(EmbreeError::Call { what: "making a device", code });
        }
        Ok(device)
    }

    fn check(&self, device: Handle, what: &'static str) -> Result<(), EmbreeError> {
        // SAFETY: the device is live.
        match unsafe { (self.functions.device_error)(device) } {
            0 => Ok(()),
            code => Err(EmbreeError::Call { what, code }),
        }
    }
}

/// A committed scene of one geometry, with the arrays that Embree refers to.
pub struct EmbreeScene<'a> {
    embree: &'a Embree,
    device: Handle,
    scene: Handle,
    _vertices: Vec<[f32; 4]>,
    _indices: Vec<u32>,
    _flags: Vec<u8>,
}

// SAFETY: Embree documents that a committed scene may be traversed by many threads at once; nothing here changes
// it afterwards, and it is released only when no reference is left.
unsafe impl Sync for EmbreeScene<'_> {}
// SAFETY: as above; handles are not tied to a thread.
unsafe impl Send for EmbreeScene<'_> {}

/// Arrays of one geometry, four floats a vertex.
struct Arrays {
    kind: i32,
    vertices: Vec<[f32; 4]>,
    vertex_format: i32,
    indices: Vec<u32>,
    index_format: i32,
    per_index: usize,
    flags: Vec<u8>,
}

impl<'a> EmbreeScene<'a> {
    /// Round linear curves (hulls of two spheres, as the renderer's), built with `threads` threads. Primitive
    /// indices count the segments of all strands in order.
    ///
    /// # Errors
    /// If a call of Embree's fails.
    pub fn curves(
        embree: &'a Embree,
        strands: &StrandSet,
        quality: Quality,
        threads: usize,
    ) -> Result<EmbreeScene<'a>, EmbreeError> {
        let vertices =
            strands.points.iter().zip(&strands.radii_mm).map(|(p, &r)| [p.x, p.y, p.z, r]).collect();
        let (mut indices, mut flags) = (Vec::new(), Vec::new());
        for s in 0..strands.len() {
            let range = strands.range(s);
            for i in range.start..range.end.saturating_sub(1) {
                indices.push(i as u32);
                // Bit 0: there is a segment before; bit 1: one after.
                flags.push(u8::from(i > range.start) | u8::from(i + 2 < range.end) << 1);
            }
        }
        let arrays = Arrays {
            kind: raw::GEOMETRY_ROUND_LINEAR_CURVE,
            vertices,
            vertex_format: raw::FORMAT_FLOAT4,
            indices,
            index_format: raw::FORMAT_UINT,
            per_index: 1,
            flags,
        };
        EmbreeScene::new(embree, arrays, quality, threads)
    }

    /// A triangle mesh.
    ///
    /// # Errors
    /// If a call of Embree's fails.
    pub fn triangles(
        embree: &'a Embree,
        mesh: &TriMesh,
        quality: Quality,
        threads: usize,
    ) -> Result<EmbreeScene<'a>, EmbreeError> {
        let arrays = Arrays {
            kind: raw::GEOMETRY_TRIANGLE,
            vertices: mesh.vertices.iter().map(|p| [p.x, p.y, p.z, 0.0]).collect(),
            vertex_format: raw::FORMAT_FLOAT3,
            indices: mesh.triangles.iter().flatten().copied().collect(),
            index_format: raw::FORMAT_UINT3,
            per_index: 3,
            flags: Vec::new(),
        };
        EmbreeScene::new(embree, arrays, quality, threads)
    }

    fn new(
        embree: &'a Embree,
        arrays: Arrays,
        quality: Quality,
        threads: usize,
    ) -> Result<EmbreeScene<'a>, EmbreeError> {
        let f = &embree.functions;
        let device = embree.device(threads)?;
        let Arrays { kind, vertices, vertex_format, indices, index_format, per_index, flags } = arrays;
        // SAFETY: handles are live until released; Embree reads vectors in units of 16 bytes at most, which holds
        // for four floats a vertex, and the other arrays are read element by element; they live as long as the
        // scene, which owns them. Their heap blocks do not move with the vectors.
        let scene = unsafe {
            let geometry = (f.new_geometry)(device, kind);
            let share = |buffer, format, data: *const c_void, stride: usize, count: usize| {
                (f.set_shared_buffer)(geometry, buffer, 0, format, data, 0, stride, count);
            };
            share(raw::BUFFER_VERTEX, vertex_format, vertices.as_ptr().cast(), 16, vertices.len());
            let rows = indices.len() / per_index;
            share(raw::BUFFER_INDEX, index_format, indices.as_ptr().cast(), 4 * per_index, rows);
            if !flags.is_empty() {
                share(raw::BUFFER_FLAGS, raw::FORMAT_UCHAR, flags.as_ptr().cast(), 1, flags.len());
            }
            (f.set_geometry_quality)(geometry, quality as i32);
            (f.commit_geometry)(geometry);
            let scene = (f.new_scene)(device);
            (f.set_scene_quality)(scene, quality as i32);
            (f.attach_geometry)(scene, geometry);
            (f.release_geometry)(geometry);
            (f.commit_scene)(scene);
            scene
        };
        // Made before the check, so that a failure releases what there is.
        let made =
            EmbreeScene { embree, device, scene, _vertices: vertices, _indices: indices, _flags: flags };
        embree.check(device, "building a scene")?;
        Ok(made)
    }

    fn ray(origin: Vec3, direction: Vec3, tmax: f32) -> RayHit {
        RayHit {
            origin: origin.to_array(),
            tnear: 0.0,
            direction: direction.to_array(),
            time: 0.0,
            tfar: tmax,
            mask: u32::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: raw::INVALID,
            geometry: raw::INVALID,
            instances: [raw::INVALID; 5],
        }
    }

    /// Distance (mm) and primitive of the first hit.
    #[inline]
    pub fn closest(&self, origin: Vec3, direction: Vec3) -> Option<(f32, u32)> {
        let mut ray = EmbreeScene::ray(origin, direction, f32::INFINITY);
        // SAFETY: the scene is committed; the ray is aligned to 16 bytes and as long as Embree's.
        unsafe { (self.embree.functions.intersect)(self.scene, &mut ray, std::ptr::null_mut()) };
        (ray.geometry != raw::INVALID).then_some((ray.tfar, ray.primitive))
    }

    /// Whether anything lies before `tmax`.
    #[inline]
    pub fn occluded(&self, origin: Vec3, direction: Vec3, tmax: f32) -> bool {
        let mut ray = EmbreeScene::ray(origin, direction, tmax);
        // SAFETY: as above; occlusion reads and writes the ray part alone.
        unsafe { (self.embree.functions.occluded)(self.scene, &mut ray, std::ptr::null_mut()) };
        ray.tfar < 0.0
    }
}

impl Drop for EmbreeScene<'_> {
    fn drop(&mut self) {
        let f = &self.embree.functions;
        // SAFETY: both are live and not used again; a null scene is not released.
        unsafe {
            if !self.scene.is_null() {
                (f.release_scene)(self.scene);
            }
            (f.release_device)(self.device);
        }
    }
}

/// Sets flush-to-zero and denormals-are-zero for this thread while `f` runs, as Embree's manual asks for.
pub fn flushing_denormals<R>(f: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        let mut old = 0u32;
        // SAFETY: stores and loads the control word of SSE, whose bits 6 and 15 are the two modes; it is put back.
        unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &mut old) };
        let new = old | 1 << 6 | 1 << 15;
        // SAFETY: as above.
        unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &new) };
        let result = f();
        // SAFETY: as above.
        unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &old) };
        result
    }
    #[cfg(not(target_arch = "x86_64"))]
    f()
}
