//! Strands as a file has them, and their way into the world.

use crate::error::{FormatError, Parsed};
use crate::options::{ImportOptions, ImportReport, place};
use crate::resample::resample;
use glam::{DMat3, Vec3};
use strandbench_types::StrandSet;

/// Two successive points nearer than this (mm) are one point (METRICS ground rule 3).
pub const MIN_SEGMENT_MM: f32 = 1e-6;

/// Smallest fibre radius kept (mm): files taper tips to zero, which no cylinder can have.
pub const MIN_RADIUS_MM: f32 = 1e-3;

/// Fibre radii as a file states them, in file units.
#[derive(Clone, Debug, PartialEq)]
pub enum Radii {
    /// The file says nothing.
    Unstated,
    /// One radius for all.
    Same(f32),
    /// One radius a point.
    PerPoint(Vec<f32>),
}

/// Strands as stored: file units, file axes, nothing dropped; all coordinates finite.
#[derive(Clone, Debug, PartialEq)]
pub struct RawStrands {
    /// The format, for people.
    pub format: &'static str,
    /// Points of all strands.
    pub points: Vec<Vec3>,
    /// Start of each strand, and the number of points as the last entry; a strand may have 0 or 1 points.
    pub offsets: Vec<u32>,
    /// Fibre radii.
    pub radii: Radii,
    /// Oddities that do not stop the import.
    pub notes: Vec<String>,
}

impl RawStrands {
    /// Builds the offsets from point counts and checks that every number is finite and no radius negative.
    pub(crate) fn new(
        format: &'static str,
        points: Vec<Vec3>,
        counts: impl Iterator<Item = u32>,
        radii: Radii,
    ) -> Parsed<RawStrands> {
        if u32::try_from(points.len()).is_err() {
            return Err(FormatError::new(
                "header",
                format!("{} points are more than 2^32", points.len()),
                "split the file",
            ));
        }
        let mut offsets = vec![0u32];
        let mut end = 0;
        for count in counts {
            end += count;
            offsets.push(end);
        }
        assert_eq!(end as usize, points.len(), "the parser must have checked the counts");
        let raw = RawStrands { format, points, offsets, radii, notes: Vec::new() };
        raw.check()?;
        Ok(raw)
    }

    fn check(&self) -> Parsed<()> {
        const REMEDY: &str = "export the file again without it";
        let place = |i: usize| {
            let strand = self.offsets.partition_point(|&o| o as usize <= i) - 1;
            format!("strand {strand}, point {}", i - self.offsets[strand] as usize)
        };
        if let Some(i) = self.points.iter().position(|p| !p.is_finite()) {
            return Err(FormatError::new(
                place(i),
                format!("coordinate {} is not finite", self.points[i]),
                REMEDY,
            ));
        }
        let bad = |r: f32| !(r.is_finite() && r >= 0.0);
        match &self.radii {
            Radii::Same(r) if bad(*r) => {
                Err(FormatError::new("header", format!("default radius {r} is not a length"), REMEDY))
            }
            Radii::PerPoint(r) => match r.iter().position(|&r| bad(r)) {
                Some(i) => {
                    Err(FormatError::new(place(i), format!("radius {} is not a length", r[i]), REMEDY))
                }
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// The strands as they are, file units taken as mm and nothing dropped or moved.
    ///
    /// # Errors
    /// Without a radius, or if a strand has fewer than two points or a radius that is not positive.
    pub fn into_exact(self) -> Parsed<StrandSet> {
        let n = self.points.len();
        let radii_mm = match self.radii {
            Radii::PerPoint(r) => r,
            Radii::Same(r) => vec![r; n],
            Radii::Unstated => {
                return Err(FormatError::new(
                    "header",
                    "no fibre radius is stated",
                    "write the thickness array",
                ));
            }
        };
        let set = StrandSet { points: self.points, offsets: self.offsets, radii_mm };
        set.validate().map_err(|e| FormatError::new("content", e.to_string(), "export the strands again"))?;
        Ok(set)
    }

    /// Places the strands in the world, drops what has no length, and resamples smoothly.
    ///
    /// # Errors
    /// If an option is bad, no strand has a length, no radius is known, or the result would be too large.
    pub fn into_world(self, options: &ImportOptions) -> Parsed<(StrandSet, ImportReport)> {
        let mut report = ImportReport {
            strands_in_file: self.offsets.len() - 1,
            points_in_file: self.points.len(),
            format: self.format.to_owned(),
            scale_mm: options.scale_mm,
            notes: self.notes.clone(),
            ..ImportReport::default()
        };
        let set = self.placed(options, &mut report)?;
        let out = resample(&set, options.max_segment_mm)?;
        report.points_resampled = out.points.len();
        let first = out.points[0];
        let (lo, hi) = out.points.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p)));
        report.bounds_mm = [lo.to_array(), hi.to_array()];
        Ok((out, report))
    }

    /// The strands in the world, less what has no length, at the file's own points.
    pub(crate) fn placed(&self, options: &ImportOptions, report: &mut ImportReport) -> Parsed<StrandSet> {
        let set = self.clean(&options.world_from_file()?, options, report)?;
        if set.is_empty() {
            return Err(FormatError::new(
                "content",
                format!("none of the {} strands has a length", self.offsets.len() - 1),
                "check the file and scale_mm",
            ));
        }
        Ok(set)
    }

    fn clean(&self, m: &DMat3, options: &ImportOptions, report: &mut ImportReport) -> Parsed<StrandSet> {
        let scale = options.scale_mm as f32;
        let mut raised = 0usize;
        let mut radius = |i: usize| -> f32 {
            let stated = match (&self.radii, options.radius_mm) {
                (_, Some(r)) => return r,
                (Radii::Same(r), None) => *r,
                (Radii::PerPoint(r), None) => r[i],
                (Radii::Unstated, None) => f32::NAN,
            };
            if stated * scale < MIN_RADIUS_MM {
                raised += 1;
            }
            (stated * scale).max(MIN_RADIUS_MM)
        };
        report.radius = match (&self.radii, options.radius_mm) {
            (Radii::Unstated, Some(r)) => format!("{r} mm (option radius_mm; the file states none)"),
            (_, Some(r)) => format!("{r} mm (option radius_mm replaces the file's own)"),
            (Radii::Same(r), None) => format!("{} mm (the file's one radius)", r * scale),
            (Radii::PerPoint(_), None) => "per point, from the file".to_owned(),
            (Radii::Unstated, None) => {
                return Err(FormatError::new(
                    "option radius_mm",
                    "the file states no fibre radius",
                    "give one in mm; human scalp hair has 0.03 to 0.05",
                ));
            }
        };
        let mut set = StrandSet::new();
        set.points.reserve(self.points.len());
        set.radii_mm.reserve(self.points.len());
        for strand in 0..self.offsets.len() - 1 {
            let start = set.points.len();
            let range = self.offsets[strand] as usize..self.offsets[strand + 1] as usize;
            for i in range.clone() {
                let p = place(m, self.points[i]);
                if !p.is_finite() {
                    return Err(FormatError::new(
                        format!("strand {strand}, point {}", i - range.start),
                        "not finite after scaling",
                        "check option scale_mm",
                    ));
                }
                let repeated = set.points[start..].last().is_some_and(|q| q.distance(p) < MIN_SEGMENT_MM);
                if repeated {
                    report.repeated_points += 1;
                    continue;
                }
                set.points.push(p);
                set.radii_mm.push(radius(i));
            }
            if set.points.len() - start < 2 {
                set.points.truncate(start);
                set.radii_mm.truncate(start);
                report.zero_length_strands += 1;
            } else {
                set.offsets.push(set.points.len() as u32);
            }
        }
        if raised > 0 {
            report.notes.push(format!("{raised} radii below {MIN_RADIUS_MM} mm were raised to it"));
        }
        set.validate().map_err(|e| {
            FormatError::new("content", e.to_string(), "check options scale_mm and radius_mm")
        })?;
        Ok(set)
    }
}
