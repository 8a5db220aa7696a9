//! What pixels show, kept apart by the powers of s and t of the light.

use crate::photon::Orders;
use crate::photon_map::Found;
use glam::{DVec4, Vec3, Vec4};

/// Where counting ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MostOrders {
    /// The largest n that is kept apart.
    pub n: u8,
    /// The largest m; more crossings count as so many.
    pub m: u8,
    /// True: light of more reflections is left out. False: it counts as if it had `n`.
    pub cut: bool,
}

/// Pixels of a row that are added to their records at once.
pub const ABREAST: usize = 8;

/// Where light of each pair of orders is kept.
pub(super) struct Places {
    /// Where n stands among the places, for n up to twice 255; light that is left out has a place behind all others.
    row: [u16; 512],
    /// The same for m; the two add up.
    column: [u16; 512],
    /// (n, m) of each place, and what the film's point of the square makes of it.
    pub orders: Vec<(u8, u8)>,
    pub weights: Vec<f32>,
}

/// What [`ABREAST`] pixels show, by place; linear RGB radiance.
pub(super) struct ByPlace {
    /// The fourth number means nothing.
    sums: Vec<[Vec4; ABREAST]>,
    /// No light has come to places from here on.
    end: usize,
    /// How many numbers have been added to each pixel.
    added: [usize; ABREAST],
    /// Sums of many numbers are kept here, in f64; empty where they are few.
    carried: Vec<[DVec4; ABREAST]>,
}

/// Photons of a map, in its order, as adding them up asks for them.
pub(super) struct Packed {
    pub photons: Vec<PackedPhoton>,
    /// They have no place from here on.
    pub end: usize,
}

/// Power (W), and the place in the bits of the fourth number.
pub(super) struct PackedPhoton(pub Vec4);

impl PackedPhoton {
    pub fn new(power: Vec3, place: u16) -> Self {
        Self(power.extend(f32::from_bits(ONE | u32::from(place))))
    }

    pub fn place(&self) -> u16 {
        self.0.w.to_bits() as u16
    }
}

/// The bits of 1.
const ONE: u32 = 1.0_f32.to_bits();

/// So many numbers, and as many again, are summed in f32 before the sum is added to others in f64.
const RUN: usize = 1024;

/// Places of all orders that are ever kept apart.
const MOST_PLACES: usize = 1 << 14;

impl Places {
    /// For pixels that are also read at the point (s, t).
    pub fn new(most: MostOrders, (s, t): (f32, f32)) -> Self {
        let across = u16::from(most.m) + 1;
        let orders: Vec<_> = (0..=most.n).flat_map(|n| (0..=most.m).map(move |m| (n, m))).collect();
        let mut weights: Vec<f32> =
            orders.iter().map(|&(n, m)| s.powi(n.into()) * t.powi(m.into())).collect();
        let places = orders.len();
        assert!(places + usize::from(across) <= MOST_PLACES, "{most:?}: more pictures than an atlas holds");
        let row = |n: u16| {
            if most.cut && n > most.n.into() { places as u16 } else { n.min(most.n.into()) * across }
        };
        // Places of light that is left out, one for each m.
        weights.resize(places + usize::from(across), 0.0);
        Self {
            row: std::array::from_fn(|n| row(n as u16)),
            column: std::array::from_fn(|m| (m as u16).min(most.m.into())),
            orders,
            weights,
        }
    }

    /// The place of light of orders `light`, read by a row that already has `row`.
    #[inline]
    pub fn of(&self, row: Orders, light: Orders) -> u16 {
        self.row[usize::from(row.n) + usize::from(light.n)]
            + self.column[usize::from(row.m) + usize::from(light.m)]
    }

    /// The place of light that has the given one, read by a row that already has `row`.
    pub fn behind(&self, row: Orders, place: u16) -> u16 {
        self.orders.get(usize::from(place)).map_or(place, |&(n, m)| self.of(row, Orders { n, m }))
    }

    /// What light at this place counts at the film's point.
    pub fn weight(&self, place: u16) -> f32 {
        self.weights[usize::from(place)]
    }

    /// True where all light that a row of these orders reads is left out.
    pub fn leaves_out(&self, row: Orders) -> bool {
        usize::from(self.row[usize::from(row.n)]) >= self.orders.len()
    }
}

impl ByPlace {
    pub fn new(places: &Places) -> Self {
        let sums = vec![[Vec4::ZERO; ABREAST]; places.weights.len()];
        Self { sums, end: 0, added: [0; ABREAST], carried: Vec::new() }
    }

    /// Adds radiance to a pixel.
    pub fn add(&mut self, pixel: usize, place: u16, value: Vec3) {
        self.sums[usize::from(place)][pixel] += value.extend(0.0);
        self.end = self.end.max(usize::from(place) + 1);
        self.count(pixel, 1);
    }

    /// Adds the radiance of photons that bring `factor` (m⁻² sr⁻¹) times their power.
    #[inline(never)] // the loop needs all registers
    pub fn add_photons(
        &mut self,
        pixel: usize,
        Packed { photons, end }: &Packed,
        found: &Found,
        factor: Vec3,
    ) {
        let (pixel, factor) = (pixel % ABREAST, factor.extend(0.0));
        for found in found.places().chunks(RUN) {
            let sums = &mut self.sums[..];
            for i in found {
                let photon = &photons[*i as usize];
                sums[usize::from(photon.place())][pixel] += factor * photon.0;
            }
            self.count(pixel, found.len());
        }
        self.end = self.end.max(*end);
    }

    fn count(&mut self, pixel: usize, more: usize) {
        self.added[pixel] += more;
        if self.added[pixel] > RUN {
            self.carry();
        }
    }

    #[cold]
    fn carry(&mut self) {
        self.carried.resize(self.sums.len(), [DVec4::ZERO; ABREAST]);
        for (carried, sum) in self.carried.as_flattened_mut().iter_mut().zip(self.sums.as_flattened_mut()) {
            *carried += std::mem::take(sum).as_dvec4();
        }
        self.added = [0; ABREAST];
    }

    /// Ends the pixels: gives what they show to `take`, by place, as far as there is light, and begins anew.
    pub fn end(&mut self, take: impl FnOnce(&[[Vec4; ABREAST]])) {
        if !self.carried.is_empty() {
            self.carry();
            for (sum, carried) in self.sums.iter_mut().zip(self.carried.drain(..)) {
                *sum = carried.map(DVec4::as_vec4);
            }
        }
        take(&self.sums[..self.end]);
        self.sums[..self.end].fill([Vec4::ZERO; ABREAST]);
        (self.end, self.added) = (0, [0; ABREAST]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Invisible;
    use crate::photon::Photon;
    use crate::photon_map::{Neighbourhood, PhotonMap};

    fn places() -> Places {
        Places::new(MostOrders { n: 2, m: 1, cut: true }, (0.5, 0.25))
    }

    #[test]
    fn places_are_those_of_orders() {
        let places = places();
        let place = |n, m| places.of(Orders::default(), Orders { n, m });
        assert_eq!([place(0, 0), place(0, 1), place(0, 9), place(2, 0), place(2, 1)], [0, 1, 1, 4, 5]);
        assert_eq!([place(3, 0), place(255, 1)], [6, 7], "left out");
        assert_eq!(places.weight(place(2, 1)), 0.25 * 0.25);
        assert_eq!(places.weight(place(3, 0)), 0.0);
        let row = Orders { n: 1, m: 1 };
        assert_eq!(places.behind(row, place(1, 0)), place(2, 1));
        assert_eq!(places.behind(row, place(2, 0)), place(3, 1));
        assert!(!places.leaves_out(row) && places.leaves_out(Orders { n: 3, m: 0 }));
    }

    #[test]
    fn many_numbers_are_summed_without_loss() {
        let mut kept = ByPlace::new(&places());
        let numbers = 3_000_000;
        // Twice: what was there is gone.
        for _ in 0..2 {
            kept.add(2, 1, Vec3::splat(7.0));
            for _ in 0..numbers {
                kept.add(5, 3, Vec3::new(0.1, 1.0, 3e-9));
            }
            kept.end(|light| {
                assert_eq!(light.len(), 4);
                let sum = light[3][5].truncate() / numbers as f32;
                let off = (sum / Vec3::new(0.1, 1.0, 3e-9) - 1.0).abs().max_element();
                let naive = (0..numbers).fold(0.0_f32, |sum, _| sum + 0.1) / (0.1 * numbers as f32);
                assert!(off < 1e-5 && (naive - 1.0).abs() > 1e-3, "{off}, and {naive} where f32 alone adds");
                assert_eq!(light[1][2].truncate(), Vec3::splat(7.0));
                let lit = light.iter().flatten().filter(|light| light.truncate() != Vec3::ZERO);
                assert_eq!(lit.count(), 2);
            });
        }
    }

    #[test]
    fn photons_are_added_where_they_belong() {
        let powers: Vec<Vec3> = (0..5000).map(|i| Vec3::new(1.0, (i % 7) as f32, (i % 3) as f32)).collect();
        let photons = powers.iter().enumerate().map(|(i, power)| PackedPhoton::new(*power, i as u16 % 6));
        let packed = Packed { photons: photons.collect(), end: 6 };
        let map = PhotonMap::build(
            powers.iter().map(|power| Photon::new(Vec3::ZERO, Vec3::Y, Invisible(*power), 1)).collect(),
        );
        let (mut near, mut found) = (Neighbourhood::default(), Found::default());
        map.neighbourhood(Vec3::ZERO, 1.0, &mut near);
        map.find(&near, [Vec3::ZERO, Vec3::Y], 0.5, u16::MAX, &mut found);
        let (mut together, mut one_by_one) = (ByPlace::new(&places()), ByPlace::new(&places()));
        let factor = Vec3::new(0.5, 2.0, 1.0);
        together.add_photons(3, &packed, &found, factor);
        for (i, power) in powers.iter().enumerate() {
            one_by_one.add(3, i as u16 % 6, factor * *power);
        }
        together.end(|a| {
            one_by_one.end(|b| {
                assert!(a.len() == 6 && b.len() == 6);
                for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                    assert!((*a - *b).truncate().abs().max_element() < 1e-3, "{a} {b}");
                }
                assert!(b[5][3].truncate().min_element() > 400.0);
            });
        });
    }
}
