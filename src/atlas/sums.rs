//! What passes add up to: per pixel one sum for each pair of stored powers, and the spreads for the error bar.

use super::errors::{self, AtGrid, ColourSpread, POINTS, RECORD};
use super::frontier::Frontier;
use super::nodes::{Nodes, Shares, VECTOR};
use super::{Atlas, AtlasErrors};
use crate::gather::{Connections, Gathered, Maps, MostOrders, Ordered, gather_by_order};
use crate::light::Power;
use crate::plan::Plan;
use fearless_simd::{Level, Simd, dispatch};
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
    /// Groups of them, each a sample of the spread.
    groups: u32,
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
    at_grid: AtGrid,
}

impl Tables {
    fn new(n: Nodes, m: Nodes, frontier: Frontier) -> Self {
        let shares = Shares::new(&n, &m, &frontier);
        let at_grid = AtGrid::new(&n, &m, &frontier);
        Self { n, m, shares, frontier, level: Level::new(), at_grid }
    }

    /// RGB of all pairs of stored powers.
    fn sums(&self) -> usize {
        3 * self.n.len() * self.m.len()
    }

    /// Sums of all pairs of stored powers, then the spread at every point of the grid; RGB each.
    fn record(&self) -> usize {
        self.sums() + RECORD
    }

    /// Adds one pixel of a group of passes.
    fn add(&self, record: &mut [f32], light: &[Ordered], group: Group, row: &mut Row) {
        // The same sums in the same order on every machine; only how many lanes are added at once differs.
        dispatch!(self.level, simd => self.add_lanes(simd, record, light, group, row));
    }

    #[inline(always)]
    fn add_lanes<S: Simd>(
        &self,
        simd: S,
        record: &mut [f32],
        light: &[Ordered],
        Group { before, passes }: Group,
        row: &mut Row,
    ) {
        let (sums, spreads) = record.split_at_mut(self.sums());
        row.total.resize(sums.len(), 0.0);
        row.room.resize(self.shares.rows(), [0.0; VECTOR]);
        row.pixel.resize(sums.len() + self.shares.spare(), 0.0);
        self.shares.share_out(simd, light, &mut row.room, &mut row.pixel);
        // How far the mean of these passes is from that of those before them. The grid is linear in the sums, so that this is
        // all that its spread needs (Welford).
        let (n, k) = (before as f32, passes as f32);
        let (over, each) = (1.0 / n.max(1.0), 1.0 / k);
        for ((value, sum), total) in row.pixel.iter_mut().zip(sums).zip(&mut row.total) {
            let away = *value * each - *sum * over;
            *sum += *value;
            *total += *value;
            *value = away;
        }
        let away = self.at_grid.of(simd, &row.pixel[..self.sums()]);
        let share = n * k / (n + k);
        for (spread, away) in spreads.iter_mut().zip(away) {
            *spread += share * away * away;
        }
    }

    /// What sums by stored powers make at every point of the grid.
    fn at_grid(&self, sums: &[f32]) -> [f32; RECORD] {
        dispatch!(self.level, simd => self.at_grid.of(simd, sums))
    }
}

/// Passes whose mean is one sample of the spread.
#[derive(Clone, Copy)]
struct Group {
    /// Passes before them.
    before: u32,
    /// How many they are.
    passes: u32,
}

/// Of a band of pixels.
#[derive(Default)]
struct Row {
    /// The sum of all pixels, by stored powers.
    total: Vec<f32>,
    /// Room to work in.
    pixel: Vec<f32>,
    room: Vec<[f32; VECTOR]>,
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
        Self {
            width,
            height,
            most,
            at,
            tables,
            passes: 0,
            groups: 0,
            records,
            colour: ColourSpread::default(),
        }
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

    /// Gathers passes, one with each of `maps`, and adds them; returns them as they look at the film's own point.
    ///
    /// Together they are one sample of the spread.
    pub fn add_passes<P: Power>(
        &mut self,
        plan: &Plan,
        connections: &Connections,
        maps: Vec<Maps<'_, P>>,
        first_pass: u32,
    ) -> Vec<Gathered<1>> {
        let tables = &self.tables;
        let group = Group { before: self.passes, passes: maps.len() as u32 };
        let add = |record: &mut [f32], light: &[Ordered], row: &mut Row| {
            tables.add(record, light, group, row);
        };
        let counting = (self.most, self.at);
        let (gathered, rows) =
            gather_by_order(plan, connections, maps, first_pass, counting, &mut self.records, add);
        let seen = f64::from(self.width) * f64::from(self.height) * f64::from(group.passes);
        let rows: Vec<_> = rows.iter().map(|row| tables.at_grid(&row.total)).collect();
        let mean = |place: usize| rows.iter().map(|row| f64::from(row[place])).sum::<f64>() / seen;
        let colour = |point| DVec3::from_array(std::array::from_fn(|c| mean(errors::place(point, c))));
        let colours = std::array::from_fn(colour);
        self.colour.add(&colours, group.before, group.passes);
        self.passes += group.passes;
        self.groups += 1;
        gathered
    }

    /// Passes so far.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// The means over passes.
    pub fn atlas(&self) -> Atlas {
        let (bins, passes) = (self.tables.n.len() * self.tables.m.len(), self.passes.max(1) as f32);
        let mut planes = self.planes(bins, |record, bin| Vec3::from_slice(&record[3 * bin..]) / passes);
        planes
            .par_iter_mut()
            .filter(|plane| plane.iter().all(|value| *value == Vec3::ZERO))
            .for_each(Vec::clear);
        let errors = (self.groups >= 2).then(|| {
            let scale = 1.0 / (passes * (self.groups as f32 - 1.0));
            let planes = self.planes(POINTS, |record, point| {
                let spread = |channel| record[3 * bins + errors::place(point, channel)];
                Vec3::from_array(std::array::from_fn(|channel| (scale * spread(channel)).sqrt()))
            });
            AtlasErrors { planes, colour: self.colour.errors(self.passes, self.groups) }
        });
        Atlas {
            width: self.width,
            height: self.height,
            passes: self.passes,
            groups: self.groups,
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

#[cfg(test)]
mod tests {
    use super::super::frontier::Sample;
    use super::*;
    use std::ops::Range;

    #[test]
    fn spreads_are_those_of_two_sweeps() {
        let samples = [0.0, 1.0].map(|t| Sample { t, kappa: 0.5 + 0.3 * t, error: 0.0 });
        let frontier = Frontier::from_samples(samples.to_vec()).expect("rising");
        let tables = Tables::new(Nodes::up_to(9), Nodes::up_to(4), frontier);
        let mut record = vec![0.0; tables.record()];
        let mut row = Row::default();
        // Orders between nodes too; some passes bring nothing.
        let passes: Vec<Vec<Ordered>> = (0..7_u8)
            .map(|pass| {
                let light = |i: u8| Vec3::new(f32::from(pass * i % 5), 1.0, f32::from((pass + i) % 3));
                (0..pass % 4).map(|i| (3 * i, i, light(i))).collect()
            })
            .collect();
        // Groups of one, three, one and two of them.
        let groups = [0..1, 1..4, 4..5, 5..7];
        for group in &groups {
            let together: Vec<Ordered> = group.clone().flat_map(|pass| passes[pass].clone()).collect();
            let group = Group { before: group.start as u32, passes: group.len() as u32 };
            tables.add(&mut record, &together, group, &mut row);
        }
        let (sums, spreads) = record.split_at(tables.sums());
        for at in 0..POINTS {
            let (s, t) = errors::point(&tables.frontier, at / 5, at % 5);
            let picture = |pass: &Vec<Ordered>, channel: usize| -> f64 {
                let term = |(n, m, light): &Ordered| {
                    s.powi((*n).into()) * t.powi((*m).into()) * f64::from(light[channel])
                };
                pass.iter().map(term).sum()
            };
            let total = tables.at_grid(sums);
            for channel in 0..3 {
                let each: Vec<f64> = passes.iter().map(|pass| picture(pass, channel)).collect();
                let mean = each.iter().sum::<f64>() / 7.0;
                let of_group = |group: &Range<usize>| {
                    let away = each[group.clone()].iter().sum::<f64>() / group.len() as f64 - mean;
                    group.len() as f64 * away * away
                };
                let spread: f64 = groups.iter().map(of_group).sum();
                let place = errors::place(at, channel);
                assert!((f64::from(total[place]) - 7.0 * mean).abs() < 2e-3, "{s} {t}: {mean}");
                assert!(
                    (f64::from(spreads[place]) - spread).abs() < 2e-3 * (1.0 + spread),
                    "{s} {t}: {spread}"
                );
            }
        }
        assert!(row.total.iter().zip(sums).all(|(a, b)| (a - b).abs() < 1e-4));
    }
}
