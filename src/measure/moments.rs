//! Mean and spread of every pixel over passes, which can be saved and continued.

use glam::{DVec3, Vec3};

/// Mean of samples, and its standard error, which is NaN below two of them.
pub fn mean_and_error(samples: &[f64]) -> (f64, f64) {
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Running mean and sum of squared deviations (Welford) of pictures of one size.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moments {
    passes: u32,
    mean: Vec<DVec3>,
    spread: Vec<DVec3>,
}

impl Moments {
    /// Nothing yet, for pictures of `pixels`.
    pub fn new(pixels: usize) -> Self {
        Self { passes: 0, mean: vec![DVec3::ZERO; pixels], spread: vec![DVec3::ZERO; pixels] }
    }

    /// Takes up what [`Moments::mean`] and [`Moments::standard_error`] gave after `passes`, two or more.
    pub fn resume(passes: u32, mean: &[Vec3], error: &[Vec3]) -> Self {
        let n = f64::from(passes);
        Self {
            passes,
            mean: mean.iter().map(|v| v.as_dvec3()).collect(),
            spread: error.iter().map(|e| e.as_dvec3() * e.as_dvec3() * (n * (n - 1.0))).collect(),
        }
    }

    /// Adds one picture.
    pub fn add(&mut self, picture: impl IntoIterator<Item = DVec3>) {
        self.passes += 1;
        let n = f64::from(self.passes);
        for ((mean, spread), value) in self.mean.iter_mut().zip(&mut self.spread).zip(picture) {
            let away = value - *mean;
            *mean += away / n;
            *spread += away * (value - *mean);
        }
    }

    /// Pictures added.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// The mean of each pixel.
    pub fn mean(&self) -> Vec<Vec3> {
        self.mean.iter().map(|v| v.as_vec3()).collect()
    }

    /// The standard error of each mean; infinite below two pictures.
    pub fn standard_error(&self) -> Vec<Vec3> {
        if self.passes < 2 {
            return vec![Vec3::INFINITY; self.mean.len()];
        }
        let n = f64::from(self.passes);
        let error = |spread: &DVec3| {
            let variance = spread.max(DVec3::ZERO) / (n * (n - 1.0));
            DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt()).as_vec3()
        };
        self.spread.iter().map(error).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taken_up_from_a_file_it_goes_on_as_if_never_stopped() {
        let pictures: Vec<[DVec3; 2]> = (1..9)
            .map(|i| [DVec3::splat(f64::from(i * i % 7)), DVec3::new(1.0, 2.0, f64::from(i))])
            .collect();
        let mut whole = Moments::new(2);
        pictures.iter().for_each(|p| whole.add(*p));
        let mut half = Moments::new(2);
        pictures[..4].iter().for_each(|p| half.add(*p));
        let mut rest = Moments::resume(4, &half.mean(), &half.standard_error());
        pictures[4..].iter().for_each(|p| rest.add(*p));
        assert_eq!(rest.passes(), 8);
        let (mean, error) = (whole.mean(), whole.standard_error());
        for (i, (m, e)) in rest.mean().iter().zip(rest.standard_error()).enumerate() {
            assert!((*m - mean[i]).abs().max_element() < 1e-5 && (e - error[i]).abs().max_element() < 1e-5);
        }
        // Values 1 4 2 2 4 1 0 1: mean 15/8, sum of squared deviations 43 - 225/8.
        let by_hand = ((43.0 - 225.0 / 8.0) / 56.0_f64).sqrt();
        assert!((f64::from(error[0].x) - by_hand).abs() < 1e-6, "{} {by_hand}", error[0].x);
    }
}
