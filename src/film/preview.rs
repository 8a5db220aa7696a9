//! How a picture is shown on a display: how bright, and by which curve.

use super::judge::automatic;
use crate::scene::Scene;
use glam::{Mat3, Vec3};
use std::fmt;
use std::str::FromStr;

/// From linear light to what a display shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// As it is: sRGB, in which all that is above 1 is white.
    #[default]
    Standard,
    /// Khronos PBR Neutral: colours of matter stay as they are, and highlights above 0.8 are bent to white.
    Neutral,
    /// AgX: the whole range is bent, and bright colours fade to white.
    Agx,
}

/// How bright a picture is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Times 2 to this.
    Stops(f32),
    /// So that four fifths of the pixels that are lit at all are at or below 0.4, by their largest component: a lamp in sight or a
    /// black background hardly matters.
    Auto,
}

/// What a PNG or JPEG file makes of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Preview {
    /// How bright.
    pub exposure: Exposure,
    /// By which curve.
    pub view: View,
}

impl Default for Exposure {
    fn default() -> Self {
        Self::Stops(0.0)
    }
}

impl From<f32> for Preview {
    /// The standard view at an exposure in stops.
    fn from(stops: f32) -> Self {
        Self { exposure: Exposure::Stops(stops), view: View::Standard }
    }
}

impl From<f64> for Preview {
    /// The standard view at an exposure in stops.
    fn from(stops: f64) -> Self {
        Self::from(stops as f32)
    }
}

impl Preview {
    /// How a picture of a scene is shown where nothing is said: as it is; but as a viewer of models would where the studio had to
    /// light it.
    pub fn usual(scene: &Scene) -> Self {
        if scene.lit_by_studio {
            Self { exposure: Exposure::Auto, view: View::Neutral }
        } else {
            Self::default()
        }
    }
}

impl Exposure {
    /// In stops, for a plane of linear RGB; 0 for one that is black.
    pub fn stops(self, plane: &[Vec3]) -> f64 {
        match self {
            Self::Stops(stops) => f64::from(stops),
            Self::Auto => automatic(plane),
        }
    }
}

impl FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let stops = || text.parse().ok().filter(|stops: &f32| stops.is_finite()).map(Self::Stops);
        let exposure = if text == "auto" { Some(Self::Auto) } else { stops() };
        exposure.ok_or_else(|| format!("`{text}` is no exposure; write auto, or a number of stops"))
    }
}

/// So far beyond white that no view tells it from brighter light, and still a number after any of them.
const MOST: f32 = 1e30;

impl View {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Standard, Self::Neutral, Self::Agx];

    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::Neutral => "neutral",
            Self::Agx => "agx",
        }
    }

    /// What a display shows of exposed linear RGB: linear light, of which it can show [0, 1].
    pub fn shown(self, rgb: Vec3) -> Vec3 {
        let there = || rgb.clamp(Vec3::ZERO, Vec3::splat(MOST));
        match self {
            Self::Standard => rgb,
            Self::Neutral => neutral(there()),
            Self::Agx => agx(there()),
        }
    }

    /// The grey that is shown as `level` in (0, 1) of a display.
    pub(super) fn grey_shown_as(self, level: f32) -> f32 {
        if self == Self::Standard {
            return level;
        }
        let (mut below, mut above) = (0.0_f32, 64.0_f32);
        // As many halvings as single precision tells apart.
        for _ in 0..40 {
            let middle = 0.5 * (below + above);
            if self.shown(Vec3::splat(middle)).y < level { below = middle } else { above = middle }
        }
        above
    }
}

impl FromStr for View {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|view| view.name() == text);
        found.ok_or_else(|| format!("`{text}` is no view; write standard, neutral or agx"))
    }
}

impl fmt::Display for View {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// What matter of index 1.5 reflects at normal incidence, F₉₀ of the specification.
const REFLECTED: f32 = 0.04;
/// Where highlights begin to be bent.
const KNEE: f32 = 0.8 - REFLECTED;
/// How fast they lose their colour.
const FADING: f32 = 0.15;

/// Khronos PBR Neutral Tone Mapper, the specification's formulas (github.com/KhronosGroup/ToneMapping, PBR_Neutral), for light that is
/// not negative.
fn neutral(rgb: Vec3) -> Vec3 {
    let least = rgb.min_element();
    // Less the offset of the specification, written so that small numbers do not cancel.
    let colour = if least <= 2.0 * REFLECTED {
        (rgb - least) + least * least / (4.0 * REFLECTED)
    } else {
        rgb - REFLECTED
    };
    let peak = colour.max_element();
    if peak <= KNEE {
        return colour;
    }
    let bent = 1.0 - (1.0 - KNEE).powi(2) / (peak + 1.0 - 2.0 * KNEE);
    let kept = 1.0 / (FADING * (peak - bent) + 1.0);
    colour * (bent / peak) * kept + Vec3::splat(bent * (1.0 - kept))
}

/// T. Sobotka's AgX (github.com/sobotka/AgX): its matrix into a smaller gamut, its 16.5 stops, and back, with the polynomial that
/// B. Wrensch fitted to its curve ("Minimal AgX implementation", 2023); for a display whose exponent is 2.2.
fn agx(rgb: Vec3) -> Vec3 {
    const INSET: Mat3 = Mat3::from_cols_array(&[
        0.842_479_06,
        0.042_328_24,
        0.042_375_655,
        0.078_433_6,
        0.878_468_64,
        0.078_433_6,
        0.079_223_745,
        0.079_166_13,
        0.879_143,
    ]);
    const OUTSET: Mat3 = Mat3::from_cols_array(&[
        1.196_879,
        -0.052_896_85,
        -0.052_971_635,
        -0.098_020_88,
        1.151_903_1,
        -0.098_043_45,
        -0.099_029_74,
        -0.098_961_18,
        1.151_073_7,
    ]);
    const STOPS: [f32; 2] = [-12.473_93, 4.026_069];
    const CURVE: [f32; 7] = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.002_32];
    let encoded = (INSET * rgb).map(|x| {
        let x = (x.log2().clamp(STOPS[0], STOPS[1]) - STOPS[0]) / (STOPS[1] - STOPS[0]);
        CURVE.into_iter().fold(0.0, |sum, factor| sum * x + factor)
    });
    (OUTSET * encoded).map(|x| x.max(0.0).powf(2.2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::srgb_encode;

    fn near(view: View, rgb: [f32; 3], expected: [f32; 3]) {
        let found = view.shown(Vec3::from_array(rgb));
        let off = (found - Vec3::from_array(expected)).abs().max_element();
        assert!(off < 2e-5, "{view} of {rgb:?}: {found}, not {expected:?}");
    }

    /// By hand from the specification; its sample implementation gives the same.
    #[test]
    fn neutral_is_what_its_specification_says() {
        near(View::Neutral, [0.5; 3], [0.46; 3]);
        near(View::Neutral, [0.02; 3], [0.0025; 3]);
        near(View::Neutral, [0.9, 0.1, 0.0], [0.848_421, 0.100_059, 0.006_514]);
        near(View::Neutral, [2.0, 1.0, 0.5], [0.96, 0.534_090, 0.321_136]);
        near(View::Neutral, [1e30, 0.0, 0.0], [1.0; 3]);
    }

    /// By another implementation of the published matrices and curve, in double precision.
    #[test]
    fn agx_is_what_is_published() {
        near(View::Agx, [0.18; 3], [0.214_467, 0.214_533, 0.214_537]);
        near(View::Agx, [1.0; 3], [0.589_977, 0.590_207, 0.590_221]);
        near(View::Agx, [1.0, 0.0, 0.0], [0.719_417, 0.039_488, 0.039_550]);
        near(View::Agx, [0.0, 0.0, 4.0], [0.285_931, 0.285_920, 0.944_497]);
        near(View::Agx, [0.8, 0.3, 0.05], [0.580_206, 0.326_377, 0.104_684]);
    }

    #[test]
    fn black_stays_black_and_more_light_is_never_darker() {
        for view in View::ALL {
            let byte = |x: f32| srgb_encode(view.shown(Vec3::splat(x)).y);
            assert_eq!((byte(0.0), byte(-1.0), byte(1e38)), (0, 0, 255), "{view}");
            let greys: Vec<u8> = (0..4000_u16).map(|i| byte((0.01 * f32::from(i) - 30.0).exp2())).collect();
            assert!(greys.windows(2).all(|pair| pair[0] <= pair[1]), "{view}");
            assert_eq!(view.shown(Vec3::NAN).to_array().map(srgb_encode), [0; 3], "{view}");
        }
    }

    #[test]
    fn the_grey_of_a_level_is_shown_as_it() {
        for view in View::ALL {
            for level in [1e-4, 0.005, 0.4, 0.9] {
                let shown = view.shown(Vec3::splat(view.grey_shown_as(level))).y;
                assert!((shown / level - 1.0).abs() < 1e-3, "{view} {level}: {shown}");
            }
        }
    }

    #[test]
    fn what_is_written_is_understood() {
        assert_eq!("auto".parse(), Ok(Exposure::Auto));
        assert_eq!("-1.5".parse(), Ok(Exposure::Stops(-1.5)));
        for wrong in ["", "bright", "inf", "nan", "1e99"] {
            assert!(wrong.parse::<Exposure>().is_err_and(|why| why.contains("auto")), "{wrong}");
        }
        assert!(View::ALL.into_iter().all(|view| view.to_string().parse() == Ok(view)));
        assert!("filmic".parse::<View>().is_err_and(|why| why.contains("neutral")));
    }
}
