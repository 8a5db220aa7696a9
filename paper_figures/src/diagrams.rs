//! Figures 2 and 3, and the scattering diagrams of eq. 12, 18, 20 and 22: the section of a scene and real light in it.

use crate::book::{Chapter, Picture, Strip, escape};
use crate::put;
use crate::section::{Flight, Section};
use glam::Vec2;
use halflight::error::Result;
use halflight::light::Light;
use halflight::scene::{Illumination, Matter};
use std::path::Path;

const STYLE: &str = "\
svg { --ink: #1b1f24; --soft: #8b949e; --ground: #fff; --inv: #6d3fc0; --vis: #c2600c; }
@media (prefers-color-scheme: dark) { svg { --ink: #e6e9ed; --soft: #7d8590; --ground: #14181d; --inv: #b794f6; --vis: #ffab4d; } }
text { font: 15px system-ui, 'DejaVu Sans', sans-serif; fill: var(--ink); }
.cut { fill: none; stroke: var(--ink); stroke-width: 2; stroke-linecap: round; }
.ray { fill: none; stroke-width: 2.4; } .sample { stroke-width: 1.1; opacity: 0.75; }
.inv { stroke: var(--inv); stroke-dasharray: 7 5; } .vis { stroke: var(--vis); }
.tinv { fill: var(--inv); } .tvis { fill: var(--vis); }
.lobe { fill: none; stroke: var(--soft); } .normal { stroke: var(--soft); stroke-dasharray: 2 4; }
.soft { fill: var(--soft); }";

/// How long the longest sample is drawn, m.
const REACH: f32 = 0.36;

/// A part of the section, drawn.
struct Drawing {
    body: String,
    low: Vec2,
    high: Vec2,
    scale: f32,
}

impl Drawing {
    fn new(low: Vec2, high: Vec2, width: f32) -> Self {
        Self { body: String::new(), low, high, scale: width / (high.x - low.x) }
    }

    fn place(&self, p: Vec2) -> Vec2 {
        self.scale * Vec2::new(p.x - self.low.x, self.high.y - p.y)
    }

    fn size(&self) -> Vec2 {
        self.scale * (self.high - self.low)
    }

    fn line(&mut self, class: &str, [a, b]: [Vec2; 2]) {
        let (a, b) = (self.place(a), self.place(b));
        self.body +=
            &format!("<path class=\"{class}\" d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>\n", a.x, a.y, b.x, b.y);
    }

    /// A line with a head at `share` of its length.
    fn arrow(&mut self, class: &str, [a, b]: [Vec2; 2], share: f32) {
        self.line(class, [a, b]);
        let along = (b - a).normalize();
        let tip = a.lerp(b, share) + along * 0.03;
        let wings = [0.5, -0.5].map(|side| self.place(tip - 0.06 * (along + side * along.perp())));
        let tip = self.place(tip);
        let half = if class.contains("inv") { "tinv" } else { "tvis" };
        let [l, r] = wings;
        self.body += &format!(
            "<path class=\"{half}\" d=\"M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}z\"/>\n",
            tip.x, tip.y, l.x, l.y, r.x, r.y
        );
    }

    fn text(&mut self, class: &str, at: Vec2, text: &str) {
        let at = self.place(at);
        self.body +=
            &format!("<text class=\"{class}\" x=\"{:.1}\" y=\"{:.1}\">{}</text>\n", at.x, at.y, escape(text));
    }

    fn cut(&mut self, segments: &[[Vec2; 2]]) {
        let margin = Vec2::splat(0.05);
        let inside = |p: &Vec2| p.cmpge(self.low - margin).all() && p.cmple(self.high + margin).all();
        let mut path = String::new();
        let mut last = Vec2::NAN;
        for [a, b] in segments {
            let crosses = inside(a) || inside(b) || a.distance(*b) > self.high.distance(self.low);
            if crosses {
                let (a, b) = (self.place(*a), self.place(*b));
                if last.is_nan() || a.distance(last) > 0.05 {
                    path += &format!("M{:.1} {:.1}", a.x, a.y);
                }
                path += &format!("L{:.1} {:.1}", b.x, b.y);
                last = b;
            }
        }
        self.body += &format!("<path class=\"cut\" d=\"{path}\"/>\n");
    }

    /// All pieces and lobes of a flight. Samples take turns where both halves leave.
    fn flight(&mut self, flight: &Flight) {
        for met in &flight.meetings {
            let lobe: Vec<String> = met
                .outline
                .iter()
                .map(|p| self.place(met.at + REACH * *p))
                .map(|p| format!("{:.1},{:.1}", p.x, p.y))
                .collect();
            if !lobe.is_empty() {
                self.body += &format!("<polyline class=\"lobe\" points=\"{}\"/>\n", lobe.join(" "));
            }
            for (i, sample) in met.scattered.iter().enumerate() {
                let halves = halves(sample.light);
                let class = halves[i % halves.len()];
                let end = met.at + REACH * sample.value * sample.to;
                self.line(&format!("sample {class}"), [met.at, end]);
            }
        }
        for (ends, light) in &flight.pieces {
            for class in halves(*light) {
                self.arrow(&format!("ray {class}"), *ends, 0.5);
            }
        }
    }

    fn svg(&self) -> String {
        let Vec2 { x, y } = self.size();
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {x:.0} {y:.0}\" width=\"{x:.0}\" height=\"{y:.0}\">\n\
             <style>{STYLE}</style>\n<rect width=\"100%\" height=\"100%\" style=\"fill: var(--ground)\"/>\n{}</svg>\n",
            self.body
        )
    }
}

/// The halves that `light` has.
fn halves(light: Light) -> Vec<&'static str> {
    let has = |v: glam::Vec3| v.max_element() > 0.0;
    let all = [("inv", has(light.invisible)), ("vis", has(light.visible))];
    all.into_iter().filter(|(_, has)| *has).map(|(class, _)| class).collect()
}

/// `[invisible, visible]`, of what left the lamp as `[1, 0]`.
fn column(light: Light) -> String {
    format!("L = [{}, {}]", light.invisible.x, light.visible.x)
}

/// Where light meets the front ball.
fn target(section: &Section) -> Vec2 {
    section.ball + section.radius * Vec2::new(-0.42, 0.91).normalize()
}

/// Figures 2 and 3.
///
/// # Errors
/// Files that cannot be written.
pub fn figures(folder: &Path) -> Result<[Chapter; 2]> {
    Ok([figure2(folder)?, figure3(folder)?])
}

fn figure2(folder: &Path) -> Result<Chapter> {
    let section = Section::new(Illumination::ONE_BOUNCE)?;
    let flight = section.shine(Vec2::new(2.2, section.floor), 5.0);
    let met = flight.meetings.last().expect("the floor");
    let mut drawing = Drawing::new(Vec2::new(1.15, -0.22), Vec2::new(2.95, 0.95), 640.0);
    drawing.cut(&section.outline());
    drawing.line("normal", [met.at, met.at + 0.55 * met.normal]);
    // All that is reflected here is seen.
    let incoming = flight.pieces.last().expect("one").0;
    let back = (incoming[0] - met.at).normalize();
    drawing.flight(&Flight {
        pieces: vec![([met.at + 0.95 * back, met.at], Light::both(glam::Vec3::ONE))],
        meetings: flight.meetings,
    });
    let met = section.shine(Vec2::new(2.2, section.floor), 5.0).meetings.remove(0);
    drawing.text("", met.at + Vec2::new(-0.02, -0.09), "x");
    drawing.text("", met.at + 0.8 * back + Vec2::new(0.05, 0.0), "L_in from the lamp");
    drawing.text("", met.at + Vec2::new(0.2, 0.26), "L_out, directions ω_out");
    drawing.text("soft", met.at + Vec2::new(0.03, 0.52), "normal");
    put(folder, "figure-2.svg", &drawing.svg())?;
    Ok(Chapter {
        key: "figure_2",
        title: "Figure 2: reflection at a point".into(),
        paper: "A sketch: radiance arrives at a point x of a surface and leaves in directions ω_out.".into(),
        here: vec![
            "The scene of figure 4, cut by the vertical plane through the middle of its lamp. The line is a ray from the lamp, \
             its end is where the program finds the floor; the thin lines are samples that the program drew from the floor's lobe, those \
             within 3.4° of the plane, each as long as f cos θ in its direction. The thin outline is f cos θ over all directions of the plane."
                .into(),
        ],
        strips: vec![Strip::new("", vec![Picture::new("figure-2.svg", "Incident ray and reflected lobe")])],
        numbers: Vec::new(),
        notes: Vec::new(),
    })
}

fn figure3(folder: &Path) -> Result<Chapter> {
    let section = Section::new(Illumination::LOCAL)?;
    let flight = section.shine(target(&section), 3.6);
    let mut drawing = Drawing::new(Vec2::new(0.05, -0.3), Vec2::new(1.85, 1.62), 640.0);
    drawing.cut(&section.outline());
    drawing.flight(&flight);
    let met = &flight.meetings[0];
    drawing.text("", met.at + Vec2::new(-0.05, -0.1), "x");
    for (i, (ends, light)) in flight.pieces.iter().enumerate() {
        let end = if i == 0 {
            ends[1] + 0.42 * (ends[0] - ends[1]).normalize()
        } else {
            ends[0].lerp(ends[1], 0.45)
        };
        // Beside the lobe on the floor.
        let aside = if i == 2 { 0.22 } else { 0.06 };
        drawing.text("tinv", end + Vec2::new(aside, 0.0), &column(*light));
    }
    let seen = met.scattered.first().map_or(Light::ZERO, |sample| sample.light);
    drawing.text("tvis", met.at + REACH * met.normal + Vec2::new(-0.36, 0.0), &column(seen));
    put(folder, "figure-3.svg", &drawing.svg())?;
    Ok(Chapter {
        key: "figure_3",
        title: "Figure 3: invisible light at a cut sphere".into(),
        paper: "A sketch of a sphere, cut open: invisible radiance arrives at a point x; the surface lets the invisible light through \
                and reflects visible light."
            .into(),
        here: vec![
            "The front ball of figure 4 with F_local, cut by the vertical plane through its centre and the middle of the lamp. One \
             ordered query gives all crossings of the ray: into the ball, out of it, and the floor. What the matrices make of light that \
             starts as L = [1, 0] (invisible, visible) is written beside each piece. Dashed is invisible, full is visible. Where the ray leaves \
             the ball it meets the back of a one-sided reflector (eq. 6): nothing is reflected there."
                .into(),
        ],
        strips: vec![Strip::new("", vec![Picture::new("figure-3.svg", "Straight-through ray and reflected lobes in the cut ball")])],
        numbers: Vec::new(),
        notes: Vec::new(),
    })
}

/// The scattering diagram of a matrix: `scattering-NAME.svg`.
///
/// # Errors
/// Files that cannot be written.
pub fn scattering(folder: &Path, name: &str, illumination: Illumination) -> Result<String> {
    let section = Section::new(illumination)?;
    let flight = section.shine(target(&section), 3.6);
    let mut drawing = Drawing::new(Vec2::new(0.2, -0.22), Vec2::new(1.7, 1.45), 300.0);
    drawing.cut(&section.outline());
    drawing.flight(&flight);
    let file = format!("scattering-{name}.svg");
    put(folder, &file, &drawing.svg())?;
    Ok(file)
}

/// The matrix of an illumination as a picture: `matrix-NAME.svg`.
///
/// # Errors
/// Files that cannot be written.
pub fn matrix(folder: &Path, name: &str, illumination: Illumination) -> Result<String> {
    let Matter { opaque, straight } = illumination.own_matter();
    let (opaque, straight) = (opaque.rows(), straight.rows());
    let mut body = String::new();
    for (row, y) in [(0, 62), (1, 108)] {
        for (column, x) in [(0, 122), (1, 252)] {
            let terms = [(opaque[row][column], "opaque"), (straight[row][column], "transp")];
            let words: Vec<String> = terms
                .iter()
                .filter(|(c, _)| *c != 0.0)
                .map(|(c, f)| {
                    let factor = if *c == 1.0 { String::new() } else { format!("{c} ") };
                    format!("{factor}f<tspan dy=\"4\" font-size=\"12\">{f}</tspan><tspan dy=\"-4\">&#8203;</tspan>")
                })
                .collect();
            let entry = if words.is_empty() { "0".to_owned() } else { words.join(" + ") };
            body += &format!("<text text-anchor=\"middle\" x=\"{x}\" y=\"{y}\">{entry}</text>\n");
        }
    }
    let svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 300 170\" width=\"300\" height=\"170\">\n<style>{STYLE}\n\
         text {{ font-size: 17px; }}</style>\n<rect width=\"100%\" height=\"100%\" style=\"fill: var(--ground)\"/>\n\
         <path class=\"cut\" d=\"M38 34h-10v94h10M276 34h10v94h-10\"/>\n{body}</svg>\n"
    );
    let file = format!("matrix-{name}.svg");
    put(folder, &file, &svg)?;
    Ok(file)
}
