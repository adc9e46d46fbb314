//! Why no comparison could be made.

/// Why two variants could not be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StatsError {
    /// There is no cell.
    #[error("nothing to compare: there is no scene that both sides have")]
    Nothing,
    /// A figure or a raw error is not a number.
    #[error("scene {scene}, seed {seed}: {what} is not a number; an absent answer must be given as none")]
    NotANumber {
        /// Scene.
        scene: String,
        /// Seed.
        seed: u64,
        /// Which figure.
        what: &'static str,
    },
    /// Two cells for one scene and seed.
    #[error("scene {scene}, seed {seed} occurs twice; a pair is one cell")]
    Twice {
        /// Scene.
        scene: String,
        /// Seed.
        seed: u64,
    },
    /// The raw errors of a cell do not fit each other or its figures.
    #[error("scene {scene}, seed {seed}: {problem}")]
    Units {
        /// Scene.
        scene: String,
        /// Seed.
        seed: u64,
        /// What is wrong.
        problem: String,
    },
    /// The samples of a stratum are too small.
    #[error("{name}: {problem}")]
    Stratum {
        /// The stratum.
        name: String,
        /// What is wrong.
        problem: String,
    },
    /// An option out of its range.
    #[error("{name} is {value}: {expected}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// What it is.
        value: String,
        /// What it may be.
        expected: &'static str,
    },
}
