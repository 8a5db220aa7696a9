//! Which colours of light are followed, alone or together.

use crate::scene::{Luminaire, Scene};

/// A set of colour channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Colours(u8);

impl Colours {
    pub const ALL: Self = Self(0b111);

    fn one(channel: usize) -> Self {
        Self(1 << channel)
    }

    pub fn contain(self, channel: usize) -> bool {
        self.0 >> channel & 1 == 1
    }

    /// The one of the least number.
    pub fn first(self) -> usize {
        self.0.trailing_zeros() as usize
    }
}

/// Sets of colours that may each be the one whose k is the largest: channel by channel, but together where re-radiation leads from each
/// to the others. Where it leads one way, k is that of a single channel, as eigenvalues of a triangular matrix are those on its diagonal.
pub(super) fn colours_that_matter(scene: &Scene) -> Vec<Colours> {
    if !scene.fluoresces() {
        return channels_that_matter(scene).into_iter().map(Colours::one).collect();
    }
    let mut leads = [0, 1, 2].map(|from| [0, 1, 2].map(|to| from == to));
    for term in scene.materials.iter().flat_map(|material| &material.bsdf.terms) {
        for from in (0..3).filter(|&from| term.lobe.bound()[from] > 0.0) {
            leads[from][(from + term.turn.colours()) % 3] = true;
        }
    }
    for between in 0..3 {
        for (from, to) in (0..9).map(|i| (i / 3, i % 3)) {
            leads[from][to] |= leads[from][between] && leads[between][to];
        }
    }
    let emitted = (0..3).filter(|&channel| scene.luminaires.iter().any(|l| emits(l, channel)));
    let reached =
        emitted.fold([false; 3], |reached, from| [0, 1, 2].map(|to| reached[to] || leads[from][to]));
    let mut sets = Vec::new();
    for channel in (0..3).filter(|&channel| reached[channel]) {
        let together = (0..3).filter(|&other| leads[channel][other] && leads[other][channel]);
        let set = Colours(together.fold(0, |set, other| set | 1 << other));
        if !sets.contains(&set) {
            sets.push(set);
        }
    }
    sets
}

fn emits(luminaire: &Luminaire, channel: usize) -> bool {
    let light = luminaire.power(1.0);
    light.invisible[channel] > 0.0 || light.visible[channel] > 0.0
}

/// Channels whose k may be the largest: those in which something shines, and that no other one filters less in every
/// lobe while all that shines in them shines in it too.
fn channels_that_matter(scene: &Scene) -> Vec<usize> {
    let filters = |channel: usize| -> Vec<f32> {
        let terms = scene.materials.iter().flat_map(|material| &material.bsdf.terms);
        terms.map(|term| term.lobe.bound()[channel]).collect()
    };
    let filters = [filters(0), filters(1), filters(2)];
    let shines = |channel: usize| scene.luminaires.iter().any(|l| emits(l, channel));
    let below = |a: usize, b: usize| {
        let nowhere_above = filters[a].iter().zip(&filters[b]).all(|(x, y)| x <= y);
        let lit_as_well = scene.luminaires.iter().all(|l| emits(l, b) || !emits(l, a));
        let alike = filters[a] == filters[b] && scene.luminaires.iter().all(|l| emits(l, a) == emits(l, b));
        nowhere_above && lit_as_well && (!alike || b < a)
    };
    (0..3).filter(|a| shines(*a) && !(0..3).any(|b| b != *a && below(*a, b))).collect()
}
