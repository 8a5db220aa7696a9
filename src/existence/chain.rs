//! Which halves of light can be reflected over and over, from the coefficient matrices alone.

use crate::light::Matrix;
use crate::optics::Lobe;
use crate::scene::{Material, Scene};

/// A pattern of nonzero entries, `[outgoing][incoming]`, invisible first.
type Pattern = [[bool; 2]; 2];

/// The halves that take part in an endless chain of reflections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chain {
    /// Invisible, visible: whether such light can become the same light again by being reflected.
    pub live: [bool; 2],
    /// The halves that such light may have on its way to a reflection that keeps it so; live ones and what crossings
    /// make of them.
    pub on_way: [bool; 2],
    /// Whether each of the two can become the other and return.
    coupled: bool,
    /// Whether live light goes straight through some surface.
    pub passes: bool,
}

impl Chain {
    /// Of all materials that some triangle has.
    pub fn of(scene: &Scene) -> Self {
        let materials = || materials(scene).map(|(_, material)| &material.bsdf);
        let straight = materials().fold([[false; 2]; 2], |sum, bsdf| or(sum, pattern(bsdf.straight)));
        let reflects = materials()
            .flat_map(|bsdf| &bsdf.terms)
            .filter(|term| term.lobe.bound().max_element() > 0.0)
            .fold([[false; 2]; 2], |sum, term| or(sum, pattern(term.coefficient)));
        // Any number of straight crossings, then a reflection.
        let identity = [[true, false], [false, true]];
        let crossings = or(or(identity, straight), product(straight, straight));
        let step = product(reflects, crossings);
        let twice = product(step, step);
        let live = [0, 1].map(|half| step[half][half] || twice[half][half]);
        let coupled = step[0][1] && step[1][0];
        let on_way = [0, 1].map(|half| {
            let comes = (0..2).any(|from| live[from] && crossings[half][from]);
            comes && (0..2).any(|to| live[to] && step[to][half])
        });
        let passes = (0..2).any(|i| (0..2).any(|j| on_way[i] && on_way[j] && straight[i][j]));
        Self { live, on_way, coupled, passes }
    }

    /// True when nothing is reflected for ever.
    pub fn ends(self) -> bool {
        self.live == [false; 2]
    }

    /// The same, where all light matters: that which luminaires send may come to take part.
    pub fn open(self) -> Self {
        Self { live: [true; 2], on_way: [true; 2], ..self }
    }

    /// What is left of light after a crossing, as far as it matters.
    pub fn crossed(&self, matrix: Matrix, power: [f32; 2]) -> [f32; 2] {
        kept(matrix, power, self.on_way)
    }

    /// What is left of light after a reflection, as far as it matters.
    pub fn reflected(&self, matrix: Matrix, power: [f32; 2]) -> [f32; 2] {
        kept(matrix, power, self.live)
    }

    /// The most that one reflection of `material` makes of a watt of live light, in the channel where it is largest.
    pub fn most_reflected(self, material: &Material) -> f64 {
        // A matrix in place of the lobes' own has no such bound.
        let together = material.most.and_then(|most| match &material.fluorescence {
            None => Some(most),
            Some(beside) => Some(most + beside.most()?),
        });
        let columns = (0..3).flat_map(|channel| {
            [0, 1].map(|column| {
                let terms = material.bsdf.terms.iter();
                let sums =
                    terms.map(|term| self.column(term.coefficient, column) * lossless(&term.lobe, channel));
                // Lobes are not all at their most in the same place, or for light from the same direction.
                let most = together.map_or(f64::INFINITY, |most| {
                    self.column(material.reflects, column) * f64::from(most[channel])
                });
                sums.sum::<f64>().min(most)
            })
        });
        columns.fold(0.0, f64::max)
    }

    /// What a watt of one live half becomes; halves that do not return to each other count on their own.
    fn column(self, matrix: Matrix, column: usize) -> f64 {
        let row = |row: usize| {
            let counts = self.live[row] && self.live[column] && (row == column || self.coupled);
            if counts { f64::from(matrix.rows()[row][column]) } else { 0.0 }
        };
        row(0) + row(1)
    }
}

/// The chosen halves of `matrix · power`.
fn kept(matrix: Matrix, [invisible, visible]: [f32; 2], halves: [bool; 2]) -> [f32; 2] {
    let all = matrix.rows().map(|[a, b]| a * invisible + b * visible);
    [0, 1].map(|half| if halves[half] { all[half] } else { 0.0 })
}

/// Materials that some triangle has, with their index.
pub(super) fn materials(scene: &Scene) -> impl Iterator<Item = (usize, &Material)> {
    let mut used = vec![false; scene.materials.len()];
    scene.mesh.surface.iter().for_each(|s| used[scene.surfaces[*s as usize].material as usize] = true);
    scene.materials.iter().enumerate().filter(move |(index, _)| used[*index])
}

/// The largest part of arriving light that a lobe sends on.
fn lossless(lobe: &Lobe, channel: usize) -> f64 {
    f64::from(lobe.bound()[channel])
}

fn pattern(matrix: Matrix) -> Pattern {
    matrix.rows().map(|row| row.map(|entry| entry != 0.0))
}

fn or(a: Pattern, b: Pattern) -> Pattern {
    [0, 1].map(|i| [0, 1].map(|j| a[i][j] || b[i][j]))
}

fn product(a: Pattern, b: Pattern) -> Pattern {
    [0, 1].map(|i| [0, 1].map(|j| (a[i][0] && b[0][j]) || (a[i][1] && b[1][j])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Illumination;

    fn chain(illumination: &str) -> Chain {
        let mut scene = Scene::load("builtin:cornell-spheres").expect("built in");
        let illumination: Illumination = illumination.parse().expect("an illumination");
        scene.illuminate(Some(illumination), &[("*".into(), illumination)]).expect("no names");
        Chain::of(&scene)
    }

    #[test]
    fn corners_of_the_square() {
        assert!(chain("local").ends() && chain("one-bounce").ends());
        let global = chain("global");
        assert!(global.live == [true, false] && !global.passes);
        let shadowless = chain("shadowless");
        assert!(shadowless.live == [true, false] && shadowless.passes);
    }

    #[test]
    fn matrices_of_ones_own() {
        // Invisible becomes visible and back: neither diagonal entry is set, and both halves live.
        let swap = chain("0,0.5,0.5,0/0,0,0,0");
        assert!(swap.live == [true, true] && swap.coupled && !swap.passes);
        // Reflection turns invisible into visible, and a crossing turns that back.
        let returns = chain("0,0,1,0/0,1,0,0");
        assert!(returns.live == [false, true] && returns.on_way == [true, true] && returns.passes);
        // It goes one way only.
        assert!(chain("0,0,1,0/0,0,1,0").ends());
    }
}
