//! The tally of the atlas: it puts each contribution in its place among the powers of s and t.

use super::places::{ABREAST, ByPlace, Packed, Places};
use crate::clearance::Reach;
use crate::connect::Connection;
use crate::gather::{Here, Maps, Nearby, Parts, Pixel, Tally, is_read, reflected};
use crate::light::{Light, Matrix, Power, Row};
use crate::optics::{Diffuse, Term};
use crate::photon::{Orders, PathClass};
use crate::photon_map::Found;
use crate::plan::{Frame, Plan};
use crate::rays::{Hit, Segment};
use crate::sampling::Rng;
use crate::scene::Material;
use glam::Vec3;

/// Adds up what a row of pixels shows, by place.
pub(super) struct ByOrder<'a, P> {
    plan: &'a Plan,
    frame: &'a Frame,
    /// By pass, and so the next two.
    maps: &'a [Maps<'a, P>],
    /// Of each map.
    packed: &'a [Vec<Packed>],
    nearby: Vec<Nearby>,
    found: Found,
    /// Which of the passes it is, from the first.
    pub pass: usize,
    places: &'a Places,
    /// Of a row of pixels.
    pub kept: Vec<ByPlace>,
    /// Which of them it is.
    pub column: usize,
    between: Vec<Hit>,
}

impl<'a, P: Power> ByOrder<'a, P> {
    pub fn new(
        plan: &'a Plan,
        frame: &'a Frame,
        maps: &'a [Maps<'a, P>],
        packed: &'a [Vec<Packed>],
        places: &'a Places,
        kept: Vec<ByPlace>,
    ) -> Self {
        let nearby = maps.iter().map(|_| Nearby::default()).collect();
        let (found, between) = (Found::default(), Vec::new());
        Self { plan, frame, maps, packed, nearby, found, pass: 0, places, kept, column: 0, between }
    }

    fn connect(
        &mut self,
        here: &Here<'_, 1>,
        term: &Term,
        (row, orders): (Row, Orders),
        parts: &mut Parts,
        rng: &mut Rng,
    ) {
        let Here { point, wo, .. } = *here;
        let Self { plan, places, between, .. } = self;
        let (kept, column) = (&mut self.kept[self.column / ABREAST], self.column % ABREAST);
        let mut visit = |connection: Connection| {
            let f = reflected(&term.lobe, point, wo, &connection);
            if f == Vec3::ZERO || row * connection.light == Vec3::ZERO {
                return;
            }
            let absorption = here.absorption(plan, connection.wi);
            let (through, left, crossed) = straight_along(plan, &connection.segment, absorption, between);
            let light: Light = (f * left) * (through * connection.light);
            let place = places.of(orders, crossed);
            let seen = row * light;
            kept.add(column, place, seen);
            let part = places.weight(place) * seen;
            parts.add(here.class(PathClass::Direct), part, row.turn.is_reradiated());
        };
        let connections = &plan.connections;
        connections.to_all(&plan.scene, point, &mut visit);
        connections.to_one(&plan.scene, None, point, rng.f32x3()).into_iter().for_each(visit);
    }

    /// What photons bring.
    fn read_maps(
        &mut self,
        here: &Here<'_, 1>,
        diffuse: &Diffuse,
        (row, orders): (Row, Orders),
        pixel: &mut Pixel<1>,
    ) {
        let Here { point, wo, .. } = *here;
        let (maps, packed, places) = (&self.maps[self.pass], &self.packed[self.pass], self.places);
        if maps.tiers().is_empty() {
            return;
        }
        let (footprint, normal, most) = (here.footprint, here.normal(), here.most_counted());
        let factor = diffuse.towards(&point.normals, wo) * row.invisible;
        let (kept, found) = (&mut self.kept[self.column / ABREAST], &mut self.found);
        let column = self.column % ABREAST;
        let around = maps.around(&mut self.nearby[self.pass], point, normal, footprint);
        let disks = maps.disks(around, point, normal, (footprint, here.reach));
        for ((tier, photons), near) in maps.tiers().iter().zip(packed).zip(&around.photons) {
            if near.is_empty() || !is_read(tier.class, here.reach) {
                continue;
            }
            let disk = tier.disk(&disks);
            let flux = tier.find(near, [point.position, normal], disk, most, found);
            let over_whole = disk.over_whole * factor;
            let (value, inner) = if orders == Orders::default() && row.turn.colours() == 0 {
                // Most rows; light keeps its place.
                kept.add_photons(column, photons, found, over_whole);
                (over_whole * flux.whole.light().invisible, flux.inner.light().invisible)
            } else {
                let mut value = Vec3::ZERO;
                for i in found.places() {
                    let photon = &photons.photons[*i as usize];
                    let place = places.behind(orders, photon.place());
                    let seen = row.turn.outgoing(over_whole * photon.0.truncate());
                    kept.add(column, place, seen);
                    value += places.weight(place) * seen;
                }
                // Row and photons are weighed apart, which forgets that orders beyond the last stored count as the last:
                // it serves the bias alone.
                let weight = places.weight(places.of(orders, Orders::default()));
                (value, weight * flux.inner.light().invisible)
            };
            let reradiated = row.turn.is_reradiated() || tier.reradiated;
            pixel.parts[0].add(here.class(tier.class), value, reradiated);
            pixel.bias += 2.0 * (value - row.turn.outgoing(disk.over_half * factor * inner));
        }
    }
}

impl<P: Power> Tally<1> for ByOrder<'_, P> {
    /// The powers of s and t that a row has.
    type Mark = Orders;

    fn crossed(orders: Orders, material: &Material) -> Orders {
        orders.crossed(material)
    }

    /// The first reflection into the visible half has no s: F(s, t)'s second row is [f_opaque 0].
    fn reflected(orders: Orders, [row]: &[Row; 1], material: &Material) -> Orders {
        if row.invisible == Vec3::ZERO { orders } else { orders.reflected(material) }
    }

    fn wants(&self, orders: Orders) -> bool {
        !self.places.leaves_out(orders)
    }

    fn emitted(
        &mut self,
        [row]: &[Row; 1],
        orders: Orders,
        radiance: Light,
        scattered: bool,
        pixel: &mut Pixel<1>,
    ) {
        let place = self.places.of(orders, Orders::default());
        let seen = *row * radiance;
        self.kept[self.column / ABREAST].add(self.column % ABREAST, place, seen);
        let part = self.places.weight(place) * seen;
        pixel.parts[0].add_emitted(part, scattered, row.turn.is_reradiated());
    }

    /// In a crowd the smallest disk is read: in matter of all powers of s and t at once paths that go on would multiply.
    fn reach(&mut self, here: &Here<'_, 1>) -> Reach {
        let (maps, nearby) = (&self.maps[self.pass], &mut self.nearby[self.pass]);
        match maps.reach(nearby, here.point, here.normal(), here.footprint, here.is_scattered()) {
            Reach::Crowded => Reach::LEAST,
            simple => simple,
        }
    }

    fn read(
        &mut self,
        here: &Here<'_, 1>,
        term: &Term,
        ([row], orders): ([Row; 1], Orders),
        pixel: &mut Pixel<1>,
        rng: &mut Rng,
    ) {
        if here.connects(term, self.frame.direct) {
            self.connect(here, term, (row, orders), &mut pixel.parts[0], rng);
        }
        if let Some(diffuse) = term.lobe.as_diffuse() {
            self.read_maps(here, diffuse, (row, orders), pixel);
        }
    }
}

/// What light that travels a connection is multiplied by, what is left of each colour on the way, and the crossings that it counts.
fn straight_along(
    plan: &Plan,
    segment: &Segment,
    absorption: Vec3,
    hits: &mut Vec<Hit>,
) -> (Matrix, Vec3, Orders) {
    let mut orders = Orders::default();
    let (through, left) = plan
        .rays
        .passed_by(&plan.scene, segment, absorption, hits, |material| orders = orders.crossed(material));
    (through, left, orders)
}
