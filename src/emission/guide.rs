//! Where on the luminaires do caustics begin? This is learned from a few paths; then more paths start there, each with less
//! power.
//!
//! The five numbers that start a path fill a unit cube. A grid over three of them (which luminaire, and the two that decide
//! whether glass is in the way) holds a density. It is bounded from below, so that nothing is missed: a wrong guide costs
//! noise, not bias. The map from uniform to guided numbers goes axis by axis, which keeps them stratified.

use super::{EMISSION_DIMENSIONS, Emitted, Emitters};
use crate::light::Power;
use crate::sampling::steps::{cumulative, invert};
use crate::scene::Luminaire;

/// Cells along the choice of the luminaire.
const SLABS: usize = 4;
/// Cells along each of the two numbers that aim.
const SIDE: usize = 32;
/// The share of paths that is guided; the rest starts as it would without.
const GUIDED: f32 = 0.1;

/// A density of starts, constant in each cell, with mean one.
#[derive(Clone, Debug)]
pub struct Guide {
    /// Cumulative probability of slabs.
    slabs: [f32; SLABS],
    /// Cumulative probability of the rows of each slab.
    rows: [[f32; SIDE]; SLABS],
    /// Cumulative probability of the cells of each row.
    cells: Vec<[[f32; SIDE]; SIDE]>,
}

impl Guide {
    /// Numbers of cells.
    pub const CELLS: usize = SLABS * SIDE * SIDE;

    /// The cell of a path that starts by the numbers `u`.
    pub fn cell<P: Power>(emitters: &Emitters<'_, P>, u: [f32; EMISSION_DIMENSIONS]) -> usize {
        let aim = emitters.aim(u[0]);
        let place = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
        (place(u[0], SLABS) * SIDE + place(u[aim], SIDE)) * SIDE + place(u[aim + 1], SIDE)
    }

    /// From how many paths of each cell were of use. None where none was.
    pub fn new(counts: &[f32]) -> Option<Self> {
        // Neighbours lend each other what few paths cannot tell. Noise falls fastest where starts are as dense as the
        // root of what they bring.
        let wish: Vec<f32> = (0..counts.len())
            .map(|cell| {
                let (slab, y, x) = (cell / (SIDE * SIDE), cell / SIDE % SIDE, cell % SIDE);
                let around = |i: usize| i.saturating_sub(1)..=(i + 1).min(SIDE - 1);
                let lent = around(y).flat_map(|y| around(x).map(move |x| (slab * SIDE + y) * SIDE + x));
                lent.map(|cell| counts[cell]).sum::<f32>().sqrt()
            })
            .collect();
        let mean = wish.iter().sum::<f32>() / wish.len() as f32;
        if mean == 0.0 {
            return None;
        }
        let density: Vec<f32> = wish.iter().map(|wish| (1.0 - GUIDED) + GUIDED * wish / mean).collect();
        let row = |row: usize| -> f32 { density[row * SIDE..(row + 1) * SIDE].iter().sum() };
        let slab = |slab: usize| -> f32 { (0..SIDE).map(|y| row(slab * SIDE + y)).sum() };
        Some(Self {
            slabs: cumulative(slab),
            rows: std::array::from_fn(|s| cumulative(|y| row(s * SIDE + y))),
            cells: (0..SLABS)
                .map(|s| std::array::from_fn(|y| cumulative(|x| density[(s * SIDE + y) * SIDE + x])))
                .collect(),
        })
    }
}

impl<P: Power> Emitters<'_, P> {
    /// The start of one of `paths` paths, as [`emit`](Self::emit), denser and fainter where the guide wants it.
    pub fn emit_guided(&self, paths: u32, u: [f32; EMISSION_DIMENSIONS], guide: &Guide) -> Emitted<P> {
        let mut u = u;
        let (slab, chosen, of_slab) = invert(&guide.slabs, u[0]);
        let aim = self.aim(chosen);
        let (row, first, of_row) = invert(&guide.rows[slab], u[aim]);
        let (_, second, of_cell) = invert(&guide.cells[slab][row], u[aim + 1]);
        (u[0], u[aim], u[aim + 1]) = (chosen, first, second);
        let emitted = self.emit(paths, u);
        Emitted { power: emitted.power.scaled(1.0 / (of_slab * of_row * of_cell)), ..emitted }
    }

    /// Which two of the numbers decide what a path meets: the first of them. Parallel light is aimed by its place.
    fn aim(&self, u0: f32) -> usize {
        match self.luminaire(u0) {
            Luminaire::Directional { .. } | Luminaire::Sun { .. } | Luminaire::Environment { .. } => 1,
            _ => 3,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sobol;

    #[test]
    fn densities_have_mean_one_and_are_bounded_from_below() {
        let mut counts = vec![0.0; SLABS * SIDE * SIDE];
        counts[5 * SIDE + 7] = 4.0;
        counts[3 * SIDE * SIDE + 9] = 1.0;
        let guide = Guide::new(&counts).expect("something to guide");
        let sobol = Sobol::new(1);
        let n = 200_000;
        let (mut inverse, mut least, mut most) = (0.0, f32::INFINITY, 0.0_f32);
        for i in 0..n {
            let [a, b, c] = sobol.point::<3>(i, 0);
            let (slab, _, of_slab) = invert(&guide.slabs, a);
            let (row, _, of_row) = invert(&guide.rows[slab], b);
            let (_, x, of_cell) = invert(&guide.cells[slab][row], c);
            assert!((0.0..1.0).contains(&x));
            let density = of_slab * of_row * of_cell;
            inverse += f64::from(1.0 / density);
            (least, most) = (least.min(density), most.max(density));
        }
        // E[1 / density] is the volume of the cube.
        assert!((inverse / f64::from(n) - 1.0).abs() < 1e-3, "{}", inverse / f64::from(n));
        assert!(least > 0.99 * (1.0 - GUIDED) && most > 5.0, "{least} to {most}");
    }

    #[test]
    fn without_caustics_there_is_no_guide() {
        assert!(Guide::new(&[0.0; SLABS * SIDE * SIDE]).is_none());
    }
}
