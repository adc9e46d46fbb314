//! Skin's pattern: pigments and blood as densities that darken the mean tone, dents of pores and furrows.

use super::noise::{dots, noise};
use super::{SkinLook, SkinTexture, regions};
use glam::{Mat3, Vec3};

/// How much more of each channel a density of 1 takes (exponents), the mean over channels 1 for patterns whose
/// standard deviation is stated: haemoglobin takes green and blue, melanin most of the blue (the shapes of their
/// absorption over the visible range).
const BLOOD: [f32; 3] = [0.15, 1.6, 1.25];
const MELANIN: [f32; 3] = [0.6, 0.95, 1.45];

/// Streams of the seed.
const BLOTCHES: u64 = 0xB10C;
const SPOTS: u64 = 0x5907;
const GRAIN: u64 = 0x6EA1;
const FINE: u64 = 0xF14E;
const FURROWS: u64 = 0xFD12;
const PORES: u64 = 0x9083;
const FRECKLES: u64 = 0xFEC1;
const MOLES: u64 = 0x301E;
const ROOTS: u64 = 0x0807;

/// Cells of freckles and moles, mm, and radii in cells; a ball that the skin cuts shows as a disc.
const FRECKLE_MM: f32 = 2.4;
const MOLE_MM: f32 = 9.0;
const RADIUS: f32 = 0.25;
const FRECKLE_SMALL: f32 = 0.5;
const MOLE_SMALL: f32 = 0.25;
/// Cells of hair roots, mm: some 110 discs a square centimetre at the most.
const ROOT_MM: f32 = 0.6;

/// Cells are turned against the face's axes: a plane along a cell's side would cut the same part of every cell, and
/// curved skin would show rings.
const TURN: Mat3 = Mat3::from_cols(
    Vec3::new(0.601_697_8, 0.305_641_98, -0.737_931_4),
    Vec3::new(0.005_691_44, 0.922_223_9, 0.386_614_35),
    Vec3::new(0.798_703_55, -0.236_824_91, 0.553_160_6),
);

fn key(texture: &SkinTexture, stream: u64) -> u64 {
    strandbench_rng::mix(texture.seed ^ stream << 32)
}

/// Probability of a cell at which a surface cuts `per_mm2` balls of mean radius (1 + small) / 2 · RADIUS cells: a ball
/// is cut if its middle is within its radius of the surface.
fn share(per_mm2: f32, cell_mm: f32, small: f32) -> f32 {
    per_mm2 * cell_mm * cell_mm / (RADIUS * (1.0 + small))
}

pub(super) fn look(t: &SkinTexture, p: Vec3, stubble: f32) -> SkinLook {
    let q = TURN * p;
    let lips = regions::lips(p);
    let bare = 1.0 - lips;
    let (blotch, _) = noise(key(t, BLOTCHES), q / 11.0);
    let (spot, _) = noise(key(t, SPOTS), q / 3.7);
    let (grain, _) = noise(key(t, GRAIN), q / 0.55);
    let (fine, fine_slope) = noise(key(t, FINE), q / 0.26);
    // Lips are furrowed from top to bottom, other skin every way.
    let stretch = Vec3::new(1.0, 1.0 - 0.65 * lips, 1.0);
    let (line, line_slope) = noise(key(t, FURROWS), p * stretch / 0.8);
    let open = (1.0 - line * line * 3.0).max(0.0);
    let furrow = open * open;
    let pore = dots(key(t, PORES), q / t.pore_mm, 1.0, 0.5, RADIUS);
    let pore_depth = pore.depth * bare;

    let per_mm2 = t.freckles_per_cm2 * 0.01 * regions::freckled(p) * bare;
    let freckle = dots(
        key(t, FRECKLES),
        q / FRECKLE_MM,
        share(per_mm2, FRECKLE_MM, FRECKLE_SMALL),
        FRECKLE_SMALL,
        RADIUS,
    );
    let per_mm2 = t.moles_per_dm2 * 1e-4 * bare;
    let mole = dots(key(t, MOLES), q / MOLE_MM, share(per_mm2, MOLE_MM, MOLE_SMALL), MOLE_SMALL, RADIUS);
    // Edges of moles are sharper than those of freckles.
    let mole_depth = (mole.depth * 3.0).min(1.0);
    let mole_tone = 0.6 + (mole.bits >> 60) as f32 * 0.05;

    let blood = t.redness * 0.34 * regions::flush(p) + t.lips * 0.55 * lips + t.mottling * 0.6 * blotch;
    let melanin = t.mottling * 0.8 * spot
        + 0.16 * regions::orbit(p)
        + 0.35 * freckle.depth
        + 1.1 * mole_tone * mole_depth;
    let both =
        t.grain * (0.7 * grain + 0.7 * fine) + 0.05 * furrow * t.pores - libm::log1pf(-t.pores * pore_depth);
    let mut albedo_rgb: [f32; 3] = std::array::from_fn(|c| {
        let density = blood * BLOOD[c] + melanin * MELANIN[c] + both;
        (t.tone_rgb[c] * libm::expf(-density)).min(0.95)
    });
    if stubble > 0.0 && bare > 0.0 {
        let root = dots(key(t, ROOTS), q / ROOT_MM, stubble, 0.6, RADIUS);
        let dark = (stubble * 0.22 + (root.depth * 6.0).min(1.0) * 0.75) * bare;
        albedo_rgb = std::array::from_fn(|c| albedo_rgb[c] + (t.stubble_rgb[c] - albedo_rgb[c]) * dark);
    }

    // Heights: pores are dents of the full depth, furrows of three quarters, the grain of a tenth.
    let depth = t.relief_mm;
    let dent = pore.gradient * (-depth * bare / t.pore_mm);
    let furrow_slope = line_slope * stretch * (12.0 * open * line * 0.75 * depth / 0.8);
    let bump = fine_slope * (0.1 * depth / 0.26);
    SkinLook {
        albedo_rgb,
        slope: TURN.transpose() * (dent + bump) + furrow_slope,
        coat: ((0.85 - 0.12 * blotch).clamp(0.5, 1.0) * (1.0 - 0.6 * pore_depth)).max(lips * 0.9),
        roughness: 1.0 - 0.25 * lips,
    }
}
