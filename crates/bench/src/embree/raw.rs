//! Embree 4's C interface, as far as it is used here: the functions by name, the layout of a ray.
//!
//! Facts from Embree's API reference (`rtcore_ray.h`, `rtcore_device.h`, `rtcore_geometry.h`).

use libloading::Library;
use std::ffi::{c_char, c_uint, c_void};
use std::mem::ManuallyDrop;

pub type Handle = *mut c_void;

/// `RTCRayHit` of Embree 4: an `RTCRay` of 48 bytes, then an `RTCHit`, which is 32 bytes in builds without and
/// 48 bytes in builds with instance arrays; the longer fits both.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct RayHit {
    pub origin: [f32; 3],
    pub tnear: f32,
    pub direction: [f32; 3],
    pub time: f32,
    pub tfar: f32,
    pub mask: u32,
    pub id: u32,
    pub flags: u32,
    pub normal: [f32; 3],
    pub u: f32,
    pub v: f32,
    pub primitive: u32,
    pub geometry: u32,
    pub instances: [u32; 5],
}

const _: () = assert!(size_of::<RayHit>() == 96 && align_of::<RayHit>() == 16);
const _: () = assert!(std::mem::offset_of!(RayHit, tfar) == 32 && std::mem::offset_of!(RayHit, normal) == 48);
const _: () =
    assert!(std::mem::offset_of!(RayHit, primitive) == 68 && std::mem::offset_of!(RayHit, geometry) == 72);

pub const INVALID: u32 = u32::MAX;
pub const PROPERTY_VERSION: i32 = 0;
pub const PROPERTY_CURVES: i32 = 99;
pub const GEOMETRY_TRIANGLE: i32 = 0;
pub const GEOMETRY_ROUND_LINEAR_CURVE: i32 = 16;
pub const BUFFER_INDEX: i32 = 0;
pub const BUFFER_VERTEX: i32 = 1;
pub const BUFFER_FLAGS: i32 = 32;
pub const FORMAT_UCHAR: i32 = 0x1001;
pub const FORMAT_UINT: i32 = 0x5001;
pub const FORMAT_UINT3: i32 = 0x5003;
pub const FORMAT_FLOAT3: i32 = 0x9003;
pub const FORMAT_FLOAT4: i32 = 0x9004;

/// Makes a struct of function pointers and the function that looks them up by their C names.
macro_rules! functions {
    ($($name:ident: $c:literal fn($($arg:ty),*) $(-> $ret:ty)?;)*) => {
        /// The functions. The library is never unloaded: its worker threads may outlive the last device.
        pub struct Functions {
            $(pub $name: unsafe extern "C" fn($($arg),*) $(-> $ret)?,)*
            _library: ManuallyDrop<Library>,
        }

        impl Functions {
            /// Looks every function up.
            pub fn of(library: Library) -> Result<Functions, libloading::Error> {
                // SAFETY: the types are those of Embree 4's headers; the caller checks the version before
                // anything but the device functions, which are the same in Embree 3, is called.
                $(let $name = unsafe {
                    *library.get::<unsafe extern "C" fn($($arg),*) $(-> $ret)?>(concat!($c, "\0").as_bytes())?
                };)*
                Ok(Functions { $($name,)* _library: ManuallyDrop::new(library) })
            }
        }
    };
}

functions! {
    new_device: "rtcNewDevice" fn(*const c_char) -> Handle;
    release_device: "rtcReleaseDevice" fn(Handle);
    device_error: "rtcGetDeviceError" fn(Handle) -> i32;
    device_property: "rtcGetDeviceProperty" fn(Handle, i32) -> isize;
    new_geometry: "rtcNewGeometry" fn(Handle, i32) -> Handle;
    release_geometry: "rtcReleaseGeometry" fn(Handle);
    set_geometry_quality: "rtcSetGeometryBuildQuality" fn(Handle, i32);
    set_shared_buffer: "rtcSetSharedGeometryBuffer"
        fn(Handle, i32, c_uint, i32, *const c_void, usize, usize, usize);
    commit_geometry: "rtcCommitGeometry" fn(Handle);
    new_scene: "rtcNewScene" fn(Handle) -> Handle;
    release_scene: "rtcReleaseScene" fn(Handle);
    set_scene_quality: "rtcSetSceneBuildQuality" fn(Handle, i32);
    attach_geometry: "rtcAttachGeometry" fn(Handle, Handle) -> c_uint;
    commit_scene: "rtcCommitScene" fn(Handle);
    intersect: "rtcIntersect1" fn(Handle, *mut RayHit, *mut c_void);
    occluded: "rtcOccluded1" fn(Handle, *mut RayHit, *mut c_void);
}
