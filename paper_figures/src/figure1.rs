//! Figure 1: one scene, four matrices, by shooting and by gathering.

use crate::book::{Chapter, Number, Picture, Strip};
use crate::diagrams;
use crate::effort::Effort;
use glam::Vec3;
use halflight::error::Result;
use halflight::film::{Asides, Film, Layer, PassImage, write_bytes_png, write_rgb_png};
use halflight::measure::{Agreement, Estimate, Metrics, agreement, compare};
use halflight::plan::{Frame, Method, Plan, Settings};
use halflight::render::{learn, render_pass};
use halflight::scene::{Illumination, Scene};
use std::path::Path;

/// In the paper's order: letter, name, illumination, what it does.
pub const CORNERS: [(char, &str, Illumination, &str); 4] = [
    ('a', "global", Illumination::GLOBAL, "shadows and inter-reflection"),
    ('b', "shadowless", Illumination::SHADOWLESS, "inter-reflection, no shadows"),
    ('c', "one-bounce", Illumination::ONE_BOUNCE, "shadows, no inter-reflection"),
    ('d', "local", Illumination::LOCAL, "neither"),
];

/// Of inter-reflection, in pixel footprints: small, so that the bias at edges is below the noise.
const RADIUS: f32 = 2.0;
/// What a full swing of the difference pictures means, relative and in standard errors.
const SWING: (f32, f32) = (0.1, 4.0);

/// Renders, compares, writes the pictures.
///
/// # Errors
/// Files that cannot be written.
pub fn figure(folder: &Path, effort: &Effort) -> Result<Chapter> {
    let (mut strips, mut numbers) = (Vec::new(), Vec::new());
    for (i, (letter, name, illumination, effect)) in CORNERS.into_iter().enumerate() {
        eprintln!("figure 1 ({letter}): {name}");
        let mut scene = Scene::load("builtin:cornell-spheres")?;
        scene.illuminate(Some(illumination), &[])?;
        let corner = Corner::render(&scene, effort, 1 + i as u64);
        let files = corner.write(folder, letter, name, effort.side)?;
        let [shot, traced, difference, z] = files;
        strips.push(Strip::new(
            format!("({letter}) {name}: {effect}"),
            vec![
                Picture::new(shot, format!("shooting, {} passes", effort.photon_passes)),
                Picture::new(
                    traced,
                    format!("gathering, {} samples a pixel", effort.path_passes * effort.path_samples),
                ),
                Picture::new(difference, "relative difference: grey 0, black and white ∓10 %"),
                Picture::new(z, "difference in standard errors: grey 0, black and white ∓4"),
            ],
        ));
        numbers.extend(corner.numbers(letter, name));
    }
    Ok(Chapter {
        key: "figure_1",
        title: "Figure 1: one scene, four matrices".into(),
        paper: "A box with two balls, rendered by gathering with F_global (a), F_shadowless (b), F_oneBounce (c) and F_local (d). \
                The lamp emits in both halves, or it would not be seen. There are no numbers. A light-shooting version is announced as \
                next work."
            .into(),
        here: vec![
            "builtin:cornell-spheres with the same four matrices, each by shooting (photons, photon maps, gather; direct light by \
             connection) and by gathering (path tracing with next-event estimation). The two share no estimator. Pictures are sRGB."
                .into(),
        ],
        strips,
        numbers,
        notes: vec![
            "relMSE: mean over pixels and channels of (x−r)² / (r² + 0.01²), shooting against gathering. Numbers and difference pictures \
             are of what surfaces reflect, without the lamp as it is seen itself. Expected is what the two error bars and the estimated bias of the gather radius add up to."
                .into(),
            "z is of the difference of the mean colours, in the channel where it is largest. “Within 1 %”: share of \
             pixel-channels whose difference a Welch test at the level of 1 % does not reject; 99 % is what noise alone gives."
                .into(),
        ],
    })
}

/// One matrix, by both methods. The visible layer is what surfaces reflect; the lamp, as it is seen, is a layer of its own: its edge
/// would be all the noise of the mean colour.
struct Corner {
    shot: Film,
    traced: Film,
}

impl Corner {
    fn render(scene: &Scene, effort: &Effort, seed: u64) -> Self {
        let settings = Settings {
            width: effort.side,
            height: effort.side,
            samples: effort.path_samples,
            caustic_radius: RADIUS,
            indirect_radius: RADIUS,
            paths: effort.paths,
            ..Settings::default()
        };
        let film = |method: Method, seed: u64, passes: u32| {
            let plan = Plan::new(scene.clone(), Settings { method, seed, ..settings.clone() });
            reflected(&plan, passes)
        };
        let shot = film(Method::Photon, 2 * seed, effort.photon_passes);
        let traced = film(Method::Path, 2 * seed + 1, effort.path_passes);
        Self { shot, traced }
    }

    fn write(&self, folder: &Path, letter: char, name: &str, side: u32) -> Result<[String; 4]> {
        let kinds = ["shooting", "gathering", "difference", "z"];
        let files = kinds.map(|kind| format!("figure-1{letter}-{name}-{kind}.png"));
        let [shot, traced] = [&self.shot, &self.traced].map(|film| film.mean(Layer::Visible));
        for (file, film) in files.iter().zip([&self.shot, &self.traced]) {
            let parts = film.mean(Layer::Visible).into_iter().zip(film.mean(Layer::Emitted));
            let whole: Vec<Vec3> = parts.map(|(reflected, emitted)| reflected + emitted).collect();
            write_rgb_png(&folder.join(file), side, side, &whole, 0.0)?;
        }
        let errors = self.shot.standard_error().into_iter().zip(self.traced.standard_error());
        let swings: Vec<(Vec3, Vec3)> = shot
            .iter()
            .zip(&traced)
            .zip(errors)
            .map(|((x, r), (a, b))| {
                let error = (a * a + b * b).map(f32::sqrt);
                let relative = (*x - *r) / (*r * *r + Vec3::splat(1e-4)).map(f32::sqrt);
                // Where nothing spreads both are the same to rounding.
                let z = Vec3::from_array(
                    [0, 1, 2].map(|c| if error[c] > 0.0 { (x[c] - r[c]) / error[c] } else { 0.0 }),
                );
                (relative / SWING.0, z / SWING.1)
            })
            .collect();
        let grey = |swing: f32| (127.5 * (1.0 + swing.clamp(-1.0, 1.0))).round() as u8;
        let bytes = |pick: fn(&(Vec3, Vec3)) -> Vec3| -> Vec<u8> {
            swings.iter().flat_map(|pair| pick(pair).to_array().map(grey)).collect()
        };
        write_bytes_png(&folder.join(&files[2]), side, side, &bytes(|pair| pair.0))?;
        write_bytes_png(&folder.join(&files[3]), side, side, &bytes(|pair| pair.1))?;
        Ok(files)
    }

    fn compare(&self) -> (Metrics, Agreement) {
        let [shot, traced] = [&self.shot, &self.traced].map(|film| film.mean(Layer::Visible));
        let metrics = compare(&shot, &traced, None);
        let estimate = |film: &Film| Estimate::from_film(film).expect("several passes");
        (metrics, agreement(&estimate(&self.shot), &estimate(&self.traced), None))
    }

    /// relMSE that the error bars promise.
    fn expected(&self) -> f64 {
        let errors = self.shot.standard_error().into_iter().zip(self.traced.standard_error());
        let reference = self.traced.mean(Layer::Visible);
        let squares = reference.iter().zip(errors).map(|(r, (a, b))| {
            let (r, a, b) = (r.as_dvec3(), a.as_dvec3(), b.as_dvec3());
            ((a * a + b * b) / (r * r + 1e-4)).element_sum()
        });
        squares.sum::<f64>() / (3.0 * reference.len() as f64) + self.bias().powi(2)
    }

    /// Of the gather radius, as the render estimates it, on the scale of √relMSE.
    fn bias(&self) -> f64 {
        self.shot.relative_bias().unwrap_or(0.0)
    }

    fn numbers(&self, letter: char, name: &str) -> Vec<Number> {
        let (metrics, agreement) = self.compare();
        let expected = self.expected();
        let difference = metrics.relative_bias.unwrap_or(0.0);
        let number = |key: &str, what: &str, value: f64, text: String| {
            Number::new(format!("{name}_{key}"), format!("({letter}) {name}: {what}"), value, text)
        };
        vec![
            number(
                "relmse",
                "relMSE between shooting and gathering",
                metrics.relmse,
                format!("{:.2e}, expected {expected:.2e}", metrics.relmse),
            ),
            number("relmse_expected", "expected relMSE, bias of the radius in it", expected, {
                format!("{expected:.2e}, of which bias {:.2e}", self.bias().powi(2))
            }),
            number(
                "mean_difference",
                "difference of the means",
                difference,
                format!("{:+.3} %, z = {:+.2}", 100.0 * difference, agreement.bias_z),
            ),
            number("z", "z of the mean colour", agreement.bias_z, format!("{:+.2}", agreement.bias_z)),
            number(
                "within",
                "pixel-channels within 1 %",
                agreement.uncorrected,
                format!("{:.2} %", 100.0 * agreement.uncorrected),
            ),
        ]
    }
}

/// Renders passes, with the lamp as it is seen taken out of the visible layer.
fn reflected(plan: &Plan, passes: u32) -> Film {
    let frame = learn(plan);
    let mut layers = vec![Layer::Visible, Layer::Emitted];
    layers.extend(frame.photons.is_some().then_some(Layer::Bias));
    let Frame { width, height, .. } = frame;
    let mut film = Film::new(width, height, &layers);
    for pass in 0..passes {
        let PassImage { mut planes, .. } = render_pass(plan, &frame, pass, &layers).0;
        let emitted = planes[1].1.clone();
        planes[0].1.iter_mut().zip(emitted).for_each(|(visible, emitted)| *visible -= emitted);
        film.add(&PassImage { width, height, planes, asides: Asides::default() });
    }
    film
}

/// The paper's §4: its matrices, each with its scattering diagram and its picture of figure 1.
///
/// # Errors
/// Files that cannot be written.
pub fn matrices(folder: &Path) -> Result<Chapter> {
    let equations = ["eq. 18, 19", "eq. 20, 21", "eq. 22, 23", "eq. 12–15"];
    let mut strips = Vec::new();
    for ((letter, name, illumination, effect), equations) in CORNERS.into_iter().zip(equations) {
        let pictures = vec![
            Picture::new(diagrams::matrix(folder, name, illumination)?, format!("F, {equations}")),
            Picture::new(
                diagrams::scattering(folder, name, illumination)?,
                "what it does to a ray, as in figure 3",
            ),
            Picture::new(format!("figure-1{letter}-{name}-shooting.png"), format!("figure 1 ({letter})")),
        ];
        strips.push(Strip::new(format!("{name}: {effect}"), pictures));
    }
    Ok(Chapter {
        key: "matrices",
        title: "Section 4: the table of matrices".into(),
        paper: "Four matrices of f_opaque and f_transp sum it up: local, global, shadowless, one-bounce.".into(),
        here: vec![
            "Written from the coefficients that the program multiplies with. They are the corners of one family, F(s, t) = \
             [[s f_opaque + t f_transp, 0], [f_opaque, 0]], with (s, t) = (1, 0), (1, 1), (0, 0), (0, 1) from top to bottom. Dashed is \
             invisible, full is visible; where both halves are reflected, samples take turns."
                .into(),
        ],
        strips,
        numbers: Vec::new(),
        notes: Vec::new(),
    })
}
