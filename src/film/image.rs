//! A picture as files hold it: named layers and facts.

use crate::film::header::Header;
use glam::Vec3;

/// A picture of named layers, each row-major from top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Name and `width · height` values: linear RGB, a vector, or one number in `x` and 0 in `y`, `z`. Plain
    /// `R G B` is called `visible`.
    pub layers: Vec<(String, Vec<Vec3>)>,
    /// Facts from the header, names without the `halflight.` prefix.
    pub header: Header,
}

impl Image {
    /// A layer's values by its name.
    pub fn layer(&self, name: &str) -> Option<&[Vec3]> {
        self.layers.iter().find(|(n, _)| n == name).map(|(_, values)| values.as_slice())
    }

    /// The names of the layers, with commas.
    pub fn layer_names(&self) -> String {
        self.layers.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
    }
}
