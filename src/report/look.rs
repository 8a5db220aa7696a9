//! How curves are told from each other.

use super::data::Curve;
use crate::plan::Method;

/// How a curve is told from others: by its colour and by the shape of its marks.
pub struct Look {
    /// Attributes of its group.
    pub group: String,
    /// For [`marker`].
    pub shape: usize,
}

/// Colours of variants, legible on light and dark.
const COLOURS: [&str; 6] = ["#d1591a", "#3b86c8", "#3f9a4f", "#a761c4", "#b3830f", "#cf4a7c"];

impl Look {
    /// Methods look the same in every comparison, variants as they follow each other.
    pub fn of(curves: &[Curve], name: &str) -> Self {
        if let Some(shape) = Method::ALL.iter().position(|method| method.name() == name) {
            return Self { group: format!("class=\"method {name}\""), shape };
        }
        let shape = curves.iter().position(|curve| curve.method == name).unwrap_or(0);
        let colour = COLOURS[shape % COLOURS.len()];
        Self { group: format!("class=\"method\" style=\"--colour: {colour}\""), shape }
    }
}

/// A shape of its own for each, so that colour is not all that tells them apart.
pub fn marker(shape: usize, x: f64, y: f64) -> String {
    match shape % 5 {
        0 => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.5\"/>"),
        1 => format!("<rect x=\"{:.1}\" y=\"{:.1}\" width=\"8\" height=\"8\"/>", x - 4.0, y - 4.0),
        2 => format!("<path d=\"M{:.1} {:.1}l5 9h-10z\"/>", x, y - 5.5),
        3 => format!("<path d=\"M{:.1} {:.1}l5.5 5.5l-5.5 5.5l-5.5 -5.5z\"/>", x, y - 5.5),
        _ => format!("<path d=\"M{:.1} {:.1}l5 -9h-10z\"/>", x, y + 5.5),
    }
}
