//! Frames that follow one another: de-noising, coherent orientation, tracked seeds and strands (4.4 and 5).

mod steps;

use crate::pipeline::{Stereo, stereo};
use crate::strands::Grower;
use crate::surface::FrameSurface;
use crate::temporal::Correspondence;
use crate::tensor::Tensor;
use crate::{Checkpoint, Diagnostics, ReconError, Reconstruction, Variant};
use std::collections::VecDeque;
use strandbench_types::{Frame, Monitor, OrientationField, Plane, Rig};

/// One frame's answer, or why it has none; a frame without an answer is to be scored as absent.
#[derive(Debug)]
pub struct SequenceFrame {
    /// Time index.
    pub frame_index: u32,
    /// The estimate and how it came about.
    pub outcome: Result<Reconstruction, ReconError>,
}

/// Reconstructs a sequence frame by frame, in memory that does not grow with its length.
///
/// A frame comes out once the frames that it looks at are in: `reach` later ones for de-noising, and one more for each pass
/// of the temporal filter if strands are grown. [`SequenceReconstructor::finish`] gives the rest. Neighbours in time are
/// told by their indices; where one is missing or has no answer, its neighbours do without it.
#[derive(Debug)]
pub struct SequenceReconstructor {
    rig: Rig,
    variant: Variant,
    /// Cameras that the variant may look at, the reference first.
    used: Vec<usize>,
    last_index: Option<u32>,
    items: VecDeque<Item>,
    grower: Grower,
    /// Index of the last frame that has come out.
    last_out: Option<u32>,
    /// Frames up to this one are looked at and do not come out.
    known_to: Option<u32>,
}

#[derive(Debug)]
enum Item {
    Present(Box<Slot>),
    /// A frame without an envelope; `None` once its error has been handed out.
    Absent(u32, Option<ReconError>),
}

/// A frame on its way.
#[derive(Debug)]
struct Slot {
    index: u32,
    /// Masks of the used cameras, indexed `[used]`.
    masks: Vec<Plane<bool>>,
    /// The envelope of this frame's images alone.
    raw: FrameSurface,
    orientation: OrientationField,
    diagnostics: Diagnostics,
    /// Where this frame's vertices are in the frame before and the one after.
    neighbours: [Option<Correspondence>; 2],
    /// The de-noised envelope.
    clean: Option<FrameSurface>,
    /// Tensors after each pass, the first before any; dropped once no frame needs them.
    passes: Vec<Vec<Tensor>>,
    emitted: bool,
}

impl SequenceReconstructor {
    /// A sequence seen by a rig.
    ///
    /// # Errors
    /// If the rig is at fault, a parameter is out of range, or the variant asks for cameras that the rig lacks.
    pub fn new(rig: &Rig, variant: &Variant) -> Result<SequenceReconstructor, ReconError> {
        variant.validate()?;
        rig.validate().map_err(ReconError::Input)?;
        let others = variant.views.others(rig.cameras.len())?;
        Ok(SequenceReconstructor {
            rig: rig.clone(),
            variant: *variant,
            used: std::iter::once(0).chain(others).collect(),
            last_index: None,
            items: VecDeque::new(),
            grower: Grower::default(),
            last_out: None,
            known_to: None,
        })
    }

    /// A sequence that goes on after the frame of a checkpoint, which was taken with the same rig and variant. The
    /// [`SequenceReconstructor::looks_back`] frames up to that one must be pushed again first; frames up to it do not
    /// come out again. What follows has the bits that it would have had without the break.
    ///
    /// # Errors
    /// As [`SequenceReconstructor::new`]; if the variant grows no strands, or the checkpoint is not one of it.
    pub fn resume(
        rig: &Rig,
        variant: &Variant,
        checkpoint: &Checkpoint,
    ) -> Result<SequenceReconstructor, ReconError> {
        let mut made = SequenceReconstructor::new(rig, variant)?;
        let Some(p) = &variant.strands else {
            return Err(ReconError::Input(format!(
                "{} grows no strands and needs no checkpoint",
                variant.name
            )));
        };
        made.grower = Grower::resume(checkpoint, p, &variant.temporal)?;
        made.known_to = Some(checkpoint.frame);
        Ok(made)
    }

    /// What is needed to go on after the last frame that came out; `None` if no strands have been grown.
    pub fn checkpoint(&self) -> Option<Checkpoint> {
        self.grower.checkpoint(self.last_out?)
    }

    /// Frames before a frame that its answer depends on, besides what a [`Checkpoint`] holds.
    pub fn looks_back(&self) -> usize {
        self.latency()
    }

    /// Frames after a frame that must be in before it comes out.
    pub fn latency(&self) -> usize {
        self.passes() + self.reach()
    }

    /// Takes the next frame and gives those that are ready, in order.
    ///
    /// A frame in which the method finds nothing to work on (an empty mask, a flat image, no surface) is an answer
    /// with an error in its turn.
    ///
    /// # Errors
    /// If the frame disagrees with the rig or does not come after the last one (the sequence may go on without it), or
    /// the work is cancelled.
    pub fn push(&mut self, frame: &Frame, monitor: &dyn Monitor) -> Result<Vec<SequenceFrame>, ReconError> {
        if let Some(last) = self.last_index.filter(|&last| frame.index <= last) {
            return Err(ReconError::Order { frame: frame.index, last });
        }
        frame.validate(&self.rig).map_err(ReconError::Input)?;
        let cut_mm = self.variant.parameters.cut_mm;
        let made = stereo(&self.rig, frame, &self.variant, monitor).and_then(|s| {
            let Stereo { depth, orientation, diagnostics } = s;
            let raw = FrameSurface::new(&self.rig.cameras[0], frame.index, depth, cut_mm)?;
            Ok(Slot {
                index: frame.index,
                masks: self.used.iter().map(|&c| frame.masks[c].clone()).collect(),
                raw,
                orientation,
                diagnostics,
                neighbours: [None, None],
                clean: None,
                passes: Vec::new(),
                emitted: false,
            })
        });
        let item = match made {
            Ok(slot) => Item::Present(Box::new(slot)),
            Err(
                e @ (ReconError::EmptyMask { .. }
                | ReconError::NoResponse { .. }
                | ReconError::NoSurface { .. }),
            ) => Item::Absent(frame.index, Some(e)),
            Err(e) => return Err(e),
        };
        self.last_index = Some(frame.index);
        self.items.push_back(item);
        self.advance(false, monitor)
    }

    /// Ends the sequence and gives the frames still on their way.
    ///
    /// # Errors
    /// If the work is cancelled.
    pub fn finish(mut self, monitor: &dyn Monitor) -> Result<Vec<SequenceFrame>, ReconError> {
        self.advance(true, monitor)
    }

    /// Passes of the temporal filter.
    fn passes(&self) -> usize {
        self.variant.strands.map_or(0, |s| s.orientation_passes)
    }

    /// How many frames before and after a frame it is registered to; the filter looks at one either way.
    fn reach(&self) -> usize {
        let temporal = &self.variant.temporal;
        if temporal.denoise { temporal.reach } else { self.passes().min(1) }
    }

    fn present(&self, k: usize) -> Option<&Slot> {
        match self.items.get(k)? {
            Item::Present(slot) => Some(slot),
            Item::Absent(..) => None,
        }
    }

    fn present_mut(&mut self, k: usize) -> &mut Slot {
        match &mut self.items[k] {
            Item::Present(slot) => slot,
            Item::Absent(..) => unreachable!("asked for a frame that has an envelope"),
        }
    }

    /// Places of the frames `away` before and after the one at `k`.
    fn around(&self, k: usize, away: usize) -> [Option<usize>; 2] {
        let Some(own) = self.present(k).map(|s| s.index as usize) else { return [None, None] };
        let place = |index: Option<usize>| {
            (0..self.items.len()).find(|&n| self.present(n).map(|s| s.index as usize) == index)
        };
        [own.checked_sub(away), Some(own + away)].map(|index| index.and_then(|i| place(Some(i))))
    }

    /// Places of the frames right before and after the one at `k`.
    fn neighbours(&self, k: usize) -> [Option<usize>; 2] {
        self.around(k, 1)
    }

    fn advance(&mut self, ended: bool, monitor: &dyn Monitor) -> Result<Vec<SequenceFrame>, ReconError> {
        let mut out = Vec::new();
        for k in 0..self.items.len() {
            let all_in =
                |own: u32| self.last_index.is_some_and(|l| l as usize >= own as usize + self.reach());
            if self.present(k).is_some_and(|s| s.clean.is_none() && (ended || all_in(s.index))) {
                self.clean(k, monitor)?;
            }
        }
        for pass in 0..=self.passes() {
            for k in 0..self.items.len() {
                if self.variant.strands.is_some() && self.ready(k, pass, ended) {
                    self.filter(k, pass, monitor)?;
                }
            }
        }
        let passes = self.passes() + usize::from(self.variant.strands.is_some());
        for k in 0..self.items.len() {
            match &mut self.items[k] {
                Item::Absent(index, error) => {
                    let known = self.known_to.is_some_and(|known| *index <= known);
                    if let Some(e) = error.take().filter(|_| !known) {
                        self.last_out = Some(*index);
                        out.push(SequenceFrame { frame_index: *index, outcome: Err(e) });
                    }
                }
                Item::Present(slot) if slot.emitted => {}
                Item::Present(slot) if slot.clean.is_some() && slot.passes.len() == passes => {
                    slot.emitted = true;
                    let frame_index = slot.index;
                    if self.known_to.is_some_and(|known| frame_index <= known) {
                        continue;
                    }
                    let outcome = match self.estimate(k, monitor) {
                        Err(e @ ReconError::Cancelled(_)) => return Err(e),
                        other => other,
                    };
                    self.last_out = Some(frame_index);
                    out.push(SequenceFrame { frame_index, outcome });
                }
                Item::Present(_) => break,
            }
        }
        // A frame that is out may still be looked at by those after it.
        let reach = self.reach().max(1);
        while self.items.len() > reach && (0..=reach).all(|k| self.is_out(k)) {
            self.items.pop_front();
        }
        Ok(out)
    }

    fn is_out(&self, k: usize) -> bool {
        match &self.items[k] {
            Item::Present(slot) => slot.emitted,
            Item::Absent(_, error) => error.is_none(),
        }
    }
}
