//! A face with straight hairs that follow their follicles.

use glam::{Mat3, Vec3};
use strandbench_rng::Rng;
use strandbench_scenes::face::{FaceModel, Follicle, Part, PosedFace};
use strandbench_types::{StrandSet, TriMesh};

pub const KINDS: [&str; 3] = ["beard", "moustache", "brows"];

/// Where hairs stand: at the same places at every moment.
pub struct Stand {
    follicles: Vec<Follicle>,
    /// Triangle of the skin's mesh, indexed [strand].
    pub triangles: Vec<u32>,
    pub kinds: Vec<u8>,
}

/// Geometry of one moment.
pub struct Shot {
    pub strands: StrandSet,
    /// Skin, eyes, teeth, tongue.
    pub meshes: Vec<TriMesh>,
    pub axes: Vec<Mat3>,
}

impl Stand {
    /// `count` follicles on chin, cheeks, lip and brows of the neutral face, even by area of texture.
    pub fn new(model: &FaceModel, neutral: &PosedFace, count: usize) -> Stand {
        let mut of_skin = Vec::new();
        let mut n = 0;
        for part in model.parts() {
            of_skin.push(n);
            n += u32::from(*part == Part::Skin);
        }
        let mut stand = Stand { follicles: Vec::new(), triangles: Vec::new(), kinds: Vec::new() };
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| neutral.vertices[i as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        let mut rng = Rng::keyed(&[0xFACE]);
        while stand.kinds.len() < count {
            let triangle = (rng.f64() * model.triangles().len() as f64) as u32;
            // Triangles are drawn in proportion to their area; the largest of a face are under 4 mm².
            if rng.f32() * 4.0 > area(&model.triangles()[triangle as usize]) {
                continue;
            }
            let (a, b) = (rng.f32(), rng.f32());
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            let f = Follicle { triangle, barycentric: [1.0 - a - b, a, b] };
            let at = f.frame(model, neutral);
            let (p, out) = (at.position, at.axes.z_axis);
            let kind = match p {
                _ if model.parts()[triangle as usize] != Part::Skin || p.z < 25.0 || out.z < 0.1 => continue,
                p if (22.0..32.0).contains(&p.y) && (12.0..50.0).contains(&p.x.abs()) => 2,
                p if (-80.0..-71.0).contains(&p.y) && p.x.abs() < 24.0 => 1,
                p if (-140.0..-102.0).contains(&p.y)
                    || ((-102.0..-40.0).contains(&p.y) && p.x.abs() > 36.0) =>
                {
                    0
                }
                _ => continue,
            };
            stand.follicles.push(f);
            stand.triangles.push(of_skin[triangle as usize]);
            stand.kinds.push(kind);
        }
        stand
    }

    pub fn barycentrics(&self) -> Vec<[f32; 3]> {
        self.follicles.iter().map(|f| f.barycentric).collect()
    }

    /// Straight hairs out of the skin and downwards, fixed to their follicles.
    pub fn shot(&self, model: &FaceModel, neutral: &PosedFace, face: &PosedFace) -> Shot {
        let (mut strands, mut axes) = (StrandSet::new(), Vec::new());
        for (i, f) in self.follicles.iter().enumerate() {
            let mut rng = Rng::keyed(&[0x4A1, i as u64]);
            let (rest, now) = (f.frame(model, neutral), f.frame(model, face));
            let mut any = |s: f32| Vec3::new(rng.range(-s, s), rng.range(-s, s), rng.range(-s, s));
            let down = if self.kinds[i] == 2 { Vec3::X * rest.position.x.signum() } else { Vec3::NEG_Y };
            let lean = (rest.axes.z_axis * 0.6 + down + any(0.4)).normalize();
            let length = [14.0, 8.0, 7.0][usize::from(self.kinds[i])] * (1.0 + any(0.4).x);
            let points: Vec<Vec3> = (0..10)
                .map(|k| now.position + now.axes * (rest.axes.transpose() * lean * length * k as f32 / 9.0))
                .collect();
            let radii: Vec<f32> = (0..10).map(|k| 0.05 * (1.0 - 0.06 * k as f32)).collect();
            strands.push_tapered(&points, &radii);
            axes.push(now.axes);
        }
        let mesh = |parts: &[Part]| model.part_mesh(&face.vertices, parts);
        let meshes = vec![
            mesh(&[Part::Skin]),
            mesh(&[Part::LeftEye, Part::RightEye]),
            mesh(&[Part::UpperTeeth, Part::LowerTeeth]),
            mesh(&[Part::Tongue]),
        ];
        Shot { strands, meshes, axes }
    }
}
