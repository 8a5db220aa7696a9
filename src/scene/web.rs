//! Luminous intensity by direction, as laboratories measure it: a table over two angles, bilinear between them, and directions in
//! proportion to it.

use super::Fnv;
use crate::sampling::Cumulative;
use std::f64::consts::{PI, TAU};

/// A photometric web: intensity by the angle from a pole and the turn about it, in units of its mean over all directions.
#[derive(Clone, Debug)]
pub(super) struct Web {
    /// rad from the pole, ascending; it is dark beyond them.
    polar: Vec<f64>,
    /// rad about the pole, ascending by a whole turn at most; dark beyond.
    azimuth: Vec<f64>,
    /// One column of `polar` after another.
    values: Vec<f64>,
    /// What a value of 1 is.
    mean: f64,
    cells: Cells,
}

/// Parts of the sphere within which directions are chosen alike.
#[derive(Clone, Debug)]
struct Cells {
    /// Cosines of what bounds rows, descending.
    heights: Vec<f64>,
    /// Turns that bound columns, rad.
    turns: Vec<f64>,
    /// ∫ I dω of each row.
    rows: Cumulative,
    /// Within each row the running sums.
    sums: Vec<f64>,
}

/// A cell and the shares of its height and of its turn before a place.
#[derive(Clone, Copy, Debug)]
struct Within {
    row: usize,
    column: usize,
    shares: [f64; 2],
}

/// The most that a cell has of the angle from the pole and of the turn, rad: intensity hardly differs within.
const STEPS: [f64; 2] = [2.0 * PI / 180.0, 6.0 * PI / 180.0];

/// Degrees between angles below which they are one, and f64 has no digits left for the integral between them.
const CLOSEST: f64 = 1e-3;

impl Web {
    /// Of degrees that ascend, from the pole (0 to 180) and about it (by 360 at most), and a column of intensity for each of
    /// the latter, finite and not negative. Err: why not.
    pub fn new(polar: &[f64], azimuth: &[f64], columns: &[Vec<f64>]) -> Result<Self, String> {
        let ascends = |angles: &[f64]| angles.windows(2).all(|pair| pair[1] - pair[0] >= CLOSEST);
        if polar.len() < 2 || azimuth.len() < 2 || !ascends(polar) || !ascends(azimuth) {
            return Err(format!("its angles do not ascend by {CLOSEST}° or more; mend it"));
        }
        let radians = |angles: &[f64]| angles.iter().map(|angle| angle.to_radians()).collect::<Vec<_>>();
        let values: Vec<f64> = columns.concat();
        assert!(values.len() == polar.len() * azimuth.len(), "a value for each pair of angles");
        let (polar, azimuth) = (radians(polar), radians(azimuth));
        let cells = Cells::new(&polar, &azimuth, &values);
        let mean = cells.rows.total() / (2.0 * TAU);
        if !(mean > 0.0 && mean.is_finite()) {
            return Err("shines in no direction, or infinitely; leave it out or mend it".into());
        }
        let values = values.into_iter().map(|value| value / mean).collect();
        Ok(Self { polar, azimuth, values, mean, cells })
    }

    /// Its mean intensity over all directions, in the unit of the table.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Intensity in the direction of a unit vector, of which x has no turn and z is the pole; 1 on average.
    pub fn at(&self, to: [f64; 3]) -> f64 {
        let [x, y, z] = to;
        let place = between(&self.polar, x.hypot(y).atan2(z));
        let turn = between(&self.azimuth, from_first(&self.azimuth, y.atan2(x)));
        let (Some((row, down)), Some((column, along))) = (place, turn) else { return 0.0 };
        let value = |column: usize| {
            let values = &self.values[column * self.polar.len() + row..];
            values[0] + down * (values[1] - values[0])
        };
        let (left, right) = (value(column), value(column + 1));
        left + along * (right - left)
    }

    /// A unit vector from two numbers in [0, 1).
    pub fn sample(&self, numbers: [f32; 2]) -> [f64; 3] {
        self.cells.direction(self.cells.choose(numbers.map(f64::from)))
    }

    /// Density of [`sample`](Self::sample) in solid angle, sr⁻¹.
    pub fn density(&self, to: [f64; 3]) -> f64 {
        self.cells.within(to).map_or(0.0, |within| self.cells.density(within))
    }

    /// The numbers that [`sample`](Self::sample) makes a unit vector of. None: it never does.
    pub fn numbers(&self, to: [f64; 3]) -> Option<[f32; 2]> {
        let numbers = self.cells.numbers(self.cells.within(to)?)?;
        Some(numbers.map(|x| (x as f32).clamp(0.0, 1.0 - f32::EPSILON)))
    }

    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        8 * (self.values.len() + self.cells.sums.len())
    }

    /// Of all that decides what shines.
    pub fn digest(&self) -> u64 {
        let mut fnv = Fnv::EMPTY;
        let all = self.polar.iter().chain(&self.azimuth).chain(&self.values);
        all.for_each(|x| fnv.word(x.to_bits()));
        fnv.0
    }
}

impl Cells {
    fn new(polar: &[f64], azimuth: &[f64], values: &[f64]) -> Self {
        let alike = |column: usize| {
            let of = |column: usize| &values[column * polar.len()..][..polar.len()];
            of(column) == of(column + 1)
        };
        let down = finer(polar, |_| STEPS[0]);
        let turns = finer(azimuth, |column| if alike(column) { TAU } else { STEPS[1] });
        let (mut sums, mut rows) = (Vec::with_capacity((down.len() - 1) * (turns.len() - 1)), Vec::new());
        for edges in down.windows(2) {
            let mut sum = 0.0;
            for sides in turns.windows(2) {
                sum += (sides[1] - sides[0])
                    * integral(polar, azimuth, values, edges, 0.5 * (sides[0] + sides[1]));
                sums.push(sum);
            }
            rows.push(sum);
        }
        Self {
            heights: down.iter().map(|angle| angle.cos()).collect(),
            turns,
            rows: Cumulative::new(rows),
            sums,
        }
    }

    fn of_row(&self, row: usize) -> &[f64] {
        let columns = self.turns.len() - 1;
        &self.sums[row * columns..][..columns]
    }

    fn choose(&self, [a, b]: [f64; 2]) -> Within {
        let x = a * self.rows.total();
        let row = self.rows.index(x);
        let sums = self.of_row(row);
        let y = b * sums[sums.len() - 1];
        let column = sums.partition_point(|sum| *sum <= y).min(sums.len() - 1);
        let (below, weight) = part(sums, column);
        let shares = [(x - self.rows.below(row)) / self.rows.weight(row), (y - below) / weight];
        Within { row, column, shares }
    }

    fn direction(&self, Within { row, column, shares: [down, along] }: Within) -> [f64; 3] {
        let z = self.heights[row] + down * (self.heights[row + 1] - self.heights[row]);
        let turn = self.turns[column] + along * (self.turns[column + 1] - self.turns[column]);
        let flat = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        [flat * turn.cos(), flat * turn.sin(), z]
    }

    fn within(&self, [x, y, z]: [f64; 3]) -> Option<Within> {
        let up = self.heights.partition_point(|height| *height >= z);
        let row = up.checked_sub(1).filter(|row| row + 1 < self.heights.len())?;
        let (column, along) = between(&self.turns, from_first(&self.turns, y.atan2(x)))?;
        let down = (self.heights[row] - z) / (self.heights[row] - self.heights[row + 1]);
        Some(Within { row, column, shares: [down, along] })
    }

    fn density(&self, Within { row, column, .. }: Within) -> f64 {
        let (_, weight) = part(self.of_row(row), column);
        let height = self.heights[row] - self.heights[row + 1];
        weight / (self.rows.total() * height * (self.turns[column + 1] - self.turns[column]))
    }

    fn numbers(&self, Within { row, column, shares: [down, along] }: Within) -> Option<[f64; 2]> {
        let sums = self.of_row(row);
        let ((below, weight), whole) = (part(sums, column), sums[sums.len() - 1]);
        let a = (self.rows.below(row) + down * self.rows.weight(row)) / self.rows.total();
        (weight > 0.0).then(|| [a, (below + along * weight) / whole])
    }
}

/// ∫ I sin θ dθ between two angles from the pole, within one step of the table, at a turn.
fn integral(polar: &[f64], azimuth: &[f64], values: &[f64], edges: &[f64], turn: f64) -> f64 {
    let (a, b) = (edges[0], edges[1]);
    let (row, column) = (step(polar, 0.5 * (a + b)), step(azimuth, turn));
    let along = (turn - azimuth[column]) / (azimuth[column + 1] - azimuth[column]);
    let value = |row: usize| {
        let [left, right] = [column, column + 1].map(|column| values[column * polar.len() + row]);
        left + along * (right - left)
    };
    let slope = (value(row + 1) - value(row)) / (polar[row + 1] - polar[row]);
    let at = |angle: f64| value(row) + slope * (angle - polar[row]);
    at(a) * a.cos() - at(b) * b.cos() + slope * (b.sin() - a.sin())
}

/// The sum before a part and the part's own, from running sums.
fn part(sums: &[f64], index: usize) -> (f64, f64) {
    let below = if index == 0 { 0.0 } else { sums[index - 1] };
    (below, sums[index] - below)
}

/// The interval between two of the ascending `edges` that `x` lies in; the nearest where it lies in none.
fn step(edges: &[f64], x: f64) -> usize {
    edges.partition_point(|edge| *edge <= x).clamp(1, edges.len() - 1) - 1
}

/// The same with the share of it before `x`. None: it lies in none.
fn between(edges: &[f64], x: f64) -> Option<(usize, f64)> {
    let inside = edges[0] <= x && x <= edges[edges.len() - 1];
    let low = step(edges, x);
    inside.then(|| (low, (x - edges[low]) / (edges[low + 1] - edges[low])))
}

/// A turn, rad, as one that is not before the first.
fn from_first(turns: &[f64], turn: f64) -> f64 {
    turns[0] + (turn - turns[0]).rem_euclid(TAU)
}

/// With more edges between, where steps are longer than they may be.
fn finer(edges: &[f64], most: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut finer = vec![edges[0]];
    for (i, pair) in edges.windows(2).enumerate() {
        let parts = ((pair[1] - pair[0]) / most(i)).ceil().max(1.0);
        let part = |j: usize| pair[0] + (pair[1] - pair[0]) * (j as f64 / parts);
        finer.extend((1..parts as usize).map(part));
        finer.push(pair[1]);
    }
    finer
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sobol;

    /// Intensity 3 − 4 θ / π up to a right angle from the pole, times what differs about it.
    fn web() -> Web {
        let turns = [0.0, 50.0, 120.0, 300.0, 360.0];
        let about = [1.0, 3.0, 0.0, 2.0, 1.0];
        let columns: Vec<Vec<f64>> = about.iter().map(|x| vec![3.0 * x, 2.0 * x, 1.0 * x]).collect();
        Web::new(&[0.0, 45.0, 90.0], &turns, &columns).expect("a good table")
    }

    #[test]
    fn the_mean_is_the_integral_over_all_directions() {
        // ∫ (3 − 4θ/π) sin θ dθ from 0 to π/2 = 3 − 4/π, and the trapezoids over the turn.
        let about: f64 = [(50.0, 4.0), (70.0, 3.0), (180.0, 2.0), (60.0, 3.0)]
            .iter()
            .map(|(step, sum): &(f64, f64)| 0.5 * step.to_radians() * sum)
            .sum();
        let expected = (3.0 - 4.0 / PI) * about / (2.0 * TAU);
        assert!((web().mean() / expected - 1.0).abs() < 1e-12, "{} for {expected}", web().mean());
        let even = Web::new(&[0.0, 180.0], &[0.0, 360.0], &[vec![7.0; 2], vec![7.0; 2]]).expect("a table");
        assert!((even.mean() / 7.0 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn directions_come_as_often_as_their_density_says_and_are_found_again() {
        let web = web();
        let sobol = Sobol::new(5);
        let n = 1 << 16;
        let (mut whole, mut up) = (0.0, 0.0);
        for i in 0..n {
            let numbers: [f32; 2] = sobol.point(i, 0);
            let to = web.sample(numbers);
            let (density, value) = (web.density(to), web.at(to));
            whole += value / density;
            up += to[2] * value / density;
            let again = web.sample(web.numbers(to).expect("it came from there"));
            let off = (0..3).map(|i| (again[i] - to[i]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-4, "{to:?} is found as {again:?}");
        }
        let (whole, up) = (whole / f64::from(n) / (2.0 * TAU), up / whole);
        // ∫ (3 − 4θ/π) cos θ sin θ dθ = 1: 3/2 − (4/π) π/8.
        let expected = 1.0 / (3.0 - 4.0 / PI);
        for (found, expected) in [(whole, 1.0), (up, expected)] {
            let fits = |over: f64| (found / (over * expected) - 1.0).abs() < 2e-3;
            assert!(fits(1.0) && !fits(1.02) && !fits(0.98), "{found} for {expected}");
        }
    }

    #[test]
    fn intensity_is_bilinear_between_the_angles_of_the_table_and_dark_beyond() {
        let web = web();
        let to = |polar: f64, turn: f64| {
            let (polar, turn) = (polar.to_radians(), turn.to_radians());
            [polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()]
        };
        for (polar, turn, expected) in [
            (45.0, 0.0, 2.0),
            (22.5, 25.0, 2.5 * 2.0),
            (67.5, 210.0, 1.5),
            (45.0, 330.0, 2.0 * 1.5),
            (45.0, -30.0, 2.0 * 1.5),
            (45.0, 119.999_999, 0.0),
            (90.001, 10.0, 0.0),
            (180.0, 10.0, 0.0),
        ] {
            let found = web.at(to(polar, turn)) * web.mean();
            assert!((found - expected).abs() < 1e-6, "{polar}°, {turn}°: {found} for {expected}");
        }
        assert_eq!(web.density(to(100.0, 10.0)), 0.0);
        assert_eq!(web.numbers(to(100.0, 10.0)), None);
    }

    #[test]
    fn a_table_that_is_none_is_refused() {
        let new = |polar: &[f64], turns: &[f64], value: f64| {
            Web::new(polar, turns, &vec![vec![value; polar.len()]; turns.len()])
        };
        assert!(new(&[0.0, 90.0], &[0.0, 360.0], 1.0).is_ok());
        for (polar, turns, value) in [
            (&[0.0][..], &[0.0, 360.0][..], 1.0),
            (&[0.0, 0.0], &[0.0, 360.0], 1.0),
            (&[90.0, 0.0], &[0.0, 360.0], 1.0),
            (&[0.0, 90.0], &[0.0], 1.0),
            (&[0.0, 90.0], &[0.0, 360.0], 0.0),
            (&[0.0, 90.0], &[0.0, 360.0], 1e308),
        ] {
            assert!(new(polar, turns, value).is_err(), "{polar:?} {turns:?} {value}");
        }
    }
}
