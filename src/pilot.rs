//! A short look before a render, where who should serve a class of paths is a matter of cost and not of logic.
//!
//! Only direct light leaves a choice. Caustics are found by photons alone; inter-reflection is read from the map that is
//! there for its photons anyway. A connection chooses one of many luminaires blindly, by power, and most of them may
//! be far away or behind a wall; photons find out by themselves where they arrive, but blur.
//!
//! Nothing here looks at a clock: equal scenes, settings and seeds make equal choices on every machine.

use crate::gather::{ALPHA, Connections, Maps, gather};
use crate::light::Light;
use crate::plan::{Direct, PhotonClasses, PhotonPlan, Plan, Settings};
use crate::shoot::{Photons, shoot};
use glam::DVec3;
use std::f64::consts::PI;

/// With fewer luminaires to choose from connections are taken unseen: a bad choice costs little.
const FEW: usize = 16;
/// Pixels of the pilot's film.
const PIXELS: f64 = 4096.0;
/// Photon paths of each of its passes.
const PATHS: u32 = 16_384;
/// Passes: variances are known to a third in each pixel, and far better over all of them.
const PASSES: u32 = 8;
/// The render it is about: after so many passes of connections.
const HORIZON: f64 = 64.0;
/// Photons blur, so they must be better by this factor in squared error.
const MARGIN: f64 = 2.0;

/// Work in units of a ray that is followed to its first hit; from the kernels' benches, good to a factor of two.
mod work {
    /// A connection: the choice of a luminaire and a query whether it is seen.
    pub const CONNECTION: f64 = 1.5;
    /// A photon that is stored: sorted into its map.
    pub const STORED: f64 = 0.5;
    /// A photon that a query meets.
    pub const MET: f64 = 0.1;
}

/// Squared error, relative to the picture's brightness, as a function of the number of passes.
#[derive(Clone, Copy, Debug)]
struct Quality {
    variance: f64,
    bias_squared: f64,
    /// Variance falls as passes^-`rate`, squared bias as passes^-(1 − rate): Knaus & Zwicker 2011.
    rate: f64,
}

impl Quality {
    fn after(self, passes: f64) -> f64 {
        self.variance * passes.powf(-self.rate) + self.bias_squared * passes.powf(self.rate - 1.0)
    }
}

/// Lets photons serve direct light where they are shot anyway, there are many luminaires, and they promise less error
/// at equal work. `plan` has connections; it says afterwards who serves and why.
pub fn choose_direct(plan: &mut Plan, connections: &Connections) {
    let Some(photons) = plan.photons.clone() else { return };
    let among = connections.chosen_among();
    if among <= FEW || plan.existence.is_refuted() || plan.settings.direct == Direct::Photons {
        return;
    }
    let asked = plan.settings.clone();
    let others = shot_alone(plan, &photons, photons.classes);
    let direct = PhotonPlan {
        classes: PhotonClasses { direct: true, caustic: false, indirect: false },
        paths: photons.paths.min(PATHS),
        max_reflections: 0,
        ..photons.clone()
    };
    let direct_photons = shot_alone(plan, &direct, direct.classes);
    shrink_film(plan);
    let connected = passes(plan, connections, None);
    plan.settings.direct = Direct::Photons;
    let shot = passes(plan, connections, Some(&direct));
    plan.settings = asked;
    let brightness = mean_square(&connected.mean).max(mean_square(&shot.mean));
    if brightness == 0.0 {
        return;
    }

    // Variance of photon counts falls with their number; the pilot shot fewer.
    let share = f64::from(direct.paths) / f64::from(photons.paths);
    let by_connection = Quality { variance: connected.variance / brightness, bias_squared: 0.0, rate: 1.0 };
    let by_photons = Quality {
        variance: share * shot.variance / brightness,
        bias_squared: shot.bias_squared / brightness,
        rate: ALPHA,
    };
    let Settings { width, height, indirect_radius, .. } = plan.settings;
    let pixels = f64::from(width) * f64::from(height);
    let disk = PI * f64::from(indirect_radius).powi(2);
    let stored =
        |photons: &Photons<Light>| photons.by_class.iter().map(Vec::len).sum::<usize>() as f64 / share;
    // A query meets as many photons as if they lay evenly over what the film shows.
    let kept = |photons: &Photons<Light>| (work::STORED + work::MET * disk) * stored(photons);
    let common = others.ledger.lines as f64 / share + pixels + kept(&others);
    let work = [common + work::CONNECTION * pixels, common + kept(&direct_photons)];
    let (c, p) = (by_connection.after(HORIZON), by_photons.after(HORIZON * work[0] / work[1]));
    let percent = |squared: f64| 100.0 * squared.sqrt();
    plan.direct_because = format!(
        "of {among} luminaires; a pilot promises an error of {:.2} % by connections, {:.2} % by photons at equal work",
        percent(c),
        percent(p)
    );
    if MARGIN * p < c {
        plan.settings.direct = Direct::Photons;
        let classes = PhotonClasses { direct: true, ..photons.classes };
        plan.photons = Some(plan.with_pilot(PhotonPlan { classes, ..photons }));
    }
}

/// A film of about [`PIXELS`], whose gather radii are those of the whole film in metres.
fn shrink_film(plan: &mut Plan) {
    let Settings { width, height, .. } = plan.settings;
    let shrink = (PIXELS / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
    let side = |side: u32| ((shrink * f64::from(side)).round() as u32).max(1);
    plan.settings.width = side(width);
    plan.settings.height = side(height);
    plan.settings.indirect_radius *= (f64::from(plan.settings.height) / f64::from(height)) as f32;
}

/// A few of the photons of a plan.
fn shot_alone(plan: &Plan, photons: &PhotonPlan, classes: PhotonClasses) -> Photons<Light> {
    let few = PhotonPlan { paths: photons.paths.min(PATHS), classes, ..photons.clone() };
    shoot::<Light>(plan, &few, u32::MAX)
}

/// What a few passes say about direct light, sums of RGB averaged over pixels.
struct Pilot {
    mean: Vec<DVec3>,
    variance: f64,
    bias_squared: f64,
}

fn passes(plan: &Plan, connections: &Connections, photons: Option<&PhotonPlan>) -> Pilot {
    let pixels = plan.settings.width as usize * plan.settings.height as usize;
    let zeros = || vec![DVec3::ZERO; pixels];
    let (mut sum, mut squares, mut bias) = (zeros(), zeros(), zeros());
    for pass in u32::MAX - PASSES..u32::MAX {
        let shot =
            photons.map_or_else(crate::render::no_photons, |photons| shoot::<Light>(plan, photons, pass));
        let maps = Maps::build(shot, plan, 0);
        for (i, pixel) in gather::<Light, 1>(plan, connections, &maps, pass).pixels.iter().enumerate() {
            let direct = pixel.parts[0].direct.as_dvec3();
            sum[i] += direct;
            squares[i] += direct * direct;
            bias[i] += pixel.bias.as_dvec3();
        }
    }
    let n = f64::from(PASSES);
    let spread = sum.iter().zip(&squares).map(|(sum, square)| (*square - *sum * *sum / n) / (n - 1.0));
    let variance = spread.map(DVec3::element_sum).sum::<f64>() / pixels as f64;
    let mean: Vec<DVec3> = sum.into_iter().map(|sum| sum / n).collect();
    let bias: Vec<DVec3> = bias.into_iter().map(|sum| sum / n).collect();
    Pilot { variance, bias_squared: mean_square(&bias), mean }
}

fn mean_square(values: &[DVec3]) -> f64 {
    values.iter().map(|v| v.length_squared()).sum::<f64>() / values.len() as f64
}
