use super::*;

#[test]
fn matrices_do_not_commute_and_order_is_light_first() {
    let to_visible = Matrix::new([[0.0, 0.0], [1.0, 0.0]]);
    let to_invisible = Matrix::new([[0.0, 1.0], [0.0, 0.0]]);
    let light = Light::new(Vec3::splat(2.0), Vec3::splat(3.0));
    assert_eq!(to_invisible * (to_visible * light), (to_invisible * to_visible) * light);
    assert_ne!(to_invisible * to_visible, to_visible * to_invisible);
}

#[test]
fn a_row_reads_through_a_matrix_as_the_matrix_acts_on_light() {
    let m = Matrix::new([[0.1, 0.2], [0.3, 0.4]]);
    let light = Light::new(Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0));
    for row in [Row::VISIBLE, Row::INVISIBLE] {
        assert!(((row * m) * light - row * (m * light)).abs().max_element() < 1e-6);
    }
}
