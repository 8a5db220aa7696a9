//! An atlas as layers of an EXR file, and back.
//!
//! `atlas.N.M` is the light of the stored powers sᴺ tᴹ, `atlas_error.I.J` the standard error at one point of the grid.
//! Layers without light are left out. Mantissas are rounded to 11 bits, as in a half (errors: to 6), far below the noise.
//! Layers whose exponents fit into a half are stored as halves.

use super::errors::{GRID, POINTS};
use super::frontier::{Frontier, Sample};
use super::nodes::Nodes;
use super::{Atlas, AtlasErrors};
use crate::error::{Error, Result};
use crate::film::{Header, Image, Layer, Line, Value, WrittenLayer, line_of};
use glam::{DVec3, Vec3};
use std::fmt::Write;
use std::path::Path;

/// Bits that are kept behind the leading one.
const LIGHT_BITS: u32 = 10;
/// The same for errors.
const ERROR_BITS: u32 = 5;

impl Atlas {
    /// Its layers, as they are written.
    pub fn layers(&self) -> Vec<WrittenLayer<'_>> {
        let planes = self.planes.iter().map(|plane| Plane::of(plane));
        self.named(planes, self.errors.iter().flat_map(|errors| &errors.planes).map(|plane| Plane::of(plane)))
    }

    /// Layers from what stands in [`planes`](Self::planes) and in [`AtlasErrors::planes`].
    pub(super) fn named<'a>(
        &self,
        planes: impl Iterator<Item = Plane<'a>>,
        errors: impl Iterator<Item = Plane<'a>>,
    ) -> Vec<WrittenLayer<'a>> {
        let light = planes.enumerate().filter(|(_, plane)| !plane.is_dark()).map(|(bin, plane)| {
            let (n, m) = (self.n.powers()[bin / self.m.len()], self.m.powers()[bin % self.m.len()]);
            plane.written(format!("atlas.{n}.{m}"), LIGHT_BITS)
        });
        let errors = errors.enumerate().map(|(point, plane)| {
            plane.written(format!("atlas_error.{}.{}", point / GRID.len(), point % GRID.len()), ERROR_BITS)
        });
        light.chain(errors).collect()
    }

    /// Adds what makes a picture out of the layers.
    pub fn describe_in(&self, header: &mut Header) {
        header.set("atlas_n", list(self.n.powers()));
        header.set("atlas_m", list(self.m.powers()));
        header.set("atlas_cut", u32::from(self.cut));
        header.set("atlas_groups", self.groups);
        let beyond = if self.cut { "left out" } else { "counted as so many" };
        header.set(
            "atlas_rule",
            format!(
                "L(s, t) = sum of s^N t^M times layer atlas.N.M; powers between those stored are shared out among \
                 the nearest six; more than {} reflections are {beyond}, more than {} crossings counted as so many",
                self.n.last(),
                self.m.last()
            ),
        );
        let kappa = self.frontier.samples().iter().fold(String::new(), |mut text, sample| {
            let _ = write!(text, "{} {} {};", sample.t, sample.kappa, sample.error);
            text
        });
        header.set("atlas_kappa", kappa);
        if let Some(errors) = &self.errors {
            let colour = errors.colour.iter().fold(String::new(), |mut text, error| {
                let _ = write!(text, "{:e} {:e} {:e};", error.x, error.y, error.z);
                text
            });
            header.set("atlas_colour_error", colour);
        }
    }

    /// The atlas of a file that was written by `render --atlas`.
    ///
    /// # Errors
    /// A file that cannot be read or holds no atlas; one line that says so.
    pub fn read(path: &Path) -> Result<(Self, Header)> {
        let image = crate::film::read_exr(path)?;
        let atlas = Self::from_image(&image);
        let atlas = atlas.map_err(|reason| Error::Image { path: path.into(), reason })?;
        Ok((atlas, image.header))
    }

    /// The atlas among the layers of a picture.
    ///
    /// # Errors
    /// What is missing or malformed, and the way out.
    pub fn from_image(image: &Image) -> std::result::Result<Self, String> {
        let fact = |name: &str| match image.header.get(name) {
            Some(Value::Text(text)) => Some(text.as_str()),
            _ => None,
        };
        if fact("atlas_n").is_none() {
            return Err("holds no atlas; make one with `halflight render SCENE --atlas`".into());
        }
        let damaged = |what: &str| format!("its {what} is damaged; make the atlas again");
        let nodes = |name: &str| {
            let powers: Option<Vec<u8>> = fact(name)?.split_whitespace().map(|p| p.parse().ok()).collect();
            Nodes::from_powers(powers?)
        };
        let n = nodes("atlas_n").ok_or_else(|| damaged("atlas_n"))?;
        let m = nodes("atlas_m").ok_or_else(|| damaged("atlas_m"))?;
        let frontier = fact("atlas_kappa").and_then(rows).and_then(|rows| {
            Frontier::from_samples(
                rows.into_iter().map(|[t, kappa, error]| Sample { t, kappa, error }).collect(),
            )
        });
        let frontier = frontier.ok_or_else(|| damaged("atlas_kappa"))?;
        let integer = |name: &str| image.header.get(name).and_then(Value::as_integer);
        let cut = integer("atlas_cut").ok_or_else(|| damaged("atlas_cut"))? != 0;
        let passes =
            integer("passes").and_then(|n| u32::try_from(n).ok()).ok_or_else(|| damaged("passes"))?;
        // Absent where every pass was a sample of its own.
        let groups = match integer("atlas_groups") {
            None => passes,
            Some(n) => u32::try_from(n).ok().ok_or_else(|| damaged("atlas_groups"))?,
        };
        let plane = |name: String| image.layer(&name).map(<[Vec3]>::to_vec);
        let planes = n
            .powers()
            .iter()
            .flat_map(|n| m.powers().iter().map(move |m| format!("atlas.{n}.{m}")))
            .map(|name| plane(name).unwrap_or_default())
            .collect();
        let errors = match fact("atlas_colour_error") {
            None => None,
            Some(text) => {
                let colour: Option<[DVec3; POINTS]> = rows(text)
                    .map(|rows| rows.into_iter().map(DVec3::from_array).collect::<Vec<_>>())
                    .and_then(|rows| rows.try_into().ok());
                let planes: Option<Vec<_>> = (0..POINTS)
                    .map(|point| plane(format!("atlas_error.{}.{}", point / GRID.len(), point % GRID.len())))
                    .collect();
                let (Some(colour), Some(planes)) = (colour, planes) else {
                    return Err(damaged("error bar"));
                };
                Some(AtlasErrors { planes, colour })
            }
        };
        let (width, height) = (image.width, image.height);
        Ok(Self { width, height, passes, groups, n, m, cut, frontier, planes, errors })
    }
}

fn list(powers: &[u8]) -> String {
    powers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// Rows of three numbers, each ended by a semicolon.
fn rows(text: &str) -> Option<Vec<[f64; 3]>> {
    let row = |row: &str| {
        let numbers: Option<Vec<f64>> = row.split_whitespace().map(|x| x.parse().ok()).collect();
        numbers?.try_into().ok()
    };
    text.split_terminator(';').map(row).collect()
}

/// A picture to be written.
pub(super) struct Plane<'a> {
    /// The mean of its magnitudes.
    pub mean: f64,
    /// The largest.
    pub most: f32,
    pub line: Line<'a>,
}

impl<'a> Plane<'a> {
    fn of(values: &'a [Vec3]) -> Self {
        let (sum, most) = values.iter().fold((0.0, 0.0_f32), |(sum, most), value| {
            let value = value.abs();
            (sum + f64::from(value.element_sum()), most.max(value.max_element()))
        });
        Self { mean: sum / (3.0 * values.len().max(1) as f64), most, line: line_of(values) }
    }

    /// With rounded mantissas.
    fn written(self, name: String, bits: u32) -> WrittenLayer<'a> {
        let half = self.suits_half();
        let line: Line<'a> = Box::new(move |y, axis, line| {
            (self.line)(y, axis, line);
            line.iter_mut().for_each(|x| *x = round_mantissa(*x, bits));
        });
        WrittenLayer { name, half, components: Layer::Visible.components(), line }
    }

    /// True where there is no light: what is not a number is not none.
    pub fn is_dark(&self) -> bool {
        self.mean == 0.0
    }

    /// True where the exponents of halves reach: what they round off beyond the mantissas is below 2⁻¹¹ of the plane's mean.
    fn suits_half(&self) -> bool {
        self.most <= LARGEST_HALF && self.mean >= f64::from(SMALLEST_HALF)
    }
}

/// The smallest normal half.
const SMALLEST_HALF: f32 = 6.103_515_6e-5;
/// The largest.
const LARGEST_HALF: f32 = 65_504.0;

/// To nearest, with so many bits behind the leading one. What is not finite stays as it is.
fn round_mantissa(x: f32, bits: u32) -> f32 {
    let dropped = 23 - bits;
    let half = 1_u32 << (dropped - 1);
    let rounded = f32::from_bits((x.to_bits() + half) & !((1 << dropped) - 1));
    if x.is_finite() && rounded.is_finite() { rounded } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_to_nearest() {
        for x in [1.0_f32, 0.3, -7.7, 1e-30, 3e38, 0.0, f32::MAX] {
            let off = (round_mantissa(x, LIGHT_BITS) - x).abs();
            assert!(off <= x.abs() * 2_f32.powi(-11) * 1.0001, "{x}");
        }
        for bits in [0x7f80_0000, 0xff80_0000, 0x7fc0_0000, 0x7fff_ffff] {
            assert_eq!(round_mantissa(f32::from_bits(bits), LIGHT_BITS).to_bits(), bits);
        }
    }

    #[test]
    fn halves_hold_what_they_can() {
        let plane = |x: f32| vec![Vec3::splat(x); 5];
        for (x, suits) in [(1.0, true), (7e-5, true), (5e-5, false), (6e4, true), (7e4, false), (0.0, false)]
        {
            assert_eq!(Plane::of(&plane(x)).suits_half(), suits, "{x}");
        }
        let mut planes = [plane(0.0), plane(0.0), plane(1e-44)];
        planes[1][3].y = f32::NAN;
        assert_eq!(planes.each_ref().map(|plane| Plane::of(plane).is_dark()), [true, false, false]);
        assert!(!Plane::of(&planes[1]).suits_half());
    }

    #[test]
    fn an_atlas_comes_back_from_its_picture() {
        let pixels = 6;
        let plane = |k: usize| (0..pixels).map(|i| Vec3::splat((k * pixels + i) as f32)).collect::<Vec<_>>();
        let (n, m) = (Nodes::up_to(3), Nodes::up_to(2));
        let mut planes: Vec<_> = (1..=n.len() * m.len()).map(plane).collect();
        planes[2] = Vec::new();
        let samples = vec![Sample { t: 1.0, kappa: 0.7, error: 0.01 }];
        let errors = AtlasErrors {
            planes: (0..POINTS).map(|k| plane(k % 8)).collect(), // six bits hold these numbers
            colour: std::array::from_fn(|i| DVec3::splat(0.1 * i as f64)),
        };
        let atlas = Atlas {
            width: 3,
            height: 2,
            passes: 8,
            groups: 5,
            n,
            m,
            cut: true,
            frontier: Frontier::from_samples(samples).expect("one sample"),
            planes,
            errors: Some(errors),
        };
        let header = Header::new().with("passes", 8_u32);
        let mut image = Image { width: 3, height: 2, layers: Vec::new(), header };
        atlas.describe_in(&mut image.header);
        for WrittenLayer { name, line, .. } in atlas.layers() {
            let mut axes = [[0.0; 6]; 3];
            for (axis, rows) in axes.iter_mut().enumerate() {
                rows.chunks_mut(3).enumerate().for_each(|(y, row)| line(y, axis, row));
            }
            let [x, y, z] = axes;
            image.layers.push((name, (0..pixels).map(|i| Vec3::new(x[i], y[i], z[i])).collect()));
        }
        assert_eq!(Atlas::from_image(&image), Ok(atlas));
        // Written when every pass was a sample.
        image.header.entries.retain(|(name, _)| name != "atlas_groups");
        assert_eq!(Atlas::from_image(&image).expect("older").groups, 8);
        image.header.set("atlas_groups", -1_i64);
        assert!(Atlas::from_image(&image).expect_err("damaged").contains("atlas_groups"));
        image.header.set("atlas_groups", 5_u32);
        image.header.set("atlas_kappa", "nonsense");
        assert!(Atlas::from_image(&image).expect_err("damaged").contains("atlas_kappa"));
    }
}
