mod closure;
mod distance;
mod occlusion;
mod refusals;

use super::*;
use glam::{DVec3, Mat3, Vec3};
use std::sync::LazyLock;
use strandbench_renderer::Probe;
use strandbench_rng::Rng;
use strandbench_scenes::face::{
    Act, FaceModel, FaceSpec, Follicle, FollicleFrame, Identity, Part, Performance, PosedFace,
};
use strandbench_types::{Camera, HitPlane, Moment, Silent, StrandSet, TriMesh};

/// A face with hairs at one moment.
struct Shot {
    strands: StrandSet,
    meshes: Vec<TriMesh>,
    frames: Vec<FollicleFrame>,
    axes: Vec<Mat3>,
}

impl Shot {
    fn refs(&self) -> Vec<&TriMesh> {
        self.meshes.iter().collect()
    }
}

/// The reference frame and one while the face talks; hairs of even index follow their follicle, the others bend too.
struct Pair {
    reference: Shot,
    now: Shot,
    kinds: Vec<u8>,
    /// Triangles of the skin's mesh and weights, indexed [strand].
    follicles: Vec<(u32, [f32; 3])>,
}

const RADIUS_MM: f32 = 0.06;

static PAIR: LazyLock<Pair> = LazyLock::new(|| {
    let model = FaceModel::embedded();
    let person = Identity::draw(model, &FaceSpec { identity: 4, ..FaceSpec::default() }).unwrap();
    let act = Performance { act: Act::Dialogue, seed: 2 };
    let face = |t: f64| model.pose(&person, &act.pose(model, t)).unwrap();
    let (neutral, talking) = (face(0.0), face(2.6));
    let mut of_skin = vec![0u32; model.triangles().len()];
    let skin = model.parts().iter().map(|p| *p == Part::Skin);
    let mut n = 0;
    for (place, is_skin) in of_skin.iter_mut().zip(skin) {
        *place = n;
        n += u32::from(is_skin);
    }
    let mut rng = Rng::keyed(&[6, 6]);
    let mut follicles = Vec::new();
    while follicles.len() < 3000 {
        let triangle = (rng.f64() * model.triangles().len() as f64) as u32;
        let (a, b) = (rng.f32(), rng.f32());
        let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
        let f = Follicle { triangle, barycentric: [1.0 - a - b, a, b] };
        let frame = f.frame(model, &neutral);
        let [p, z] = [frame.position, frame.axes.z_axis];
        if model.parts()[triangle as usize] == Part::Skin
            && (-100.0..-25.0).contains(&p.y)
            && p.z > 40.0
            && z.z > 0.3
        {
            follicles.push(f);
        }
    }
    let shot = |face: &PosedFace, bend: f32| {
        let frames: Vec<_> = follicles.iter().map(|f| f.frame(model, face)).collect();
        let mut strands = StrandSet::new();
        for (i, f) in frames.iter().enumerate() {
            let mut rng = Rng::keyed(&[7, i as u64]);
            // Fixed to the follicle: out of the skin and to the side.
            let lean = Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(0.4, 1.0)).normalize();
            let count = 4 + i % 19;
            let points: Vec<Vec3> = (0..count)
                .map(|k| {
                    let s = 0.8 * k as f32;
                    let own = if i % 2 == 1 { bend * 0.01 * s * s } else { 0.0 };
                    f.position + f.axes * (lean * s + own * Vec3::new(0.3, 1.0, 0.2))
                })
                .collect();
            let radii: Vec<f32> =
                (0..count).map(|k| RADIUS_MM * (1.0 - 0.5 * k as f32 / count as f32)).collect();
            strands.push_tapered(&points, &radii);
        }
        let mesh = |parts: &[Part]| model.part_mesh(&face.vertices, parts);
        Shot {
            strands,
            meshes: vec![
                mesh(&[Part::Skin]),
                mesh(&[Part::LeftEye, Part::RightEye]),
                mesh(&[Part::UpperTeeth, Part::LowerTeeth]),
                mesh(&[Part::Tongue]),
            ],
            axes: frames.iter().map(|f| f.axes).collect(),
            frames,
        }
    };
    Pair {
        reference: shot(&neutral, 0.0),
        now: shot(&talking, 1.0),
        kinds: (0..follicles.len()).map(|i| (i % 3) as u8).collect(),
        follicles: follicles.iter().map(|f| (of_skin[f.triangle as usize], f.barycentric)).collect(),
    }
});

/// 10 px/mm as a camera of 12 megapixels has that sees a head, but of a window alone.
fn window(name: &str, eye: DVec3, px: u32) -> Camera {
    Camera::look_at(name, (px, px), 8000.0, eye, DVec3::new(3.0, -62.0, 85.0), DVec3::NEG_Y)
}

fn cameras() -> [Camera; 2] {
    let front = window("front", DVec3::new(20.0, -60.0, 880.0), 420);
    [front, window("side", DVec3::new(560.0, -190.0, 640.0), 420)]
}

/// First hits with and without hair.
fn planes(shot: &Shot, camera: &Camera) -> (HitPlane, HitPlane) {
    let all = Probe::new(&shot.strands, &shot.refs()).unwrap();
    let none = StrandSet::new();
    let bare = Probe::new(&none, &shot.refs()).unwrap();
    let seen = all.first_hits(camera, &Silent).unwrap();
    let behind = bare.behind_hair(camera, &seen, &Silent).unwrap();
    (seen, behind)
}

fn moment<'a>(shot: &'a Shot, meshes: &'a [&'a TriMesh]) -> Moment<'a> {
    Moment { strands: &shot.strands, meshes, follicle_axes: &shot.axes }
}

/// The point of a segment nearest to `p`.
fn foot(p: DVec3, [a, b]: [DVec3; 2]) -> DVec3 {
    let u = b - a;
    a + u * ((p - a).dot(u) / u.length_squared()).clamp(0.0, 1.0)
}
