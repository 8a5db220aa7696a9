//! Error against run time: ways to render, budgets and seeds side by side, and the reference they are measured against.

mod maker;
mod race;
mod reference;

pub use maker::{ReferenceMaker, can_refer, candidates};
pub use race::{Course, Run, Snapshot, Variant, race};
pub use reference::{NoiseShare, OwnError, Reference};
