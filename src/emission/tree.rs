//! Which starts of paths are of use, where few are: a density over all five numbers that start one.
//!
//! Of the light of the sun that falls on a wide plain what is seen gets one part in millions, of that of a sky what comes in
//! by a window. The five numbers fill a unit cube, which is divided where the density changes most, and again, until parts are
//! even or too little is known of them (hierarchical warping: P. Clarberg et al. 2005, *Wavelet importance sampling*, §4.2). A
//! share of all paths starts as it would without, wherever that is, so that a wrong density costs noise, not bias.

use super::{EMISSION_DIMENSIONS, Emitted, Emitters};
use crate::light::Power;

/// The share of paths that is not guided.
const EVEN: f64 = 0.2;
/// Samples below which a part is not divided.
const FEW: usize = 48;
/// Places at which a side may be divided: all multiples of one over this.
const BINS: usize = 8;
/// Nats by which a division must tell more, per sample; what chance tells is about one over twice the number of samples.
const WORTH: f64 = 0.01;
/// Parts at the most.
const PARTS: usize = 1 << 14;
/// A sample counts for at most so many times the mean: that of rare paths says little.
const HEAVY: f64 = 64.0;

/// A start that was of use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Useful {
    /// The numbers of the start.
    pub start: [f32; EMISSION_DIMENSIONS],
    /// What it contributed to the picture, in any unit.
    pub weight: f32,
}

/// A density of starts over the unit cube, constant in each part, with mean one.
#[derive(Clone, Debug)]
pub struct StartTree {
    nodes: Vec<Node>,
    /// By how much denser than without it starts are where they are of use, in the mean.
    gain: f64,
}

#[derive(Clone, Copy, Debug)]
enum Node {
    /// Below `at` of its own side `axis` (0 to 1) goes this share of the node's probability, to the next node; the rest to `above`.
    Divided { axis: u8, at: f32, below: f32, above: u32 },
    /// With its share of the cube, and of what was of use.
    Part { volume: f64, mass: f64 },
}

/// A box that is being divided.
struct Part {
    low: [f32; EMISSION_DIMENSIONS],
    high: [f32; EMISSION_DIMENSIONS],
    /// Its share of the cube, and of what was of use.
    volume: f64,
    mass: f64,
}

impl Part {
    /// Below and above `at` (0 to 1) of a side, below with the share `mass` of its mass.
    fn divided(&self, axis: usize, at: f32, mass: f64) -> [Self; 2] {
        let middle = self.low[axis] + at * (self.high[axis] - self.low[axis]);
        let (mut below, mut above) = (self.high, self.low);
        (below[axis], above[axis]) = (middle, middle);
        let share = f64::from(at);
        [
            Self { low: self.low, high: below, volume: share * self.volume, mass: mass * self.mass },
            Self {
                low: above,
                high: self.high,
                volume: (1.0 - share) * self.volume,
                mass: (1.0 - mass) * self.mass,
            },
        ]
    }
}

/// Where a part is best divided.
#[derive(Clone, Copy)]
struct Cut {
    axis: usize,
    at: f32,
    /// Share of the mass below.
    mass: f64,
    /// Nats per unit of the part's mass.
    gain: f64,
}

impl StartTree {
    /// From starts that were of use. None where they tell nothing.
    pub fn new(mut useful: Vec<Useful>) -> Option<Self> {
        useful.retain(|one| one.weight > 0.0 && one.weight.is_finite());
        let mean = useful.iter().map(|one| f64::from(one.weight)).sum::<f64>() / useful.len() as f64;
        if useful.len() < FEW {
            return None;
        }
        let most = (HEAVY * mean) as f32;
        useful.iter_mut().for_each(|one| one.weight = one.weight.min(most));
        let mut tree = Self { nodes: Vec::new(), gain: 1.0 };
        let whole = Part {
            low: [0.0; EMISSION_DIMENSIONS],
            high: [1.0; EMISSION_DIMENSIONS],
            volume: 1.0,
            mass: 1.0,
        };
        tree.grow(&whole, &mut useful);
        tree.share_out(0, 1.0 / tree.wishes());
        tree.gain = tree.gain_for(&useful);
        (tree.nodes.len() > 1).then_some(tree)
    }

    /// Adds a node for `part`, which holds `useful`, and those below it.
    fn grow(&mut self, part: &Part, useful: &mut [Useful]) {
        let cut =
            if useful.len() < FEW || self.nodes.len() > 2 * PARTS { None } else { best_cut(part, useful) };
        let Some(Cut { axis, at, mass, .. }) = cut else {
            self.nodes.push(Node::Part { volume: part.volume, mass: part.mass });
            return;
        };
        let [below, above] = part.divided(axis, at, mass);
        let node = self.nodes.len();
        self.nodes.push(Node::Divided { axis: axis as u8, at, below: 0.0, above: 0 });
        useful.sort_unstable_by(|a, b| a.start[axis].total_cmp(&b.start[axis]));
        let middle = useful.partition_point(|one| one.start[axis] < above.low[axis]);
        let (first, second) = useful.split_at_mut(middle);
        self.grow(&below, first);
        let next = self.nodes.len() as u32;
        if let Node::Divided { above, .. } = &mut self.nodes[node] {
            *above = next;
        }
        self.grow(&above, second);
    }

    /// The sum of what parts wish for: see [`wish`].
    fn wishes(&self) -> f64 {
        let each = self.nodes.iter().map(|node| match *node {
            Node::Part { volume, mass } => wish(volume, mass),
            Node::Divided { .. } => 0.0,
        });
        each.sum()
    }

    /// Sets by which share paths go below in a node and all nodes under it; returns its probability. `scale` makes all wishes one.
    fn share_out(&mut self, node: usize, scale: f64) -> f64 {
        match self.nodes[node] {
            Node::Part { volume, mass } => EVEN * volume + (1.0 - EVEN) * scale * wish(volume, mass),
            Node::Divided { above: next, .. } => {
                let (first, second) = (self.share_out(node + 1, scale), self.share_out(next as usize, scale));
                if let Node::Divided { below, .. } = &mut self.nodes[node] {
                    // Numbers of 24 bits must find both sides, however little is on one of them.
                    *below = ((first / (first + second)) as f32).clamp(f32::EPSILON, 1.0 - f32::EPSILON);
                }
                first + second
            }
        }
    }

    /// The start that even numbers become, and its density.
    pub fn warp(&self, even: [f32; EMISSION_DIMENSIONS]) -> ([f32; EMISSION_DIMENSIONS], f32) {
        let mut u = even;
        let (mut low, mut side) = ([0.0_f32; EMISSION_DIMENSIONS], [1.0_f32; EMISSION_DIMENSIONS]);
        let (mut node, mut density) = (0, 1.0_f64);
        while let Node::Divided { axis, at, below, above } = self.nodes[node] {
            let axis = usize::from(axis);
            if u[axis] < below {
                u[axis] /= below;
                side[axis] *= at;
                density *= f64::from(below / at);
                node += 1;
            } else {
                u[axis] = (u[axis] - below) / (1.0 - below);
                low[axis] += at * side[axis];
                side[axis] *= 1.0 - at;
                density *= f64::from((1.0 - below) / (1.0 - at));
                node = above as usize;
            }
        }
        let within = |i: usize| (low[i] + u[i].min(1.0) * side[i]).min(1.0 - f32::EPSILON);
        (std::array::from_fn(within), density as f32)
    }

    /// Density at a start.
    pub fn density(&self, start: [f32; EMISSION_DIMENSIONS]) -> f32 {
        let mut u = start;
        let (mut node, mut density) = (0, 1.0_f64);
        while let Node::Divided { axis, at, below, above } = self.nodes[node] {
            let axis = usize::from(axis);
            if u[axis] < at {
                u[axis] /= at;
                density *= f64::from(below / at);
                node += 1;
            } else {
                u[axis] = (u[axis] - at) / (1.0 - at);
                density *= f64::from((1.0 - below) / (1.0 - at));
                node = above as usize;
            }
        }
        density as f32
    }

    /// By how much denser than without it starts are where they are of use: the harmonic mean over `useful`.
    pub fn gain_for(&self, useful: &[Useful]) -> f64 {
        let (sum, weights) = useful.iter().fold((0.0, 0.0), |(sum, weights), one| {
            let weight = f64::from(one.weight);
            (sum + weight / f64::from(self.density(one.start)), weights + weight)
        });
        if sum == 0.0 { 1.0 } else { weights / sum }
    }

    /// The same for the starts that it was learned from.
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
    }
}

/// How many paths a part should get. Noise falls fastest if starts are as dense as what they bring in the mean, where each brings
/// as much, and as the root of that, where each brings all or nothing: far from what is seen many start in vain. Nobody knows
/// which it is; this lies between.
fn wish(volume: f64, mass: f64) -> f64 {
    volume * (mass / volume).powf(0.75)
}

/// The division that tells most, where one tells enough.
fn best_cut(part: &Part, useful: &[Useful]) -> Option<Cut> {
    let mut best: Option<Cut> = None;
    for axis in 0..EMISSION_DIMENSIONS {
        let (low, side) = (part.low[axis], part.high[axis] - part.low[axis]);
        // Below this f32 has no numbers left to choose from.
        if side < 256.0 * f32::EPSILON {
            continue;
        }
        let mut bins = [0.0_f64; BINS];
        for one in useful {
            let bin = ((one.start[axis] - low) / side * BINS as f32) as usize;
            bins[bin.min(BINS - 1)] += f64::from(one.weight);
        }
        let sum: f64 = bins.iter().sum();
        let mut below = 0.0;
        for (bin, weight) in bins[..BINS - 1].iter().enumerate() {
            below += weight;
            let (at, mass) = ((bin + 1) as f64 / BINS as f64, below / sum);
            let gain = relative_entropy(mass, at);
            if best.is_none_or(|best| gain > best.gain) {
                best = Some(Cut { axis, at: at as f32, mass, gain });
            }
        }
    }
    best.filter(|cut| cut.gain > WORTH + 2.0 / useful.len() as f64)
}

/// Of the shares (`mass`, 1 − `mass`) to those of the volume, nats.
fn relative_entropy(mass: f64, volume: f64) -> f64 {
    let term = |p: f64, q: f64| if p > 0.0 { p * (p / q).ln() } else { 0.0 };
    term(mass, volume) + term(1.0 - mass, 1.0 - volume)
}

impl<P: Power> Emitters<'_, P> {
    /// The start of one of `paths` paths, as [`emit`](Self::emit), denser and fainter where it is of more use.
    pub fn emit_by_use(&self, paths: u32, u: [f32; EMISSION_DIMENSIONS], tree: &StartTree) -> Emitted<P> {
        let (start, density) = tree.warp(u);
        let emitted = self.emit(paths, start);
        let beam = emitted.beam.thinned(density);
        Emitted { power: emitted.power.scaled(1.0 / density), beam, ..emitted }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sobol;

    /// Starts in a box that holds one part in 10⁵ of the cube, and some all over.
    fn useful(n: u32) -> Vec<Useful> {
        let sobol = Sobol::new(3);
        let within = |x: f32, side: f32| 0.3 + side * x;
        let start = |i: u32| {
            let u: [f32; 5] = sobol.point(i, 0);
            match i % 10 {
                0 => u,
                _ => [within(u[0], 0.1), within(u[1], 0.01), within(u[2], 0.01), u[3], u[4]],
            }
        };
        (0..n).map(|i| Useful { start: start(i), weight: 1.0 + (i % 7) as f32 }).collect()
    }

    #[test]
    fn densities_have_mean_one_are_what_they_are_said_to_be_and_bounded_from_below() {
        let tree = StartTree::new(useful(20_000)).expect("something to tell");
        let (sobol, n) = (Sobol::new(1), 1 << 16);
        let (mut inverse, mut least, mut square) = (0.0, f32::INFINITY, 0.0);
        for i in 0..n {
            let (start, density) = tree.warp(sobol.point(i, 0));
            assert!(start.iter().all(|x| (0.0..1.0).contains(x)));
            assert!((tree.density(start) / density - 1.0).abs() < 1e-4);
            inverse += f64::from(1.0 / density);
            square += f64::from(start[1].powi(2) / density);
            least = least.min(density);
        }
        // E[1 / density] is the volume of the cube, E[u² / density] the integral of u².
        for (found, expected) in [(inverse, 1.0), (square, 1.0 / 3.0)] {
            let off = found / f64::from(n) / expected - 1.0;
            assert!(off.abs() < 0.01, "{off}");
        }
        assert!(f64::from(least) > 0.99 * EVEN, "{least}");
    }

    #[test]
    fn what_is_of_use_becomes_dense() {
        let tree = StartTree::new(useful(20_000)).expect("something to tell");
        let starts: Vec<_> = (0..4096).map(|i| tree.warp(Sobol::new(2).point(i, 0)).0).collect();
        let inside =
            starts.iter().filter(|u| (0.3..0.4).contains(&u[0]) && (0.3..0.31).contains(&u[1])).count();
        // A tenth of all is of use elsewhere, if seldom.
        assert!(inside > 600, "{inside} of 4096, of which all but for that were one in 1000 without");
        assert!(tree.gain() > 3.0, "{}", tree.gain());
    }

    #[test]
    fn even_starts_tell_nothing() {
        let sobol = Sobol::new(9);
        let even = |i| Useful { start: sobol.point(i, 0), weight: 1.0 };
        assert!(StartTree::new((0..5000).map(even).collect()).is_none());
        assert!(StartTree::new(Vec::new()).is_none());
    }
}
