use super::*;

#[test]
fn three_turns_make_any_matrix_of_colours_and_rows_read_through_them_what_light_becomes() {
    let m = |out: usize, c: usize| (1 + 3 * out + c) as f32;
    let diagonal = |d: usize| Vec3::from_array([0, 1, 2].map(|c| m((c + d) % 3, c)));
    let rgb = Vec3::new(2.0, 3.0, 5.0);
    let expected: Vec3 = Vec3::from_array([0, 1, 2].map(|out| (0..3).map(|c| m(out, c) * rgb[c]).sum()));
    let became: Vec3 = (0..3).map(|d| Turn::by(d as u8).outgoing(diagonal(d) * rgb)).sum();
    assert_eq!(became, expected);
    let light = Light::new(rgb, Vec3::new(7.0, 11.0, 13.0));
    for (first, second) in [(0, 1), (1, 1), (1, 2), (2, 2), (2, 0)].map(|(a, b)| (Turn::by(a), Turn::by(b))) {
        let shot = light.turned(first).turned(second);
        for row in [Row::VISIBLE, Row::INVISIBLE] {
            let gathered = row.before(second).before(first);
            assert_eq!(gathered * light, row * shot);
            assert!(gathered.turn.is_reradiated());
        }
        assert_eq!(light.turned(first.then(second)), shot);
        assert_eq!(first.incoming(first.outgoing(rgb)), rgb);
    }
    assert!(!Row::VISIBLE.before(Turn::NONE).turn.is_reradiated());
}

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
