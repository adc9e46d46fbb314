//! Chiang's model against Mitsuba's `hair`.

use super::{Differences, Grid, chiang_optics, place, point};
use crate::{Bundle, Case, CrossError, Gate};
use strandbench_renderer::fibre::FibreModel;

/// Largest relative difference with Mitsuba's own Bessel function.
const SAME_BESSEL: f64 = 5e-4;
/// The same with the exact one, which Mitsuba's is up to 0.6 % off.
const EXACT_BESSEL: f64 = 8e-3;

pub(super) fn judge(
    case: &Case,
    answer: &Bundle,
    Grid { to_camera, to_light, told }: &Grid,
) -> Result<Vec<Gate>, CrossError> {
    let n = to_camera.len();
    let theirs: Vec<f32> = answer.get("eval", &[told.len(), n, 3])?;
    let densities: Vec<f32> = answer.get("pdf", &[told.len(), n])?;
    let mut gates = Vec::new();
    for (k, told) in told.iter().enumerate() {
        let theirs = &theirs[k * n * 3..(k + 1) * n * 3];
        let densities = &densities[k * n..(k + 1) * n];
        for (same, limit) in [(true, SAME_BESSEL), (false, EXACT_BESSEL)] {
            let (optics, absorption) = chiang_optics(told, same).map_err(CrossError::Ours)?;
            let model = FibreModel::new(&optics).map_err(CrossError::Ours)?;
            let at = point(absorption);
            let (mut value, mut density) = (Vec::new(), Vec::new());
            for (camera, light) in to_camera.iter().zip(to_light) {
                let toward = model.toward(&at, *camera);
                value.extend(toward.eval(*light));
                density.push(toward.pdf(*light));
            }
            let bessel = if same { "Mitsuba's I0" } else { "exact I0" };
            let d = Differences::of(&value, theirs, |i| {
                format!("fibre {k}, {}, channel {}", place(to_camera[i / 3], to_light[i / 3]), i % 3)
            });
            let p = Differences::of(&density, densities, |i| {
                format!("fibre {k}, {}", place(to_camera[i], to_light[i]))
            });
            let gate = |what: &str, d: Differences| {
                let name = format!("fibre {k}, {what}, {bessel}: largest relative");
                Gate::at_most(2, &case.name, &name, d.worst, limit, "").because(d.at)
            };
            gates.push(gate("value", d));
            // Lobes are drawn by luminance there and by the mean of the channels here, which is a choice: the
            // densities are the same function where the channels are equal.
            if absorption.iter().all(|a| *a == absorption[0]) {
                gates.push(gate("density", p));
            }
        }
    }
    Ok(gates)
}
