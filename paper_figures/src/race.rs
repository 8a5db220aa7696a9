//! Figure 4's error against run time: methods side by side, against given pictures.

use crate::clock::cpu_seconds;
use crate::figure4::Display;
use glam::Vec3;
use halflight::error::Result;
use halflight::film::Layer;
use halflight::measure::compare;
use halflight::plan::{Direct, Method, Settings};
use halflight::render::Render;
use halflight::scene::Scene;

/// Camera samples a pixel in a pass of the path tracer.
const SAMPLES: u32 = 16;

/// Who takes part: name, method, who serves direct light.
pub const METHODS: [(&str, Method, Direct); 3] = [
    ("shooting", Method::Photon, Direct::Photons),
    ("plan-chosen", Method::Photon, Direct::Connection),
    ("path-plain", Method::PathPlain, Direct::Connection),
];

/// One method's way.
pub struct Run {
    /// As in [`METHODS`].
    pub name: &'static str,
    /// Whenever a time is passed, each double the last.
    pub points: Vec<Point>,
    /// The last picture, W m⁻² sr⁻¹.
    pub picture: Vec<Vec3>,
}

/// What was there at a time.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Planning and passes: CPU time over the number of threads, which is the time on idle cores.
    pub seconds: f64,
    /// Camera samples a pixel.
    pub samples: u32,
    /// Mean `e_pixel` against each picture given.
    pub errors: [f64; 2],
}

struct Runner {
    render: Render,
    seconds: f64,
    run: Run,
}

/// Runs all methods until each has used `seconds`. Whichever has used the least renders next. Errors are measured on displayed values against both of `against`.
///
/// # Errors
/// A method that cannot render the scene.
pub fn race(
    scene: &Scene,
    (width, height): (u32, u32),
    seconds: f64,
    display: Display,
    against: [&[Vec3]; 2],
) -> Result<Vec<Run>> {
    let threads = rayon::current_num_threads() as f64;
    let mut runners = Vec::new();
    for (name, method, direct) in METHODS {
        let settings = Settings { width, height, method, direct, samples: SAMPLES, ..Settings::default() };
        let begin = cpu_seconds();
        let render = Render::new(scene.clone(), settings, &[Layer::Visible])?;
        let seconds = (cpu_seconds() - begin) / threads;
        runners.push(Runner { render, seconds, run: Run { name, points: Vec::new(), picture: Vec::new() } });
    }
    loop {
        // Planning alone may take longer than is given.
        let goes_on = |runner: &&mut Runner| runner.run.points.is_empty() || runner.seconds < seconds;
        let waiting = runners.iter_mut().filter(goes_on);
        let Some(next) = waiting.min_by(|a, b| a.seconds.total_cmp(&b.seconds)) else { break };
        let begin = cpu_seconds();
        next.render.pass();
        next.seconds += (cpu_seconds() - begin) / threads;
        let due = next.run.points.last().map_or(0.0, |point| 2.0 * point.seconds);
        if next.seconds >= due.min(seconds) {
            next.keep(display, against);
        }
    }
    Ok(runners.into_iter().map(|runner| runner.run).collect())
}

impl Runner {
    fn keep(&mut self, display: Display, against: [&[Vec3]; 2]) {
        let film = self.render.film();
        let picture = film.mean(Layer::Visible);
        let shown = display.show(&picture);
        let errors = against.map(|other| compare(&shown, other, None).e_pixel);
        let each = if self.render.plan().settings.method == Method::Photon { 1 } else { SAMPLES };
        self.run.points.push(Point { seconds: self.seconds, samples: film.passes() * each, errors });
        self.run.picture = picture;
    }
}

impl Run {
    /// The time and samples at which the error against picture `which` falls to `level`: between two points by a power law, beyond the
    /// last as 1/√time, which is marked by `true`. The first point where it is below that already.
    pub fn reaches(&self, which: usize, level: f64) -> (f64, f64, bool) {
        let at = |p: &Point| (p.seconds, f64::from(p.samples), p.errors[which]);
        let (first, last) = (at(&self.points[0]), at(self.points.last().expect("a point at least")));
        if first.2 <= level {
            return (first.0, first.1, false);
        }
        let crossing = self.points.windows(2).find(|pair| pair[1].errors[which] <= level);
        match crossing {
            Some(pair) => {
                let (a, b) = (at(&pair[0]), at(&pair[1]));
                let share = (a.2 / level).ln() / (a.2 / b.2).ln();
                (a.0 * (b.0 / a.0).powf(share), a.1 * (b.1 / a.1).powf(share), false)
            }
            None => {
                let factor = (last.2 / level).powi(2);
                (last.0 * factor, last.1 * factor, true)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_to_a_level_lies_on_a_power_law() {
        let point = |seconds: f64| Point {
            seconds,
            samples: (100.0 * seconds) as u32,
            errors: [0.02 / seconds.sqrt(), 0.02 / seconds.sqrt()],
        };
        let run = Run { name: "", points: vec![point(1.0), point(4.0), point(16.0)], picture: Vec::new() };
        let (seconds, samples, beyond) = run.reaches(0, 0.01 / 1.5_f64.sqrt());
        assert!((seconds - 6.0).abs() < 1e-6 && (samples - 600.0).abs() < 1e-3 && !beyond);
        let (seconds, _, beyond) = run.reaches(1, 0.002);
        assert!((seconds - 100.0).abs() < 1e-6 && beyond);
        assert_eq!(run.reaches(0, 0.03), (1.0, 100.0, false));
    }
}
