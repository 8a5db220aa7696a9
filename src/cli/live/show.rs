//! A layer as a page shows it.

use super::board::Picture;
use super::http::field;
use crate::film::{Exposure, Layer, Preview, quick_png, rgb_bytes};
use crate::measure::error_picture::heat_map;
use glam::Vec3;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What somebody wants to see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    pub layer: Layer,
    pub preview: Preview,
}

impl Wanted {
    /// From a query; what it does not say is as `usual`. None: it cannot be understood.
    pub fn read(query: &str, usual: Preview) -> Option<Self> {
        let layer = field(query, "layer").map_or(Some(Layer::Visible), |name| name.parse().ok())?;
        let exposure = field(query, "exposure").map_or(Some(usual.exposure), |text| text.parse().ok())?;
        let view = field(query, "view").map_or(Some(usual.view), |text| text.parse().ok())?;
        Some(Self { layer, preview: Preview { exposure, view } })
    }
}

/// What was encoded: sent to whoever asks for the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Encoded {
    /// Which picture.
    pub of: (u32, u32),
    wanted: Wanted,
    /// The exposure.
    pub stops: f64,
    pub png: Vec<u8>,
}

/// Encodes pictures one after another, a few a second, however many ask for them.
#[derive(Default)]
pub struct Encoder {
    last: Mutex<Last>,
}

#[derive(Default)]
struct Last {
    encoded: Option<Arc<Encoded>>,
    /// When the next may be encoded.
    next: Option<Instant>,
}

/// The least time between two encodings, and how many times as long as one takes: a tenth of one processor at most.
const EVERY: (Duration, u32) = (Duration::from_millis(200), 10);

impl Encoder {
    /// None: the picture has no such layer.
    pub fn encode(&self, picture: &Picture, wanted: Wanted) -> Option<Arc<Encoded>> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |known: &&Arc<Encoded>| known.of == picture.of && known.wanted == wanted;
        if let Some(known) = last.encoded.as_ref().filter(same) {
            return Some(Arc::clone(known));
        }
        if let Some(next) = last.next {
            std::thread::sleep(next.saturating_duration_since(Instant::now()));
        }
        let begin = Instant::now();
        let (rgb, stops) = shown(picture, wanted)?;
        let png = quick_png(picture.width, picture.height, &rgb);
        let encoded = Arc::new(Encoded { of: picture.of, wanted, stops, png });
        last.encoded = Some(Arc::clone(&encoded));
        last.next = Some(begin + EVERY.0.max((EVERY.1 + 1) * begin.elapsed()));
        Some(encoded)
    }
}

/// Three sRGB bytes a pixel, and the exposure. Error and bias are relative to the picture, in false colour; normals as
/// (n + 1) / 2; of depths the nearest is white, and what is twice as far half as bright. None: the picture has no such layer.
fn shown(picture: &Picture, wanted: Wanted) -> Option<(Vec<u8>, f64)> {
    let plane = picture.plane(wanted.layer)?;
    Some(match wanted.layer {
        Layer::Error | Layer::Bias => (relative(plane, picture.plane(Layer::Visible)?), 0.0),
        Layer::Normal => {
            let byte = |x: f32| (127.5 * (x + 1.0) + 0.5) as u8;
            (plane.iter().flat_map(|n| n.to_array().map(byte)).collect(), 0.0)
        }
        Layer::Depth => {
            let nearest =
                plane.iter().map(|depth| depth.x).filter(|depth| *depth > 0.0).fold(f32::INFINITY, f32::min);
            let grey: Vec<Vec3> = plane.iter().map(|depth| Vec3::splat(nearness(nearest, depth.x))).collect();
            (rgb_bytes(&grey, 0.0), 0.0)
        }
        _ => {
            let stops = wanted.preview.exposure.stops(plane);
            let preview = Preview { exposure: Exposure::Stops(stops as f32), ..wanted.preview };
            (rgb_bytes(plane, preview), stops)
        }
    })
}

/// From 1 at the nearest down to 0 where nothing is.
fn nearness(nearest: f32, depth: f32) -> f32 {
    if depth.is_finite() && depth > 0.0 { nearest / depth } else { 0.0 }
}

/// The same scale as the maps of `halflight compare`. Grey: not known yet.
fn relative(plane: &[Vec3], mean: &[Vec3]) -> Vec<u8> {
    let unknown: Vec<bool> = plane.iter().map(|error| *error == Vec3::INFINITY).collect();
    let pixel = |(error, mean): (&Vec3, &Vec3)| *error / (*mean * *mean + Vec3::splat(1e-4)).map(f32::sqrt);
    let relative: Vec<Vec3> = plane.iter().zip(mean).map(pixel).collect();
    heat_map(&relative, &unknown)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::View;

    fn picture(layers: &[(Layer, [Vec3; 2])]) -> Picture {
        let planes = layers.iter().map(|(layer, plane)| (*layer, plane.to_vec())).collect();
        Picture { of: (1, 4), width: 2, height: 1, planes, preview: Preview::default() }
    }

    #[test]
    fn a_query_says_what_it_changes() {
        let usual = Preview { exposure: Exposure::Auto, view: View::Neutral };
        let read = |query: &str| Wanted::read(query, usual);
        assert_eq!(read(""), Some(Wanted { layer: Layer::Visible, preview: usual }));
        let wanted = read("layer=invisible&exposure=-1.5&view=agx").unwrap();
        assert_eq!((wanted.layer, wanted.preview.view), (Layer::Invisible, View::Agx));
        assert_eq!(wanted.preview.exposure, Exposure::Stops(-1.5));
        for wrong in ["layer=secret", "exposure=bright", "view=%2e%2e", "exposure=nan"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn an_error_of_a_tenth_is_salmon_on_any_brightness_and_one_not_known_is_grey() {
        let bright = [Vec3::splat(100.0), Vec3::ONE];
        let of = |error: [Vec3; 2]| {
            let picture = picture(&[(Layer::Visible, bright), (Layer::Error, error)]);
            shown(&picture, Wanted { layer: Layer::Error, preview: Preview::default() }).unwrap().0
        };
        let tenth = of([Vec3::splat(10.0), Vec3::splat(0.1)]);
        let off = tenth[..3].iter().zip(&tenth[3..]).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(tenth[0] > 200 && tenth[2] < 150 && off <= Some(3), "{tenth:?}");
        assert_eq!(of([Vec3::INFINITY, Vec3::NAN]), [96, 96, 96, 0, 255, 0]);
    }

    #[test]
    fn light_is_shown_as_the_preview_says_and_depths_from_white() {
        let picture = picture(&[
            (Layer::Visible, [Vec3::splat(0.25), Vec3::ZERO]),
            (Layer::Depth, [Vec3::new(2.0, 0.0, 0.0), Vec3::new(f32::INFINITY, 0.0, 0.0)]),
        ]);
        let of = |layer, preview| shown(&picture, Wanted { layer, preview });
        assert_eq!(
            of(Layer::Visible, 1.0.into()),
            Some((rgb_bytes(&[Vec3::splat(0.5), Vec3::ZERO], 0.0), 1.0))
        );
        assert_eq!(of(Layer::Depth, 1.0.into()).unwrap().0, [255, 255, 255, 0, 0, 0]);
        assert_eq!(of(Layer::Caustic, 1.0.into()), None);
    }

    #[test]
    fn the_same_is_encoded_once_and_others_wait_their_turn() {
        let picture = picture(&[(Layer::Visible, [Vec3::ONE, Vec3::ZERO])]);
        let encoder = Encoder::default();
        let wanted = |stops: f32| Wanted { layer: Layer::Visible, preview: stops.into() };
        let begin = Instant::now();
        let first = encoder.encode(&picture, wanted(0.0)).unwrap();
        assert!(Arc::ptr_eq(&first, &encoder.encode(&picture, wanted(0.0)).unwrap()));
        let other = encoder.encode(&picture, wanted(1.0)).unwrap();
        assert!(!Arc::ptr_eq(&first, &other) && begin.elapsed() >= EVERY.0);
    }
}
