//! Error against run time: methods, budgets and seeds side by side, and the reference they are measured against.

pub mod race;
pub mod reference;
