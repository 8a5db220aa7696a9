//! Light, matrices and rows.

use glam::Vec3;
use halflight::light::{Light, Matrix, Row};
use halflight::scene::Illumination;
use proptest::prelude::*;

/// Entries over twelve decades, zero among them.
fn entry() -> impl Strategy<Value = f32> {
    prop_oneof![1 => Just(0.0_f32), 4 => (-6.0_f32..6.0).prop_map(|e| 10.0_f32.powf(e))]
}

fn vector() -> impl Strategy<Value = Vec3> {
    [entry(), entry(), entry()].prop_map(Vec3::from_array)
}

fn matrix() -> impl Strategy<Value = Matrix> {
    [[entry(), entry()], [entry(), entry()]].prop_map(Matrix::new)
}

fn light() -> impl Strategy<Value = Light> {
    (vector(), vector()).prop_map(|(invisible, visible)| Light::new(invisible, visible))
}

/// Nothing is negative, so nothing cancels: a few roundings is all.
fn close(a: Vec3, b: Vec3) -> bool {
    (a - b).abs().cmple(8.0 * f32::EPSILON * a.max(b)).all()
}

proptest! {
    #[test]
    fn rows_read_through_matter_as_matter_acts_on_light(a in matrix(), b in matrix(), light in light()) {
        for row in [Row::VISIBLE, Row::INVISIBLE] {
            let shot = row * (a * (b * light));
            prop_assert!(close(shot, ((row * a) * b) * light));
            prop_assert!(close(shot, (row * (a * b)) * light));
        }
    }

    #[test]
    fn products_are_associative_and_distribute_over_light(
        a in matrix(), b in matrix(), c in matrix(), x in light(), y in light()
    ) {
        let rows = |m: Matrix| m.rows().map(|[p, q]| Vec3::new(p, q, 0.0));
        prop_assert!(rows((a * b) * c).into_iter().zip(rows(a * (b * c))).all(|(p, q)| close(p, q)));
        let (sum, parts) = (a * (x + y), a * x + a * y);
        prop_assert!(close(sum.invisible, parts.invisible) && close(sum.visible, parts.visible));
    }

    #[test]
    fn the_square_is_where_it_says(s in 0.0_f32..=1.0, t in 0.0_f32..=1.0) {
        let point = Illumination::Square { s, t };
        let matter = point.own_matter();
        prop_assert_eq!(matter.opaque.rows(), [[s, 0.0], [1.0, 0.0]]);
        prop_assert_eq!(matter.straight.rows(), [[t, 0.0], [0.0, 0.0]]);
        prop_assert_eq!(point.describe().parse::<Illumination>(), Ok(point));
    }
}
