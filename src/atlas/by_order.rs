//! The final gather of the atlas: what each pixel shows is kept apart by its powers of s and t.
//!
//! It runs over a scene at (s, t) = (1, 1), where every matrix that follows the scene's point has factor one, and counts
//! instead: the [walk](crate::gather) is that of any picture, its tally is [`ByOrder`]. A row reads only one half of light
//! (whatever would mix them is refused beforehand), so each contribution has one pair of orders (n, m), and its weight
//! anywhere else in the square is sⁿ tᵐ.

use super::places::{ABREAST, ByPlace, MostOrders, Packed, PackedPhoton, Places};
use super::tally::ByOrder;
use crate::gather::{Gathered, Maps, Pixel, TILE, TILE_WIDTH, Tier, Walk};
use crate::light::Power;
use crate::photon::{Orders, Photon};
use crate::plan::{Frame, Plan};
use crate::sampling::{Rng, Stream};
use glam::Vec4;
use rayon::prelude::*;

/// So many numbers by place stay near the processor that adds to them.
const NEAR: usize = 8192;

/// Gathers passes of `plan`, whose scene stands at (1, 1), one with each of `maps`. What [`ABREAST`] pixels of a row show in all
/// of them together is given to `add`: by n, then m, each up to `most`, ended where there is no more light, the fourth number of
/// each without meaning; with the pixels' own record, one of equal parts of `records` (row by row; the last of a row may have pixels
/// beyond its end, which are dark), and a total of its band of pixels. Returns each pass as it looks at the point `at`, and the totals,
/// topmost first.
pub fn gather_by_order<P: Power, R: Send, T: Default + Send>(
    plan: &Plan,
    frame: &Frame,
    mut maps: Vec<Maps<'_, P>>,
    first_pass: u32,
    (most, at): (MostOrders, (f32, f32)),
    records: &mut [R],
    add: impl Fn(&mut [R], &[[Vec4; ABREAST]], &mut T) + Sync,
) -> (Vec<Gathered<1>>, Vec<T>) {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let across = width.div_ceil(ABREAST);
    let block = records.len() / (across * height);
    let places = Places::new(most, at);
    let place = |orders| places.of(Orders::default(), orders);
    maps.iter_mut().for_each(|maps| maps.weigh(|orders| places.weight(place(orders))));
    let of_pass = |maps: &Maps<'_, P>| -> Vec<Packed> {
        maps.tiers().iter().map(|tier| packed_by(tier, place)).collect()
    };
    let packed: Vec<_> = maps.iter().map(of_pass).collect();
    let together = (NEAR / places.weights.len()).clamp(ABREAST, TILE_WIDTH) / ABREAST * ABREAST;
    let mut pictures = vec![vec![Pixel::<1>::EMPTY; width * height]; maps.len()];
    // Tiles, so that the photons that pixels share stay near.
    let mut bands: Vec<_> = pictures.iter_mut().map(|pixels| pixels.chunks_mut(width * TILE)).collect();
    let bands = records.chunks_mut(across * TILE * block).map(|records| {
        let bands = bands.iter_mut().map(|band| band.next().expect("as many as of records"));
        (records, bands.collect::<Vec<_>>())
    });
    let totals = bands
        .collect::<Vec<_>>()
        .into_par_iter()
        .enumerate()
        .map(|(band, (records, mut pixels))| {
            let kept = (0..together / ABREAST).map(|_| ByPlace::new(&places)).collect();
            let mut walk = Walk::new(plan, frame, ByOrder::new(plan, frame, &maps, &packed, &places, kept));
            let mut total = T::default();
            for left in (0..width).step_by(TILE_WIDTH) {
                for row in 0..records.len() / (across * block) {
                    let right = (left + TILE_WIDTH).min(width);
                    for left in (left..right).step_by(together) {
                        let right = (left + together).min(right);
                        for (i, pixels) in pixels.iter_mut().enumerate() {
                            walk.tally.pass = i;
                            for x in left..right {
                                let (y, pass) = (band * TILE + row, first_pass + i as u32);
                                let index = (y * width + x) as u64;
                                let rng = Rng::new(plan.settings.seed, Stream::Gather, pass, index);
                                walk.tally.column = x - left;
                                pixels[row * width + x] = walk.pixel([x, y], rng);
                            }
                        }
                        // What adding needs does not stay near while others are gathered, nor photons of one pass while those of
                        // another are: each is done for many pixels.
                        let records =
                            records[(row * across + left / ABREAST) * block..].chunks_exact_mut(block);
                        let used = (right - left).div_ceil(ABREAST);
                        for (record, kept) in records.zip(&mut walk.tally.kept[..used]) {
                            // What is left out has a place behind those of all orders.
                            kept.end(|light| {
                                add(record, &light[..light.len().min(places.orders.len())], &mut total);
                            });
                        }
                    }
                }
            }
            total
        })
        .collect();
    (pictures.into_iter().map(|pixels| Gathered { pixels }).collect(), totals)
}

/// The photons of a map as adding them up asks for them.
fn packed_by<P: Power>(tier: &Tier<P>, place: impl Fn(Orders) -> u16 + Sync) -> Packed {
    let photons = tier.map.photons();
    let each = |photon: &Photon<P>| PackedPhoton::new(photon.power.light().invisible, place(photon.orders));
    let ends = photons.par_iter().map(|photon| usize::from(place(photon.orders)) + 1);
    Packed { photons: photons.par_iter().map(each).collect(), end: ends.max().unwrap_or(0) }
}
