//! What passes add up to: per pixel one sum for each pair of stored powers, and the spreads for the error bar.

use super::errors::{self, AtEachT, ColourSpread, GRID, LANES, POINTS, RECORD};
use super::frontier::Frontier;
use super::nodes::{Nodes, Shares};
use super::{Atlas, AtlasErrors};
use crate::gather::{ByOrder, Connections, Gathered, Maps, MostOrders, gather_by_order};
use crate::light::Power;
use crate::plan::Plan;
use fearless_simd::{Level, dispatch};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// An atlas in the making.
pub struct AtlasSums {
    width: u32,
    height: u32,
    most: MostOrders,
    /// The film's own point of the square.
    at: (f32, f32),
    tables: Tables,
    passes: u32,
    /// Per pixel: [`Tables::record`] numbers.
    records: Vec<f32>,
    colour: ColourSpread,
}

/// What every pixel needs and none changes.
struct Tables {
    n: Nodes,
    m: Nodes,
    shares: Shares,
    frontier: Frontier,
    level: Level,
    /// tᵐ, by m.
    t_powers: Vec<AtEachT>,
    /// sⁿ, by share of the largest s at t and n.
    s_powers: [Vec<AtEachT>; GRID.len()],
}

impl Tables {
    fn new(n: Nodes, m: Nodes, frontier: Frontier) -> Self {
        let at_each_t = |value: &dyn Fn(usize) -> f64| -> AtEachT {
            std::array::from_fn(|lane| if lane / 3 < GRID.len() { value(lane / 3) as f32 } else { 0.0 })
        };
        let t_powers = (0..=m.last()).map(|m| at_each_t(&|i| GRID[i].powi(m.into()))).collect();
        let s_powers = std::array::from_fn(|j| {
            let s = |i: usize| errors::point(&frontier, i, j).0;
            (0..=n.last()).map(|n| at_each_t(&|i| s(i).powi(n.into()))).collect()
        });
        let shares = Shares::new(&n, &m, &frontier);
        Self { n, m, shares, frontier, level: Level::new(), t_powers, s_powers }
    }

    /// Sums of all pairs of stored powers, then mean and spread at every point of the grid; RGB each.
    fn record(&self) -> usize {
        3 * self.n.len() * self.m.len() + RECORD
    }

    /// Adds one pixel of one pass. Values at the points of the grid are also added to the row.
    fn add(&self, record: &mut [f32], pixel: &ByOrder, before: u32, row: &mut RowTotal) {
        // The same sums in the same order on every machine; only how many lanes are added at once differs.
        dispatch!(self.level, _simd => self.add_lanes(record, pixel, before, row));
    }

    #[inline(always)]
    fn add_lanes(&self, record: &mut [f32], pixel: &ByOrder, before: u32, row: &mut RowTotal) {
        let (sums, spreads) = record.split_at_mut(3 * self.n.len() * self.m.len());
        row.by_n.resize(self.s_powers[0].len(), [0.0; LANES]);
        let mut highest = 0;
        for (n, m, value) in pixel.iter() {
            for &(bin, weight) in self.shares.of(n, m) {
                let weighted = (weight * value).to_array();
                let sums = &mut sums[3 * bin as usize..][..3];
                sums.iter_mut().zip(weighted).for_each(|(sum, x)| *sum += x);
            }
            // By n alone, once t is put in: far fewer numbers for the points of one t.
            let [r, g, b] = value.to_array();
            let rgb = [r, g, b, r, g, b, r, g, b, r, g, b, r, g, b, 0.0];
            let powers = &self.t_powers[usize::from(m)];
            let by_n = &mut row.by_n[usize::from(n)];
            (0..LANES).for_each(|lane| by_n[lane] += powers[lane] * rgb[lane]);
            highest = highest.max(usize::from(n));
        }
        for (j, powers) in self.s_powers.iter().enumerate() {
            let mut values = [0.0; LANES];
            for (by_n, powers) in row.by_n[..=highest].iter().zip(powers) {
                (0..LANES).for_each(|lane| values[lane] += powers[lane] * by_n[lane]);
            }
            errors::add_to_record(spreads, j, &values, before);
            let total = &mut row.total[j];
            (0..LANES).for_each(|lane| total[lane] += f64::from(values[lane]));
        }
        row.by_n[..=highest].fill([0.0; LANES]);
    }
}

/// Of a row of pixels: the sum of the picture at every point of the grid; and room to work in.
struct RowTotal {
    total: [[f64; LANES]; GRID.len()],
    by_n: Vec<AtEachT>,
}

impl Default for RowTotal {
    fn default() -> Self {
        Self { total: [[0.0; LANES]; GRID.len()], by_n: Vec::new() }
    }
}

impl AtlasSums {
    /// Empty sums for a film of this size in pixels that is read at the point `at`.
    pub fn new((width, height): (u32, u32), most: MostOrders, at: (f32, f32), frontier: Frontier) -> Self {
        let (n, m) = (Nodes::up_to(most.n), Nodes::up_to(most.m));
        let most = MostOrders { n: n.last(), m: m.last(), ..most };
        let tables = Tables::new(n, m, frontier);
        // Written, not asked for as zeros: a page of zeros that is read before it is written is mapped twice.
        let numbers = width as usize * height as usize * tables.record();
        let records = (0..numbers).into_par_iter().map(|_| 0.0).collect();
        Self { width, height, most, at, tables, passes: 0, records, colour: ColourSpread::default() }
    }

    /// The largest orders that are kept apart.
    pub fn most(&self) -> MostOrders {
        self.most
    }

    /// How far it counts and what it takes, in one line.
    pub fn describe(&self) -> String {
        let Tables { n, m, frontier, .. } = &self.tables;
        let everywhere = frontier.largest_s(1.0) >= 1.0;
        let images = if everywhere {
            "the whole square has images".to_owned()
        } else {
            format!("images up to s = {:.2} at t = 1", frontier.largest_s(1.0))
        };
        format!(
            "atlas: {} pictures by up to {} reflections and {} crossings; {images}; {:.0} MB while it is made",
            n.len() * m.len(),
            n.last(),
            m.last(),
            4e-6 * self.records.len() as f64
        )
    }

    /// Gathers one pass and adds it; returns it as it looks at the film's own point.
    pub fn add_pass<P: Power>(
        &mut self,
        plan: &Plan,
        connections: &Connections,
        maps: Maps<'_, P>,
        pass: u32,
    ) -> Gathered<1> {
        let (tables, before) = (&self.tables, self.passes);
        let add = |record: &mut [f32], pixel: &ByOrder, total: &mut RowTotal| {
            tables.add(record, pixel, before, total);
        };
        let counting = (self.most, self.at);
        let (gathered, rows) =
            gather_by_order(plan, connections, maps, pass, counting, &mut self.records, add);
        let pixels = f64::from(self.width) * f64::from(self.height);
        let colour = |row: &RowTotal, point: usize| {
            DVec3::from_slice(&row.total[point % GRID.len()][3 * (point / GRID.len())..])
        };
        let colours = std::array::from_fn(|i| rows.iter().map(|row| colour(row, i)).sum::<DVec3>() / pixels);
        self.colour.add(&colours, before);
        self.passes += 1;
        gathered
    }

    /// The means over passes.
    pub fn atlas(&self) -> Atlas {
        let (bins, passes) = (self.tables.n.len() * self.tables.m.len(), self.passes.max(1) as f32);
        let mut planes = self.planes(bins, |record, bin| Vec3::from_slice(&record[3 * bin..]) / passes);
        planes
            .par_iter_mut()
            .filter(|plane| plane.iter().all(|value| *value == Vec3::ZERO))
            .for_each(Vec::clear);
        let errors = (self.passes >= 2).then(|| {
            let scale = 1.0 / (passes * (passes - 1.0));
            let planes = self.planes(POINTS, |record, point| {
                (scale * Vec3::from_slice(&record[3 * bins + errors::place_of_spread(point)..]))
                    .map(f32::sqrt)
            });
            AtlasErrors { planes, colour: self.colour.errors(self.passes) }
        });
        Atlas {
            width: self.width,
            height: self.height,
            passes: self.passes,
            n: self.tables.n.clone(),
            m: self.tables.m.clone(),
            cut: self.most.cut,
            frontier: self.tables.frontier.clone(),
            planes,
            errors,
        }
    }

    /// `count` planes, each of which takes a number from each pixel's record. Records are read once, a few rows' worth at a
    /// time.
    fn planes(&self, count: usize, value: impl Fn(&[f32], usize) -> Vec3 + Sync) -> Vec<Vec<Vec3>> {
        const TOGETHER: usize = 512;
        let stride = self.tables.record();
        let mut planes = vec![vec![Vec3::ZERO; self.records.len() / stride]; count];
        let mut parts: Vec<_> = planes.iter_mut().map(|plane| plane.chunks_mut(TOGETHER)).collect();
        let jobs = self.records.chunks(TOGETHER * stride).map(|records| {
            let parts: Vec<_> =
                parts.iter_mut().map(|part| part.next().expect("as many as records")).collect();
            (records, parts)
        });
        jobs.collect::<Vec<_>>().into_par_iter().for_each(|(records, parts)| {
            for (i, part) in parts.into_iter().enumerate() {
                for (to, record) in part.iter_mut().zip(records.chunks(stride)) {
                    *to = value(record, i);
                }
            }
        });
        planes
    }
}
