//! Sunlight through the atmosphere: Preetham, Shirley, Smits 1999, appendix A.1, after M. Iqbal, "An introduction to solar
//! radiation", 1983.

use glam::{DVec3, Vec3};

/// The sun of a [`Sky`](super::Sky): a disk of [`SUN_RADIUS`], alike all over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector towards it.
    pub direction: Vec3,
    /// Linear RGB, in the unit of its sky.
    pub radiance: Vec3,
}

/// Angular radius of the sun, rad: 0.2665°, half of 0.533°.
pub const SUN_RADIUS: f32 = 0.2665 * std::f32::consts::PI / 180.0;

impl Sun {
    /// ∫ cos θ dω over its disk about the normal, π sin², sr.
    pub(super) const PROJECTED: f64 = {
        // The sine of so small an angle, exact to 1e-10.
        let angle = SUN_RADIUS as f64;
        let sine = angle - angle * angle * angle / 6.0;
        std::f64::consts::PI * sine * sine
    };
}

/// Spectral radiance of the sun outside the atmosphere, 100 W m⁻² nm⁻¹ sr⁻¹, from 380 nm in steps of 10.
const SUN: [f64; 38] = [
    165.5, 162.3, 211.2, 258.8, 258.2, 242.3, 267.6, 296.6, 305.4, 300.6, 306.6, 288.3, 287.1, 278.2, 271.0,
    272.3, 263.6, 255.0, 250.6, 253.1, 253.5, 251.3, 246.3, 241.7, 236.8, 232.1, 228.2, 223.4, 219.7, 215.3,
    211.0, 207.3, 202.4, 198.7, 194.3, 190.7, 186.3, 182.6,
];
/// What ozone absorbs, cm⁻¹, at the same wavelengths.
const OZONE: [f64; 38] = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.003, 0.006, 0.009, 0.014, 0.021, 0.03, 0.04, 0.048, 0.063, 0.075,
    0.085, 0.103, 0.12, 0.12, 0.115, 0.125, 0.12, 0.105, 0.09, 0.079, 0.067, 0.057, 0.048, 0.036, 0.028,
    0.023, 0.018, 0.014, 0.011, 0.01, 0.009,
];
/// What water vapour absorbs: a wavelength, and there.
const WATER: [(usize, f64); 7] =
    [(690, 0.016), (700, 0.024), (710, 0.0125), (720, 1.0), (730, 0.87), (740, 0.061), (750, 0.001)];

/// The paper's amounts of ozone (cm) and of water vapour (cm).
const OZONE_DEPTH: f64 = 0.35;
const WATER_DEPTH: f64 = 2.0;
/// Of aerosol, for sizes of particles as they commonly are.
const ANGSTROM_EXPONENT: f64 = 1.3;

/// XYZ of the sun's radiance on the ground, Y in kcd m⁻², for its elevation in degrees.
///
/// Gases whose bands lie above 750 nm, where nothing is seen, have no part in it.
pub(super) fn radiance_of_sun(elevation: f64, turbidity: f64) -> DVec3 {
    // Kasten 1965.
    let mass = 1.0 / (elevation.to_radians().sin() + 0.15 * (elevation + 3.885).powf(-1.253));
    let each = (0..SUN.len()).map(|i| {
        let nanometres = 380 + 10 * i;
        let micrometres = nanometres as f64 / 1000.0;
        let water = WATER.iter().find(|(at, _)| *at == nanometres).map_or(0.0, |(_, absorbs)| *absorbs);
        let rayleigh = 0.008735 * micrometres.powf(-4.08) * mass;
        let aerosol = (0.04608 * turbidity - 0.04586) * micrometres.powf(-ANGSTROM_EXPONENT) * mass;
        let ozone = OZONE[i] * OZONE_DEPTH * mass;
        let wet = water * WATER_DEPTH * mass;
        let vapour = 0.2385 * wet / (1.0 + 20.07 * wet).powf(0.45);
        100.0 * SUN[i] * (-rayleigh - aerosol - ozone - vapour).exp() * observer(nanometres as f64)
    });
    // 683 lm W⁻¹, steps of 10 nm.
    0.683 * 10.0 * each.sum::<DVec3>()
}

/// The colour-matching functions of the CIE 1931 standard observer at a wavelength in nm, as Wyman, Sloan and Shirley fitted them:
/// "Simple analytic approximations to the CIE XYZ color matching functions", JCGT 2(2), 2013, eq. 4.
fn observer(wavelength: f64) -> DVec3 {
    let lobe = |height: f64, middle: f64, below: f64, above: f64| {
        let distance = wavelength - middle;
        let width = if distance < 0.0 { below } else { above };
        height * (-0.5 * (distance / width).powi(2)).exp()
    };
    DVec3::new(
        lobe(0.362, 442.0, 16.0, 26.7) + lobe(1.056, 599.8, 37.9, 31.0) + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beside 127.5 klx, the constant of the Illuminating Engineering Society.
    #[test]
    fn above_the_atmosphere_the_sun_gives_what_is_measured_there() {
        let each = SUN.iter().enumerate().map(|(i, power)| 100.0 * power * observer(380.0 + 10.0 * i as f64));
        let xyz = 0.683 * 10.0 * each.sum::<DVec3>();
        let illuminance = xyz.y * Sun::PROJECTED;
        assert!((illuminance / 127.5 - 1.0).abs() < 0.01, "{illuminance} klx");
        // Its correlated colour temperature, after McCamy 1992, is that of daylight.
        let [x, y] = [xyz.x, xyz.y].map(|part| part / xyz.element_sum());
        let n = (x - 0.3320) / (0.1858 - y);
        let temperature = ((449.0 * n + 3525.0) * n + 6823.3) * n + 5520.33;
        assert!((5800.0..6500.0).contains(&temperature), "{temperature} K");
    }

    #[test]
    fn the_observer_sees_the_peaks_of_the_standard() {
        for (wavelength, expected) in [
            (450.0, [0.3362, 0.0380, 1.7721]),
            (555.0, [0.5121, 1.0, 0.0057]),
            (600.0, [1.0622, 0.6310, 0.0008]),
        ] {
            let found = observer(wavelength);
            assert!(
                (found - DVec3::from_array(expected)).abs().max_element() < 0.04,
                "{wavelength}: {found}"
            );
        }
    }

    #[test]
    fn the_disk_has_the_solid_angle_of_the_sun() {
        let angle = 0.2665_f64.to_radians();
        assert!((Sun::PROJECTED / (std::f64::consts::PI * angle.sin().powi(2)) - 1.0).abs() < 1e-6);
        assert!((Sun::PROJECTED / 6.797e-5 - 1.0).abs() < 1e-3);
    }
}
