//! Image cells and the patches that lie in them: Q and Q* of the paper.

use super::Patch;
use super::bits;
use super::view::View;
use glam::DVec3;

/// The cells of all views.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    cell_px: usize,
    grids: Vec<Grid>,
}

#[derive(Clone, Debug)]
struct Grid {
    columns: usize,
    rows: usize,
    /// Patches that may be visible there: Q.
    visible: Vec<Vec<u32>>,
    /// Patches that agree there: Q*.
    agreeing: Vec<Vec<u32>>,
}

impl Cells {
    /// Cells that hold `patches`, of which patch k is number k.
    pub fn new(views: &[View], cell_px: usize, patches: &[Patch]) -> Cells {
        let grids = views
            .iter()
            .map(|v| {
                let (columns, rows) = (v.image.width.div_ceil(cell_px), v.image.height.div_ceil(cell_px));
                let empty = vec![Vec::new(); columns * rows];
                Grid { columns, rows, visible: empty.clone(), agreeing: empty }
            })
            .collect();
        let mut cells = Cells { cell_px, grids };
        for (k, patch) in patches.iter().enumerate() {
            cells.insert(views, k as u32, patch);
        }
        cells
    }

    pub fn insert(&mut self, views: &[View], number: u32, patch: &Patch) {
        for v in bits(patch.visible | patch.agreeing) {
            let Some(cell) = self.cell_of(views, v, patch.centre) else { continue };
            let grid = &mut self.grids[v];
            grid.visible[cell].push(number);
            if patch.agreeing >> v & 1 == 1 {
                grid.agreeing[cell].push(number);
            }
        }
    }

    /// The cell of a view that holds a point's image.
    pub fn cell_of(&self, views: &[View], view: usize, at: DVec3) -> Option<usize> {
        let (p, _) = views[view].camera.project(at).filter(|(p, _)| views[view].camera.contains(*p))?;
        let (x, y) = (p.x as usize / self.cell_px, p.y as usize / self.cell_px);
        Some(y * self.grids[view].columns + x)
    }

    /// Centre of a cell, px.
    pub fn centre_px(&self, view: usize, cell: usize) -> glam::DVec2 {
        let columns = self.grids[view].columns;
        glam::DVec2::new((cell % columns) as f64 + 0.5, (cell / columns) as f64 + 0.5) * self.cell_px as f64
    }

    /// The four cells beside a cell.
    pub fn beside(&self, view: usize, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let (columns, rows) = (self.grids[view].columns, self.grids[view].rows);
        let (x, y) = (cell % columns, cell / columns);
        let there = [(x > 0, cell.wrapping_sub(1)), (x + 1 < columns, cell + 1)];
        let above = [(y > 0, cell.wrapping_sub(columns)), (y + 1 < rows, cell + columns)];
        there.into_iter().chain(above).filter_map(|(is, c)| is.then_some(c))
    }

    pub fn visible(&self, view: usize, cell: usize) -> &[u32] {
        &self.grids[view].visible[cell]
    }

    pub fn agreeing(&self, view: usize, cell: usize) -> &[u32] {
        &self.grids[view].agreeing[cell]
    }

    /// Whether a point lies at most ρ (the size of a cell there) behind the patches that agree in its cell of a view.
    pub fn in_front(&self, views: &[View], patches: &[Patch], view: usize, at: DVec3) -> bool {
        let Some(cell) = self.cell_of(views, view, at) else { return false };
        let camera = &views[view].camera;
        let depth = |p: DVec3| camera.to_camera(p).z;
        let nearest = self
            .agreeing(view, cell)
            .iter()
            .map(|&k| depth(patches[k as usize].centre))
            .fold(f64::INFINITY, f64::min);
        depth(at) <= nearest + self.size_mm(&views[view], at)
    }

    /// Size of a cell of a view at a point, mm.
    pub fn size_mm(&self, view: &View, at: DVec3) -> f64 {
        view.footprint_mm(at) * self.cell_px as f64
    }

    /// Whether two patches are neighbours: close to each other along both normals (Eq. 4 of the paper).
    pub fn neighbours(&self, views: &[View], a: &Patch, b: &Patch) -> bool {
        let d = a.centre - b.centre;
        let reach = self.size_mm(&views[a.reference], 0.5 * (a.centre + b.centre));
        d.dot(a.normal).abs() + d.dot(b.normal).abs() < 2.0 * reach
    }
}
