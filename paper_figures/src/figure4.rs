//! Figure 4: OpenGL against F_local, and the error against run time.

use crate::book::{Chapter, Number, Picture, Strip};
use crate::effort::{Effort, LAMP_SAMPLES, OPENGL_SAMPLES};
use crate::five_points::five_points;
use crate::images::Shown;
use crate::opengl::OpenGl;
use crate::plot::{Curve, Panel, plot};
use crate::put;
use crate::race::{Run, race};
use crate::wireframe::wireframe;
use glam::Vec3;
use halflight::error::Result;
use halflight::film::{Film, Layer};
use halflight::measure::mask::dilated;
use halflight::measure::{Metrics, compare};
use halflight::plan::{Method, Settings};
use halflight::render::Render;
use halflight::scene::Scene;
use std::path::Path;

/// The paper's mean `e_pixel`.
const PAPER: f64 = 0.004;
/// Left, top of the detail (upper left of the front ball) and its size, as shares of the picture.
const DETAIL: [f32; 4] = [0.57, 0.40, 1.0 / 15.0, 1.0 / 15.0];
/// Width of the details as drawn, pixels.
const DRAWN: u32 = 480;
/// By how much differences are multiplied in pictures.
const GAIN: f32 = 32.0;

/// How radiance is shown: multiplied, clipped to [0, 1] by what shows it.
#[derive(Clone, Copy, Debug)]
pub struct Display(f32);

impl Display {
    /// The brightest channel of `picture` is 1.
    fn of(picture: &[Vec3]) -> Self {
        Self(1.0 / picture.iter().map(|pixel| pixel.max_element()).fold(f32::MIN_POSITIVE, f32::max))
    }

    /// Displayed values, before clipping.
    pub fn show(self, picture: &[Vec3]) -> Vec<Vec3> {
        picture.iter().map(|pixel| self.0 * *pixel).collect()
    }
}

/// All pictures, as radiance.
struct Found {
    scene: Scene,
    /// Of each of the five spots, times a₂.
    intensity: f32,
    /// By OpenGL, with the triangles it drew.
    opengl: Option<(Vec<Vec3>, usize)>,
    /// Ours of the same five points, plan-chosen.
    five: Film,
    /// Ours of the lamp, by gathering with connections: no method that is measured against it made it.
    lamp: Film,
    runs: Vec<Run>,
    display: Display,
}

/// Renders, compares, writes the pictures.
///
/// # Errors
/// Files that cannot be written.
pub fn figure(folder: &Path, effort: &Effort, opengl: Option<&OpenGl>) -> Result<Chapter> {
    let found = Found::make(effort, opengl)?;
    let strips = found.write(folder, effort)?;
    let mut here = vec![
        "builtin:two-spheres with F_local, its lamp purely invisible. Both programs draw the same triangles. Displayed values are linear \
         radiance times one exposure, clipped to [0, 1], without tone mapping or transfer function, and written to the files as they are; \
         the exposure makes the brightest channel of the reference 1."
            .into(),
    ];
    here.push(
        "The scale between the two lights is worked out, not fitted. A piece dA of a lamp of radiance L gives the irradiance \
         L cos θ′ cos θ dA / r²; a point of eq. 24 with e = 1, a₀ = a₁ = 0 gives I cos θ′ cos θ / (a₂ r²); so five points that each stand \
         for a fifth of the lamp have I = a₂ L A / 5. A diffuse surface of albedo ρ shows ρ E / π, OpenGL shows ρ times its light, so \
         GL_DIFFUSE of each light is I / π."
            .into(),
    );
    Ok(Chapter {
        key: "figure_4",
        title: "Figure 4: OpenGL against F_local".into(),
        paper: "Two balls of about 500,000 triangles, lit by OpenGL (a: five spot lights in the centre and corner tiles of a 3×3 checkerboard on \
                the lamp, exponent 1, a₀ = a₁ = 0, a₂ = 0.0025, 64 samples a pixel), with details of the mesh (b), of that picture (c) and of \
                one path-traced with F_local at 80,000 samples a pixel (d), speckled by its noise. The mean of e_pixel is 0.4 % and the average \
                colours differ by less than 1/255."
            .into(),
        here,
        strips,
        numbers: found.numbers(),
        notes: found.notes(effort),
    })
}

impl Found {
    fn make(effort: &Effort, opengl: Option<&OpenGl>) -> Result<Self> {
        let scene = Scene::load("builtin:two-spheres")?;
        let (five_scene, intensity) = five_points(&scene);
        eprintln!("figure 4: OpenGL");
        let picture = opengl.map(|opengl| opengl.picture(&five_scene, effort.size, OPENGL_SAMPLES));
        let opengl = picture.transpose().map_err(halflight::error::Error::Usage)?;
        eprintln!("figure 4: our own pictures");
        let film = |scene: &Scene, method: Method, passes: u32, layers: &[Layer]| -> Result<Film> {
            let (width, height) = effort.size;
            let settings =
                Settings { width, height, method, samples: LAMP_SAMPLES, seed: 7, ..Settings::default() };
            let mut render = Render::new(scene.clone(), settings, layers)?;
            (0..passes).for_each(|_| render.pass());
            Ok(render.film().clone())
        };
        let five = film(&five_scene, Method::Photon, effort.five_passes, &[Layer::Albedo])?;
        let lamp = film(&scene, Method::Path, effort.lamp_passes, &[])?;
        let (own_five, own_lamp) = (five.mean(Layer::Visible), lamp.mean(Layer::Visible));
        let reference = opengl.as_ref().map_or(&own_five, |(picture, _)| picture);
        let display = Display::of(reference);
        eprintln!(
            "figure 4: error against run time, {} s of idle cores for each of three methods",
            effort.seconds
        );
        let against = [display.show(reference), display.show(&own_lamp)];
        let runs = race(&scene, effort.size, effort.seconds, display, [&against[0], &against[1]])?;
        Ok(Self { scene, intensity: intensity.x, opengl, five, lamp, runs, display })
    }

    /// What the paper measures against: OpenGL's picture, or ours of the same lights.
    fn reference(&self) -> Vec<Vec3> {
        self.opengl.as_ref().map_or_else(|| self.five.mean(Layer::Visible), |(picture, _)| picture.clone())
    }

    fn reference_name(&self) -> &'static str {
        if self.opengl.is_some() { "OpenGL" } else { "our five points" }
    }

    fn metrics(&self, picture: &[Vec3], reference: &[Vec3]) -> Metrics {
        compare(&self.display.show(picture), &self.display.show(reference), None)
    }

    fn write(&self, folder: &Path, effort: &Effort) -> Result<Vec<Strip>> {
        let size = effort.size;
        let shown = |picture: &[Vec3]| Shown { width: size.0, pixels: self.display.show(picture) };
        let [w, h] = [size.0 as f32, size.1 as f32];
        let window = [DETAIL[0] * w, DETAIL[1] * h, DETAIL[2] * w, DETAIL[3] * h].map(|x| (x as u32).max(1));
        let by = (DRAWN / window[2]).max(1);
        let lamp = shown(&self.lamp.mean(Layer::Visible));
        let reference = shown(&self.reference());
        let put_both = |name: &str, picture: &Shown| -> Result<[String; 2]> {
            let files = [format!("figure-4-{name}.png"), format!("figure-4-{name}-detail.png")];
            picture.write(&folder.join(&files[0]))?;
            picture.detail(window, by).write(&folder.join(&files[1]))?;
            Ok(files)
        };
        let (mesh, seen) = wireframe(&self.scene, size, window, by);
        put(folder, "figure-4b-mesh.svg", &mesh)?;
        let [ours, ours_detail] = put_both("d-local", &lamp)?;
        let triangles = self.scene.mesh.triangles.len();
        let mut whole = Vec::new();
        let mut details = vec![Picture::new(
            "figure-4b-mesh.svg",
            format!("(b) mesh, detail: {seen} of {triangles} triangles"),
        )];
        if self.opengl.is_some() {
            let [a, c] = put_both("a-opengl", &reference)?;
            whole.push(Picture::new(
                a,
                format!("(a) fixed-function OpenGL, five spot lights, {OPENGL_SAMPLES} samples a pixel"),
            ));
            details.push(Picture::magnified(c, "(c) OpenGL, detail"));
        }
        let samples = effort.lamp_passes * LAMP_SAMPLES;
        whole.push(Picture::new(
            ours,
            format!("(d) F_local under the lamp, path-traced with connections, {samples} samples a pixel"),
        ));
        details.push(Picture::magnified(ours_detail, "(d) F_local, the same picture, detail"));
        lamp.less(&reference, GAIN).write(&folder.join("figure-4-difference.png"))?;
        whole.push(Picture::new(
            "figure-4-difference.png",
            format!("(d) less {}, {GAIN} times, on grey", self.reference_name()),
        ));
        let mut raced = Vec::new();
        for run in &self.runs {
            let [_, detail] = put_both(run.name, &shown(&run.picture))?;
            let last = run.points.last().expect("a point at least");
            raced.push(Picture::magnified(
                detail,
                format!(
                    "{}, {:.1} s, {} samples a pixel: mean e_pixel {}",
                    run.name,
                    last.seconds,
                    last.samples,
                    percent(last.errors[0])
                ),
            ));
        }
        put(folder, "figure-4-error-vs-time.svg", &self.curves())?;
        let curves = Picture::new(
            "figure-4-error-vs-time.svg",
            "both axes logarithmic; the same runs, two references",
        );
        Ok(vec![
            Strip::new("Whole pictures", whole),
            Strip::new("The same detail, magnified", details),
            Strip::new("The same detail after equal time", raced),
            Strip::new("Error against run time", vec![curves]),
        ])
    }

    fn curves(&self) -> String {
        let floor = self.metrics(&self.lamp.mean(Layer::Visible), &self.reference()).e_pixel;
        let panel = |which: usize, title: String, mark: (String, f64)| Panel {
            title,
            across: "seconds on idle cores, planning included".into(),
            curves: self
                .runs
                .iter()
                .map(|run| Curve {
                    name: run.name,
                    points: run.points.iter().map(|point| [point.seconds, point.errors[which]]).collect(),
                })
                .collect(),
            marks: vec![("the paper, 80,000 samples a pixel".into(), PAPER), mark],
        };
        plot(&[
            panel(
                0,
                format!("against {}", self.reference_name()),
                ("five points are not a lamp".into(), floor),
            ),
            panel(1, "against our own converged picture".into(), ("its own noise".into(), self.own_noise())),
        ])
    }

    /// Mean `e_pixel` of our converged picture that its error bar promises. A normal error of size σ in each channel has a mean
    /// of √(⅓(Δr²+Δg²+Δb²)) between 0.8 σ (one channel, or all alike) and 0.92 σ; the upper bound σ is given.
    fn own_noise(&self) -> f64 {
        let errors = self.lamp.standard_error();
        let sum: f64 = errors.iter().map(|e| (e.as_dvec3().length_squared() / 3.0).sqrt()).sum();
        f64::from(self.display.0) * sum / errors.len() as f64
    }

    /// Pixels in which more than one surface is seen, or a surface and the background, and their neighbours: OpenGL's samples may
    /// see the tip of an edge that ours miss.
    fn edges(&self) -> Vec<bool> {
        let pure: Vec<Vec3> =
            self.scene.materials.iter().flat_map(|m| &m.lobes).map(|(_, lobe)| lobe.albedo()).collect();
        let is_pure = |albedo: Vec3| albedo == Vec3::ZERO || pure.iter().any(|p| p.distance(albedo) < 1e-5);
        let edges: Vec<bool> =
            self.five.mean(Layer::Albedo).into_iter().map(|albedo| !is_pure(albedo)).collect();
        dilated(&edges, self.five.width(), 1)
    }

    fn numbers(&self) -> Vec<Number> {
        let (five, lamp, reference) =
            (self.five.mean(Layer::Visible), self.lamp.mean(Layer::Visible), self.reference());
        let mut numbers = Vec::new();
        let mut tell = |key: &str, what: String, paper: &'static str, value: f64, text: String| {
            numbers.push(Number::new(key, what, value, text).beside(paper));
        };
        let triangles = self.scene.mesh.triangles.len();
        tell(
            "triangles",
            "triangles of the scene".into(),
            "about 500,000",
            triangles as f64,
            triangles.to_string(),
        );
        let name = self.reference_name();
        let m = self.metrics(&lamp, &reference);
        tell(
            "e_pixel",
            format!("mean e_pixel, F_local under the lamp against {name}"),
            "0.4 %",
            m.e_pixel,
            percent(m.e_pixel),
        );
        tell(
            "mean_colour",
            "difference of the average colours, largest channel".into(),
            "< 1/255",
            m.mean_colour,
            per_byte(m.mean_colour),
        );
        tell("e_pixel_max", "largest e_pixel".into(), "", m.e_pixel_max, percent(m.e_pixel_max));
        if let Some((opengl, drawn)) = &self.opengl {
            let m = self.metrics(&five, opengl);
            tell(
                "like_e_pixel",
                "like with like, our five Warn spots against OpenGL’s: mean e_pixel".into(),
                "",
                m.e_pixel,
                format!("{}, {}", percent(m.e_pixel), per_byte(m.e_pixel)),
            );
            tell(
                "like_e_pixel_max",
                "like with like: largest e_pixel".into(),
                "",
                m.e_pixel_max,
                percent(m.e_pixel_max),
            );
            tell(
                "like_mean_colour",
                "like with like: difference of the average colours".into(),
                "",
                m.mean_colour,
                per_byte(m.mean_colour),
            );
            let edges = self.edges();
            let [ours, theirs] = [&five, opengl].map(|picture| self.display.show(picture));
            let inside = compare(&ours, &theirs, Some(&edges)).e_pixel_max;
            tell(
                "like_e_pixel_max_inside",
                "like with like: largest e_pixel away from edges".into(),
                "",
                inside,
                format!("{}, {}", percent(inside), per_byte(inside)),
            );
            let errors = self.display.show(&self.five.standard_error());
            let kept = errors.iter().zip(&edges).filter(|(_, out)| !**out).map(|(error, _)| error);
            let noise = kept.map(|e| f64::from(e.length_squared() / 3.0).sqrt()).fold(0.0, f64::max);
            tell(
                "like_noise_max_inside",
                "like with like: largest standard error of ours there (light that varies across a pixel)"
                    .into(),
                "",
                noise,
                percent(noise),
            );
            let fitted = fit(&five, opengl);
            tell(
                "like_scale",
                "like with like: factor on OpenGL’s picture that a fit would choose".into(),
                "",
                fitted,
                format!("{fitted:.6}"),
            );
            tell(
                "triangles_opengl",
                "triangles that OpenGL drew, flat ones divided".into(),
                "",
                *drawn as f64,
                drawn.to_string(),
            );
        }
        let m = self.metrics(&lamp, &five);
        tell(
            "floor",
            "our five spots against our lamp: mean e_pixel that the light model makes".into(),
            "",
            m.e_pixel,
            percent(m.e_pixel),
        );
        tell(
            "own_noise",
            "standard error of our picture of the lamp, as mean e_pixel".into(),
            "",
            self.own_noise(),
            percent(self.own_noise()),
        );
        tell(
            "intensity",
            "intensity I of each spot, from I = a₂ L A / 5".into(),
            "",
            self.intensity.into(),
            format!("{:.5}", self.intensity),
        );
        let fitted = fit(&lamp, &reference);
        tell(
            "fitted_scale",
            "factor on it with which five points would be closest to the lamp (not used)".into(),
            "",
            fitted,
            format!("{fitted:.5}"),
        );
        for run in &self.runs {
            let last = run.points.last().expect("a point at least");
            tell(
                &format!("{}_e_pixel", run.name),
                format!("{}: mean e_pixel after {:.1} s", run.name, last.seconds),
                "",
                last.errors[0],
                percent(last.errors[0]),
            );
            let (seconds, samples, beyond) = run.reaches(1, PAPER);
            let note = if beyond { ", extrapolated as 1/√time" } else { "" };
            let paper = if run.name == "path-plain" { "80,000" } else { "" };
            tell(
                &format!("{}_samples_to_paper", run.name),
                format!("{}: samples a pixel to 0.4 % of noise and bias", run.name),
                paper,
                samples,
                format!("{samples:.0}{note}"),
            );
            tell(
                &format!("{}_seconds_to_paper", run.name),
                format!("{}: seconds to it", run.name),
                "",
                seconds,
                format!("{seconds:.1}{note}"),
            );
        }
        numbers
    }

    fn notes(&self, effort: &Effort) -> Vec<String> {
        let reference = self.reference();
        let black = reference.iter().filter(|pixel| **pixel == Vec3::ZERO).count();
        let share = 100.0 * black as f64 / reference.len() as f64;
        let mut notes = vec![
            format!("{}×{} pixels; {share:.0} % of them are black in the reference: background, and halves of balls that face away from the light.", effort.size.0, effort.size.1),
            "e_pixel = √(⅓(Δr² + Δg² + Δb²)) on displayed values, mean over all pixels, as in the paper. What five points and a lamp differ by \
             in the terminators of the balls stays, however long one renders: the floor in the left diagram. Against our own \
             converged picture (right) noise and the bias of the gather radius are all there is."
                .into(),
            "shooting: direct light too comes from the photon map. plan-chosen: what halflight does when not told otherwise; in local matter \
             that is connections without photons or visibility. path-plain: the paper’s path tracer, which finds the lamp by chance; ours stratifies \
             its 16 samples a pixel and pass. The picture (d) that the right diagram measures against is by none of them. One seed each; time is CPU time over threads."
                .into(),
        ];
        if self.opengl.is_some() {
            notes.push(
                "OpenGL lights the corners of triangles and is linear between them. The floor, two triangles of the scene, is divided for it until \
                 no edge is longer than 1/150 of the scene’s radius. Drawn to float pixels; the 64 jittered pictures are averaged in f64. \
                 The largest differences lie along silhouettes, where 64 samples a pixel and ours cover edges by slightly different shares."
                    .into(),
            );
        }
        notes
    }
}

/// The factor on `b` that brings it closest to `a`, in the least squares.
fn fit(a: &[Vec3], b: &[Vec3]) -> f64 {
    let (mut cross, mut square) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        cross += a.as_dvec3().dot(b.as_dvec3());
        square += b.as_dvec3().length_squared();
    }
    cross / square
}

fn percent(value: f64) -> String {
    format!("{:.3} %", 100.0 * value)
}

fn per_byte(value: f64) -> String {
    format!("{:.4}/255", 255.0 * value)
}
