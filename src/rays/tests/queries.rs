use super::*;
use crate::scene::Backs;
use fearless_simd::Level;

/// A triangle around the z axis at height z.
fn pane(z: f32) -> [Vec3; 3] {
    [Vec3::new(-1.0, -1.0, z), Vec3::new(2.0, -1.0, z), Vec3::new(-1.0, 2.0, z)]
}

fn flipped([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    [a, c, b]
}

const UP: Ray = Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: f32::INFINITY };

#[test]
fn nothing_and_one_triangle() {
    let empty = clear(&[]);
    assert_eq!(empty.closest(&UP), None);
    assert!(all(&empty, &UP).is_empty());
    assert!(!empty.occluded(&UP));
    assert_eq!(empty.transmittance(&UP), Matrix::IDENTITY);
    for triangle in [pane(1.0), flipped(pane(1.0))] {
        let one = opaque(&[triangle]);
        assert_eq!(one.closest(&UP).map(|hit| (hit.t, hit.triangle)), Some((1.0, 0)));
        assert_eq!(one.transmittance(&UP), Matrix::ZERO);
        assert!(!one.occluded(&Ray { t_max: 1.0, ..UP }), "the end is not part of the segment");
        assert!(!one.occluded(&half_line(Vec3::Z, Vec3::Z)), "neither is the origin");
        assert!(one.occluded(&Ray { t_max: 1f32.next_up(), ..UP }));
        assert!(one.occluded(&half_line(Vec3::new(0.0, 0.0, 1f32.next_down()), Vec3::Z)));
    }
    let flat = opaque(&[[Vec3::Z, Vec3::Z + Vec3::X, Vec3::Z - Vec3::X], [Vec3::Z; 3]]);
    assert!(!flat.occluded(&UP));
}

#[test]
fn backs_are_there_for_whom_they_are() {
    // Seen from below, the back of the first and the front of the second.
    let soup = [pane(1.0), flipped(pane(2.0))];
    let with = |backs| {
        let mut scene = scene(&soup, |_| 0, &[Matrix::ZERO]);
        scene.materials[0].backs = backs;
        Rays::build(&scene)
    };
    for (backs, eye) in [(Backs::Seen, 1.0), (Backs::Unseen, 2.0)] {
        for rays in [with(backs), with(backs).without_shortcuts()] {
            let first = |hits: &[Hit]| hits.iter().map(|hit| hit.t).collect::<Vec<_>>();
            let mut seen = Vec::new();
            rays.crossings_seen(&UP, &mut seen);
            assert_eq!((first(&seen), first(&all(&rays, &UP))), (vec![eye], vec![1.0]), "{backs:?}");
            assert_eq!(rays.closest_seen(&UP).map(|hit| hit.t), Some(eye));
            assert_eq!(rays.closest(&UP).map(|hit| hit.t), Some(1.0));
            assert!(rays.occluded(&Ray { t_max: 1.5, ..UP }));
            assert!(rays.transmittance(&Ray { t_max: 1.5, ..UP }).is_zero());
        }
    }
}

#[test]
fn coincident_triangles_each_count_once_fronts_first() {
    let hits = all(&clear(&[pane(2.0), pane(1.0), flipped(pane(1.0)), pane(1.0)]), &UP);
    assert_eq!(hits.iter().map(|hit| hit.triangle).collect::<Vec<_>>(), [2, 1, 3, 0]);
}

#[test]
fn many_equal_triangles_all_count() {
    // So many that a builder of O(n²), as obvhs' own is for equal boxes, would not end.
    let rays = clear(&vec![pane(1.0); 200_000]);
    let hits = all(&rays, &UP);
    assert!(hits.iter().map(|hit| hit.triangle).eq(0..200_000));
}

#[test]
fn a_fan_of_many_triangles_builds() {
    let rim = |i: usize| Vec3::new((i as f32 * 3e-4).cos(), (i as f32 * 3e-4).sin(), 1.0);
    let rays = clear(&(0..20_000).map(|i| [Vec3::Z, rim(i), rim(i + 1)]).collect::<Vec<_>>());
    assert_eq!(all(&rays, &UP).len(), 1);
}

#[test]
fn crossings_come_in_order_and_end_at_the_first_blocker() {
    let half = 0.5 * Matrix::IDENTITY;
    let mut rng = rng(3);
    for _ in 0..200 {
        // Many equal distances.
        let heights: Vec<f32> = (0..30).map(|_| (1 + rng.u32() % 20) as f32).collect();
        let blocks: Vec<bool> = (0..30).map(|_| rng.u32().is_multiple_of(8)).collect();
        let soup: Vec<_> = heights.iter().map(|z| pane(*z)).collect();
        let rays = Rays::build(&scene(&soup, |i| u32::from(blocks[i]), &[half, Matrix::ZERO]));
        let mut expected: Vec<usize> = (0..30).collect();
        expected.sort_by(|a, b| (heights[*a], a).partial_cmp(&(heights[*b], b)).unwrap());
        if let Some(end) = expected.iter().position(|i| blocks[*i]) {
            expected.truncate(end + 1);
        }
        let ids: Vec<usize> = all(&rays, &UP).iter().map(|hit| hit.triangle as usize).collect();
        assert_eq!(ids, expected);
        assert_eq!(rays.closest(&UP).map(|hit| hit.triangle as usize), expected.first().copied());
        let through = if blocks.contains(&true) { Matrix::ZERO } else { 0.5f32.powi(30) * Matrix::IDENTITY };
        assert_eq!(rays.transmittance(&UP), through);
    }
}

#[test]
fn transmittance_multiplies_in_the_order_of_light_from_the_far_end() {
    let first = Matrix::new([[0.5, 0.25], [0.0, 0.75]]);
    let second = Matrix::new([[1.0, 0.0], [0.5, 0.5]]);
    let third = Matrix::new([[0.25, 0.5], [0.75, 0.5]]);
    // In space and in the mesh in different orders.
    let soup = [pane(3.0), pane(1.0), pane(2.0)];
    let rays = Rays::build(&scene(&soup, |i| [2, 0, 1][i], &[first, second, third]));
    assert_eq!(rays.transmittance(&UP), first * second * third);
    assert_ne!(rays.transmittance(&UP), third * second * first);
    assert_eq!(
        rays.transmittance(&half_line(Vec3::splat(0.0) + 9.0 * Vec3::Z, -Vec3::Z)),
        third * second * first
    );
    assert_eq!(rays.transmittance(&Ray { t_max: 2.5, ..UP }), first * second);
    let blocked = Rays::build(&scene(&soup, |i| [3, 0, 1][i], &[first, second, third, Matrix::ZERO]));
    assert_eq!(blocked.transmittance(&UP), Matrix::ZERO);
    assert_eq!(blocked.transmittance(&Ray { t_max: 2.5, ..UP }), first * second);
}

#[test]
fn halves_that_pass_different_panes_leave_nothing() {
    let invisible = Matrix::new([[1.0, 0.0], [0.0, 0.0]]);
    let visible = Matrix::new([[0.0, 0.0], [0.0, 1.0]]);
    let rays = Rays::build(&scene(&[pane(1.0), pane(2.0)], |i| i as u32, &[invisible, visible]));
    assert_eq!(rays.transmittance(&UP), Matrix::ZERO);
    assert_eq!(rays.transmittance(&Ray { t_max: 1.5, ..UP }), invisible);
    assert_eq!(all(&rays, &UP).len(), 2, "neither pane blocks by itself");
}

#[test]
fn answers_do_not_depend_on_the_instruction_set() {
    let mut rng = rng(4);
    let soup: Vec<[Vec3; 3]> = (0..3000)
        .map(|_| {
            let middle = in_cube(&mut rng);
            [(); 3].map(|()| middle + 0.1 * in_cube(&mut rng))
        })
        .collect();
    let straight = [Matrix::ZERO, 0.3 * Matrix::IDENTITY, Matrix::new([[0.7, 0.0], [0.0, 0.9]])];
    let scene = scene(&soup, |i| if i % 50 == 0 { 0 } else { 1 + i as u32 % 2 }, &straight);
    let (best, plain) = (Rays::build(&scene), Rays::build_at(&scene, Level::baseline()));
    for _ in 0..3000 {
        let t_max = if rng.u32().is_multiple_of(2) { 0.5 } else { f32::INFINITY };
        let ray = Ray { t_max, ..half_line(in_cube(&mut rng), direction(&mut rng)) };
        assert_eq!(best.closest(&ray), plain.closest(&ray));
        assert_eq!(all(&best, &ray), all(&plain, &ray));
        assert_eq!(best.occluded(&ray), plain.occluded(&ray));
        assert_eq!(best.transmittance(&ray), plain.transmittance(&ray));
        assert_eq!(best.occluded(&ray), best.closest(&ray).is_some());
    }
}

#[test]
fn odd_rays_meet_nothing_and_do_no_harm() {
    let rays = opaque(&cube(2, 1.0, Vec3::ZERO));
    for bad in [f32::NAN, f32::INFINITY] {
        assert_eq!(rays.closest(&half_line(Vec3::splat(bad), Vec3::Z)), None);
        assert_eq!(rays.closest(&half_line(Vec3::ZERO, Vec3::splat(bad))), None);
    }
    assert_eq!(rays.closest(&half_line(Vec3::ZERO, Vec3::ZERO)), None);
    for t_max in [0.0, -1.0, f32::NAN] {
        assert_eq!(rays.closest(&Ray { t_max, ..UP }), None);
        assert!(!rays.occluded(&Ray { t_max, ..UP }));
    }
}
