//! What the eye sees of a picture from its distance: how it blurs colours, and which edges and points it notices.

use super::colour::{opponent, perceived};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// A display of 3,840 pixels seen from as far away as it is wide: 67.02.
const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// What is seen of a picture.
pub struct Seen {
    /// [`perceived`] colours after the blur of the eye.
    pub colours: Vec<Vec3>,
    /// How much of an edge and of a point there is.
    pub features: Vec<Vec2>,
}

/// The eye as filters, each along rows and then along columns.
pub struct Eye {
    luminance: Kernel,
    red_green: Kernel,
    /// A sum of two, with their weights.
    yellow_blue: [(f32, Kernel); 2],
    smooth: Kernel,
    slope: Kernel,
    curvature: Kernel,
}

impl Eye {
    pub fn new() -> Self {
        // Amplitudes and widths of the contrast sensitivity of yellow against blue.
        let terms = [(34.1, 0.04), (13.5, 0.025)];
        let volumes = terms.map(|(a, b)| a * (PI / b).sqrt() * sensitivity(b).iter().sum::<f64>().powi(2));
        let weight = |i: usize| (volumes[i] / (volumes[0] + volumes[1])) as f32;
        let blur = |b| Kernel::averaging(&sensitivity(b));
        let [smooth, slope, curvature] = features();
        Self {
            luminance: blur(0.0047),
            red_green: blur(0.0053),
            yellow_blue: [(weight(0), blur(terms[0].1)), (weight(1), blur(terms[1].1))],
            smooth: Kernel::averaging(&smooth),
            slope: Kernel::differing(&slope),
            curvature: Kernel::differing(&curvature),
        }
    }

    /// Of a picture in linear sRGB, each channel in [0, 1].
    pub fn sees(&self, width: usize, picture: &[Vec3]) -> Seen {
        let colours: Vec<Vec3> = picture.par_iter().map(|rgb| opponent(*rgb)).collect();
        let plane = |channel: usize| colours.par_iter().map(|colour| colour[channel]).collect::<Vec<f32>>();
        let luminance = plane(0);
        Seen {
            colours: self.blurred(width, &luminance, &plane(1), &plane(2)),
            features: self.features(width, &luminance),
        }
    }

    fn blurred(&self, width: usize, luminance: &[f32], red_green: &[f32], yellow_blue: &[f32]) -> Vec<Vec3> {
        let luminance = filtered(width, luminance, &self.luminance, &self.luminance);
        let red_green = filtered(width, red_green, &self.red_green, &self.red_green);
        let [wide, narrow] = self.yellow_blue.each_ref().map(|(weight, kernel)| {
            let plane = filtered(width, yellow_blue, kernel, kernel);
            (*weight, plane)
        });
        let colour = |i: usize| {
            perceived(Vec3::new(luminance[i], red_green[i], wide.0 * wide.1[i] + narrow.0 * narrow.1[i]))
        };
        (0..luminance.len()).into_par_iter().map(colour).collect()
    }

    fn features(&self, width: usize, luminance: &[f32]) -> Vec<Vec2> {
        let [edge, point] = [&self.slope, &self.curvature].map(|kernel| {
            let along_x = filtered(width, luminance, kernel, &self.smooth);
            let along_y = filtered(width, luminance, &self.smooth, kernel);
            along_x.into_par_iter().zip(along_y).map(|(x, y)| x.hypot(y)).collect::<Vec<f32>>()
        });
        edge.into_par_iter().zip(point).map(Vec2::from).collect()
    }
}

/// Contrast sensitivity as a blur, exp(−π²x²/b) over the pixels about one, x in degrees. All are as long as the widest,
/// of b = 0.04, needs for three standard deviations.
fn sensitivity(b: f64) -> Vec<f64> {
    let deviation = (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE;
    let value = |i: f64| (-(PI * i / PIXELS_PER_DEGREE).powi(2) / b).exp();
    offsets(3.0 * deviation).map(value).collect()
}

/// A Gaussian of two standard deviations in the width w = 0.082 degrees of a feature, its slope and its curvature.
fn features() -> [Vec<f64>; 3] {
    let deviation = 0.5 * 0.082 * PIXELS_PER_DEGREE;
    let gauss = |i: f64| (-0.5 * (i / deviation).powi(2)).exp();
    let over = || offsets(3.0 * deviation);
    [
        over().map(gauss).collect(),
        over().map(|i| -i * gauss(i)).collect(),
        over().map(|i| ((i / deviation).powi(2) - 1.0) * gauss(i)).collect(),
    ]
}

/// Pixels from one to those around it.
fn offsets(radius: f64) -> impl Iterator<Item = f64> {
    let radius = radius.ceil() as i32;
    (-radius..=radius).map(f64::from)
}

/// The weights of the pixels about one, itself in the middle.
struct Kernel(Vec<f32>);

impl Kernel {
    /// Weights that sum to one.
    fn averaging(values: &[f64]) -> Self {
        let sum: f64 = values.iter().sum();
        Self(values.iter().map(|value| (value / sum) as f32).collect())
    }

    /// Positive weights that sum to one, and negative ones that sum to minus one.
    fn differing(values: &[f64]) -> Self {
        let above: f64 = values.iter().filter(|&&value| value > 0.0).sum();
        let below: f64 = values.iter().filter(|&&value| value < 0.0).sum();
        let weight = |value: &f64| if *value > 0.0 { value / above } else { -value / below };
        Self(values.iter().map(|value| weight(value) as f32).collect())
    }
}

/// A plane filtered along rows by one kernel and along columns by another. Beyond the border is what is at the border.
fn filtered(width: usize, plane: &[f32], along_rows: &Kernel, along_columns: &Kernel) -> Vec<f32> {
    columns_filtered(width, &rows_filtered(width, plane, along_rows), along_columns)
}

fn rows_filtered(width: usize, plane: &[f32], kernel: &Kernel) -> Vec<f32> {
    let mut filtered = vec![0.0; plane.len()];
    let radius = kernel.0.len() / 2;
    let rows = filtered.par_chunks_mut(width).zip(plane.par_chunks(width));
    rows.for_each_init(Vec::new, |padded: &mut Vec<f32>, (filtered, row)| {
        padded.clear();
        padded.extend(std::iter::repeat_n(row[0], radius));
        padded.extend(row);
        padded.extend(std::iter::repeat_n(row[width - 1], radius));
        for (i, weight) in kernel.0.iter().enumerate() {
            add(filtered, *weight, &padded[i..]);
        }
    });
    filtered
}

fn columns_filtered(width: usize, plane: &[f32], kernel: &Kernel) -> Vec<f32> {
    let mut filtered = vec![0.0; plane.len()];
    let (radius, last) = (kernel.0.len() / 2, plane.len() / width - 1);
    filtered.par_chunks_mut(width).enumerate().for_each(|(y, filtered)| {
        for (i, weight) in kernel.0.iter().enumerate() {
            let from = (y + i).saturating_sub(radius).min(last) * width;
            add(filtered, *weight, &plane[from..from + width]);
        }
    });
    filtered
}

fn add(sums: &mut [f32], weight: f32, values: &[f32]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_pictures_stay_as_they_are_and_show_no_features() {
        let seen = Eye::new().sees(5, &[Vec3::new(0.2, 0.5, 0.7); 15]);
        let colour = perceived(opponent(Vec3::new(0.2, 0.5, 0.7)));
        assert!(seen.colours.iter().all(|seen| seen.abs_diff_eq(colour, 1e-3)), "{:?}", seen.colours);
        assert!(seen.features.iter().all(|seen| seen.length() < 1e-6), "{:?}", seen.features);
    }

    #[test]
    fn an_edge_is_an_edge_and_a_point_a_point_in_either_direction() {
        let side = 41;
        let picture = |lit: &dyn Fn(usize, usize) -> bool| -> Vec<Vec3> {
            (0..side * side).map(|i| if lit(i % side, i / side) { Vec3::ONE } else { Vec3::ZERO }).collect()
        };
        let middle = |lit: &dyn Fn(usize, usize) -> bool| {
            Eye::new().sees(side, &picture(lit)).features[20 * side + 20]
        };
        let (across, down) = (middle(&|x, _| x > 20), middle(&|_, y| y > 20));
        assert!((across.x - 1.0).abs() < 1e-5 && across.abs_diff_eq(down, 1e-5), "{across} {down}");
        let point = middle(&|x, y| x == 20 && y == 20);
        assert!(point.x < 1e-6 && point.y > 0.0, "{point}");
    }
}
