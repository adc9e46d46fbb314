//! Ground truth of a face with hair: flow, the skin beneath, where hairs stand, how far the hair is.

use crate::{DepthMap, FirstHit, HitPlane, Plane, StrandSet, TriMesh};
use glam::{DVec3, Vec3};

/// Where what each pixel's centre shows at one moment lies in the same camera's image of another moment, px.
#[derive(Clone, Debug)]
pub struct FlowMap {
    /// Position in the other image less the pixel's centre (x right, y down), px; NaN where nothing is met or what
    /// is met lies at or behind the camera then.
    pub flow_px: Plane<[f32; 2]>,
    /// What becomes of the pixel's point.
    pub state: Plane<FlowState>,
}

/// What becomes of a pixel's point at the other moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FlowState {
    /// The pixel shows nothing, or the point lies at or behind the camera: there is no flow.
    #[default]
    Absent,
    /// The point projects outside the image.
    Outside,
    /// The point projects into the image, but something hides it.
    Occluded,
    /// The point is seen.
    Seen,
}

impl FlowState {
    /// Whether the point projects into the image.
    pub fn is_valid(self) -> bool {
        matches!(self, FlowState::Occluded | FlowState::Seen)
    }
}

impl PartialEq for FlowMap {
    /// Bit equality, so that two absent flows are equal.
    fn eq(&self, other: &FlowMap) -> bool {
        let bits = |f: &FlowMap| f.flow_px.map(|v| v.map(f32::to_bits));
        self.state == other.state && bits(self) == bits(other)
    }
}

/// Label of a pixel that shows nothing.
pub const LABEL_NOTHING: u8 = 0;
/// Label of a pixel that shows skin (surface 0).
pub const LABEL_SKIN: u8 = 1;
/// Label of a pixel that shows another surface: eyes, teeth, tongue.
pub const LABEL_OTHER: u8 = 2;
/// Label of a pixel that shows hair of kind 0; kind k has this plus k.
pub const LABEL_HAIR: u8 = 16;

/// Truth of one camera's view of a face, from rays through the pixels' centres.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceView {
    /// What is seen.
    pub seen: HitPlane,
    /// What would be seen without hair.
    pub bare: HitPlane,
    /// [`LABEL_NOTHING`], [`LABEL_SKIN`], [`LABEL_OTHER`], or [`LABEL_HAIR`] plus the hair's kind.
    pub labels: Plane<u8>,
    /// Flow to the reference frame of what is seen; hidden by anything there.
    pub flow: FlowMap,
    /// Flow to the reference frame of what would be seen without hair; hidden by surfaces alone there.
    pub bare_flow: FlowMap,
}

impl FaceView {
    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        self.labels.size()
    }

    /// Whether hair is seen, indexed `[pixel]`.
    pub fn hair_mask(&self) -> Plane<bool> {
        self.labels.map(|&l| l >= LABEL_HAIR)
    }

    /// Depth of the skin and what else is no hair, mm.
    pub fn skin_depth(&self) -> &DepthMap {
        &self.bare.depth
    }

    /// Says how the planes contradict each other, if they do: sizes, and what is seen where no hair is.
    pub fn validate(&self) -> Result<(), String> {
        let size = self.size();
        let sizes = [
            ("seen", self.seen.hits.size()),
            ("depth", self.seen.depth.size()),
            ("bare", self.bare.hits.size()),
            ("bare depth", self.bare.depth.size()),
            ("flow", self.flow.flow_px.size()),
            ("state of flow", self.flow.state.size()),
            ("bare flow", self.bare_flow.flow_px.size()),
            ("state of bare flow", self.bare_flow.state.size()),
        ];
        if let Some((name, other)) = sizes.iter().find(|(_, s)| *s != size) {
            return Err(format!("labels are {size:?} px, but {name} is {other:?} px"));
        }
        for (i, (seen, bare)) in self.seen.hits.data.iter().zip(&self.bare.hits.data).enumerate() {
            let fault = match (seen, bare) {
                (_, FirstHit::Fibre { .. }) => "hair without hair",
                (FirstHit::Fibre { .. }, _) => continue,
                (a, b) if a != b => "something else without hair although it shows none",
                _ => continue,
            };
            return Err(format!("pixel ({}, {}) shows {fault}", i % size.0, i / size.0));
        }
        Ok(())
    }
}

/// Bounds between classes of density, hairs per cm² (METRICS D4).
pub const DENSITY_BOUNDS_PER_CM2: [f32; 3] = [10.0, 30.0, 60.0];
/// Bounds between classes of length, mm (METRICS D4).
pub const LENGTH_BOUNDS_MM: [f32; 3] = [2.0, 5.0, 20.0];

/// Where and what a hair is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HairRoot {
    /// First point of the strand, mm.
    pub position_mm: Vec3,
    /// Triangle of the skin that holds the follicle.
    pub triangle: u32,
    /// Weights of the triangle's corners; none is negative and their sum is 1.
    pub barycentric: [f32; 3],
    /// Arc length of the strand, mm.
    pub length_mm: f32,
    /// Kind of hair: what groom it belongs to.
    pub kind: u8,
    /// Hairs around it, per cm² of skin.
    pub density_per_cm2: f32,
}

impl HairRoot {
    /// Class by [`LENGTH_BOUNDS_MM`], 0 for the shortest.
    pub fn length_class(&self) -> usize {
        class(self.length_mm, &LENGTH_BOUNDS_MM)
    }

    /// Class by [`DENSITY_BOUNDS_PER_CM2`], 0 for the sparsest.
    pub fn density_class(&self) -> usize {
        class(self.density_per_cm2, &DENSITY_BOUNDS_PER_CM2)
    }
}

/// How many bounds the value reaches.
fn class(value: f32, bounds: &[f32]) -> usize {
    bounds.iter().filter(|&&b| value >= b).count()
}

/// What hair does to a vertex of the skin (METRICS D1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum SkinCover {
    /// Far from all hair and never hidden by it: the control.
    Bare = 0,
    /// Neither.
    Margin = 1,
    /// Under hair.
    Under = 2,
}

/// Truth of one frame of a face, apart from its views.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceTruth {
    /// The skin.
    pub skin: TriMesh,
    /// Every fibre, mm, world, root first.
    pub strands: StrandSet,
    /// Indexed `[strand]`.
    pub roots: Vec<HairRoot>,
    /// Names of the kinds, indexed `[kind]`.
    pub kinds: Vec<String>,
    /// Which cameras see which strand sample; see [`crate::Visibility`].
    pub visibility: crate::Visibility,
    /// Bit c is set where camera c sees the vertex of the skin.
    pub skin_seen_by: Vec<u32>,
    /// Bit c is set where camera c would see the vertex without hair.
    pub skin_bare_seen_by: Vec<u32>,
    /// Indexed `[vertex]` of the skin.
    pub skin_cover: Vec<SkinCover>,
}

impl FaceTruth {
    /// Says what contradicts what, if anything does.
    pub fn validate(&self) -> Result<(), String> {
        self.skin.validate().map_err(|e| format!("skin: {e}"))?;
        self.strands.validate().map_err(|e| e.to_string())?;
        let (n, v) = (self.strands.len(), self.skin.vertices.len());
        if self.roots.len() != n || self.visibility.offsets.len() != n + 1 {
            return Err(format!(
                "{n} strands have {} roots and visibility of {}",
                self.roots.len(),
                self.visibility.offsets.len().saturating_sub(1)
            ));
        }
        let counts = [
            ("skin_seen_by", self.skin_seen_by.len()),
            ("skin_bare_seen_by", self.skin_bare_seen_by.len()),
            ("skin_cover", self.skin_cover.len()),
        ];
        if let Some((name, c)) = counts.iter().find(|(_, c)| *c != v) {
            return Err(format!("{name} has {c} entries for {v} vertices of the skin"));
        }
        if self.kinds.len() > usize::from(u8::MAX - LABEL_HAIR) + 1 {
            return Err(format!("{} kinds of hair do not fit into a label", self.kinds.len()));
        }
        for (i, r) in self.roots.iter().enumerate() {
            r.check(self.skin.triangles.len(), self.kinds.len()).map_err(|e| format!("root {i} {e}"))?;
        }
        Ok(())
    }
}

impl HairRoot {
    /// Says what is wrong with the root, if anything is, among so many triangles and kinds.
    pub fn check(&self, triangles: usize, kinds: usize) -> Result<(), String> {
        let b = self.barycentric;
        let sum: f32 = b.iter().sum();
        if self.triangle as usize >= triangles {
            return Err(format!("stands in triangle {} of {triangles}", self.triangle));
        }
        if usize::from(self.kind) >= kinds {
            return Err(format!("is of kind {} of {kinds}", self.kind));
        }
        let whole = b.iter().all(|w| *w >= -1e-5) && (sum - 1.0).abs() <= 1e-4;
        if !whole {
            return Err(format!("has weights {b:?}, which are negative or do not sum to 1"));
        }
        let numbers = [self.position_mm.length(), self.length_mm, self.density_per_cm2];
        if numbers.iter().any(|v| !(v.is_finite() && *v >= 0.0)) {
            return Err("has a position, length or density that is negative or not finite".to_owned());
        }
        Ok(())
    }
}

/// Distance to the nearest hair on a regular grid, with the place of the first voxel's centre. Indexed
/// `[(x * ny + y) * nz + z]`: C order of shape (nx, ny, nz).
#[derive(Clone, Debug, PartialEq)]
pub struct HairField {
    /// Centre of voxel (0, 0, 0), mm, world.
    pub origin_mm: Vec3,
    /// Edge of a voxel, mm.
    pub voxel_mm: f32,
    /// Voxels along x, y and z of the world.
    pub size: [usize; 3],
    /// Distance from the voxel's centre to the nearest point of any fibre's axis, mm.
    pub distance_mm: Vec<f32>,
    /// Strand that holds this point.
    pub strand: Vec<u32>,
}

impl HairField {
    /// Centre of a voxel, mm.
    pub fn centre_mm(&self, [x, y, z]: [usize; 3]) -> DVec3 {
        self.origin_mm.as_dvec3() + f64::from(self.voxel_mm) * DVec3::new(x as f64, y as f64, z as f64)
    }
}
