//! Sums against whole numbers as long as they need be, and in every order.

use super::*;

/// Some numbers of all kinds of size.
fn numbers(spread: i32, count: usize) -> Vec<f32> {
    let mut state = 7_u64;
    let mut next = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as u32
    };
    let one = |_| {
        let fraction = 1.0 + next() as f32 / 2.0_f32.powi(31);
        let size = 2.0_f32.powi(next() as i32 % (2 * spread + 1) - spread);
        if next().is_multiple_of(3) { -fraction * size } else { fraction * size }
    };
    (0..count).map(one).collect()
}

fn summed(values: &[f32]) -> (Row<i64>, Row<i128>) {
    let (mut sum, mut squares) = (Row::new(1), Row::new(1));
    for x in values {
        sum.add_f32(0, *x);
        squares.add_square_of_f32(0, *x);
    }
    (sum, squares)
}

#[test]
fn the_order_and_the_parts_do_not_show() {
    for spread in [0, 3, 12, 25, 60, 120] {
        let values = numbers(spread, 300);
        let (sum, squares) = summed(&values);
        let backwards: Vec<f32> = values.iter().rev().copied().collect();
        let mut ordered = values.clone();
        ordered.sort_by(f32::total_cmp);
        for other in [backwards, ordered] {
            let mut parts = (Row::new(1), Row::new(1));
            for part in other.chunks(41) {
                let (sum, squares) = summed(part);
                parts.0.add_row(&sum);
                parts.1.add_row(&squares);
            }
            assert_eq!(parts.0.number(0), sum.number(0), "{spread}");
            assert_eq!(parts.1.number(0), squares.number(0), "{spread}");
            assert_eq!(parts.0.pair(0), sum.pair(0), "{spread}");
            assert_eq!(parts.1.pair(0), squares.pair(0), "{spread}");
            assert_eq!(parts.0.value(0), sum.pair(0).high, "{spread}");
        }
    }
}

#[test]
fn sums_are_those_of_whole_numbers() {
    // Each is a multiple of 2⁻⁴⁸ below 2²⁵, so that its square is a multiple of 2⁻⁹⁶ below 2⁵⁰.
    for spread in [4, 12, 20] {
        let values: Vec<f32> = numbers(spread, 500);
        let whole = |x: f32| (f64::from(x) * 2.0_f64.powi(48)) as i128;
        let sum: i128 = values.iter().map(|x| whole(*x)).sum();
        let (found, squares) = summed(&values);
        assert_eq!(found.value(0), sum as f64 * 2.0_f64.powi(-48), "{spread}");
        if spread == 4 {
            let squared = |x: f32| ((f64::from(x) * 2.0_f64.powi(30)) as i128).pow(2);
            let all: i128 = values.iter().map(|x| squared(*x)).sum();
            assert_eq!(squares.value(0), all as f64 * 2.0_f64.powi(-60));
        }
        let mut off = found.clone();
        off.add_f32(0, 2.0_f32.powi(-100));
        assert_ne!(off.number(0), found.number(0), "a lost bit is not seen");
    }
}

#[test]
fn numbers_come_back_from_their_bytes() {
    let mut row = Row::<i64>::new(6);
    let values = [1.0, -3.5e-38, f32::MAX, 0.0, 1e-45, -0.0];
    values.iter().enumerate().for_each(|(i, x)| row.add_f32(i, *x));
    row.add_f32(1, 3e38);
    let mut again = Row::<i64>::new(6);
    (0..6).for_each(|i| again.add_number(i, &row.number(i)));
    (0..6).for_each(|i| assert_eq!(again.number(i), row.number(i)));
    assert_eq!(row.number(0), Number::Finite { negative: false, exponent: 0, magnitude: vec![1] });
    assert_eq!(row.number(3), Number::Zero);
    let huge = |exponent| Number::Finite { negative: false, exponent, magnitude: vec![1; 9] };
    assert!(huge(-576).is_held() && !huge(-577).is_held() && !huge(i32::MAX).is_held());
    assert!(huge(wide::HIGHEST - 72).is_held() && !huge(wide::HIGHEST - 71).is_held());
}

#[test]
fn what_is_not_finite_stays_so_in_any_order() {
    let (inf, nan) = (f32::INFINITY, f32::NAN);
    for (values, expected) in [
        (&[1.0, inf, 2.0, inf][..], Number::Infinite),
        (&[-inf, 1e30], Number::MinusInfinite),
        (&[1.0, inf, -inf], Number::Nan),
        (&[nan, inf], Number::Nan),
        (&[1e38, 1e-38, nan], Number::Nan),
    ] {
        let backwards: Vec<f32> = values.iter().rev().copied().collect();
        assert_eq!(summed(values).0.number(0), expected);
        assert_eq!(summed(&backwards).0.number(0), expected);
        let mut merged = summed(&values[..1]).0;
        merged.add_row(&summed(&values[1..]).0);
        assert_eq!(merged.number(0), expected);
    }
    assert_eq!(summed(&[-inf]).1.number(0), Number::Infinite);
}

#[test]
fn spreads_are_right_where_the_mean_is_a_million_times_as_large() {
    let of = |values: &[f32]| {
        let (sum, squares) = summed(values);
        spread(sum.pair(0), squares.pair(0), values.len() as f64)
    };
    assert_eq!(of(&[1e-7; 1000]), 0.0);
    assert_eq!(of(&[0.1; 3]), 0.0);
    for scale in [1e-30, 1.0, 1e30] {
        for (mean, away) in [(1.0_f32, 0.5), (4096.0, 0.5), (1_048_576.0, 0.125), (8_388_608.0, 1.0)] {
            let scale = 2.0_f32.powf(f32::log2(scale).round());
            let values = [mean, mean + away, mean + 2.0 * away, mean + 5.0 * away].map(|x| x * scale);
            // Around their mean: 2, 1, 0, 3.
            let expected = 14.0 * f64::from(away * scale).powi(2);
            assert!((of(&values) / expected - 1.0).abs() < 1e-12, "{mean} {away} {}", of(&values) / expected);
        }
    }
}

#[test]
fn averages_keep_all_their_digits() {
    let mut row = Row::<i128>::new(2);
    for x in [0.1, -1e-40, 1e38 / 3.0, 0.0] {
        row.add_average(0, x, false);
        row.add_average(1, x, true);
    }
    for x in [-0.1, 1e-40, -1e38 / 3.0] {
        row.add_average(0, x, false);
    }
    assert_eq!(row.number(0), Number::Zero);
    let square = |x: f64| x * x;
    assert!((row.value(1) / square(1e38 / 3.0) - 1.0).abs() < 1e-15);
}
