use super::numbers::Numbers;
use super::walk::Line;
use crate::sampling::endurance;

/// A branch that reads this share of what the pixel reads is kept for certain; smaller ones are rouletted up to it.
/// A quarter lets two or three reflections by before chance sets in: most of a picture's light.
const KEPT_FOR_CERTAIN: f32 = 0.25;

/// Branches of one sample after which the bar rises in proportion to their number. Walks in matter with k < 0.99
/// rarely have as many.
const MANY: u32 = 1024;

/// Branches of one sample after which one line at a time is followed, so that even walks in supercritical matter end.
const TOO_MANY: u32 = 16_384;

/// Reflections after which a walk may end although its weight has not fallen.
pub(super) const LONG: u32 = 64;

/// The unit of all that comes by a surface that the camera looks at and that reads `total` of what had the unit `before`: it is
/// followed however dark it is.
pub(super) fn unit_at_first(total: f32, before: f32) -> f32 {
    before.min(total / KEPT_FOR_CERTAIN)
}

/// How many branches one camera sample has had, and who may live.
///
/// Where matter both scatters and lets light straight through, a walk is a tree. Its branches keep to equal weights,
/// as those of a neutron transport code do, so that the number of branches, not their weight, follows the
/// multiplication factor k. Every decision depends on the past only and is paid for by weight: no bias.
#[derive(Default)]
pub(super) struct Population {
    born: u32,
}

impl Population {
    /// Probability with which a branch that reads `total` is to live, where a whole pixel reads `unit`; both above 0.
    pub fn survival(&self, total: f32, unit: f32) -> f32 {
        let crowding = (self.born as f32 / MANY as f32).max(1.0);
        (total / (unit * KEPT_FOR_CERTAIN * crowding)).min(1.0)
    }

    /// Counts a branch.
    pub fn grow(&mut self) {
        self.born += 1;
    }

    /// If there have been too many branches, leaves one of the lines yet to be followed, chosen in proportion to what it
    /// reads, to read for all; or none, with the same falling chance as that of a long walk.
    pub fn thin<const N: usize>(&self, lines: &mut Vec<Line<N>>, numbers: &mut Numbers<'_>) {
        if self.born < TOO_MANY || lines.is_empty() {
            return;
        }
        let endurance = endurance(LONG + self.born - TOO_MANY, LONG);
        if numbers.one() >= endurance {
            lines.clear();
            return;
        }
        let sum: f32 = lines.iter().map(|line| line.reads.total()).sum();
        let mut rest = numbers.one() * sum;
        let chosen = lines.iter().position(|line| {
            rest -= line.reads.total();
            rest < 0.0
        });
        // Rounding may leave a rest after the last.
        let mut line = lines[chosen.unwrap_or(lines.len() - 1)];
        line.reads = line.reads.scaled(sum / (line.reads.total() * endurance));
        lines.clear();
        lines.push(line);
    }
}
