//! Sets of the six components of light (two halves, three colours), and what matter makes of them.

use crate::light::{Light, Matrix, Turn};
use glam::Vec3;

/// A set of components: the invisible red, green and blue, then the visible ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Components(u8);

const COLOURS: u8 = 0b111;

impl Components {
    pub const NONE: Self = Self(0);
    pub const INVISIBLE: Self = Self(COLOURS);
    pub const VISIBLE: Self = Self(COLOURS << 3);

    /// Those that are not zero.
    pub fn of(light: Light) -> Self {
        Self::halves(colours(light.invisible), colours(light.visible))
    }

    fn halves(invisible: u8, visible: u8) -> Self {
        Self(invisible | visible << 3)
    }

    /// The light in these components.
    pub fn of_light(self, light: Light) -> Light {
        let kept = |bits: u8| Vec3::from_array([0, 1, 2].map(|c| f32::from(bits >> c & 1)));
        Light::new(kept(self.0) * light.invisible, kept(self.0 >> 3) * light.visible)
    }

    pub fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    pub fn any(self) -> bool {
        self != Self::NONE
    }

    /// Some colour of the invisible half is among them.
    pub fn invisible(self) -> bool {
        self.and(Self::INVISIBLE).any()
    }

    /// Some colour of the visible half is among them.
    pub fn visible(self) -> bool {
        self.and(Self::VISIBLE).any()
    }

    /// What re-radiation makes of these.
    pub fn turned(self, turn: Turn) -> Self {
        (0..turn.colours()).fold(self, |set, _| {
            let next = |half: u8| (half << 1 | half >> 2) & COLOURS;
            Self::halves(next(set.0 & COLOURS), next(set.0 >> 3))
        })
    }

    /// What re-radiation makes these of.
    pub fn turned_back(self, turn: Turn) -> Self {
        self.turned(turn).turned(turn)
    }

    /// The incoming components that `matrix`, times a lobe of this colour, turns into one of these outgoing ones.
    pub fn before(self, matrix: Matrix, lobe: Vec3) -> Self {
        let [[ii, iv], [vi, vv]] = matrix.rows();
        let (invisible, visible, lobe) = (self.0 & COLOURS, self.0 >> 3, colours(lobe));
        Self::halves(
            lobe & (through(ii, invisible) | through(vi, visible)),
            lobe & (through(iv, invisible) | through(vv, visible)),
        )
    }

    /// The outgoing components that `matrix`, times a lobe of this colour, makes of these incoming ones.
    pub fn after(self, matrix: Matrix, lobe: Vec3) -> Self {
        let [[ii, iv], [vi, vv]] = matrix.rows();
        let (invisible, visible, lobe) = (self.0 & COLOURS, self.0 >> 3, colours(lobe));
        Self::halves(
            lobe & (through(ii, invisible) | through(iv, visible)),
            lobe & (through(vi, invisible) | through(vv, visible)),
        )
    }
}

/// What `step` adds, over and over, until it adds nothing.
pub(super) fn fixed_point(mut set: Components, step: impl Fn(Components) -> Components) -> Components {
    loop {
        let next = set.or(step(set));
        if next == set {
            return set;
        }
        set = next;
    }
}

fn colours(rgb: Vec3) -> u8 {
    (0..3).filter(|c| rgb[*c] != 0.0).fold(0, |bits, c| bits | 1 << c)
}

fn through(entry: f32, colours: u8) -> u8 {
    if entry != 0.0 { colours } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_turn_as_light_does() {
        for (set, turn) in (0..64).map(Components).flat_map(|set| (0..3).map(move |by| (set, Turn::by(by)))) {
            let light = set.of_light(Light::both(Vec3::ONE));
            let became = Light::new(turn.outgoing(light.invisible), turn.outgoing(light.visible));
            assert_eq!(set.turned(turn), Components::of(became));
            assert_eq!(set.turned(turn).turned_back(turn), set);
        }
    }

    #[test]
    fn sets_follow_the_numbers() {
        // Whatever is not zero in the product is in the set, and the other way round, for matrices of every pattern.
        for pattern in 0..16_u8 {
            let entry = |bit: u8| f32::from(pattern >> bit & 1);
            let matrix = Matrix::new([[entry(0), entry(1)], [entry(2), entry(3)]]);
            for colour in [Vec3::ONE, Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.0, 0.2, 0.9), Vec3::ZERO] {
                for set in (0..64).map(Components) {
                    let light = set.of_light(Light::both(Vec3::ONE));
                    assert_eq!(set.after(matrix, colour), Components::of(colour * (matrix * light)));
                    // A component comes before the set iff what is made of it alone meets the set.
                    for one in (0..6).map(|bit| Components(1 << bit)) {
                        let meets = one.after(matrix, colour).and(set).any();
                        assert_eq!(set.before(matrix, colour).and(one).any(), meets);
                    }
                }
            }
        }
    }
}
