//! Curves of relMSE over time, log-log, as SVG that is legible on a light or dark background.

use super::data::{Comparison, Curve, Interval, SceneReport};
use super::look::{Look, marker};
use std::fmt::Write;

/// Where things stand, in pixels of a figure that is shown at its own size.
struct Layout {
    class: &'static str,
    width: f64,
    height: f64,
    /// Height of the title, which a page leaves out.
    above: f64,
    /// The plot's own rectangle: left, top, right, bottom.
    frame: [f64; 4],
    /// Height of a method's two lines in the legend.
    step: f64,
}

/// Names stand beside the ends of their curves.
const BROAD: Layout = Layout {
    class: "broad",
    width: 760.0,
    height: 460.0,
    above: 30.0,
    frame: [74.0, 66.0, 566.0, 404.0],
    step: 38.0,
};
/// For a phone, where the broad one would have to shrink beyond reading: names stand below.
const NARROW: Layout = Layout {
    class: "narrow",
    width: 340.0,
    height: 330.0,
    above: 30.0,
    frame: [48.0, 72.0, 334.0, 312.0],
    step: 44.0,
};

/// Style of the curves; the page has it too.
pub const STYLE: &str = include_str!("curves.css");

/// All scenes below each other, two in a row where there are more than two.
pub fn svg(comparison: &Comparison) -> String {
    let columns = if comparison.scenes.len() > 2 { 2 } else { 1 };
    let rows = comparison.scenes.len().div_ceil(columns).max(1);
    let (width, height) = (BROAD.width * columns as f64, BROAD.height * rows as f64);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" class=\"curves\" role=\"img\" aria-label=\"relMSE over run time\">\n<style>{STYLE}</style>\n\
         <rect class=\"ground\" width=\"100%\" height=\"100%\"/>\n"
    );
    for (i, scene) in comparison.scenes.iter().enumerate() {
        let (x, y) = (BROAD.width * (i % columns) as f64, BROAD.height * (i / columns) as f64);
        text += &format!("<g transform=\"translate({x} {y})\">\n{}</g>\n", panel(&BROAD, comparison, scene));
    }
    text + "</svg>\n"
}

/// One scene on its own, without style and without the title, which stands above it on a page: broad and narrow, of which
/// the style of the page shows one.
pub fn figure(comparison: &Comparison, scene: &SceneReport) -> String {
    let one = |layout: &Layout| {
        let below =
            if layout.class == "narrow" { 52.0 + layout.step * scene.curves.len() as f64 } else { 0.0 };
        format!(
            "<svg viewBox=\"0 {} {} {}\" class=\"curves {}\" role=\"img\" aria-label=\"relMSE over run time for {}\">\n{}</svg>\n",
            layout.above,
            layout.width,
            layout.height - layout.above + below,
            layout.class,
            escape(&scene.scene),
            panel(layout, comparison, scene)
        )
    };
    one(&BROAD) + &one(&NARROW)
}

/// A logarithmic axis.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// Covers all positive values, with a little room.
    fn over(values: impl Iterator<Item = f64>, from: f64, to: f64, room: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for value in values.filter(|value| value.is_finite() && *value > 0.0) {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            (low, high) = (1.0, 10.0);
        }
        Self { low: low / room, high: high * room, from, to }
    }

    fn place(&self, value: f64) -> f64 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        self.from + (self.to - self.from) * share
    }

    /// Marks within: a value and whether it is labelled (1, 2, 5 where there are few decades, else powers of ten).
    fn ticks(&self) -> Vec<(f64, bool)> {
        let decades = (self.high / self.low).log10();
        let labelled: &[u32] = match decades {
            ..0.7 => &[1, 2, 3, 4, 5, 6, 8],
            ..1.2 => &[1, 2, 3, 5, 7],
            ..2.4 => &[1, 2, 5],
            _ => &[1],
        };
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let marks = (first..=last)
            .flat_map(|power| (1..10_u32).map(move |digit| (digit, f64::from(digit) * 10_f64.powi(power))));
        marks
            .filter(|(_, value)| (self.low..=self.high).contains(value))
            .map(|(digit, value)| (value, labelled.contains(&digit)))
            .collect()
    }
}

fn panel(layout: &Layout, comparison: &Comparison, scene: &SceneReport) -> String {
    let [left, top, right, bottom] = layout.frame;
    let points = || scene.curves.iter().flat_map(|curve| &curve.points);
    let own = scene.reference.own_error.total;
    let x = Axis::over(points().map(|point| point.seconds), left, right, 1.12);
    let y = Axis::over(
        points().flat_map(|point| [point.low, point.high, point.relmse]).chain([own]),
        bottom,
        top,
        1.25,
    );
    let mut text = String::new();
    let _ = writeln!(text, "<text class=\"title\" x=\"{left}\" y=\"26\">{}</text>", escape(&title(scene)));
    notes(&mut text, layout, comparison);
    grid(&mut text, layout, &x, &y);
    if own > 0.0 && own.is_finite() {
        let place = y.place(own);
        let _ = writeln!(
            text,
            "<line class=\"own\" x1=\"{left}\" y1=\"{place:.1}\" x2=\"{right}\" y2=\"{place:.1}\"/>\n\
             <text class=\"note\" x=\"{}\" y=\"{:.1}\">what may be left of the reference’s error</text>",
            left + 8.0,
            place - 6.0
        );
    }
    for curve in &scene.curves {
        draw(&mut text, layout, (curve, &Look::of(&scene.curves, &curve.method)), &x, &y);
    }
    legend(&mut text, layout, &scene.curves, &y);
    text
}

/// What is drawn, above the plot: in one line, or in two where that is too long.
fn notes(text: &mut String, layout: &Layout, comparison: &Comparison) {
    let (seeds, threads) = (comparison.seeds.len(), comparison.threads);
    let what = format!("relMSE, median and 80 % band of {seeds} seeds");
    let s = if threads == 1 { "" } else { "s" };
    let how = format!("{}×{}, {threads} thread{s}", comparison.width, comparison.height);
    let lines = if layout.class == "narrow" { vec![what, how] } else { vec![format!("{what}; {how}")] };
    let left = if layout.class == "narrow" { 2.0 } else { layout.frame[0] };
    for (i, line) in lines.iter().enumerate() {
        let y = 46.0 + 17.0 * i as f64;
        let _ = writeln!(text, "<text class=\"note\" x=\"{left}\" y=\"{y}\">{line}</text>");
    }
}

/// Scene and light in one line.
pub fn title(scene: &SceneReport) -> String {
    let short = |text: &str, most: usize| match text.char_indices().nth(most) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    };
    let name = scene.scene.rsplit(['/', ':']).next().unwrap_or(&scene.scene);
    format!("{}, {}", short(name, 40), short(&scene.illumination, 48))
}

fn grid(text: &mut String, layout: &Layout, x: &Axis, y: &Axis) {
    let [left, top, right, bottom] = layout.frame;
    for (value, labelled) in x.ticks() {
        let (place, class) = (x.place(value), if labelled { "grid" } else { "grid fine" });
        let _ = writeln!(
            text,
            "<line class=\"{class}\" x1=\"{place:.1}\" y1=\"{top}\" x2=\"{place:.1}\" y2=\"{bottom}\"/>"
        );
        if labelled {
            let _ = writeln!(
                text,
                "<text class=\"tick\" text-anchor=\"middle\" x=\"{place:.1}\" y=\"{}\">{}</text>",
                bottom + 18.0,
                plain(value)
            );
        }
    }
    for (value, labelled) in y.ticks() {
        let (place, class) = (y.place(value), if labelled { "grid" } else { "grid fine" });
        let _ = writeln!(
            text,
            "<line class=\"{class}\" x1=\"{left}\" y1=\"{place:.1}\" x2=\"{right}\" y2=\"{place:.1}\"/>"
        );
        if labelled {
            let _ = writeln!(
                text,
                "<text class=\"tick\" text-anchor=\"end\" x=\"{}\" y=\"{:.1}\">{}</text>",
                left - 8.0,
                place + 4.0,
                plain(value)
            );
        }
    }
    let middle = 0.5 * (left + right);
    let _ = writeln!(
        text,
        "<text class=\"axis\" text-anchor=\"middle\" x=\"{middle}\" y=\"{}\">seconds, set-up included</text>\n\
         <rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/>",
        bottom + 40.0,
        right - left,
        bottom - top
    );
}

fn draw(text: &mut String, layout: &Layout, (curve, look): (&Curve, &Look), x: &Axis, y: &Axis) {
    let [_, top, _, bottom] = layout.frame;
    let at = |seconds: f64, error: f64| {
        format!("{:.1},{:.1}", x.place(seconds), y.place(error.max(y.low)).clamp(top, bottom))
    };
    let drawn: Vec<_> =
        curve.points.iter().filter(|point| point.relmse > 0.0 && point.relmse.is_finite()).collect();
    let upper = drawn.iter().map(|point| at(point.seconds, point.high));
    let lower = drawn.iter().rev().map(|point| at(point.seconds, point.low));
    let band: Vec<_> = upper.chain(lower).collect();
    let line: Vec<_> = drawn.iter().map(|point| at(point.seconds, point.relmse)).collect();
    let _ = writeln!(text, "<g {}>", look.group);
    let _ = writeln!(text, "<polygon class=\"band\" points=\"{}\"/>", band.join(" "));
    let _ = writeln!(text, "<polyline class=\"curve\" points=\"{}\"/>", line.join(" "));
    for point in drawn {
        let (cx, cy) = (x.place(point.seconds), y.place(point.relmse));
        let noisy = if point.reference_too_noisy { "; reference too noisy" } else { "" };
        let _ = writeln!(
            text,
            "<g class=\"point{}\">{}<title>{}: {:.2} s, relMSE {:.3e} [{:.3e}, {:.3e}]{noisy}</title></g>",
            if noisy.is_empty() { "" } else { " noisy" },
            marker(look.shape, cx, cy),
            escape(&curve.method),
            point.seconds,
            point.relmse,
            point.low,
            point.high
        );
    }
    *text += "</g>\n";
}

/// Names and slopes: below the plot, or beside the ends of the curves.
fn legend(text: &mut String, layout: &Layout, curves: &[Curve], y: &Axis) {
    let [_, _, right, bottom] = layout.frame;
    let below = |i: usize| bottom + 66.0 + layout.step * i as f64;
    let (x, places) = if layout.class == "narrow" {
        (8.0, curves.iter().enumerate().map(|(i, curve)| (below(i), curve)).collect())
    } else {
        (right + 16.0, beside(layout, curves, y))
    };
    for (place, curve) in places {
        let slope =
            curve.slope.map_or("slope not known".to_owned(), |slope| format!("slope {}", interval(&slope)));
        let look = Look::of(curves, &curve.method);
        let _ = writeln!(
            text,
            "<g {}>{}<text class=\"name\" x=\"{}\" y=\"{:.1}\">{}</text>\
             <text class=\"note\" x=\"{}\" y=\"{:.1}\">{slope}</text></g>",
            look.group,
            marker(look.shape, x, place),
            x + 12.0,
            place + 4.0,
            escape(&curve.method),
            x + 12.0,
            place + 20.0
        );
    }
}

/// The heights at which curves end, moved apart where their names would overlap.
fn beside<'a>(layout: &Layout, curves: &'a [Curve], y: &Axis) -> Vec<(f64, &'a Curve)> {
    let [_, top, _, bottom] = layout.frame;
    let end = |curve: &Curve| {
        let error = curve.points.last().map_or(f64::NAN, |point| point.relmse);
        if error > 0.0 && error.is_finite() { y.place(error) } else { top }
    };
    let mut places: Vec<(f64, &Curve)> = curves.iter().map(|curve| (end(curve), curve)).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    for i in 1..places.len() {
        places[i].0 = places[i].0.max(places[i - 1].0 + layout.step);
    }
    let mut limit = bottom - 16.0;
    for (place, _) in places.iter_mut().rev() {
        *place = place.min(limit);
        limit = *place - layout.step;
    }
    places
}

fn interval(slope: &Interval) -> String {
    let signed = |value: f64| format!("{value:.2}").replace('-', "−");
    format!("{} [{}, {}]", signed(slope.value), signed(slope.low), signed(slope.high))
}

/// A power of ten or a multiple of it, as people write it.
fn plain(value: f64) -> String {
    if (0.001..10_000.0).contains(&value) {
        let digits = (-value.log10().floor()).max(0.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.0e}").replace('-', "−")
    }
}

/// Text for XML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_written_plainly_and_lie_within() {
        assert_eq!([0.002, 0.5, 1.0, 20.0].map(plain), ["0.002", "0.5", "1", "20"]);
        assert_eq!(plain(2e-5), "2e−5");
        let axis = Axis::over([0.9, 70.0].into_iter(), 0.0, 100.0, 1.1);
        let ticks = axis.ticks();
        assert!(ticks.iter().all(|(value, _)| (0.0..=100.0).contains(&axis.place(*value))));
        let labelled: Vec<_> = ticks.iter().filter(|t| t.1).map(|t| plain(t.0)).collect();
        assert_eq!(labelled, ["1", "2", "5", "10", "20", "50"]);
        assert!(axis.place(0.9) > 0.0 && axis.place(70.0) < 100.0);
    }
}
