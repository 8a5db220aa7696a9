//! How `halflight diff` prints its results.

use crate::cli::diff::{LayerReport, Report};
use crate::cli::escape::line;
use crate::film::Layer;

impl Report {
    /// An aligned table, then one line for everything that needs saying.
    pub fn text(&self) -> String {
        let mut rows = vec![header(self)];
        rows.extend(self.layers.iter().map(|layer| row(self, layer)));
        let pixels = self.width as usize * self.height as usize;
        let mut text = format!(
            "{} against {}, {} x {} pixels\n",
            line(&self.picture.display().to_string()),
            line(&self.reference.display().to_string()),
            self.width,
            self.height
        );
        if let (Some(mask), Some(layer)) = (&self.mask, self.layers.first()) {
            text += &format!("left out: {} of {pixels} pixels ({mask})\n", layer.metrics.masked);
        }
        text += &aligned(&rows);
        for layer in self.layers.iter().filter(|layer| layer.metrics.not_finite > 0) {
            let (name, m) = (line(&layer.layer), &layer.metrics);
            text += &format!(
                "{name}: pixels not finite, and in no figure: {}; of these not the same in both: {}\n",
                m.not_finite, m.not_finite_apart
            );
        }
        for exceeded in &self.exceeded {
            text += &format!("exceeded: {}\n", line(exceeded));
        }
        text
    }

    /// The same as one JSON object.
    pub fn json(&self) -> String {
        let mut text =
            serde_json::to_string_pretty(self).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"));
        text.push('\n');
        text
    }

    fn has_hdr(&self) -> bool {
        self.layers.iter().any(|layer| layer.hdr_flip.is_some())
    }
}

fn header(report: &Report) -> Vec<String> {
    let mut names =
        vec!["layer", "RMSE", "relMSE", "bias", "bias %", "e_pixel", "(max)", "mean colour", "FLIP"];
    if report.has_hdr() {
        names.push("HDR-FLIP");
    }
    names.into_iter().map(String::from).collect()
}

fn row(report: &Report, layer: &LayerReport) -> Vec<String> {
    let m = &layer.metrics;
    let maybe = |x: Option<f64>| x.map_or_else(|| "-".into(), number);
    let shown = |x: f64| if layer.flip.is_some() { number(x) } else { "-".into() };
    let mut cells = vec![
        line(&layer.layer).into_owned(),
        number(m.rmse),
        number(m.relmse),
        number(m.bias),
        maybe(m.relative_bias.map(|b| 100.0 * b)),
        shown(m.e_pixel),
        shown(m.e_pixel_max),
        shown(m.mean_colour),
        maybe(layer.flip),
    ];
    if report.has_hdr() {
        cells.push(maybe(layer.hdr_flip));
    }
    cells
}

/// Names to the left, numbers to the right.
fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let name = widths[0].max(Layer::Invisible.name().len());
        text += &format!("{:<name$}", row[0]);
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            text += &format!("  {cell:>width$}");
        }
        text.push('\n');
    }
    text
}

/// Four significant digits, without an exponent where that is readable.
pub(super) fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".into()
    } else if (1e-4..1e5).contains(&size) {
        let digits = (3 - size.log10().floor() as i32).max(0) as usize;
        format!("{x:.digits$}")
    } else {
        format!("{x:.3e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_four_digits() {
        let cases =
            [(0.0, "0"), (0.012345, "0.01235"), (-1.5, "-1.500"), (12345.6, "12346"), (1e-7, "1.000e-7")];
        for (x, expected) in cases {
            assert_eq!(number(x), expected);
        }
    }
}
