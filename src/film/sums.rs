//! Sums over passes: mean and standard error of every pixel and of the whole picture.

use crate::film::exact::{Pair, Row, spread};
use crate::film::header::Header;
use crate::film::image::Image;
use crate::film::layer::Layer;
use crate::film::passes::{PassSet, half};
use crate::film::peaks::Peaks;
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
    /// What the error bar and its tests know beside the planes.
    pub asides: Asides,
}

/// What a pass knows of each pixel of `Visible` beside its light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asides {
    /// What one photon more than came would have added; the error bar counts one more than came, so that no place where none did is
    /// taken for certainly dark. None: no photons serve.
    pub one_more: Option<Vec<f32>>,
    /// The brightness (length of R, G, B) of what did not come straight from a luminaire. None: all is taken for that.
    pub scattered: Option<Vec<f32>>,
}

/// The sums of all passes so far. Every pass counts alike; passes are independent and identically distributed
/// but for a radius that shrinks, so their spread is the error bar.
///
/// Sums are exact: the same passes make the same film, however they come together.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    layers: Vec<Layer>,
    passes: PassSet,
    pub(super) sums: Sums,
}

/// By row of the picture, three numbers a pixel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sums {
    /// Per accumulated layer, `Visible` first.
    pub layers: Vec<(Layer, Vec<Row<i64>>)>,
    /// Of `Visible`.
    pub squares: Vec<Row<i128>>,
    /// [`Layer::Bias`] over either [`half`] of the passes: the product of two independent estimates is free of the
    /// noise that their square would add up.
    pub bias: [Vec<Row<i64>>; 2],
    /// The average colour of each pass, and its square. Pixels of one pass share photons, so this spread cannot
    /// be had from that of the pixels.
    pub colour: [Row<i128>; 2],
    /// Maxima and minima, which do not depend on order either.
    pub peaks: Vec<Peaks>,
}

impl Sums {
    fn new(width: u32, height: u32, layers: impl Iterator<Item = Layer>) -> Self {
        let row = 3 * width as usize;
        let plane = || (0..height).map(|_| Row::new(row)).collect::<Vec<_>>();
        Self {
            layers: layers.map(|layer| (layer, plane())).collect(),
            squares: (0..height).map(|_| Row::new(row)).collect(),
            bias: [plane(), plane()],
            colour: [Row::new(3), Row::new(3)],
            peaks: (0..height).map(|_| Peaks::new(width as usize)).collect(),
        }
    }

    /// Adds all of another film of the same size and layers.
    fn add(&mut self, other: &Self) {
        for ((_, to), (_, from)) in self.layers.iter_mut().zip(&other.layers) {
            add_rows(to, from);
        }
        add_rows(&mut self.squares, &other.squares);
        self.bias.iter_mut().zip(&other.bias).for_each(|(to, from)| add_rows(to, from));
        self.colour.iter_mut().zip(&other.colour).for_each(|(to, from)| to.add_row(from));
        self.peaks.iter_mut().zip(&other.peaks).for_each(|(to, from)| to.join(from));
    }

    /// Sums and sums of squares of `Visible`, row by row.
    fn visible(&self) -> impl IndexedParallelIterator<Item = (&Row<i64>, &Row<i128>)> {
        self.layers[0].1.par_iter().zip(&self.squares)
    }
}

fn add_rows<W: crate::film::exact::Whole>(to: &mut [Row<W>], from: &[Row<W>]) {
    to.par_iter_mut().zip(from).for_each(|(to, from)| to.add_row(from));
}

fn add_plane(rows: &mut [Row<i64>], plane: &[Vec3], width: usize) {
    rows.par_iter_mut().zip(plane.par_chunks(width)).for_each(|(row, plane)| {
        for (i, x) in plane.iter().flat_map(Vec3::to_array).enumerate() {
            row.add_f32(i, x);
        }
    });
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
        let accumulated = all.iter().copied().filter(|layer| !matches!(layer, Layer::Error | Layer::Bias));
        let sums = Sums::new(width, height, accumulated);
        Self { width, height, layers: all, passes: PassSet::default(), sums }
    }

    /// What a film takes in memory: sums of each accumulated layer, squares, two sums of the bias.
    pub fn bytes(width: u32, height: u32, layers: &[Layer]) -> usize {
        let summed = |layer: &&Layer| !matches!(layer, Layer::Visible | Layer::Error | Layer::Bias);
        let planes = 1 + layers.iter().filter(summed).count() + 2;
        let number = planes * Row::<i64>::BYTES + Row::<i128>::BYTES;
        (3 * number + Peaks::BYTES) * width as usize * height as usize
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
        self.sums.layers.iter().map(|(layer, _)| *layer)
    }

    /// The number of passes added.
    pub fn passes(&self) -> u32 {
        self.passes.len()
    }

    /// Which passes were added.
    pub fn pass_set(&self) -> &PassSet {
        &self.passes
    }

    /// Adds the pass after the last one.
    ///
    /// # Panics
    /// As [`add_pass`](Self::add_pass) does.
    pub fn add(&mut self, image: &PassImage) {
        self.add_pass(self.passes.end(), image);
    }

    /// Adds a pass by its number. Planes of layers the film does not have are passed over.
    ///
    /// # Panics
    /// When it was added before, the size differs or an accumulated layer is missing: that is a bug of the caller.
    pub fn add_pass(&mut self, pass: u32, image: &PassImage) {
        assert_eq!((image.width, image.height), (self.width, self.height), "a pass of another size");
        assert!(self.passes.insert(pass), "pass {pass} was added before");
        let (pixels, width) = (self.width as usize * self.height as usize, self.width.max(1) as usize);
        let plane_of = |wanted: Layer| image.planes.iter().find(|(layer, _)| *layer == wanted);
        for (layer, rows) in &mut self.sums.layers {
            let (_, plane) = plane_of(*layer).unwrap_or_else(|| panic!("a pass without its {layer} layer"));
            assert_eq!(plane.len(), pixels, "a {layer} plane of another size");
            add_plane(rows, plane, width);
            if *layer == Layer::Visible {
                let rows = self.sums.squares.par_iter_mut().zip(plane.par_chunks(width));
                let totals: Vec<DVec3> = rows.map(|(row, plane)| add_squares(row, plane)).collect();
                if image.asides.scattered.is_none() {
                    let lengths: Vec<f32> = plane.iter().map(|x| x.as_dvec3().length() as f32).collect();
                    let rows = self.sums.peaks.iter_mut().zip(lengths.chunks(width));
                    rows.for_each(|(peaks, lengths)| peaks.meet_scattered(lengths));
                }
                let colour = totals.iter().sum::<DVec3>() / (pixels.max(1) as f64);
                for (channel, x) in colour.to_array().into_iter().enumerate() {
                    self.sums.colour[0].add_average(channel, x, false);
                    self.sums.colour[1].add_average(channel, x, true);
                }
            }
        }
        if let Some((_, plane)) = plane_of(Layer::Bias) {
            add_plane(&mut self.sums.bias[half(pass)], plane, width);
        }
        let Asides { one_more, scattered } = &image.asides;
        for (y, peaks) in self.sums.peaks.iter_mut().enumerate() {
            let row = y * width..(y + 1) * width;
            one_more.iter().for_each(|one_more| peaks.meet_one_more(&one_more[row.clone()]));
            scattered.iter().for_each(|scattered| peaks.meet_scattered(&scattered[row.clone()]));
        }
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
        let passes = f64::from(self.passes().max(1));
        if layer == Layer::Bias {
            let [a, b] = &self.sums.bias;
            let rows = a.par_iter().zip(b);
            return pixels(rows.map(|(a, b)| a.value_of_both(b)), move |sum| sum / passes);
        }
        let rows = self.sums.layers.iter().find(|(l, _)| *l == layer).map(|(_, rows)| rows);
        let rows = rows.unwrap_or_else(|| panic!("a film without its {layer} layer"));
        pixels(rows.par_iter().map(|row| (0..row.len()).map(|i| row.value(i)).collect()), move |sum| {
            sum / passes
        })
    }

    /// The standard error of the mean of `Visible`, per pixel and channel, in its unit. Below two passes nothing
    /// is known of it, which reads `f32::INFINITY`.
    ///
    /// Of photons it counts one more than came: where n arrived in all, the variance is that of n + 1, and where none did, it is what
    /// one would have brought.
    pub fn standard_error(&self) -> Vec<Vec3> {
        if self.passes() < 2 {
            return vec![Vec3::INFINITY; self.width as usize * self.height as usize];
        }
        let rows = (0..self.height as usize).into_par_iter().map(|y| {
            (0..self.width as usize)
                .flat_map(|x| self.channels(y, x).map(|channel| channel.variance))
                .collect()
        });
        pixels(rows, f64::sqrt)
    }

    /// Red, green and blue of a pixel. From two passes on.
    pub(super) fn channels(&self, y: usize, x: usize) -> [Channel; 3] {
        let (sums, squares) = (&self.sums.layers[0].1[y], &self.sums.squares[y]);
        let (scale, n) = (self.variance_scale(), f64::from(self.passes()));
        let one_more = self.sums.peaks[y].one_more(x) / n;
        [3 * x, 3 * x + 1, 3 * x + 2].map(|i| {
            let sum: Pair = sums.pair(i);
            let deviations = spread(sum, squares.pair(i), n);
            Channel { mean: sum.high / n, deviations, variance: deviations * scale + one_more * one_more }
        })
    }

    /// The expected root of relMSE: √(mean over pixels and channels of se²/(mean² + 0.01²)). None below two passes.
    pub fn relative_error(&self) -> Option<f64> {
        self.noise_and_doubt().map(|(noise, _)| noise)
    }

    /// The estimated bias on the scale of [`relative_error`](Self::relative_error): the root of the mean over pixels and
    /// channels of bias² / (mean² + 0.01²). Zero where noise hides it. None as long as all passes are of one [`half`].
    pub fn relative_bias(&self) -> Option<f64> {
        let [a, b] = self.passes.halves().map(f64::from);
        if a == 0.0 || b == 0.0 {
            return None;
        }
        let n = f64::from(self.passes());
        let [first, second] = &self.sums.bias;
        let rows =
            self.sums.visible().zip(first.par_iter().zip(second)).map(|((sums, _), (first, second))| {
                let relative = |i| {
                    let mean = sums.value(i) / n;
                    (first.value(i) / a) * (second.value(i) / b) / (mean * mean + DARK)
                };
                (0..sums.len()).map(relative).sum::<f64>()
            });
        Some(self.mean_over_numbers(rows).max(0.0).sqrt())
    }

    /// The average of what has these sums over rows.
    fn mean_over_numbers(&self, rows: impl IndexedParallelIterator<Item = f64>) -> f64 {
        let rows: Vec<f64> = rows.collect();
        rows.iter().sum::<f64>() / (3.0 * f64::from(self.width) * f64::from(self.height))
    }

    /// The average colour of the picture, linear RGB.
    pub fn mean_colour(&self) -> DVec3 {
        let [sums, _] = &self.sums.colour;
        DVec3::from_array([0, 1, 2].map(|i| sums.value(i))) / f64::from(self.passes().max(1))
    }

    /// The standard error of [`Film::mean_colour`], from the averages of the single passes and therefore right
    /// also where pixels share photons. None below two passes.
    pub fn mean_colour_error(&self) -> Option<DVec3> {
        let ([sums, squares], n) = (&self.sums.colour, f64::from(self.passes()));
        let error = |i| (spread(sums.pair(i), squares.pair(i), n) * self.variance_scale()).sqrt();
        (n >= 2.0).then(|| DVec3::from_array([0, 1, 2].map(error)))
    }

    /// Adds all passes of another film of the same size and layers: the same, bit for bit, as if they had been added one by one.
    ///
    /// # Errors
    /// A pass that is in both; then nothing is added.
    ///
    /// # Panics
    /// When size or layers differ.
    pub fn merge(&mut self, other: &Self) -> Result<(), u32> {
        assert_eq!((self.width, self.height), (other.width, other.height), "a film of another size");
        assert_eq!(self.layers, other.layers, "a film of other layers");
        self.passes.join(&other.passes)?;
        self.sums.add(&other.sums);
        Ok(())
    }

    /// The sums, to which all of `passes` are added by the caller.
    ///
    /// # Errors
    /// A pass that is in the film already; then nothing is changed.
    pub(super) fn joined(&mut self, passes: &PassSet) -> Result<&mut Sums, u32> {
        self.passes.join(passes)?;
        Ok(&mut self.sums)
    }

    /// The picture as a file holds it: the mean of every layer, and facts.
    pub fn image(&self, header: &Header) -> Image {
        self.image_of(&self.layers, header)
    }

    /// The same with `Visible` and those layers alone that are among `layers`.
    pub fn image_of(&self, layers: &[Layer], header: &Header) -> Image {
        let is_shown = |layer: &&Layer| **layer == Layer::Visible || layers.contains(layer);
        let shown = self.layers.iter().filter(is_shown);
        let layers = shown.map(|&layer| (layer.name().into(), self.mean(layer))).collect();
        Image { width: self.width, height: self.height, layers, header: header.clone() }
    }

    /// What turns a sum of squared deviations into the variance of the mean.
    pub(super) fn variance_scale(&self) -> f64 {
        let n = f64::from(self.passes());
        1.0 / (n * (n - 1.0))
    }
}

/// What `Visible` is known to be in one channel of a pixel.
pub(super) struct Channel {
    pub mean: f64,
    /// Σ (x − mean)² over passes.
    pub deviations: f64,
    /// Of the mean, with one photon more than came.
    pub variance: f64,
}

/// What is added to the square of a mean, so that the error of a dark pixel counts little: 0.01².
pub(super) const DARK: f64 = 1e-4;

/// Pixels of rows of numbers, after something was done to each.
fn pixels(rows: impl ParallelIterator<Item = Vec<f64>>, each: impl Fn(f64) -> f64 + Sync) -> Vec<Vec3> {
    let pixel = |x: &[f64]| Vec3::new(each(x[0]) as f32, each(x[1]) as f32, each(x[2]) as f32);
    rows.flat_map_iter(|row| row.chunks_exact(3).map(pixel).collect::<Vec<_>>()).collect()
}

/// Adds the squares of a row and returns the sum of it.
fn add_squares(row: &mut Row<i128>, plane: &[Vec3]) -> DVec3 {
    let mut total = DVec3::ZERO;
    for (pixel, value) in plane.iter().enumerate() {
        for (channel, x) in value.to_array().into_iter().enumerate() {
            row.add_square_of_f32(3 * pixel + channel, x);
        }
        total += value.as_dvec3();
    }
    total
}
