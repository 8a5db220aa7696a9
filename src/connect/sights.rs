//! Which luminaires are seen from where: learned, so that connections seldom end at a wall.
//!
//! Of a sky a room sees what its window shows, of a hundred lamps those of its own. A grid lies over what the camera sees; in
//! each of its cells luminaires are chosen in proportion to what they were found to bring to places around, and directions of an
//! environment likewise, in parts of equal power. A share is chosen as it would be without: a wrong guess costs noise, not
//! bias (J. Vorba et al. 2014, *On-line learning of parametric mixture models for light transport simulation*, §4, use such a
//! share in the same way).

use crate::sampling::Cumulative;
use crate::sampling::steps::{cumulative, density, invert};
use crate::scene::SurfacePoint;
use glam::{IVec3, Vec3};
use std::collections::HashMap;

/// The share of connections that is not guided.
const EVEN: f32 = 0.25;
/// Parts along each of the two numbers that choose a direction of the environment.
const SIDE: usize = 16;
/// What is found in a cell counts so much for its neighbours.
const NEIGHBOUR: f32 = 0.3;
/// And what is found in a part of the sky for parts beside it: what is seen of it ends within parts.
const BESIDE: f32 = 0.1;
/// With more luminaires to choose from they are not told apart.
const MOST: usize = 256;
/// Cells along the longest side of what is seen.
const CELLS: f32 = 24.0;

/// What a trial connection brought.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    /// From where.
    pub position: Vec3,
    /// Which of the luminaires that are chosen from.
    pub chosen: u32,
    /// The two numbers that chose the place on it.
    pub place: [f32; 2],
    /// What the picture read of it, in any unit; zero where something hid it.
    pub weight: f32,
}

/// What is seen from where.
#[derive(Clone, Debug)]
pub struct Sights {
    origin: Vec3,
    /// Cells per metre.
    per_metre: f32,
    cells: HashMap<IVec3, Cell>,
}

/// From one cell.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    /// Which luminaire. None: as without.
    choice: Option<Cumulative>,
    /// Which directions of the environment. None: as without.
    sky: Option<Box<Parts>>,
}

/// A density over the unit square, constant in each part, with mean one.
#[derive(Clone, Debug)]
struct Parts {
    rows: [f32; SIDE],
    columns: [[f32; SIDE]; SIDE],
}

impl Sights {
    /// From trials. `even` are the probabilities of the luminaires without, `sky` that which is an environment. None: there is
    /// nothing to learn from.
    pub fn new(trials: &[Trial], even: &[f32], sky: Option<u32>) -> Option<Self> {
        let found = trials.iter().filter(|trial| trial.weight > 0.0 && trial.weight.is_finite());
        let bounds = found.clone().map(|trial| (trial.position, trial.position));
        let (min, max) = bounds.reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))?;
        let per_metre = CELLS / (max - min).max_element().max(f32::MIN_POSITIVE);
        let mut sights = Self { origin: min, per_metre, cells: HashMap::new() };
        let mut sums: HashMap<IVec3, Sums> = HashMap::new();
        for trial in found {
            let own = sights.place(trial.position);
            for (dx, dy, dz) in around() {
                let share = if (dx, dy, dz) == (0, 0, 0) { 1.0 } else { NEIGHBOUR };
                sums.entry(own + IVec3::new(dx, dy, dz)).or_default().add(trial, share, sky);
            }
        }
        let cell = |(place, sums): (IVec3, Sums)| (place, sums.cell(even));
        sights.cells = sums.into_iter().map(cell).collect();
        (per_metre.is_finite() && !sights.cells.is_empty()).then_some(sights)
    }

    fn place(&self, position: Vec3) -> IVec3 {
        ((position - self.origin) * self.per_metre).floor().as_ivec3()
    }

    /// What is seen from a point. None: nobody knows.
    pub(super) fn from(&self, point: &SurfacePoint) -> Option<&Cell> {
        self.cells.get(&self.place(point.position))
    }

    /// By how much denser than without them connections like this one are.
    pub fn density(&self, trial: &Trial, even: &[f32], sky: Option<u32>) -> f32 {
        let Some(cell) = self.cells.get(&self.place(trial.position)) else { return 1.0 };
        let index = trial.chosen as usize;
        let choice = cell.probability(index).map_or(1.0, |probability| probability / even[index]);
        let of_sky = sky == Some(trial.chosen);
        choice * if of_sky { cell.density_of_sky(trial.place) } else { 1.0 }
    }

    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        let each = |cell: &Cell| {
            let choice = cell.choice.as_ref().map_or(0, |choice| 8 * choice.len());
            choice + cell.sky.as_ref().map_or(0, |_| size_of::<Parts>()) + size_of::<(IVec3, Cell)>()
        };
        self.cells.values().map(each).sum()
    }
}

fn around() -> impl Iterator<Item = (i32, i32, i32)> {
    (-1..=1).flat_map(|x| (-1..=1).flat_map(move |y| (-1..=1).map(move |z| (x, y, z))))
}

/// What trials brought to a cell.
#[derive(Default)]
struct Sums {
    of_luminaire: HashMap<u32, f32>,
    of_sky: Option<Box<[[f32; SIDE]; SIDE]>>,
}

impl Sums {
    fn add(&mut self, trial: &Trial, share: f32, sky: Option<u32>) {
        *self.of_luminaire.entry(trial.chosen).or_default() += share * trial.weight;
        if sky == Some(trial.chosen) {
            let [x, y] = trial.place.map(|x| ((x * SIDE as f32) as i32).min(SIDE as i32 - 1));
            let parts = self.of_sky.get_or_insert_default();
            for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
                // The first number goes round, the second does not.
                let column = (x + dx).rem_euclid(SIDE as i32) as usize;
                let Some(row) = usize::try_from(y + dy).ok().and_then(|row| parts.get_mut(row)) else {
                    continue;
                };
                row[column] += share * trial.weight * if (dx, dy) == (0, 0) { 1.0 } else { BESIDE };
            }
        }
    }

    fn cell(self, even: &[f32]) -> Cell {
        let of = |i: usize| self.of_luminaire.get(&(i as u32)).copied().unwrap_or(0.0);
        // In a fixed order, so that rounding is the same each time.
        let sum: f32 = (0..even.len()).map(of).sum();
        let guided = |(i, even): (usize, &f32)| EVEN * even + (1.0 - EVEN) * of(i) / sum;
        let many = even.len() > MOST || even.len() < 2;
        let choice = (!many).then(|| Cumulative::new(even.iter().enumerate().map(guided).map(f64::from)));
        Cell { choice, sky: self.of_sky.map(|sums| Box::new(Parts::new(&sums))) }
    }
}

impl Cell {
    /// Which luminaire `u` in [0, 1) chooses, and its probability. None: as without.
    pub fn choose(&self, u: f32) -> Option<(usize, f32)> {
        let choice = self.choice.as_ref()?;
        let index = choice.index(f64::from(u) * choice.total());
        Some((index, self.probability(index)?))
    }

    /// The probability of a luminaire. None: as without.
    pub fn probability(&self, index: usize) -> Option<f32> {
        let choice = self.choice.as_ref()?;
        Some((choice.weight(index) / choice.total()) as f32)
    }

    /// The numbers that choose a direction of the environment, and their density.
    pub fn of_sky(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        self.sky.as_ref().map_or((u, 1.0), |parts| parts.warp(u))
    }

    /// The density of numbers that choose a direction of the environment.
    pub fn density_of_sky(&self, numbers: [f32; 2]) -> f32 {
        self.sky.as_ref().map_or(1.0, |parts| parts.density(numbers))
    }
}

impl Parts {
    fn new(sums: &[[f32; SIDE]; SIDE]) -> Self {
        let sum: f32 = sums.iter().flatten().sum();
        let even = EVEN / (SIDE * SIDE) as f32;
        let share = |y: usize, x: usize| even + (1.0 - EVEN) * sums[y][x] / sum;
        Self {
            rows: cumulative(|y| (0..SIDE).map(|x| share(y, x)).sum()),
            columns: std::array::from_fn(|y| cumulative(|x| share(y, x))),
        }
    }

    fn warp(&self, [a, b]: [f32; 2]) -> ([f32; 2], f32) {
        let (y, b, of_row) = invert(&self.rows, b);
        let (_, a, of_column) = invert(&self.columns[y], a);
        ([a, b], of_row * of_column)
    }

    fn density(&self, [a, b]: [f32; 2]) -> f32 {
        let (y, of_row) = density(&self.rows, b);
        of_row * density(&self.columns[y], a).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sobol;

    #[test]
    fn numbers_follow_the_density_that_is_told() {
        let mut sums = [[0.0; SIDE]; SIDE];
        (sums[3][7], sums[3][8], sums[12][1]) = (4.0, 1.0, 2.0);
        let parts = Parts::new(&sums);
        let (sobol, n) = (Sobol::new(1), 1 << 16);
        let (mut area, mut moment, mut dense) = (0.0, 0.0, 0);
        for i in 0..n {
            let (numbers, density) = parts.warp(sobol.point(i, 0));
            assert!((parts.density(numbers) / density - 1.0).abs() < 1e-3, "{numbers:?}");
            area += f64::from(1.0 / density);
            moment += f64::from(numbers[0] * numbers[1] / density);
            dense += i32::from(density > 10.0);
        }
        let n = f64::from(n);
        assert!((area / n - 1.0).abs() < 1e-3 && (moment / n - 0.25).abs() < 1e-3, "{area} {moment}");
        assert!((f64::from(dense) / n - f64::from(1.0 - EVEN)).abs() < 0.02, "{dense}");
    }

    #[test]
    fn what_was_seen_is_chosen_more_often_and_nothing_never() {
        let trial = |x: f32, chosen| Trial { position: x * Vec3::X, chosen, place: [0.5; 2], weight: 1.0 };
        let trials = [trial(0.0, 0), trial(0.1, 0), trial(9.9, 2), trial(10.0, 2)];
        let sights = Sights::new(&trials, &[0.5, 0.25, 0.25], None).expect("something to learn from");
        let cell = |x: f32| &sights.cells[&sights.place(x * Vec3::X)];
        let odds = |x: f32| [0, 1, 2].map(|i| cell(x).probability(i).expect("a choice"));
        assert_eq!(odds(0.0), [0.875, 0.0625, 0.0625]);
        assert_eq!(odds(10.0), [0.125, 0.0625, 0.8125]);
        assert!(Sights::new(&[], &[1.0], None).is_none());
    }
}
