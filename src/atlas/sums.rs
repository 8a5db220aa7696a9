//! What passes add up to: for each pixel one sum per pair of stored powers, and the spreads for the error bar.

use super::by_order::gather_by_order;
use super::errors::{AtGrid, ColourSpread, POINTS};
use super::file::Plane;
use super::frontier::Frontier;
use super::nodes::{Colours, Nodes, Pixels, Room, Shares};
use super::places::{ABREAST, MostOrders};
use super::{Atlas, AtlasErrors};
use crate::film::{Header, WrittenLayer};
use crate::gather::{Gathered, Maps};
use crate::light::Power;
use crate::plan::{Frame, Plan};
use fearless_simd::{Level, Simd, dispatch};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// An atlas in the making.
pub struct AtlasSums {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) most: MostOrders,
    /// The film's own point of the square.
    pub(super) at: (f32, f32),
    pub(super) tables: Tables,
    pub(super) passes: u32,
    /// Groups of them, each a sample of the spread.
    pub(super) groups: u32,
    /// [`Tables::record`] colours of [`ABREAST`] pixels, row by row; the last ones of a row may have no pixel.
    pub(super) records: Vec<Colours>,
    pub(super) colour: ColourSpread,
}

/// What every pixel needs and none changes.
pub(super) struct Tables {
    pub(super) n: Nodes,
    pub(super) m: Nodes,
    shares: Shares,
    pub(super) frontier: Frontier,
    level: Level,
    at_grid: AtGrid,
}

impl Tables {
    fn new(n: Nodes, m: Nodes, frontier: Frontier) -> Self {
        let shares = Shares::new(&n, &m, &frontier);
        let at_grid = AtGrid::new(&n, &m, &frontier);
        Self { n, m, shares, frontier, level: Level::new(), at_grid }
    }

    /// How many pairs of stored powers.
    fn bins(&self) -> usize {
        self.n.len() * self.m.len()
    }

    /// Sums of all pairs of stored powers, by node of n, then m; then the spread at every point of the grid: a colour each.
    pub(super) fn record(&self) -> usize {
        self.bins() + POINTS
    }

    /// Adds some pixels of a group of passes.
    fn add(&self, record: &mut [Colours], light: &[[Vec4; ABREAST]], group: Group, row: &mut Row) {
        // The same sums in the same order on every machine; only how many lanes are added at once differs.
        dispatch!(self.level, simd => self.add_lanes(simd, record, light, group, row));
    }

    #[inline(always)]
    fn add_lanes<S: Simd>(
        &self,
        simd: S,
        record: &mut [Colours],
        light: &[[Vec4; ABREAST]],
        Group { before, passes }: Group,
        row: &mut Row,
    ) {
        let (sums, spreads) = record.split_at_mut(self.bins());
        row.pixels.resize(sums.len(), Colours::default());
        self.shares.share_out(simd, light, &mut row.room, &mut row.pixels);
        // How far the mean of these passes is from that of those before them. The grid is linear in the sums, so that this is
        // all that its spread needs (Welford).
        let (n, k) = (before as f32, passes as f32);
        let (over, each) = (1.0 / n.max(1.0), 1.0 / k);
        let pixels = row.pixels.as_flattened_mut().as_flattened_mut();
        let sums = sums.as_flattened_mut().as_flattened_mut();
        for (value, sum) in pixels.iter_mut().zip(sums) {
            let away = *value * each - *sum * over;
            *sum += *value;
            *value = away;
        }
        let away = self.at_grid.of(simd, &row.pixels);
        let share = n * k / (n + k);
        let spreads = spreads.as_flattened_mut().as_flattened_mut();
        let totals = row.away.as_flattened_mut().as_flattened_mut();
        for ((spread, total), away) in spreads.iter_mut().zip(totals).zip(away.as_flattened().as_flattened())
        {
            *spread += share * away * away;
            *total += away;
        }
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
    /// How far means are from those before them at every point of the grid, summed over all pixels that have the same place
    /// among those that are added at once.
    away: [Colours; POINTS],
    /// Room to work in.
    pixels: Vec<Colours>,
    room: Room,
}

impl AtlasSums {
    /// Bytes of the sums for a film of this size in pixels.
    pub fn bytes((width, height): (u32, u32), most: MostOrders) -> usize {
        let bins = Nodes::up_to(most.n).len() * Nodes::up_to(most.m).len();
        (width as usize).div_ceil(ABREAST) * height as usize * (bins + POINTS) * size_of::<Colours>()
    }

    /// Empty sums for a film of this size in pixels that is read at the point `at`.
    pub fn new((width, height): (u32, u32), most: MostOrders, at: (f32, f32), frontier: Frontier) -> Self {
        let (n, m) = (Nodes::up_to(most.n), Nodes::up_to(most.m));
        let most = MostOrders { n: n.last(), m: m.last(), ..most };
        let tables = Tables::new(n, m, frontier);
        // Written, not asked for as zeros: a page of zeros that is read before it is written is mapped twice.
        let colours = (width as usize).div_ceil(ABREAST) * height as usize * tables.record();
        let records = (0..colours).into_par_iter().map(|_| Colours::default()).collect();
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
            1e-6 * size_of_val(&self.records[..]) as f64
        )
    }

    /// Gathers passes, one with each of `maps`, and adds them; returns them as they look at the film's own point.
    ///
    /// Together they are one sample of the spread.
    pub fn add_passes<P: Power>(
        &mut self,
        plan: &Plan,
        frame: &Frame,
        maps: Vec<Maps<'_, P>>,
        first_pass: u32,
    ) -> Vec<Gathered<1>> {
        let tables = &self.tables;
        let group = Group { before: self.passes, passes: maps.len() as u32 };
        let add = |record: &mut [Colours], light: &[[Vec4; ABREAST]], row: &mut Row| {
            tables.add(record, light, group, row);
        };
        let counting = (self.most, self.at);
        let (gathered, rows) =
            gather_by_order(plan, frame, maps, first_pass, counting, &mut self.records, add);
        let pixels = f64::from(self.width) * f64::from(self.height);
        let all = |point: usize, channel: usize| {
            let away = rows.iter().flat_map(|row| row.away[point][channel]);
            away.map(f64::from).sum::<f64>() / pixels
        };
        let away = std::array::from_fn(|point| {
            DVec3::from_array(std::array::from_fn(|channel| all(point, channel)))
        });
        self.colour.add(&away, group.before, group.passes);
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
        let pixels = self.width as usize * self.height as usize;
        let all = |plane: &Plane<'_>| {
            let mut values = vec![Vec3::ZERO; pixels];
            let mut line = vec![0.0; self.width as usize];
            for (y, values) in values.chunks_mut(line.len()).enumerate() {
                for axis in 0..3 {
                    (plane.line)(y, axis, &mut line);
                    values.iter_mut().zip(&line).for_each(|(value, x)| value[axis] = *x);
                }
            }
            values
        };
        let [light, errors] = self.written();
        let mut atlas = self.facts();
        atlas.planes =
            light.par_iter().map(|plane| if plane.is_dark() { Vec::new() } else { all(plane) }).collect();
        if let Some(found) = &mut atlas.errors {
            found.planes = errors.par_iter().map(all).collect();
        }
        atlas
    }

    /// The same as layers of a file; adds what makes a picture out of them to its header.
    pub fn layers(&self, header: &mut Header) -> Vec<WrittenLayer<'_>> {
        let facts = self.facts();
        facts.describe_in(header);
        let [light, errors] = self.written();
        facts.named(light.into_iter(), errors.into_iter())
    }

    /// An atlas whose planes are still missing.
    fn facts(&self) -> Atlas {
        let colour = (self.groups >= 2).then(|| self.colour.errors(self.passes, self.groups));
        Atlas {
            width: self.width,
            height: self.height,
            passes: self.passes,
            groups: self.groups,
            n: self.tables.n.clone(),
            m: self.tables.m.clone(),
            cut: self.most.cut,
            frontier: self.tables.frontier.clone(),
            planes: Vec::new(),
            errors: colour.map(|colour| AtlasErrors { planes: Vec::new(), colour }),
        }
    }

    /// The planes of the atlas and those of its errors, as numbers that are taken from the records when they are asked for.
    fn written(&self) -> [Vec<Plane<'_>>; 2] {
        let (bins, size) = (self.tables.bins(), self.tables.record());
        let (width, row) = (self.width as usize, (self.width as usize).div_ceil(ABREAST) * size);
        let passes = self.passes.max(1) as f32;
        let scale = 1.0 / (passes * (self.groups as f32 - 1.0));
        let value = move |place: usize, x: f32| if place < bins { x / passes } else { (scale * x).sqrt() };
        // Sums and maxima of magnitudes, of all pixels that have the same place among those that are added at once.
        let magnitudes = |records: &[Colours]| {
            let mut found = vec![<(Pixels, Pixels)>::default(); size];
            for record in records.chunks_exact(size) {
                for (place, ((sum, most), colours)) in found.iter_mut().zip(record).enumerate() {
                    for (i, x) in colours.iter().flat_map(|colour| colour.iter().enumerate()) {
                        let x = value(place, *x).abs();
                        sum[i] += x;
                        most[i] = most[i].max(x);
                    }
                }
            }
            found
        };
        let rows: Vec<_> = self.records.par_chunks(row).map(magnitudes).collect();
        let plane = |place: usize| {
            let sum: f64 = rows.iter().flat_map(|row| row[place].0).map(f64::from).sum();
            let most = rows.iter().flat_map(|row| row[place].1).fold(0.0, f32::max);
            let line = move |y: usize, axis: usize, line: &mut [f32]| {
                let records = self.records[y * row..][..row].chunks_exact(size);
                for (line, record) in line.chunks_mut(ABREAST).zip(records) {
                    line.iter_mut().zip(&record[place][axis]).for_each(|(to, x)| *to = value(place, *x));
                }
            };
            let mean = sum / (3.0 * width as f64 * f64::from(self.height));
            Plane { mean, most, line: Box::new(line) }
        };
        let errors = if self.groups >= 2 { bins..size } else { 0..0 };
        [(0..bins).map(plane).collect(), errors.map(plane).collect()]
    }
}

#[cfg(test)]
#[path = "sums_tests.rs"]
mod tests;
