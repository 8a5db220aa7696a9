//! Whether a picture shows anything at its exposure, and the exposure at which it would.

use super::preview::View;
use glam::Vec3;

/// What a display shows of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// All pixels.
    pub pixels: usize,
    /// Those with a component that is not a finite number.
    pub not_finite: usize,
    /// How the others look.
    pub look: Look,
}

/// How the finite pixels look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Look {
    /// There is something to see.
    Fine,
    /// No pixel is lit at all.
    Dark,
    /// Lit, but black on a display; whole stops at which it is not.
    Black {
        /// For `--exposure`.
        show_at: i32,
    },
    /// Lit pixels are nearly black, but for those that are white.
    NearlyBlack {
        /// For `--exposure`.
        show_at: i32,
    },
    /// Nearly all lit pixels are brighter than a display can be.
    NearlyWhite {
        /// For `--exposure`.
        show_at: i32,
    },
}

/// The darkest value that an 8-bit display tells from black: half a step of sRGB's linear part.
const SEEN: f32 = 0.5 / 255.0 / 12.92;
/// Darker than this hardly shows: 15 of 255 in sRGB.
const DIM: f32 = 0.005;
/// Brighter than this is clipped by more than a step of 8 bits.
const CLIPPED: f32 = 1.01;
/// Half a step of 8 bits below white, for views that come near it only.
const WHITE: f32 = 0.9955;
/// "Nearly all" of the lit pixels.
const NEARLY: f64 = 0.95;
/// This share of the lit pixels ...
const SHOWN_SHARE: f64 = 0.8;
/// ... is shown at or below this: a bright tone with room above it.
const SHOWN_AT: f64 = 0.4;

/// Judges a plane of linear RGB by a view at an exposure in stops, by the largest component of each pixel.
pub fn judge(plane: &[Vec3], view: View, stops: f64) -> Judgement {
    let not_finite = plane.iter().filter(|pixel| !pixel.is_finite()).count();
    let look = Limits::of(view).look(&lit(plane), stops.exp2());
    Judgement { pixels: plane.len(), not_finite, look }
}

/// The exposure in stops at which [`SHOWN_SHARE`] of the lit pixels are at or below [`SHOWN_AT`]. 0 where no pixel is lit.
pub(super) fn automatic(plane: &[Vec3]) -> f64 {
    let lit = lit(plane);
    if lit.is_empty() { 0.0 } else { stops(&lit) }
}

/// The brightnesses of finite pixels above zero, in ascending order.
fn lit(plane: &[Vec3]) -> Vec<f32> {
    let finite = plane.iter().filter(|pixel| pixel.is_finite());
    let mut lit: Vec<f32> = finite.map(|pixel| pixel.max_element()).filter(|x| *x > 0.0).collect();
    lit.sort_unstable_by(f32::total_cmp);
    lit
}

/// How many of these are below a limit when they are scaled.
fn below(lit: &[f32], limit: f32, scale: f64) -> usize {
    lit.partition_point(|x| scale * f64::from(*x) < f64::from(limit))
}

/// Exposed greys which a view shows as [`SEEN`], [`DIM`] and [`CLIPPED`].
struct Limits {
    seen: f32,
    dim: f32,
    clipped: f32,
}

impl Limits {
    fn of(view: View) -> Self {
        let clipped = if view == View::Standard { CLIPPED } else { view.grey_shown_as(WHITE) };
        Self { seen: view.grey_shown_as(SEEN), dim: view.grey_shown_as(DIM), clipped }
    }

    /// Of brightnesses in ascending order.
    fn look(&self, lit: &[f32], scale: f64) -> Look {
        if lit.is_empty() {
            return Look::Dark;
        }
        let unclipped = below(lit, self.clipped, scale);
        let nearly = |part: usize, whole: usize| part as f64 > NEARLY * whole as f64;
        if below(lit, self.seen, scale) == lit.len() {
            Look::Black { show_at: whole_stops(lit) }
        } else if nearly(lit.len() - unclipped, lit.len()) {
            Look::NearlyWhite { show_at: whole_stops(lit) }
        } else if nearly(below(lit, self.dim, scale), unclipped) {
            Look::NearlyBlack { show_at: whole_stops(&lit[..unclipped]) }
        } else {
            Look::Fine
        }
    }
}

/// Stops that show most of these brightnesses, of which there is at least one.
fn stops(lit: &[f32]) -> f64 {
    let bright = lit[((SHOWN_SHARE * lit.len() as f64) as usize).min(lit.len() - 1)];
    (SHOWN_AT / f64::from(bright)).log2()
}

fn whole_stops(lit: &[f32]) -> i32 {
    stops(lit).round() as i32
}

impl Judgement {
    /// True where there is nothing but pixels that are not finite and darkness.
    pub fn shows_nothing(&self) -> bool {
        self.not_finite > 0 && self.look == Look::Dark
    }

    /// What to tell the user, a line each; none where all is well. For the exposure that it was judged at, in stops.
    pub fn warnings(&self, stops: f64) -> Vec<String> {
        let Self { pixels, not_finite, look } = *self;
        let exposure = (100.0 * stops).round() / 100.0;
        let lost = (not_finite > 0).then(|| {
            format!(
                "{not_finite} of {pixels} pixels are not finite numbers (magenta in the preview): light there is too strong for \
                 single precision; scale the lamps down"
            )
        });
        let look = match look {
            Look::Fine => None,
            Look::Dark if not_finite > 0 => None,
            Look::Dark => Some(
                "the picture is black: no light reaches the camera; look where the camera and the lamps are, and which way \
                 surfaces face"
                    .into(),
            ),
            Look::Black { show_at } => {
                Some(format!("the picture is black at exposure {exposure}; --exposure {show_at} shows it"))
            }
            Look::NearlyBlack { show_at } => {
                Some(format!("the picture is nearly black at exposure {exposure}; --exposure {show_at} shows it"))
            }
            Look::NearlyWhite { show_at } => Some(format!(
                "nearly all that is lit is white at exposure {exposure}, brighter than a display can be; --exposure {show_at} shows it"
            )),
        };
        lost.into_iter().chain(look).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp of a hundred brightnesses up to `most`, among as many unlit pixels.
    fn ramp(most: f32) -> Vec<Vec3> {
        let lit = (1..=100).map(|i| Vec3::new(0.0, most * i as f32 / 100.0, 0.0));
        lit.chain(std::iter::repeat_n(Vec3::ZERO, 100)).collect()
    }

    fn judge(plane: &[Vec3], stops: f64) -> Judgement {
        super::judge(plane, View::Standard, stops)
    }

    fn look_at(plane: &[Vec3], stops: f64) -> Look {
        judge(plane, stops).look
    }

    #[test]
    fn a_picture_that_shows_needs_no_word() {
        for most in [0.05, 0.3, 1.0, 5.0] {
            assert_eq!(look_at(&ramp(most), 0.0), Look::Fine, "{most}");
            assert!(judge(&ramp(most), 0.0).warnings(0.0).is_empty());
        }
        // A lamp in sight is white, a furnace of one is just not, and most of a picture may be unlit.
        let mut lamp = ramp(0.5);
        lamp[..50].fill(Vec3::splat(40.0));
        assert_eq!(look_at(&lamp, 0.0), Look::Fine);
        assert_eq!(look_at(&[Vec3::splat(1.004); 64], 0.0), Look::Fine);
        let mut spot = vec![Vec3::ZERO; 10_000];
        spot[7] = Vec3::splat(0.5);
        assert_eq!(look_at(&spot, 0.0), Look::Fine);
    }

    #[test]
    fn the_exposure_that_is_named_shows_the_picture() {
        for most in [1e-30, 1e-6, 2e-4, 3e-3, 60.0, 1e5, 1e30] {
            let plane = ramp(most);
            let plane =
                if most > 1.0 { plane.iter().map(|x| *x + most * Vec3::Y * 0.05).collect() } else { plane };
            let show_at = match look_at(&plane, 0.0) {
                Look::Black { show_at } if most < 1e-4 => show_at,
                Look::NearlyBlack { show_at } if (1e-4..1.0).contains(&most) => show_at,
                Look::NearlyWhite { show_at } if most > 1.0 => show_at,
                other => panic!("{most} looks {other:?}"),
            };
            assert_eq!(look_at(&plane, f64::from(show_at)), Look::Fine, "{most}");
            let word = judge(&plane, 0.0).warnings(0.0).concat();
            assert!(word.contains(&format!("--exposure {show_at} ")), "{word}");
        }
    }

    #[test]
    fn a_lamp_does_not_hide_that_the_rest_is_black() {
        let mut plane = ramp(1e-3);
        plane[..40].fill(Vec3::splat(9.0));
        let Look::NearlyBlack { show_at } = look_at(&plane, 0.0) else {
            panic!("{:?}", look_at(&plane, 0.0))
        };
        assert_eq!(show_at, 9);
    }

    #[test]
    fn what_is_not_finite_is_counted_and_darkness_is_named() {
        let mut plane = vec![Vec3::ZERO; 12];
        assert_eq!(judge(&plane, 0.0), Judgement { pixels: 12, not_finite: 0, look: Look::Dark });
        assert!(!judge(&plane, 0.0).shows_nothing());
        assert!(judge(&plane, 0.0).warnings(0.0).concat().contains("no light reaches the camera"));
        plane[3].x = f32::NAN;
        plane[4] = Vec3::INFINITY;
        let judgement = judge(&plane, 0.0);
        assert!(judgement.shows_nothing() && judgement.warnings(0.0).concat().contains("2 of 12 pixels"));
        plane[5] = Vec3::splat(0.4);
        assert!(!judge(&plane, 0.0).shows_nothing());
        assert_eq!(look_at(&plane, 0.0), Look::Fine);
    }

    #[test]
    fn automatic_exposure_shows_a_picture_by_every_view() {
        for most in [1e-30_f32, 1e-6, 0.3, 60.0, 1e30] {
            let mut plane = ramp(most);
            let stops = automatic(&plane);
            assert!(((0.4 / (0.81 * f64::from(most))).log2() - stops).abs() < 1e-5, "{most}: {stops}");
            for view in View::ALL {
                assert_eq!(super::judge(&plane, view, stops).look, Look::Fine, "{view} {most}");
            }
            // A lamp in sight makes it hardly darker, whatever its radiance.
            plane[..5].fill(Vec3::splat(9e5 * most));
            let with_lamp = automatic(&plane);
            assert!(with_lamp <= stops && stops - with_lamp < 0.1, "{most}: {with_lamp} after {stops}");
            // A background without light has no part in it.
            plane.truncate(100);
            assert_eq!(automatic(&plane), with_lamp);
        }
        assert_eq!(automatic(&[Vec3::ZERO, Vec3::NAN]), 0.0);
    }

    #[test]
    fn a_view_that_bends_highlights_shows_what_standard_cannot() {
        let bright: Vec<Vec3> = ramp(8.0).into_iter().map(|rgb| rgb + 2.0 * Vec3::ONE).collect();
        assert!(matches!(look_at(&bright, 0.0), Look::NearlyWhite { .. }));
        for view in [View::Neutral, View::Agx] {
            assert_eq!(super::judge(&bright, view, 0.0).look, Look::Fine, "{view}");
            assert!(matches!(super::judge(&bright, view, 5.0).look, Look::NearlyWhite { .. }), "{view}");
            assert!(matches!(
                super::judge(&bright, view, -14.0).look,
                Look::NearlyBlack { .. } | Look::Black { .. }
            ));
        }
    }
}
