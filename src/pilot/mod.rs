//! A few trial paths before a render: how many photons a path leaves, where caustics begin, and who serves direct light where
//! that depends on cost rather than logic. What they teach is a [`Frame`]; the plan stays as it is.
//!
//! Only direct light leaves a choice. Only photons find caustics, and inter-reflection is read from the map that is there for
//! them anyway. A connection chooses one of many luminaires blindly, by power, and most of them may be far away or behind
//! a wall. Photons find out by themselves where they arrive, but they blur.
//!
//! Nothing here looks at a clock: equal scenes, settings and seeds make equal choices on every machine.

mod sights;

use crate::gather::ALPHA;
use crate::light::Light;
use crate::pass::look;
use crate::photon::Photons;
use crate::plan::{
    DEFAULT_PATHS, Direct, Frame, MAX_DEPOSITS, Method, PerPath, PhotonClasses, PhotonPlan, Plan,
};
use crate::shoot::{learn_guide, learn_starts, shoot};
use glam::DVec3;
use sights::learn_sights;
use std::f64::consts::PI;
use std::sync::Arc;

/// Lines of one pass at the most, where the plan chooses: half a minute of a processor.
const MAX_LINES: f64 = 3.2e7;
/// Paths of the pilot that counts deposits per path: the most, fewer where paths are long, so many at least where they are
/// not of the longest.
const PILOT_PATHS: [f64; 2] = [16.0, 8_192.0];
/// Reflections of the pilot, about; and where those of the fewest paths would be more than this, it has fewer.
const PILOT_REFLECTIONS: [f64; 2] = [1.0e5, 4.0e5];
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

/// How passes of `plan` are best rendered: the number of photons, where paths start, and who serves direct light where that was left
/// to us.
pub fn learn(plan: &Plan) -> Frame {
    let frame = learn_photons(plan);
    if plan.is_endless() {
        return frame;
    }
    let sights = learn_sights(plan, &frame);
    let frame = Frame { sights, ..frame };
    let choice = plan.settings.direct == Direct::Auto && plan.settings.method == Method::Photon;
    if choice { choose_direct(plan, frame) } else { frame }
}

/// The same, but that direct light is served as logic has it.
pub fn learn_photons(plan: &Plan) -> Frame {
    let frame = Frame::asked(plan);
    // Where there is no image a pilot would not end.
    if plan.is_endless() { frame } else { counted(plan, frame) }
}

/// Learns where paths of the frame should start, counts the deposits of a few, and from them sets the paths per pass and the share of
/// deposits kept.
pub(crate) fn counted(plan: &Plan, mut frame: Frame) -> Frame {
    let starts = learn_starts(plan, &frame).map(Arc::new);
    let guide = if starts.is_some() { None } else { learn_guide(plan, &frame) };
    let Some(photons) = frame.photons.take() else { return frame };
    let mut photons = PhotonPlan { guide, starts, ..photons };
    let wanted = plan.settings.paths.unwrap_or(DEFAULT_PATHS);
    let length = plan.existence.length();
    let [fewest, most] = PILOT_PATHS;
    let [short, long] = PILOT_REFLECTIONS.map(|reflections| reflections / length);
    let pilot = short.clamp(fewest.min(long.max(1.0)), most) as u32;
    // Counted, not kept.
    let pilot = PhotonPlan { paths: wanted.min(pilot), keep: 0.0, ..photons.clone() };
    let paths = f64::from(pilot.paths);
    let ledger = shot_alone(plan, &frame, pilot).ledger;
    let each = |count: u64| count as f64 / paths;
    photons.per_path = PerPath { lines: each(ledger.lines), deposits: each(ledger.deposits) };
    let affordable = MAX_DEPOSITS / photons.per_path.deposits.max(1e-9);
    photons.paths = wanted;
    match plan.settings.paths {
        // The user's number of paths stands; some of their deposits are thinned.
        Some(_) if f64::from(wanted) > affordable => {
            photons.keep = (affordable / f64::from(wanted)) as f32;
        }
        Some(_) => {}
        None => {
            let affordable = affordable.min(MAX_LINES / photons.per_path.lines.max(1.0));
            photons.paths = wanted.min(affordable as u32).max(1);
        }
    }
    frame.photons = Some(photons);
    frame
}

/// Photons of a pilot: those of `photons`.
fn shot_alone(plan: &Plan, frame: &Frame, photons: PhotonPlan) -> Photons<Light> {
    shoot(plan, &Frame { photons: Some(photons), ..frame.clone() }, u32::MAX)
}

/// Lets photons serve direct light where they are shot anyway, there are many luminaires, and they promise less error
/// at equal work. `frame` has connections; it says afterwards who serves and why.
fn choose_direct(plan: &Plan, frame: Frame) -> Frame {
    let Some(photons) = frame.photons.clone() else { return frame };
    let among = plan.connections.chosen_among();
    if among <= FEW || plan.existence.is_refuted() || frame.direct == Direct::Photons {
        return frame;
    }
    let few = |photons: &PhotonPlan| PhotonPlan { paths: photons.paths.min(PATHS), ..photons.clone() };
    let others = shot_alone(plan, &frame, few(&photons));
    let direct = PhotonPlan {
        classes: PhotonClasses { direct: true, caustic: false, indirect: false },
        max_reflections: 0,
        ..few(&photons)
    };
    let direct_photons = shot_alone(plan, &frame, direct.clone());
    let small = shrunk(&frame);
    let connected = passes(plan, &Frame { photons: None, ..small.clone() });
    let share = f64::from(direct.paths) / f64::from(photons.paths);
    let shot = passes(plan, &Frame { photons: Some(direct), direct: Direct::Photons, ..small.clone() });
    let brightness = mean_square(&connected.mean).max(mean_square(&shot.mean));
    if brightness == 0.0 {
        return frame;
    }

    // Variance of photon counts falls with their number; the pilot shot fewer.
    let by_connection = Quality { variance: connected.variance / brightness, bias_squared: 0.0, rate: 1.0 };
    let by_photons = Quality {
        variance: share * shot.variance / brightness,
        bias_squared: shot.bias_squared / brightness,
        rate: ALPHA,
    };
    let pixels = frame.pixels() as f64;
    let disk = PI * f64::from(frame.indirect_radius).powi(2);
    // A query meets as many photons as if they lay evenly over what the film shows.
    let kept =
        |photons: &Photons<Light>| (work::STORED + work::MET * disk) * (photons.count() as f64 / share);
    let common = others.ledger.lines as f64 / share + pixels + kept(&others);
    let work = [common + work::CONNECTION * pixels, common + kept(&direct_photons)];
    let (c, p) = (by_connection.after(HORIZON), by_photons.after(HORIZON * work[0] / work[1]));
    let percent = |squared: f64| 100.0 * squared.sqrt();
    let direct_because = format!(
        "of {among} luminaires; a pilot promises an error of {:.2} % by connections, {:.2} % by photons at equal work",
        percent(c),
        percent(p)
    );
    let frame = Frame { direct_because, ..frame };
    if MARGIN * p >= c {
        return frame;
    }
    let classes = PhotonClasses { direct: true, ..photons.classes };
    counted(
        plan,
        Frame {
            direct: Direct::Photons,
            photons: Some(PhotonPlan { classes, ..photons }),
            sights: None,
            ..frame
        },
    )
}

/// A film of about [`PIXELS`], whose gather radii are those of the whole film in metres.
fn shrunk(frame: &Frame) -> Frame {
    let Frame { width, height, .. } = *frame;
    let shrink = (PIXELS / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
    let side = |side: u32| ((shrink * f64::from(side)).round() as u32).max(1);
    let by = (f64::from(side(height)) / f64::from(height)) as f32;
    let indirect_radius = by * frame.indirect_radius;
    Frame { width: side(width), height: side(height), indirect_radius, ..frame.clone() }
}

/// What a few passes say about direct light, sums of RGB averaged over pixels.
struct Pilot {
    mean: Vec<DVec3>,
    variance: f64,
    bias_squared: f64,
}

fn passes(plan: &Plan, frame: &Frame) -> Pilot {
    let pixels = frame.pixels();
    let zeros = || vec![DVec3::ZERO; pixels];
    let (mut sum, mut squares, mut bias) = (zeros(), zeros(), zeros());
    for pass in u32::MAX - PASSES..u32::MAX {
        // Photons of a pilot have the radii of the first pass.
        for (i, pixel) in look::<Light, 1>(plan, frame, pass, 0).0.pixels.iter().enumerate() {
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
