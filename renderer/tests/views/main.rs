//! Whole views of small scenes against closed forms, and the renderer's promises.

mod adaptive;
mod closed;
mod common;
mod kept;
mod promises;
mod shadows;
mod skin;
mod transport;
mod witness;
