//! Connections that serve all diffuse terms of a place. Where matter fluoresces there are several, which differ in colours alone: one
//! point of a luminaire, and one look at what lies between, tell all of them what arrives.

use super::again::Sequence;
use super::direct::Open;
use super::walk::reflected;
use crate::connect::Connection;
use crate::light::{Light, Matrix};
use crate::optics::{Diffuse, Lobe};
use crate::plan::{Frame, Plan};
use crate::scene::SurfacePoint;
use glam::Vec3;
use std::num::NonZeroU32;

/// A place where several diffuse terms are read, one after another.
pub(super) struct Place {
    number: NonZeroU32,
    pixel: usize,
    triangle: u32,
    /// The point, and where it is seen from.
    seen: [Vec3; 2],
    /// The connections of all its terms.
    numbers: Sequence,
}

impl Place {
    /// True for what is seen there in the same way.
    fn is(&self, pixel: usize, point: &SurfacePoint, wo: Vec3) -> bool {
        (self.pixel, self.triangle, self.seen) == (pixel, point.triangle, [point.position, wo])
    }

    /// The number of the place of a term and the sequence of its connections. It becomes the `last` place; `numbers` is called where it
    /// is another one than that.
    pub fn of(
        last: &mut Option<Self>,
        (pixel, point, wo): (usize, &SurfacePoint, Vec3),
        numbers: impl FnOnce() -> Sequence,
    ) -> (NonZeroU32, Sequence) {
        if let Some(same) = last.as_ref().filter(|last| last.is(pixel, point, wo)) {
            return (same.number, same.numbers);
        }
        let number = last.as_ref().and_then(|last| last.number.checked_add(1)).unwrap_or(NonZeroU32::MIN);
        let (seen, numbers) = ([point.position, wo], numbers());
        *last = Some(Self { number, pixel, triangle: point.triangle, seen, numbers });
        (number, numbers)
    }
}

/// A connection, and what lies on it.
#[derive(Clone, Copy)]
pub(super) struct Arriving {
    pub connection: Connection,
    /// What light that travels it is multiplied by, and what is left of each colour.
    pub through: Matrix,
    pub left: Vec3,
}

/// What is known of the light that comes to the place asked for last.
#[derive(Default)]
pub(super) struct Shared {
    number: Option<NonZeroU32>,
    /// Of the luminaires that are all connected.
    every: Option<Vec<Arriving>>,
    /// Of those that are chosen from, by the number of the connection. None: it was not asked for. Of it None: nothing comes.
    one: Vec<Option<Option<Arriving>>>,
    /// Irradiance by closed forms.
    unhidden: Option<Light>,
}

impl Shared {
    /// What is known of a place.
    fn at(&mut self, place: NonZeroU32) -> &mut Self {
        if self.number != Some(place) {
            let mut one = std::mem::take(&mut self.one);
            one.clear();
            *self = Self { number: Some(place), one, ..Self::default() };
        }
        self
    }

    /// What comes by all connections to luminaires of which each has its own.
    pub fn every<const R: usize>(&mut self, plan: &Plan, open: &Open<R>, place: NonZeroU32) -> &[Arriving] {
        self.at(place).every.get_or_insert_with(|| {
            let mut all = Vec::new();
            plan.connections.to_all(&plan.scene, &open.point, |connection| {
                all.extend(arriving(plan, open, connection));
            });
            all
        })
    }

    /// What comes by connection `i`.
    pub fn one<const R: usize>(
        &mut self,
        (plan, frame): (&Plan, &Frame),
        open: &Open<R>,
        place: NonZeroU32,
        i: u32,
    ) -> Option<Arriving> {
        let known = &mut self.at(place).one;
        let index = i as usize;
        if known.len() <= index {
            known.resize(index + 1, None);
        }
        *known[index].get_or_insert_with(|| {
            let connection = plan.connections.to_one(
                &plan.scene,
                frame.sights.as_deref(),
                &open.point,
                open.numbers.point(i),
            );
            connection.and_then(|connection| arriving(plan, open, connection))
        })
    }

    /// Irradiance (W m⁻²) by closed forms; see [`Connections::unhidden`](crate::connect::Connections::unhidden).
    pub fn unhidden<const R: usize>(&mut self, plan: &Plan, open: &Open<R>, place: NonZeroU32) -> Light {
        let known = &mut self.at(place).unhidden;
        *known.get_or_insert_with(|| plan.connections.unhidden(&open.point, open.wo))
    }
}

/// None: a diffuse lobe does not show it, whatever its colour is.
fn arriving<const R: usize>(plan: &Plan, open: &Open<R>, connection: Connection) -> Option<Arriving> {
    let white = open.term.lobe.as_diffuse().map(|lobe| Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, ..*lobe }));
    let white = white.unwrap_or(open.term.lobe);
    if reflected(&white, &open.point, open.wo, &connection) == Vec3::ZERO {
        return None;
    }
    let (through, left) = plan.visibility_along(&connection.segment, open.absorption_towards(connection.wi));
    Some(Arriving { connection, through, left })
}
