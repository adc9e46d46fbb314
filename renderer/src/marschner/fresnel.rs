//! Dielectric reflection seen in the plane across the fibre (Marschner et al. 2003, appendix B).

/// Bravais indices (η', η'') of a fibre of index `eta` at difference angle θ_d: the index that governs
/// refraction in the normal plane and the perpendicular polarisation, and the one that governs the parallel
/// polarisation. η' = sqrt(η² - sin²θ_d) / cos θ_d and η'' = η² / η'.
pub fn bravais(eta: f64, cos_theta_d: f64) -> (f64, f64) {
    let cos = cos_theta_d.max(1e-6);
    let sin2 = 1.0 - cos * cos;
    let prime = (eta * eta - sin2).sqrt() / cos;
    (prime, eta * eta / prime)
}

/// Unpolarised reflectance at angle γ_i in the normal plane, given cos γ_i and the Bravais indices; the
/// refraction angle is that of η' for both polarisations, which makes it equal to the three-dimensional
/// Fresnel reflectance. By reversibility it also holds for the inner side of the same path.
pub fn reflectance(cos_gamma_i: f64, eta_prime: f64, eta_second: f64) -> f64 {
    let sin_t = (1.0 - cos_gamma_i * cos_gamma_i).max(0.0).sqrt() / eta_prime;
    let cos_t = (1.0 - sin_t * sin_t).max(0.0).sqrt();
    let perpendicular = (cos_gamma_i - eta_prime * cos_t) / (cos_gamma_i + eta_prime * cos_t);
    let parallel = (eta_second * cos_gamma_i - cos_t) / (eta_second * cos_gamma_i + cos_t);
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The textbook reflectance of a plane interface at a true angle of incidence.
    fn fresnel_3d(cos_i: f64, eta: f64) -> f64 {
        let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (eta * eta)).sqrt();
        let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
        0.5 * (s * s + p * p)
    }

    #[test]
    fn projected_reflectance_equals_the_three_dimensional_one() {
        for theta_deg in [0.0, 10.0, 45.0, 80.0f64] {
            for gamma_deg in [0.0, 20.0, 60.0, 89.0f64] {
                let (ct, cg) = (theta_deg.to_radians().cos(), gamma_deg.to_radians().cos());
                let (p, s) = bravais(1.55, ct);
                let (got, want) = (reflectance(cg, p, s), fresnel_3d(ct * cg, 1.55));
                assert!((got - want).abs() < 1e-12, "θ {theta_deg} γ {gamma_deg}: {got} against {want}");
            }
        }
    }

    #[test]
    fn normal_incidence_and_bravais_at_zero() {
        let (p, s) = bravais(1.55, 1.0);
        assert!((p - 1.55).abs() < 1e-12 && (s - 1.55).abs() < 1e-12);
        assert!((reflectance(1.0, p, s) - (0.55f64 / 2.55).powi(2)).abs() < 1e-12);
    }
}
