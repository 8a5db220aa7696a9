//! Curves, log-log, as SVG that is legible on light and dark ground.

use crate::book::escape;

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 430.0;
/// Left, top, right, bottom of the plot itself.
const FRAME: [f64; 4] = [66.0, 54.0, 540.0, 376.0];

const STYLE: &str = "\
text { font: 13px system-ui, 'DejaVu Sans', sans-serif; fill: var(--ink); }
svg { --ink: #1b1f24; --soft: #59636e; --line: #d8dee4; --ground: #fff; --a: #c2410c; --b: #0b62a8; --c: #4d7c0f; }
@media (prefers-color-scheme: dark) { svg { --ink: #e6e9ed; --soft: #9aa4af; --line: #39414b; --ground: #14181d;
--a: #ff8f4d; --b: #62b0f5; --c: #a3d13f; } }
.soft { fill: var(--soft); } .title { font-weight: 600; font-size: 15px; }
.grid { stroke: var(--line); } .frame { fill: none; stroke: var(--soft); }
.mark { stroke: var(--soft); stroke-dasharray: 4 4; }
.c0 { --colour: var(--a); } .c1 { --colour: var(--b); } .c2 { --colour: var(--c); }
.curve { fill: none; stroke: var(--colour); stroke-width: 2.2; } .point, .name { fill: var(--colour); }
.name { font-weight: 600; }";

/// One curve; the same name has the same colour in every panel.
pub struct Curve {
    /// Beside its end.
    pub name: &'static str,
    /// Both > 0, x ascending.
    pub points: Vec<[f64; 2]>,
}

/// One diagram.
pub struct Panel {
    /// Above it.
    pub title: String,
    /// Below it.
    pub across: String,
    /// Drawn in order.
    pub curves: Vec<Curve>,
    /// Levels, with what they are.
    pub marks: Vec<(String, f64)>,
}

/// Panels side by side with common axes. y is shown in per cent.
pub fn plot(panels: &[Panel]) -> String {
    let points = || panels.iter().flat_map(|p| &p.curves).flat_map(|curve| &curve.points);
    let levels = || panels.iter().flat_map(|p| &p.marks).map(|mark| mark.1);
    let x = Axis::over(points().map(|p| p[0]), FRAME[0], FRAME[2]);
    let y = Axis::over(points().map(|p| p[1]).chain(levels()), FRAME[3], FRAME[1]);
    let width = WIDTH * panels.len() as f64;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {HEIGHT}\" width=\"{width}\" height=\"{HEIGHT}\">\n\
         <style>{STYLE}</style>\n<rect width=\"100%\" height=\"100%\" style=\"fill: var(--ground)\"/>\n"
    );
    for (i, panel) in panels.iter().enumerate() {
        text += &format!("<g transform=\"translate({} 0)\">\n{}</g>\n", WIDTH * i as f64, panel.draw(&x, &y));
    }
    text + "</svg>\n"
}

struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let positive = values.filter(|value| *value > 0.0 && value.is_finite());
        let (low, high) =
            positive.fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if low > high { (0.1, 1.0) } else { (low / 1.5, high * 1.5) };
        Self { low, high, from, to }
    }

    fn place(&self, value: f64) -> f64 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        self.from + (self.to - self.from) * share.clamp(0.0, 1.0)
    }

    /// 1, 2, 5 and their decades, or decades alone where there are many.
    fn ticks(&self) -> Vec<f64> {
        let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let digits: &[f64] = if self.high / self.low > 2000.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let all = decades.flat_map(|power| digits.iter().map(move |digit| digit * 10_f64.powi(power)));
        all.filter(|value| (self.low..=self.high).contains(value)).collect()
    }
}

impl Panel {
    fn draw(&self, x: &Axis, y: &Axis) -> String {
        let [left, top, right, bottom] = FRAME;
        let mut text =
            format!("<text class=\"title\" x=\"{left}\" y=\"24\">{}</text>\n", escape(&self.title));
        text += &format!("<text class=\"soft\" x=\"{left}\" y=\"43\">mean e_pixel, %</text>\n");
        for value in x.ticks() {
            let place = x.place(value);
            text += &format!(
                "<line class=\"grid\" x1=\"{place:.1}\" y1=\"{top}\" x2=\"{place:.1}\" y2=\"{bottom}\"/>\
                 <text class=\"soft\" text-anchor=\"middle\" x=\"{place:.1}\" y=\"{}\">{}</text>\n",
                bottom + 18.0,
                plain(value)
            );
        }
        for value in y.ticks() {
            let place = y.place(value);
            text += &format!(
                "<line class=\"grid\" x1=\"{left}\" y1=\"{place:.1}\" x2=\"{right}\" y2=\"{place:.1}\"/>\
                 <text class=\"soft\" text-anchor=\"end\" x=\"{}\" y=\"{:.1}\">{}</text>\n",
                left - 8.0,
                place + 4.0,
                plain(100.0 * value)
            );
        }
        text += &format!(
            "<text class=\"soft\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>\n\
             <rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/>\n",
            0.5 * (left + right),
            bottom + 40.0,
            escape(&self.across),
            right - left,
            bottom - top
        );
        let curves: Vec<Vec<[f64; 2]>> = self
            .curves
            .iter()
            .map(|curve| curve.points.iter().map(|p| [x.place(p[0]), y.place(p[1])]).collect())
            .collect();
        let marks: Vec<(&str, f64)> = self
            .marks
            .iter()
            .filter(|mark| mark.1 > 0.0)
            .map(|(name, level)| (name.as_str(), y.place(*level)))
            .collect();
        let mut labels = Labels { lines: curves.clone(), boxes: Vec::new() };
        labels.lines.extend(marks.iter().map(|(_, place)| vec![[left, *place], [right, *place]]));
        let mut names = Vec::new();
        for (curve, places) in self.curves.iter().zip(&curves) {
            let around = |[px, py]: [f64; 2]| {
                [(px + 6.0, py - 9.0, "start"), (px - 8.0, py + 4.0, "end"), (px + 6.0, py + 19.0, "start")]
            };
            names.push(
                places.first().map_or(String::new(), |first| labels.put("name", curve.name, &around(*first))),
            );
        }
        // A mark's words stand on its own line.
        labels.lines.truncate(curves.len());
        for (name, place) in marks {
            let [above, below] = [place - 5.0, place + 15.0];
            let ends = [(left + 6.0, "start"), (right - 6.0, "end")];
            let around = [above, below].map(|y| ends.map(|(x, anchor)| (x, y, anchor)));
            text += &format!(
                "<line class=\"mark\" x1=\"{left}\" y1=\"{place:.1}\" x2=\"{right}\" y2=\"{place:.1}\"/>{}\n",
                labels.put("soft", name, around.as_flattened())
            );
        }
        for (i, ((curve, places), name)) in self.curves.iter().zip(&curves).zip(names).enumerate() {
            let line: Vec<String> = places.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            text += &format!("<g class=\"c{i}\"><polyline class=\"curve\" points=\"{}\"/>", line.join(" "));
            for ([px, py], [seconds, error]) in places.iter().zip(&curve.points) {
                text += &format!(
                    "<circle class=\"point\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"4\"><title>{}: {seconds:.2} s, {:.4} %</title></circle>",
                    curve.name,
                    100.0 * error
                );
            }
            text += &(name + "</g>\n");
        }
        text
    }
}

/// Words that keep clear of lines and of each other.
struct Labels {
    lines: Vec<Vec<[f64; 2]>>,
    /// Left, top, right, bottom of the words put so far.
    boxes: Vec<[f64; 4]>,
}

impl Labels {
    /// Puts words to the first of the places (x, base line, anchor) where they are free, to the first of all where none is.
    fn put(&mut self, class: &str, words: &str, places: &[(f64, f64, &str)]) -> String {
        let boxed = |&(x, y, anchor): &(f64, f64, &str)| {
            // Of 13 px type, about; bold is wider.
            let width = words.chars().count() as f64 * if class == "name" { 7.8 } else { 7.2 };
            let left = if anchor == "end" { x - width } else { x };
            [left, y - 11.0, left + width, y + 3.0]
        };
        let place = places.iter().find(|place| self.free(boxed(place))).unwrap_or(&places[0]);
        self.boxes.push(boxed(place));
        let (x, y, anchor) = place;
        format!(
            "<text class=\"{class}\" text-anchor=\"{anchor}\" x=\"{x:.1}\" y=\"{y:.1}\">{}</text>",
            escape(words)
        )
    }

    /// Whether a box lies in the frame, apart from other words and from all lines.
    fn free(&self, [left, top, right, bottom]: [f64; 4]) -> bool {
        let within = left >= FRAME[0] && top >= FRAME[1] && right <= FRAME[2] && bottom <= FRAME[3];
        let apart =
            |other: &[f64; 4]| left > other[2] || right < other[0] || top > other[3] || bottom < other[1];
        // Points are drawn as disks of radius 4.
        let room = 4.0;
        let touches = |[x, y]: [f64; 2]| {
            (left - room..=right + room).contains(&x) && (top - room..=bottom + room).contains(&y)
        };
        let crossed =
            |line: &Vec<[f64; 2]>| line.windows(2).any(|ends| along([ends[0], ends[1]]).any(touches));
        within && self.boxes.iter().all(apart) && !self.lines.iter().any(crossed)
    }
}

/// Points of a straight line, no more than a pixel apart.
fn along([a, b]: [[f64; 2]; 2]) -> impl Iterator<Item = [f64; 2]> {
    let steps = (b[0] - a[0]).abs().max((b[1] - a[1]).abs()).ceil().max(1.0);
    (0..=steps as u32).map(move |i| {
        let share = f64::from(i) / steps;
        [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
    })
}

fn plain(value: f64) -> String {
    let digits = (-value.log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_marks_are_logarithmic() {
        let axis = Axis::over([1.5, 200.0 / 3.0].into_iter(), 0.0, 100.0);
        assert!((axis.place(10.0) - 50.0).abs() < 1e-9, "{}", axis.place(10.0));
        assert_eq!(axis.ticks(), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
        assert_eq!([0.05, 2.0, 50.0].map(plain), ["0.05", "2", "50"]);
    }

    /// The curves of figure 4 as they were measured, about: the paper's level meets one of them, as does that of five points.
    #[test]
    fn words_keep_clear_of_curves_and_of_the_frame() {
        let curve = |name, from: f64, errors: &[f64]| {
            let points =
                errors.iter().enumerate().map(|(i, e)| [from * 2_f64.powi(i as i32), 0.01 * e]).collect();
            Curve { name, points }
        };
        let panel = Panel {
            title: "against OpenGL".into(),
            across: "seconds".into(),
            curves: vec![
                curve("shooting", 0.69, &[0.748, 0.403, 0.29, 0.218, 0.172, 0.137]),
                curve("plan-chosen", 0.48, &[0.0682, 0.0289, 0.0229, 0.0204, 0.019, 0.0183]),
                curve("path-plain", 1.18, &[10.08, 5.47, 3.56, 2.42, 1.69]),
            ],
            marks: vec![
                ("the paper, 80,000 samples a pixel".into(), 0.004),
                ("five points are not a lamp".into(), 2e-4),
            ],
        };
        let svg = plot(&[panel]);
        let number = |text: &str, key: &str| -> f64 {
            let rest = text.split_once(key).expect("it is there").1;
            rest.split('"').next().unwrap_or_default().parse().expect("a number")
        };
        let lines: Vec<Vec<[f64; 2]>> = svg
            .split("points=\"")
            .skip(1)
            .map(|rest| {
                let pairs = rest.split('"').next().unwrap_or_default().split(' ');
                pairs
                    .map(|pair| pair.split_once(',').expect("a pair"))
                    .map(|(x, y)| [x, y].map(|c| c.parse().unwrap()))
                    .collect()
            })
            .collect();
        assert_eq!(lines.len(), 3);
        for words in [
            "shooting",
            "plan-chosen",
            "path-plain",
            "the paper, 80,000 samples a pixel",
            "five points are not a lamp",
        ] {
            let at = svg.find(&format!(">{words}</text>")).expect("it is drawn");
            let tag = &svg[svg[..at].rfind("<text").expect("its tag")..at];
            let (x, y, width) = (number(tag, " x=\""), number(tag, " y=\""), 7.0 * words.len() as f64);
            let left = if tag.contains("\"end\"") { x - width } else { x };
            assert!(
                left >= FRAME[0] && left + width <= FRAME[2] && y - 10.0 >= FRAME[1] && y <= FRAME[3],
                "{tag}"
            );
            let inside = |[px, py]: [f64; 2]| {
                (left..=left + width).contains(&px) && (y - 10.0..=y + 2.0).contains(&py)
            };
            let crossed = lines
                .iter()
                .flat_map(|line| line.windows(2))
                .any(|ends| along([ends[0], ends[1]]).any(inside));
            assert!(!crossed, "a curve runs through {tag}");
        }
    }
}
