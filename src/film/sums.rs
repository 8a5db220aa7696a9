//! Sums over passes: mean and standard error of every pixel and of the whole picture.

use crate::film::header::Header;
use crate::film::image::Image;
use crate::film::layer::Layer;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// What one pass makes of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PassImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// One plane of `width · height` values per accumulated layer, row-major from top left: linear RGB radiance,
    /// or a vector; [`Layer::Depth`] uses `x` only.
    pub planes: Vec<(Layer, Vec<Vec3>)>,
}

/// The sums of all passes so far. Every pass counts alike; passes are independent and identically distributed
/// but for a radius that shrinks, so their spread is the error bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    layers: Vec<Layer>,
    passes: u32,
    /// Per accumulated layer, `Visible` first.
    sums: Vec<(Layer, Vec<DVec3>)>,
    /// Sum of squared deviations from the running mean of `Visible` (Welford), so that nothing is lost to
    /// cancellation when the spread is small beside the mean.
    spread: Vec<DVec3>,
    /// Sums of [`Layer::Bias`] over even and over odd passes: the product of two independent estimates is free of the
    /// noise that their square would add up.
    bias: [Vec<DVec3>; 2],
    /// The same two for the average colour of each pass. Pixels of one pass share photons, so this spread cannot
    /// be had from that of the pixels.
    colour_sum: DVec3,
    colour_spread: DVec3,
}

impl Film {
    /// An empty film, in pixels. `Visible` is always accumulated, asked for or not: it is the picture, and its
    /// spread is the error. `Error` is derived and only decides what a file holds.
    pub fn new(width: u32, height: u32, layers: &[Layer]) -> Self {
        let mut all = vec![Layer::Visible];
        for &layer in layers {
            if !all.contains(&layer) {
                all.push(layer);
            }
        }
        let pixels = width as usize * height as usize;
        let accumulated = all.iter().filter(|&&layer| !matches!(layer, Layer::Error | Layer::Bias));
        Self {
            width,
            height,
            passes: 0,
            sums: accumulated.map(|&layer| (layer, vec![DVec3::ZERO; pixels])).collect(),
            spread: vec![DVec3::ZERO; pixels],
            bias: [vec![DVec3::ZERO; pixels], vec![DVec3::ZERO; pixels]],
            colour_sum: DVec3::ZERO,
            colour_spread: DVec3::ZERO,
            layers: all,
        }
    }

    /// What a film takes in memory: sums of each accumulated layer, the spread, two sums of the bias.
    pub fn bytes(width: u32, height: u32, layers: &[Layer]) -> usize {
        let summed = |layer: &&Layer| !matches!(layer, Layer::Visible | Layer::Error | Layer::Bias);
        let planes = 1 + layers.iter().filter(summed).count() + 1 + 2;
        planes * width as usize * height as usize * size_of::<DVec3>()
    }

    /// Pixels per row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The layers of the file, `Visible` first, then in the order asked for.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The layers a [`PassImage`] must bring: all but `Error`, and `Bias`, which it may bring.
    pub fn accumulated(&self) -> impl Iterator<Item = Layer> + '_ {
        self.sums.iter().map(|(layer, _)| *layer)
    }

    /// The number of passes added.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// Adds one pass. Planes of layers the film does not have are passed over.
    ///
    /// # Panics
    /// When the size differs or an accumulated layer is missing: that is a bug of the caller.
    pub fn add(&mut self, pass: &PassImage) {
        assert_eq!((pass.width, pass.height), (self.width, self.height), "a pass of another size");
        let row = self.width.max(1) as usize;
        let before = f64::from(self.passes);
        for (layer, sums) in &mut self.sums {
            let plane = pass.planes.iter().find(|(l, _)| l == layer).map(|(_, plane)| plane);
            let plane = plane.unwrap_or_else(|| panic!("a pass without its {layer} layer"));
            assert_eq!(plane.len(), sums.len(), "a {layer} plane of another size");
            if *layer == Layer::Visible {
                let rows = sums.par_chunks_mut(row).zip(self.spread.par_chunks_mut(row));
                let totals: Vec<DVec3> = rows
                    .zip(plane.par_chunks(row))
                    .map(|((sums, spread), plane)| add_visible(sums, spread, plane, before))
                    .collect();
                let colour = totals.iter().sum::<DVec3>() / (plane.len().max(1) as f64);
                add_one(&mut self.colour_sum, &mut self.colour_spread, colour, before);
            } else {
                sums.par_chunks_mut(row).zip(plane.par_chunks(row)).for_each(|(sums, plane)| {
                    for (sum, value) in sums.iter_mut().zip(plane) {
                        *sum += value.as_dvec3();
                    }
                });
            }
        }
        if let Some((_, plane)) = pass.planes.iter().find(|(layer, _)| *layer == Layer::Bias) {
            let sums = &mut self.bias[self.passes as usize % 2];
            sums.par_iter_mut().zip(plane).for_each(|(sum, value)| *sum += value.as_dvec3());
        }
        self.passes += 1;
    }

    /// The mean over passes of an accumulated layer (`Error`: [`Film::standard_error`]), row-major from top left;
    /// black before the first pass.
    ///
    /// # Panics
    /// When the film does not have the layer.
    pub fn mean(&self, layer: Layer) -> Vec<Vec3> {
        if layer == Layer::Error {
            return self.standard_error();
        }
        if layer == Layer::Bias {
            let passes = f64::from(self.passes.max(1));
            let sums = self.bias[0].par_iter().zip(&self.bias[1]);
            return sums.map(|(even, odd)| ((even + odd) / passes).as_vec3()).collect();
        }
        let sums = self.sums.iter().find(|(l, _)| *l == layer).map(|(_, sums)| sums);
        let sums = sums.unwrap_or_else(|| panic!("a film without its {layer} layer"));
        let passes = f64::from(self.passes.max(1));
        sums.par_iter().map(|sum| (sum / passes).as_vec3()).collect()
    }

    /// The standard error of the mean of `Visible`, per pixel and channel, in its unit. Below two passes nothing
    /// is known of it, which reads `f32::INFINITY`.
    pub fn standard_error(&self) -> Vec<Vec3> {
        if self.passes < 2 {
            return vec![Vec3::INFINITY; self.spread.len()];
        }
        let scale = self.variance_scale();
        self.spread.par_iter().map(|spread| dvec3_sqrt(spread * scale).as_vec3()).collect()
    }

    /// The expected root of relMSE: √(mean over pixels and channels of se²/(mean² + 0.01²)). None below two passes.
    pub fn relative_error(&self) -> Option<f64> {
        if self.passes < 2 {
            return None;
        }
        let (scale, passes) = (self.variance_scale(), f64::from(self.passes));
        let row = self.width.max(1) as usize;
        let rows: Vec<f64> = self.sums[0]
            .1
            .par_chunks(row)
            .zip(self.spread.par_chunks(row))
            .map(|(sums, spread)| {
                let pixels = sums.iter().zip(spread);
                pixels
                    .map(|(sum, spread)| {
                        let mean = sum / passes;
                        (spread * scale / (mean * mean + DVec3::splat(1e-4))).element_sum()
                    })
                    .sum()
            })
            .collect();
        Some((rows.iter().sum::<f64>() / (3.0 * self.spread.len() as f64)).sqrt())
    }

    /// The estimated bias on the scale of [`relative_error`](Self::relative_error): the root of the mean over pixels and
    /// channels of bias² / (mean² + 0.01²). Zero where noise hides it. None below two passes.
    pub fn relative_bias(&self) -> Option<f64> {
        if self.passes < 2 {
            return None;
        }
        let passes = f64::from(self.passes);
        let (even, odd) = (f64::from(self.passes.div_ceil(2)), f64::from(self.passes / 2));
        let sum: f64 = self.sums[0]
            .1
            .iter()
            .zip(self.bias[0].iter().zip(&self.bias[1]))
            .map(|(sum, (a, b))| {
                let mean = sum / passes;
                ((*a / even) * (*b / odd) / (mean * mean + DVec3::splat(1e-4))).element_sum()
            })
            .sum();
        Some((sum / (3.0 * self.spread.len() as f64)).max(0.0).sqrt())
    }

    /// The average colour of the picture, linear RGB.
    pub fn mean_colour(&self) -> DVec3 {
        self.colour_sum / f64::from(self.passes.max(1))
    }

    /// The standard error of [`Film::mean_colour`], from the averages of the single passes and therefore right
    /// also where pixels share photons. None below two passes.
    pub fn mean_colour_error(&self) -> Option<DVec3> {
        (self.passes >= 2).then(|| dvec3_sqrt(self.colour_spread * self.variance_scale()))
    }

    /// Adds all passes of another film of the same size and layers, as if they had been added one by one.
    ///
    /// # Panics
    /// When size or layers differ.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!((self.width, self.height), (other.width, other.height), "a film of another size");
        assert_eq!(self.layers, other.layers, "a film of other layers");
        if other.passes == 0 {
            return;
        }
        let (a, b) = (f64::from(self.passes), f64::from(other.passes));
        let visible = self.sums[0].1.par_iter().zip(&other.sums[0].1);
        self.spread.par_iter_mut().zip(&other.spread).zip(visible).for_each(
            |((to, from), (ours, theirs))| {
                *to = merged_spread(*to, *from, *ours, *theirs, a, b);
            },
        );
        self.colour_spread =
            merged_spread(self.colour_spread, other.colour_spread, self.colour_sum, other.colour_sum, a, b);
        self.colour_sum += other.colour_sum;
        for ((_, to), (_, from)) in self.sums.iter_mut().zip(&other.sums) {
            to.par_iter_mut().zip(from).for_each(|(to, from)| *to += *from);
        }
        // Which passes are called even does not matter, as long as the two halves are apart.
        for (k, from) in other.bias.iter().enumerate() {
            let to = &mut self.bias[(self.passes as usize + k) % 2];
            to.par_iter_mut().zip(from).for_each(|(to, from)| *to += *from);
        }
        self.passes += other.passes;
    }

    /// The picture as a file holds it: the mean of every layer, and facts.
    pub fn image(&self, header: &Header) -> Image {
        let layers = self.layers.iter().map(|&layer| (layer.name().into(), self.mean(layer))).collect();
        Image { width: self.width, height: self.height, layers, header: header.clone() }
    }

    /// What turns a sum of squared deviations into the variance of the mean.
    fn variance_scale(&self) -> f64 {
        let n = f64::from(self.passes);
        1.0 / (n * (n - 1.0))
    }
}

/// Adds a row and returns its sum.
fn add_visible(sums: &mut [DVec3], spread: &mut [DVec3], plane: &[Vec3], before: f64) -> DVec3 {
    let mut total = DVec3::ZERO;
    for ((sum, spread), value) in sums.iter_mut().zip(spread).zip(plane) {
        add_one(sum, spread, value.as_dvec3(), before);
        total += value.as_dvec3();
    }
    total
}

/// One step of Welford's sum: `before` values are in already.
fn add_one(sum: &mut DVec3, spread: &mut DVec3, value: DVec3, before: f64) {
    if before > 0.0 {
        let away = value - *sum / before;
        *spread += away * away * (before / (before + 1.0));
    }
    *sum += value;
}

/// Chan, Golub & LeVeque 1979: the spread of two sets together, from their spreads, sums and counts (`b` > 0).
fn merged_spread(spread_a: DVec3, spread_b: DVec3, sum_a: DVec3, sum_b: DVec3, a: f64, b: f64) -> DVec3 {
    if a == 0.0 {
        return spread_b;
    }
    let apart = sum_b / b - sum_a / a;
    spread_a + spread_b + apart * apart * (a * b / (a + b))
}

fn dvec3_sqrt(v: DVec3) -> DVec3 {
    DVec3::new(v.x.sqrt(), v.y.sqrt(), v.z.sqrt())
}
