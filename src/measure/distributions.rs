//! The normal and Student's t distribution: tail probabilities and quantiles, relative accuracy about 1e-12.

use std::f64::consts::PI;

/// P(|Z| > |z|) for a standard normal Z.
pub fn normal_two_sided(z: f64) -> f64 {
    upper_gamma_half(0.5 * z * z)
}

/// P(|T| > |t|) for Student's T with `freedom` > 0 degrees of freedom; infinitely many are the normal distribution.
pub fn student_two_sided(t: f64, freedom: f64) -> f64 {
    // Above this the two agree to 1e-8 of the level, and the continued fraction would need ever more steps.
    if freedom > 1e8 {
        return normal_two_sided(t);
    }
    incomplete_beta(0.5 * freedom, 0.5, freedom / (freedom + t * t), t * t / (freedom + t * t))
}

/// The z ≥ 0 with P(|Z| > z) = `level`, for 0 < `level` ≤ 1. Zero `level` gives infinity.
pub fn normal_quantile_two_sided(level: f64) -> f64 {
    quantile(level, normal_two_sided)
}

/// The t ≥ 0 with P(|T| > t) = `level`, for 0 < `level` ≤ 1. Zero `level` gives infinity.
pub fn student_quantile_two_sided(level: f64, freedom: f64) -> f64 {
    quantile(level, |t| student_two_sided(t, freedom))
}

/// Bisection down to neighbouring numbers: the tail is monotone, and a quantile is wanted once per test.
fn quantile(level: f64, tail: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while tail(high) > level {
        high *= 2.0;
        if high == f64::INFINITY {
            return high;
        }
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if tail(middle) > level { low = middle } else { high = middle }
    }
}

/// Q(½, x) = erfc(√x), the regularised upper incomplete gamma function; series and continued fraction as in Press et
/// al., Numerical Recipes §6.2.
fn upper_gamma_half(x: f64) -> f64 {
    let a = 0.5;
    if x.is_nan() {
        return x;
    }
    if x == f64::INFINITY {
        return 0.0;
    }
    let front = (-x).exp() * (x / PI).sqrt(); // e^-x x^a / Γ(a)
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * f64::EPSILON {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - front * sum
    } else {
        front * lentz(x + 1.0 - a, |i| (-i * (i - a), x + 1.0 - a + 2.0 * i))
    }
}

/// I_x(a, b), the regularised incomplete beta function, given x and 1−x (so that neither loses digits); ibid. §6.4.
fn incomplete_beta(a: f64, b: f64, x: f64, rest: f64) -> f64 {
    if x.is_nan() || rest.is_nan() {
        return if x == 0.0 { 0.0 } else { f64::NAN };
    }
    if x <= 0.0 || rest <= 0.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * rest.ln()).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front / a * beta_fraction(a, b, x)
    } else {
        1.0 - front / b * beta_fraction(b, a, rest)
    }
}

fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    // Even and odd coefficients of 1 / (1 + d1 / (1 + d2 / …)).
    lentz(1.0, |i| {
        let m = (0.5 * i).floor();
        let d = if i % 2.0 == 0.0 {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        (d, 1.0)
    })
}

/// 1 / (first + n₁ / (d₁ + n₂ / (d₂ + …))) by Lentz' method.
fn lentz(first: f64, coefficients: impl Fn(f64) -> (f64, f64)) -> f64 {
    // Stands in for an exact zero, which the method divides by.
    const TINY: f64 = 1e-300;
    let nonzero = |v: f64| if v.abs() < TINY { TINY } else { v };
    let (mut c, mut d) = (1.0 / TINY, 1.0 / nonzero(first));
    let mut value = d;
    // Converges in about √(max(a, b)) steps; the bound only keeps NaN from looping for ever.
    for i in 1..100_000 {
        let (numerator, denominator) = coefficients(f64::from(i));
        d = 1.0 / nonzero(denominator + numerator * d);
        c = nonzero(denominator + numerator / c);
        value *= c * d;
        if (c * d - 1.0).abs() <= f64::EPSILON {
            break;
        }
    }
    value
}

/// ln Γ(x) for x > 0: Stirling's series after shifting x above 12.
fn ln_gamma(x: f64) -> f64 {
    let (mut x, mut shift) = (x, 0.0);
    while x < 12.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let y = 1.0 / (x * x);
    let series = (1.0 / 12.0 - y * (1.0 / 360.0 - y * (1.0 / 1260.0 - y * (1.0 / 1680.0 - y / 1188.0)))) / x;
    shift + (x - 0.5) * x.ln() - x + 0.5 * (2.0 * PI).ln() + series
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: f64, expected: f64, relative: f64) {
        assert!((got / expected - 1.0).abs() < relative, "got {got}, expected {expected}");
    }

    #[test]
    fn normal_tails_of_the_tables() {
        near(normal_two_sided(1.0), 0.317_310_507_862_914_1, 1e-12);
        near(normal_two_sided(-1.959_963_984_540_054), 0.05, 1e-12);
        near(normal_two_sided(3.5), 4.652_581_580_710_53e-4, 1e-10);
        near(normal_two_sided(10.0), 1.523_970_604_832_1e-23, 1e-10);
        near(normal_quantile_two_sided(0.01), 2.575_829_303_548_901, 1e-12);
        assert_eq!((normal_two_sided(0.0), normal_two_sided(f64::INFINITY)), (1.0, 0.0));
    }

    #[test]
    fn student_tails_have_closed_forms_for_one_two_and_three_degrees() {
        for t in [0.01, 0.5, 1.0, 3.0, 12.0, 1e4] {
            near(student_two_sided(t, 1.0), 2.0 / PI * (1.0 / t).atan(), 1e-11);
            let root: f64 = (2.0 + t * t).sqrt();
            near(student_two_sided(t, 2.0), 2.0 / (root * (root + t)), 1e-11);
        }
        let t = 3.0_f64.sqrt();
        near(student_two_sided(t, 3.0), 1.0 - 2.0 / PI * (0.5 + PI / 4.0), 1e-11);
        near(student_quantile_two_sided(0.05, 10.0), 2.228_138_851_964_939, 1e-10);
        near(student_quantile_two_sided(0.01, 30.0), 2.749_995_653_567_231, 1e-10);
    }

    #[test]
    fn many_degrees_are_normal() {
        for t in [0.3, 2.0, 4.0] {
            near(student_two_sided(t, 1e6), normal_two_sided(t), 1e-4);
            near(student_two_sided(t, 0.99e8), normal_two_sided(t), 1e-6);
            assert_eq!(student_two_sided(t, f64::INFINITY), normal_two_sided(t));
        }
        assert_eq!(student_two_sided(f64::INFINITY, 4.0), 0.0);
    }
}
