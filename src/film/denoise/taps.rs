//! Which neighbours a pixel is compared with.

/// A neighbour: where it is from the pixel, and what it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tap {
    pub dx: isize,
    pub dy: isize,
    pub weight: f32,
}

/// Along a spiral, by the golden angle: as many within any radius as its power of 1/[`CROWDING`].
const TURNS: u32 = 90;
/// Above ½ the near ones are closer together than those far away, which share their photons anyway.
const CROWDING: f32 = 0.75;
/// Of the weights, which are those of a bell: its width by the radius.
const WIDTH: f32 = 0.5;

/// The neighbours within a radius in pixels, in pairs that face each other so that no side counts for more, and the pixel itself.
pub(super) fn taps(radius: f32) -> Vec<Tap> {
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let place = |k: u32| {
        let (r, angle) = (radius * (k as f32 / TURNS as f32).powf(CROWDING), k as f32 * golden);
        ((r * angle.cos()).round() as isize, (r * angle.sin()).round() as isize)
    };
    let places = (1..TURNS).map(place).flat_map(|(x, y)| [(x, y), (-x, -y)]);
    let places: std::collections::BTreeSet<_> = places.chain([(0, 0)]).collect();
    let tap = |(dx, dy): (isize, isize)| {
        let r = (dx as f32).hypot(dy as f32) / radius;
        // A tap stands for the pixels around it, of which there are the more the fewer taps are there.
        let area = r.max(1.0 / radius).powf(2.0 - 1.0 / CROWDING);
        Tap { dx, dy, weight: area * (-0.5 * (r / WIDTH).powi(2)).exp() }
    };
    places.into_iter().map(tap).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_neighbour_has_one_that_faces_it_and_the_pixel_itself_is_there_once() {
        for radius in [4.0, 13.0, 54.0] {
            let taps = taps(radius);
            let facing = |tap: &Tap| Tap { dx: -tap.dx, dy: -tap.dy, ..*tap };
            assert!(taps.iter().all(|tap| taps.contains(&facing(tap))));
            assert_eq!(taps.iter().filter(|tap| (tap.dx, tap.dy) == (0, 0)).count(), 1);
            assert!(
                taps.iter()
                    .all(|tap| tap.weight > 0.0 && (tap.dx as f32).hypot(tap.dy as f32) <= radius + 1.0)
            );
        }
    }
}
