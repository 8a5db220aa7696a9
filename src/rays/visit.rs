//! What each query does with the crossings that the traversal shows it.

use super::cover::Cover;
use super::walk::Visit;
use super::{BLOCKER, Hit, UNSEEN};
use crate::light::Matrix;
use std::ops::ControlFlow;

/// The order in which crossings are met. Of faces that coincide the front comes first: a sheet made of two opposite
/// faces shows each side its own.
pub(super) fn order(hit: &Hit) -> (f32, bool, u32) {
    (hit.t, hit.back, hit.triangle)
}

/// No triangle; orders behind all.
const NONE: u32 = u32::MAX;

/// Keeps the first crossing.
pub(super) struct Closest {
    best: Hit,
    limit: f32,
}

impl Closest {
    pub fn new(t_max: f32) -> Self {
        Self { best: Hit { t: t_max, triangle: NONE, u: 0.0, v: 0.0, back: true }, limit: t_max }
    }

    pub fn finish(self) -> Option<Hit> {
        (self.best.triangle != NONE).then_some(self.best)
    }
}

impl Visit for Closest {
    const ORDERED: bool = true;

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn hit(&mut self, hit: Hit, _class: u32) -> ControlFlow<()> {
        if order(&hit) < order(&self.best) {
            self.best = hit;
            self.limit = hit.t;
        }
        ControlFlow::Continue(())
    }
}

/// What the eye meets of what another visit would be shown.
pub(super) struct Seen<V>(pub V);

impl<V: Visit> Visit for Seen<V> {
    const ORDERED: bool = V::ORDERED;

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.0.limit()
    }

    #[inline(always)]
    fn hit(&mut self, hit: Hit, class: u32) -> ControlFlow<()> {
        if hit.back && class & UNSEEN != 0 { ControlFlow::Continue(()) } else { self.0.hit(hit, class) }
    }
}

/// The straight matrix of a class.
#[inline(always)]
fn matter(class: u32) -> u32 {
    class & !UNSEEN
}

/// What goes straight through where a triangle of this class is met.
#[inline(always)]
fn straight(hit: &Hit, class: u32, straight: &[Matrix], cover: Option<&Cover>) -> Matrix {
    let class = matter(class);
    let partial = cover.and_then(|cover| cover.straight(hit, class));
    partial.unwrap_or_else(|| straight[class as usize])
}

/// Keeps all crossings up to the first blocker.
pub(super) struct UpToBlocker<'a> {
    cover: Option<&'a Cover>,
    hits: &'a mut Vec<Hit>,
    /// Order of the first blocker so far; (`t_max`, true, [`NONE`]) where there is none.
    end: (f32, bool, u32),
}

impl Visit for UpToBlocker<'_> {
    const ORDERED: bool = true;

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.end.0
    }

    #[inline(always)]
    fn hit(&mut self, hit: Hit, class: u32) -> ControlFlow<()> {
        if order(&hit) <= self.end {
            self.hits.push(hit);
            let partial = self.cover.and_then(|cover| cover.straight(&hit, matter(class)));
            if partial.map_or(matter(class) == BLOCKER, Matrix::is_zero) {
                self.end = order(&hit);
            }
        }
        ControlFlow::Continue(())
    }
}

impl<'a> UpToBlocker<'a> {
    pub fn new(t_max: f32, cover: Option<&'a Cover>, hits: &'a mut Vec<Hit>) -> Self {
        Self { cover, hits, end: (t_max, true, NONE) }
    }

    /// Sorts, and cuts what lies behind the blocker.
    pub fn finish(self) {
        self.hits.sort_unstable_by(|a, b| {
            a.t.total_cmp(&b.t).then((a.back, a.triangle).cmp(&(b.back, b.triangle)))
        });
        let reached = self.hits.partition_point(|hit| order(hit) <= self.end);
        self.hits.truncate(reached);
    }
}

/// Stops at any crossing.
pub(super) struct Any {
    pub t_max: f32,
    pub found: bool,
}

impl Visit for Any {
    const ORDERED: bool = false;

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn hit(&mut self, _hit: Hit, _class: u32) -> ControlFlow<()> {
        self.found = true;
        ControlFlow::Break(())
    }
}

/// The product of matrices that commute, in the order of the tree (which does not depend on the ray's direction).
pub(super) struct Product<'a> {
    pub t_max: f32,
    pub straight: &'a [Matrix],
    pub cover: Option<&'a Cover>,
    pub product: Matrix,
}

impl Visit for Product<'_> {
    const ORDERED: bool = false;

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn hit(&mut self, hit: Hit, class: u32) -> ControlFlow<()> {
        self.product = self.product * straight(&hit, class, self.straight, self.cover);
        if self.product.is_zero() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// All crossings with their classes, for a product that must be taken in order.
pub(super) struct Passed<'a> {
    pub t_max: f32,
    pub straight: &'a [Matrix],
    pub cover: Option<&'a Cover>,
    /// Order, what goes through.
    pub passed: &'a mut Vec<((f32, bool, u32), Matrix)>,
    pub blocked: bool,
}

impl Visit for Passed<'_> {
    const ORDERED: bool = false;

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn hit(&mut self, hit: Hit, class: u32) -> ControlFlow<()> {
        let through = straight(&hit, class, self.straight, self.cover);
        if through.is_zero() {
            self.blocked = true;
            return ControlFlow::Break(());
        }
        self.passed.push((order(&hit), through));
        ControlFlow::Continue(())
    }
}

impl Passed<'_> {
    /// h1, h2, … are met in this order from the ray's origin, so light from its far end meets h1 last.
    pub fn product(self) -> Matrix {
        if self.blocked {
            return Matrix::ZERO;
        }
        self.passed.sort_unstable_by(|(a, _), (b, _)| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        self.passed.iter().fold(Matrix::IDENTITY, |product, hit| product * hit.1)
    }
}
