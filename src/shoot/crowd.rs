//! How many lines one path may have, and how many photons one task may keep: bounds that cost no bias.
//!
//! Roulette keeps photons alike in power, by comparing them with what generations of light become in the long run. That is
//! measured, and the measurement may be wrong. A path that multiplies all the same, or is reflected without end, is thinned
//! here. Every decision depends on the past alone and is compensated in power.

use crate::plan::PhotonPlan;

/// Lines waiting to be followed, beyond which their number falls.
const WAITING: f32 = 65_536.0;
/// A task keeps so many deposits at least before it thins them.
const FEWEST_KEPT: f32 = 4096.0;

/// What one task has had.
pub(super) struct Crowd {
    /// Lines of the path under way.
    pub lines: u64,
    /// Lines of a path beyond which fewer and fewer are born.
    most_lines: f32,
    /// Photons kept by this task.
    pub kept: usize,
    /// Photons beyond which fewer and fewer are kept.
    most_kept: f32,
}

impl Crowd {
    /// Of one of `tasks` that share out a pass.
    pub fn new(plan: &PhotonPlan, tasks: u32) -> Self {
        let most_kept = (2.0 * crate::plan::MAX_DEPOSITS as f32 / tasks.max(1) as f32).max(FEWEST_KEPT);
        Self { lines: 0, most_lines: plan.crowd as f32, kept: 0, most_kept }
    }

    /// Probability with which a line that roulette lets live is born where `waiting` others are. One as a rule.
    pub fn born(&self, waiting: usize) -> f32 {
        let room = self.most_lines / self.lines as f32;
        room.min(WAITING / waiting as f32).min(1.0)
    }

    /// Probability with which one more photon is kept. One as a rule.
    pub fn kept(&self) -> f32 {
        (self.most_kept / self.kept as f32).min(1.0)
    }
}
