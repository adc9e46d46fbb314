//! Numbers of the method, one table for the struct, its defaults, its overrides and its listing.

use serde::Serialize;

/// A block of numbers: the struct, the values of the variant `luo`, overrides by name, listing and ranges.
macro_rules! parameters {
    (
        $(#[$block_doc:meta])* $block:ident;
        $($(#[$doc:meta])* $name:ident: $type:ty = $default:expr, $holds:expr, $wanted:literal;)*
    ) => {
        $(#[$block_doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Serialize)]
        pub struct $block { $($(#[$doc])* pub $name: $type,)* }

        impl $block {
            /// The values of the variant `luo`.
            pub const LUO: $block = $block { $($name: $default,)* };

            /// Names of all parameters, in order.
            pub const KEYS: &'static [&'static str] = &[$(stringify!($name),)*];

            /// Sets a parameter from text; `None` if there is none of that name, an error that says what is wanted.
            pub(crate) fn set(&mut self, key: &str, value: &str) -> Option<Result<(), &'static str>> {
                match key {
                    $(stringify!($name) => Some(match value.parse::<$type>() {
                        Ok(v) => {
                            self.$name = v;
                            Ok(())
                        }
                        Err(_) => Err($wanted),
                    }),)*
                    _ => None,
                }
            }

            /// Names and values, in order.
            pub fn entries(&self) -> Vec<(&'static str, String)> {
                vec![$((stringify!($name), self.$name.to_string()),)*]
            }

            /// The first parameter out of its range: name, value and what is wanted.
            pub(crate) fn fault(&self) -> Option<(&'static str, String, &'static str)> {
                $({
                    let holds: fn($type) -> bool = $holds;
                    if !holds(self.$name) {
                        return Some((stringify!($name), self.$name.to_string(), $wanted));
                    }
                })*
                None
            }
        }
    };
}

pub(crate) use parameters;

pub(crate) fn positive(v: f32) -> bool {
    v.is_finite() && v > 0.0
}

pub(crate) fn not_negative(v: f32) -> bool {
    v.is_finite() && v >= 0.0
}

parameters! {
    /// Every number of the method for one frame's envelope. The paper's values where it gives them; the
    /// documentation of a field says which are choices of this project.
    Parameters;
    /// Levels of the orientation pyramid, the finest included. The paper gives no number; SWEEPS.md has the
    /// figures behind this one and the other values that the paper leaves out.
    levels: usize = 2, |v| (1..=8).contains(&v), "a whole number from 1 to 8";
    /// Orientations of the filter bank over [0, π). The paper gives no number; on drawn lines 8, 16, 32 and 64
    /// err by at most 1.90, 1.08, 0.95 and 0.96 degrees, so 32 is where more buys nothing.
    angles: usize = 32, |v| (4..=256).contains(&v), "a whole number from 4 to 256";
    /// σ of K_0, pixels of the level (4.3: 1).
    sigma_px: f32 = 1.0, |v| positive(v) && v <= 4.0, "a number above 0, up to 4, below sigma_wide_px";
    /// σ' of K_0, pixels of the level (4.3: 2).
    sigma_wide_px: f32 = 2.0, |v| positive(v) && v <= 8.0, "a number above 0, up to 8";
    /// Exponent γ of the response (4.3: 0.5).
    gamma: f32 = 0.5, |v| positive(v) && v <= 4.0, "a number above 0, up to 4";
    /// The filter response that counts as |O| = 1, as a share of the reference view's positive responses at
    /// the finest level that lie below it. It makes σ_o, σ_d and λ independent of exposure; the paper gives
    /// no unit of |O|.
    unit_quantile: f32 = 0.95, |v| positive(v) && v <= 1.0, "a number above 0, up to 1";
    /// Depth labels, uniform in inverse depth from near to far. The paper gives no number.
    labels: usize = 192, |v| (3..=2048).contains(&v), "a whole number from 3 to 2048";
    /// Cost of a view whose hair mask excludes the point, in units of c (Eq. 6), at every level. Zero is an O'
    /// of zero; a match is always below zero. A view whose image does not reach the point has no say. The
    /// paper is silent.
    absent_cost: f32 = 0.25, not_negative, "a number of at least 0";
    /// Whether costs are aggregated (Eq. 8).
    aggregate: bool = true, |_| true, "true or false";
    /// σ_d of Eq. 7, in units of |O|. The paper gives no number.
    sigma_d: f32 = 0.5, positive, "a number above 0";
    /// σ_p of Eq. 7, pixels of the level. The paper gives no number.
    sigma_p_px: f32 = 3.0, |v| positive(v) && v <= 16.0, "a number above 0, up to 16";
    /// Half-width of the window K of Eq. 8 in units of σ_p, rounded up to whole pixels.
    window_sigmas: f32 = 2.0, |v| positive(v) && v <= 4.0, "a number above 0, up to 4";
    /// λ of Eq. 2. Depth differences count in pixel footprints (z / f at the geometric mean of near and far), so
    /// that λ is the price of a slope of 45 degrees whatever the number of labels and the resolution. Tuned for
    /// each matching cost; the paper gives no number and no unit.
    lambda: f32 = 0.005, not_negative, "a number of at least 0";
    /// σ_o of Eq. 4, in units of |O| (4.4: 0.5).
    sigma_o: f32 = 0.5, positive, "a number above 0";
    /// Whether labels are refined below one step (Eq. 9).
    refine: bool = true, |_| true, "true or false";
    /// Whether the depth map is filtered (Eq. 10).
    filter: bool = true, |_| true, "true or false";
    /// Half-width of the correlation window of the NCC cost, pixels of the level.
    ncc_radius_px: usize = 2, |v| (1..=8).contains(&v), "a whole number from 1 to 8";
    /// Depth step between neighbouring pixels beyond which the envelope is cut, mm.
    cut_mm: f32 = 10.0, positive, "a number above 0";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_reads_back_what_it_prints() {
        for (key, value) in Parameters::LUO.entries() {
            let mut p = Parameters::LUO;
            assert_eq!(p.set(key, &value), Some(Ok(())), "{key}");
            assert_eq!(p, Parameters::LUO);
        }
        assert_eq!(Parameters::LUO.fault(), None);
        assert_eq!(Parameters::KEYS.len(), Parameters::LUO.entries().len());
    }
}
