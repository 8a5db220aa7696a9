//! Medians, slopes, ratios, and how certain they are.

use super::data::Interval;
use crate::sampling::{Rng, Stream};

/// The quantile `q` in [0, 1] of values in any order, linear between neighbours; NaN of none.
pub fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = q * last as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    // Equal neighbours may be infinite.
    if below == above { below } else { below + (above - below) * place.fract() }
}

/// The middle one, or the mean of the two in the middle.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// Least squares of log y over log x. None below two different x, or where a value is not positive.
pub fn log_slope(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mean_x, mean_y) =
        (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let (mut xx, mut xy) = (0.0, 0.0);
    for (x, y) in logs {
        xx += (x - mean_x) * (x - mean_x);
        xy += (x - mean_x) * (y - mean_y);
    }
    let slope = xy / xx;
    (xx > 1e-12 && slope.is_finite()).then_some(slope)
}

/// y at `x` on a curve of ascending x, log-log between its points, held at its ends.
pub fn at(curve: &[(f64, f64)], x: f64) -> f64 {
    let after = curve.iter().position(|p| p.0 >= x).unwrap_or(curve.len());
    match (after.checked_sub(1).map(|i| curve[i]), curve.get(after)) {
        (Some(a), Some(&b)) => between(a, b, x),
        (Some(end), None) => end.1,
        (None, Some(&start)) => start.1,
        (None, None) => f64::NAN,
    }
}

fn between((x0, y0): (f64, f64), (x1, y1): (f64, f64), x: f64) -> f64 {
    let share = (x / x0).ln() / (x1 / x0).ln();
    y0 * (y1 / y0).powf(share)
}

/// When a curve first comes down to `y`; the flag is true when it begins there, so that the time is an upper bound.
/// None when it never does.
pub fn reached(curve: &[(f64, f64)], y: f64) -> Option<(f64, bool)> {
    let first = curve.iter().position(|p| p.1 <= y)?;
    let (x1, y1) = curve[first];
    if first == 0 {
        return Some((x1, y1 < y));
    }
    let (x0, y0) = curve[first - 1];
    Some((between((y0, x0), (y1, x1), y), false))
}

/// Resamples of a bootstrap.
const RESAMPLES: u32 = 2000;

/// The 95 % interval of a figure that is a function of which seeds are drawn: `figure` gets, for each of `groups`,
/// indices below `count` drawn with replacement. Resamples without a figure are passed over.
pub fn bootstrap(
    value: f64,
    groups: usize,
    count: usize,
    figure: impl Fn(&[Vec<usize>]) -> Option<f64>,
) -> Interval {
    let resample = |i: u32| {
        let mut rng = Rng::new(0, Stream::Measure, i, 0);
        let mut draw = || (rng.f32() * count as f32) as usize;
        let drawn: Vec<Vec<usize>> =
            (0..groups).map(|_| (0..count).map(|_| draw().min(count - 1)).collect()).collect();
        figure(&drawn)
    };
    let figures: Vec<f64> = (0..RESAMPLES).filter_map(resample).collect();
    Interval { value, low: quantile(&figures, 0.025), high: quantile(&figures, 0.975) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_by_hand() {
        let values = [5.0, 1.0, 3.0, 2.0, 4.0];
        assert_eq!((median(&values), quantile(&values, 0.0), quantile(&values, 1.0)), (3.0, 1.0, 5.0));
        assert!((quantile(&values, 0.1) - 1.4).abs() < 1e-12);
        assert_eq!(median(&[1.0, 2.0]), 1.5);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn a_power_law_has_its_slope_and_is_read_between_its_points() {
        let curve: Vec<_> = [1.0, 2.0, 5.0, 9.0].map(|t: f64| (t, 3.0 * t.powf(-2.0 / 3.0))).to_vec();
        assert!((log_slope(&curve).unwrap() + 2.0 / 3.0).abs() < 1e-12);
        assert!((at(&curve, 3.0) - 3.0 * 3.0_f64.powf(-2.0 / 3.0)).abs() < 1e-12);
        assert_eq!((at(&curve, 0.5), at(&curve, 20.0)), (curve[0].1, curve[3].1));
        let (time, bound) = reached(&curve, 3.0 * 7.0_f64.powf(-2.0 / 3.0)).unwrap();
        assert!((time - 7.0).abs() < 1e-9 && !bound);
        assert_eq!(reached(&curve, 10.0), Some((1.0, true)));
        assert_eq!(reached(&curve, 0.01), None);
        assert_eq!(log_slope(&[(1.0, 1.0), (1.0, 2.0)]), None);
        assert_eq!(log_slope(&[(1.0, 0.0), (2.0, 2.0)]), None);
    }

    #[test]
    fn the_interval_holds_the_figure_and_is_the_same_every_time() {
        let values = [1.0, 1.3, 0.8, 1.1, 0.9];
        let figure =
            |drawn: &[Vec<usize>]| Some(median(&drawn[0].iter().map(|&i| values[i]).collect::<Vec<_>>()));
        let interval = bootstrap(1.0, 1, 5, figure);
        assert!(interval.low < 1.0 && interval.high > 1.0 && interval.low >= 0.8 && interval.high <= 1.3);
        assert_eq!(interval, bootstrap(1.0, 1, 5, figure));
    }
}
