//! What the cameras deliver.

use crate::{Plane, Rig};

/// One time step: a linear-light image and a keyed hair mask per camera, in rig order.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Time index.
    pub index: u32,
    /// Linear-light monochrome images, 1.0 at full scale, indexed `[camera][pixel]`.
    pub images: Vec<Plane<f32>>,
    /// Keyed hair masks (true = hair), indexed `[camera][pixel]`: what Luo et al. 4.2 get from rotoscoping.
    pub masks: Vec<Plane<bool>>,
}

impl Frame {
    /// Says how the frame disagrees with the rig, if it does: counts, sizes, values that are not finite.
    pub fn validate(&self, rig: &Rig) -> Result<(), String> {
        let (n, images, masks) = (rig.cameras.len(), self.images.len(), self.masks.len());
        if images != n || masks != n {
            return Err(format!(
                "rig has {n} cameras but frame {} has {images} images and {masks} masks",
                self.index
            ));
        }
        for (c, (image, mask)) in rig.cameras.iter().zip(self.images.iter().zip(&self.masks)) {
            let want = (c.width as usize, c.height as usize);
            for (what, size) in [("image", image.size()), ("mask", mask.size())] {
                if size != want {
                    return Err(format!(
                        "camera {} is {}x{} but its {what} in frame {} is {}x{}",
                        c.name, want.0, want.1, self.index, size.0, size.1
                    ));
                }
            }
            if let Some(i) = image.data.iter().position(|v| !v.is_finite()) {
                return Err(format!(
                    "frame {}, camera {}: pixel ({}, {}) is not finite",
                    self.index,
                    c.name,
                    i % want.0,
                    i / want.0
                ));
            }
        }
        Ok(())
    }
}
