use crate::light::{Light, Matrix, Row};
use crate::optics::Term;
use glam::Vec3;

/// N rows that are carried along one geometric path; whatever is chosen at random is chosen for all of them at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reads<const N: usize>([Row; N]);

impl Reads<1> {
    /// `[0 1]`, paper eq. 8.
    pub fn visible() -> Self {
        Self([Row::VISIBLE])
    }
}

impl Reads<2> {
    /// `[0 1]` and `[1 0]`.
    pub fn visible_and_invisible() -> Self {
        Self([Row::VISIBLE, Row::INVISIBLE])
    }
}

impl<const N: usize> Reads<N> {
    /// Light meets `matrix` before it meets what the rows have gone through so far.
    pub fn through(self, matrix: Matrix) -> Self {
        Self(self.0.map(|row| row * matrix))
    }

    /// Light meets a term before, but for the lobe's own filter.
    pub fn before(self, term: &Term) -> Self {
        Self(self.0.map(|row| term.before(row)))
    }

    /// Filtered by a scalar lobe.
    pub fn filtered(self, weight: Vec3) -> Self {
        Self(self.0.map(|row| row * weight))
    }

    /// Scaled alike.
    pub fn scaled(self, factor: f32) -> Self {
        Self(self.0.map(|row| row * factor))
    }

    /// What each row reads from `light`.
    pub fn of(self, light: Light) -> [Vec3; N] {
        self.0.map(|row| row * light)
    }

    /// The sum of all weights: how much is still read, as one number for roulette and choice.
    pub fn total(self) -> f32 {
        self.0.iter().map(|row| row.total()).sum()
    }

    /// What is read of each colour.
    pub fn colours(self) -> Vec3 {
        self.0.iter().map(|row| row.colours()).sum()
    }

    /// True when nothing is read.
    pub fn is_zero(self) -> bool {
        self.0.iter().all(|row| row.is_zero())
    }

    /// True when some row reads the invisible half.
    pub fn any_invisible(self) -> bool {
        self.0.iter().any(|row| row.invisible != Vec3::ZERO)
    }

    /// True when some row reads the visible half.
    pub fn any_visible(self) -> bool {
        self.0.iter().any(|row| row.visible != Vec3::ZERO)
    }
}
