//! Daylight: A. J. Preetham, P. Shirley, B. Smits, "A practical analytic model for daylight", SIGGRAPH 1999, appendix A.2.

use super::panorama::Panorama;
use super::sun::{Sun, radiance_of_sun};
use glam::{DMat3, DVec3};
use std::f64::consts::{PI, TAU};

/// A cloudless day.
///
/// Radiances are in proportion to luminances, of which one unit is 27 kcd m⁻²: under a sun at 45° and in air of turbidity 3 the ground
/// gets about π, and white paper there looks as 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    elevation: f32,
    turbidity: f32,
    azimuth: f32,
}

/// Luminance of linear RGB (1, 1, 1) in the model's own unit, kcd m⁻².
pub(super) const UNIT: f64 = 27.0;

/// What the ground reflects of the light that it gets, alike in all colours.
const ALBEDO: f64 = 0.2;

/// Texels of the picture: a degree has 1.4, and nothing in a sky without its sun is smaller.
const SIZE: [u32; 2] = [512, 256];

/// From XYZ to linear sRGB, IEC 61966-2-1; columns.
const TO_SRGB: DMat3 =
    DMat3::from_cols_array(&[3.2406, -0.9689, 0.0557, -1.5372, 1.8758, -0.2040, -0.4986, 0.0415, 1.0570]);
/// The luminance of linear sRGB.
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// A to E of Perez et al. for Y, x and y: each what it is per unit of turbidity, and at turbidity 0.
const PEREZ: [[[f64; 2]; 5]; 3] = [
    [[0.1787, -1.4630], [-0.3554, 0.4275], [-0.0227, 5.3251], [0.1206, -2.5771], [-0.0670, 0.3703]],
    [[-0.0193, -0.2592], [-0.0665, 0.0008], [-0.0004, 0.2125], [-0.0641, -0.8989], [-0.0033, 0.0452]],
    [[-0.0167, -0.2608], [-0.0950, 0.0092], [-0.0079, 0.2102], [-0.0441, -1.6537], [-0.0109, 0.0529]],
];

/// Chromaticity x and y of the zenith: rows for the square of turbidity, turbidity and 1; columns for the cube of the sun's zenith
/// angle, its square, itself and 1.
const ZENITH: [[[f64; 4]; 3]; 2] = [
    [
        [0.00166, -0.00375, 0.00209, 0.0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ],
    [
        [0.00275, -0.00610, 0.00317, 0.0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ],
];

impl Default for Sky {
    fn default() -> Self {
        Self { elevation: 45.0, turbidity: 3.0, azimuth: 225.0 }
    }
}

impl Sky {
    /// `elevation` of the sun in degrees above the horizon, over 0 and up to 90; `turbidity` of the air, from 2 (clear) to 10 (hazy),
    /// where the model holds; `azimuth` in degrees from −z (which a viewer looks along), clockwise as seen from above, so that the
    /// sun of 90 stands at +x and that of 225 behind the viewer's left shoulder. Err: what is wrong with them.
    pub fn new(elevation: f32, turbidity: f32, azimuth: f32) -> Result<Self, String> {
        if !(elevation > 0.0 && elevation <= 90.0) {
            return Err(format!("the sun's elevation {elevation} is not over 0 and up to 90 degrees"));
        }
        if !(2.0..=10.0).contains(&turbidity) {
            return Err(format!("the turbidity {turbidity} is not from 2 (clear) to 10 (hazy)"));
        }
        if !azimuth.is_finite() {
            return Err(format!("the sun's azimuth {azimuth} is no angle in degrees"));
        }
        Ok(Self { elevation, turbidity, azimuth })
    }

    /// Of the sun, degrees.
    pub fn elevation(&self) -> f32 {
        self.elevation
    }

    /// Of the air.
    pub fn turbidity(&self) -> f32 {
        self.turbidity
    }

    /// Of the sun, degrees.
    pub fn azimuth(&self) -> f32 {
        self.azimuth
    }

    /// The sun.
    pub fn sun(&self) -> Sun {
        let xyz = radiance_of_sun(f64::from(self.elevation), f64::from(self.turbidity));
        Sun { direction: self.towards_sun().as_vec3(), radiance: srgb(xyz / UNIT).as_vec3() }
    }

    fn towards_sun(&self) -> DVec3 {
        let (up, along) = f64::from(self.elevation).to_radians().sin_cos();
        let (east, north) = f64::from(self.azimuth).to_radians().sin_cos();
        DVec3::new(along * east, up, -along * north)
    }

    /// All but the sun: the sky, and below the horizon a grey ground of albedo 0.2, lit by both.
    pub fn panorama(&self) -> Panorama {
        let [width, height] = SIZE;
        let (model, sun) = (Perez::of(self), self.towards_sun());
        let place = |i: u32, side: u32| (i as f32 + 0.5) / side as f32;
        let texel = |x: u32, y: u32| {
            let to = Panorama::direction([place(x, width), place(y, height)]).as_dvec3();
            model.at(to.y, to.angle_between(sun))
        };
        let sky: Vec<DVec3> = (0..height / 2).flat_map(|y| (0..width).map(move |x| texel(x, y))).collect();
        let from_sky = irradiance(&sky, width, height);
        let Sun { direction, radiance } = self.sun();
        let from_sun = f64::from(direction.y) * Sun::PROJECTED * radiance.as_dvec3();
        let ground = ALBEDO / PI * (from_sky + from_sun);
        let below = std::iter::repeat_n(ground, (width * (height - height / 2)) as usize);
        let texels = sky.into_iter().chain(below).map(DVec3::as_vec3).collect();
        Panorama::of_texels(width, height, texels)
    }
}

/// ∫ L cos θ dω over the upper half, whose rows `texels` are.
fn irradiance(texels: &[DVec3], width: u32, height: u32) -> DVec3 {
    let edge = |row: usize| (PI * row as f64 / f64::from(height)).sin().powi(2);
    let rows = texels.chunks_exact(width as usize).enumerate();
    let each = rows.map(|(y, row)| 0.5 * (edge(y + 1) - edge(y)) * row.iter().sum::<DVec3>());
    TAU / f64::from(width) * each.sum::<DVec3>()
}

/// The distribution of light over one sky.
struct Perez {
    coefficients: [[f64; 5]; 3],
    /// Y (kcd m⁻²), x and y at the zenith, over what the distribution says there.
    scale: [f64; 3],
}

impl Perez {
    fn of(sky: &Sky) -> Self {
        let turbidity = f64::from(sky.turbidity);
        let angle = (90.0 - f64::from(sky.elevation)).to_radians();
        let coefficients = PEREZ.map(|all| all.map(|[slope, start]| slope * turbidity + start));
        let chi = (4.0 / 9.0 - turbidity / 120.0) * (PI - 2.0 * angle);
        let luminance = (4.0453 * turbidity - 4.9710) * chi.tan() - 0.2155 * turbidity + 2.4192;
        let [x, y] = ZENITH.map(|rows| {
            let [a, b, c] = rows.map(|row| row.into_iter().fold(0.0, |sum, factor| sum * angle + factor));
            (a * turbidity + b) * turbidity + c
        });
        let zenith = [luminance, x, y];
        let scale = std::array::from_fn(|c| zenith[c] / distribution(coefficients[c], 1.0, angle));
        Self { coefficients, scale }
    }

    /// Linear sRGB in a direction whose cosine to the zenith is `cos` > 0, at an angle from the sun.
    fn at(&self, cos: f64, angle: f64) -> DVec3 {
        let [luminance, x, y] =
            std::array::from_fn(|c| self.scale[c] * distribution(self.coefficients[c], cos, angle));
        srgb(luminance / UNIT * DVec3::new(x / y, 1.0, (1.0 - x - y) / y))
    }
}

/// Equation 3 of the paper.
fn distribution([a, b, c, d, e]: [f64; 5], cos: f64, angle: f64) -> f64 {
    (1.0 + a * (b / cos).exp()) * (1.0 + c * (d * angle).exp() + e * angle.cos().powi(2))
}

/// A colour as linear sRGB. One that its primaries do not reach is moved towards the grey of its luminance until they do.
fn srgb(xyz: DVec3) -> DVec3 {
    let rgb = TO_SRGB * xyz;
    let (grey, least) = (LUMINANCE.dot(rgb), rgb.min_element());
    if least >= 0.0 {
        return rgb;
    }
    // The least becomes zero, also in single precision.
    (DVec3::splat(grey) + grey / (grey - least) * (rgb - grey)).max(DVec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn sky(elevation: f32, turbidity: f32) -> Sky {
        Sky::new(elevation, turbidity, 0.0).expect("a sky")
    }

    fn luminance(rgb: Vec3) -> f64 {
        LUMINANCE.dot(rgb.as_dvec3())
    }

    /// On level ground, klx: from the sky and from the sun.
    fn illuminance(sky: &Sky) -> (f64, f64) {
        let (panorama, sun) = (sky.panorama(), sky.sun());
        let upper = (0..128).flat_map(|y| (0..512).map(move |x| (x, y)));
        let texels: Vec<DVec3> = upper.map(|(x, y)| panorama.at(x, y).as_dvec3()).collect();
        let from_sky = UNIT * LUMINANCE.dot(irradiance(&texels, 512, 256));
        (from_sky, UNIT * luminance(sun.radiance) * Sun::PROJECTED * f64::from(sun.direction.y))
    }

    /// Clear skies of the Illuminating Engineering Society (RP-21, "Calculation of daylight availability"): the sun on a surface that
    /// faces it 127.5 exp(−0.21 m) klx, the ground from the sky 0.8 + 15.5 √sin(elevation) klx.
    #[test]
    fn sun_and_sky_are_as_bright_as_they_are_measured() {
        for elevation in [30.0_f32, 45.0, 60.0, 75.0] {
            let sine = f64::from(elevation).to_radians().sin();
            let (from_sky, from_sun) = illuminance(&sky(elevation, 2.0));
            let sun = 127.5 * (-0.21 / sine).exp();
            assert!(
                (from_sun / sine / sun - 1.0).abs() < 0.04,
                "{elevation}: {} for {sun} klx",
                from_sun / sine
            );
            // The paper's sky is brighter than that one, together with its sun by less than a quarter.
            let all = sun * sine + 0.8 + 15.5 * sine.sqrt();
            let ratio = (from_sky + from_sun) / all;
            assert!((1.0..1.25).contains(&ratio), "{elevation}: {ratio}");
            // Hazier air takes from the sun and gives to the sky.
            let (hazy_sky, hazy_sun) = illuminance(&sky(elevation, 6.0));
            assert!(hazy_sun < 0.75 * from_sun && hazy_sky > 1.25 * from_sky);
        }
    }

    #[test]
    fn paper_in_the_open_looks_white_at_exposure_zero() {
        let (from_sky, from_sun) = illuminance(&sky(45.0, 3.0));
        let paper = (from_sky + from_sun) / UNIT / PI;
        assert!((paper - 1.0).abs() < 0.03, "{paper}");
    }

    /// Zenith luminance and chromaticity by hand from equations of the paper: turbidity 3, sun at 60° from the zenith.
    #[test]
    fn the_zenith_is_what_the_paper_says() {
        let chi = (4.0 / 9.0 - 3.0 / 120.0) * (PI - 2.0 * PI / 3.0);
        let expected = 7.1649 * f64::tan(chi) + 1.7727;
        let found = Perez::of(&sky(30.0, 3.0));
        let at_zenith = |c: usize| found.scale[c] * distribution(found.coefficients[c], 1.0, PI / 3.0);
        assert!((at_zenith(0) / expected - 1.0).abs() < 1e-6);
        assert!(
            (at_zenith(1) - 0.2450).abs() < 5e-4 && (at_zenith(2) - 0.2526).abs() < 5e-4,
            "{} {}",
            at_zenith(1),
            at_zenith(2)
        );
    }

    #[test]
    fn the_zenith_is_blue_and_a_low_sun_red() {
        for turbidity in [2.0, 3.0, 5.0] {
            let zenith = sky(30.0, turbidity).panorama().at(0, 0);
            assert!(zenith.z > 1.2 * zenith.x && zenith.z > 1.1 * zenith.y, "{turbidity}: {zenith}");
        }
        let [low, high] = [3.0, 60.0].map(|elevation| sky(elevation, 3.0).sun().radiance);
        assert!(low.x > 3.0 * low.y && low.y > 3.0 * low.z, "{low}");
        assert!(high.x < 1.3 * high.y && high.z > 0.8 * high.y, "{high}");
        assert!(luminance(high) > 30.0 * luminance(low));
    }

    #[test]
    fn nothing_is_negative_and_nothing_jumps() {
        let mut last: Option<Panorama> = None;
        for step in 0..=24_i16 {
            let elevation = (3.75 * f32::from(step)).max(0.01);
            for turbidity in [2.0, 6.5, 10.0] {
                let sun = sky(elevation, turbidity).sun();
                assert!(
                    sun.radiance.min_element() >= 0.0 && sun.radiance.max_element() > 0.0,
                    "{elevation} {turbidity}"
                );
                // Construction refuses what is negative.
                sky(elevation, turbidity).panorama();
            }
            let now = sky(elevation, 4.0).panorama();
            if let Some(last) = last {
                let [a, b] = [&last, &now].map(|panorama| luminance(panorama.at(300, 20)));
                assert!((b / a).ln().abs() < 0.35, "{elevation}: {a} {b}");
            }
            last = Some(now);
        }
        let panorama = sky(40.0, 3.0).panorama();
        for (x, y) in (0..127).flat_map(|y| (0..511).map(move |x| (x, y))) {
            let [here, right, below] =
                [(x, y), (x + 1, y), (x, y + 1)].map(|(x, y)| luminance(panorama.at(x, y)));
            assert!((right / here).ln().abs() < 0.1 && (below / here).ln().abs() < 0.2, "({x}, {y})");
        }
    }

    #[test]
    fn the_sun_stands_where_it_is_asked_and_the_sky_is_brightest_there() {
        for (azimuth, towards) in
            [(0.0, Vec3::NEG_Z), (90.0, Vec3::X), (180.0, Vec3::Z), (-90.0, Vec3::NEG_X)]
        {
            let sky = Sky::new(20.0, 3.0, azimuth).expect("a sky");
            let level = Vec3::new(sky.sun().direction.x, 0.0, sky.sun().direction.z).normalize();
            assert!(level.distance(towards) < 1e-6, "{azimuth}: {level}");
            assert!((sky.sun().direction.y - 20_f32.to_radians().sin()).abs() < 1e-6);
            let panorama = sky.panorama();
            let texels = (0..128).flat_map(|y| (0..512).map(move |x| (x, y)));
            let brightest = texels.max_by(|a, b| panorama.at(a.0, a.1).y.total_cmp(&panorama.at(b.0, b.1).y));
            let (x, y) = brightest.expect("a texel");
            let to = Panorama::direction([(x as f32 + 0.5) / 512.0, (y as f32 + 0.5) / 256.0]);
            assert!(to.angle_between(sky.sun().direction) < 6_f32.to_radians(), "{azimuth}: {to}");
        }
    }

    #[test]
    fn the_ground_reflects_a_fifth_of_what_it_gets() {
        let sky = sky(50.0, 3.0);
        let (from_sky, from_sun) = illuminance(&sky);
        let ground = sky.panorama().at(7, 200);
        assert!((luminance(ground) * UNIT * PI / (0.2 * (from_sky + from_sun)) - 1.0).abs() < 1e-3);
        assert_eq!(sky.panorama().at(300, 128), ground);
    }

    #[test]
    fn a_sky_that_the_model_does_not_know_is_refused() {
        for (elevation, turbidity, azimuth, word) in [
            (0.0, 3.0, 0.0, "elevation 0 "),
            (91.0, 3.0, 0.0, "elevation 91 "),
            (f32::NAN, 3.0, 0.0, "elevation NaN"),
            (45.0, 1.9, 0.0, "turbidity 1.9"),
            (45.0, 11.0, 0.0, "turbidity 11"),
            (45.0, 3.0, f32::INFINITY, "azimuth inf"),
        ] {
            let why = Sky::new(elevation, turbidity, azimuth).expect_err(word);
            assert!(why.contains(word), "{why}");
        }
    }
}
