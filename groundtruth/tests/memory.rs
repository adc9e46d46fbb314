//! Planes of a view take no more memory than they hold, and a view more takes none.

use glam::{DVec3, Mat3, Vec3};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use strandbench_groundtruth::Sightings;
use strandbench_groundtruth::face::{Frames, face_view};
use strandbench_renderer::Probe;
use strandbench_types::{
    Camera, FaceView, FirstHit, FlowState, Moment, Rig, SampleHit, SampleHits, Silent, StrandSet, TriMesh,
};

struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: passes everything on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        MOST.fetch_max(NOW.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        // SAFETY: as the caller's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as the caller's.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What `work` gives, and by how many bytes the memory in use rose above what it was before.
fn rise<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = NOW.load(Relaxed);
    MOST.store(before, Relaxed);
    let made = work();
    (made, MOST.load(Relaxed) - before)
}

fn camera(width: u32, height: u32) -> Camera {
    Camera::look_at("c", (width, height), 1000.0, DVec3::new(0.0, 0.0, 500.0), DVec3::ZERO, DVec3::NEG_Y)
}

// One test alone, for the count is that of the whole process.
#[test]
fn memory_is_that_of_what_is_returned() {
    let mut strands = StrandSet::new();
    for i in 0..200 {
        let x = i as f32 - 100.0;
        strands.push(&[Vec3::new(x, -90.0, 5.0), Vec3::new(x + 9.0, 90.0, 6.0)], 0.2);
    }
    let vertices = [(-400.0, -400.0), (400.0, -400.0), (0.0, 500.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let mesh = TriMesh { vertices: vertices.to_vec(), triangles: vec![[0, 1, 2]] };
    let (meshes, axes, none) = ([&mesh], vec![Mat3::IDENTITY; 200], StrandSet::new());
    let (all, bare) = (Probe::new(&strands, &meshes).unwrap(), Probe::new(&none, &meshes).unwrap());
    let moment = Moment { strands: &strands, meshes: &meshes, follicle_axes: &axes };
    let kinds = vec![0; 200];
    let frames = Frames { now: moment, reference: moment, kinds: &kinds, sight: &all, bare_sight: &bare };
    let view = |c: &Camera| -> FaceView {
        let seen = all.first_hits(c, &Silent).unwrap();
        let behind = bare.behind_hair(c, &seen, &Silent).unwrap();
        face_view(&frames, c, seen, behind, &Silent).unwrap()
    };
    // Threads and their stacks come first.
    drop(view(&camera(64, 48)));
    let c = camera(2000, 1500);
    let (made, most) = rise(|| view(&c));
    // Two planes each of hits, depths, flows and states, and one of labels.
    let pixel = 2 * (size_of::<FirstHit>() + 4 + 8 + size_of::<FlowState>()) + 1;
    let held = 2000 * 1500 * pixel;
    assert!(made.hair_mask().data.iter().filter(|&&m| m).count() > 10_000);
    assert!(most < held + (1 << 20), "{most} bytes for planes of {held}");
    drop(made);

    // Buffers of cameras that come one after the other do not add up.
    let buffer = |n: usize| {
        let (a, b) = (strands.points[0].as_dvec3(), strands.points[1].as_dvec3());
        let (px, z) = c.project(a.lerp(b, 0.5)).unwrap();
        let at = px.y as usize * 2000 + px.x as usize;
        let hit = SampleHit { strand: 0, segment: 0, along: 0.5, depth_mm: z as f32 };
        let offsets = (0..=3_000_000).map(|i| if i > at { n as u32 } else { 0 }).collect();
        SampleHits { width: 2000, height: 1500, rays: vec![n as u16; 3_000_000], offsets, hits: vec![hit; n] }
    };
    let rig = |n: usize| Rig {
        cameras: (0..n).map(|i| Camera { name: format!("c{i}"), ..c.clone() }).collect(),
        near_mm: 1.0,
        far_mm: 1000.0,
        frame_rate_hz: 25.0,
        exposure_s: 0.001,
    };
    let walk = |n: usize| {
        let rig = rig(n);
        rise(|| {
            let mut sightings = Sightings::new(&rig, &strands).unwrap();
            for i in 0..n {
                drop(sightings.add(i, &buffer(64)).unwrap());
            }
            sightings.finish()
        })
    };
    let ((few, a), (many, b)) = (walk(2), walk(6));
    assert_eq!(few.seen_by.iter().filter(|&&s| s == 3).count(), 1);
    assert_eq!(many.seen_by.iter().filter(|&&s| s == 63).count(), 1);
    assert!(b < a + (1 << 20), "{a} bytes for two cameras, {b} for six");
}
