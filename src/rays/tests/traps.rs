//! Why obvhs' own traversal and triangle test are not used.

use super::*;
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::triangle::Triangle;
use std::time::Duration;

#[test]
fn obvhs_leaks_at_edges_where_we_do_not() {
    let sphere = uv_sphere(64, 32, 1.0, Vec3::ZERO);
    let ours = opaque(&sphere);
    let triangles: Vec<_> = sphere
        .iter()
        .map(|corners| {
            let [v0, v1, v2] = corners.map(Into::into);
            Triangle { v0, v1, v2 }
        })
        .collect();
    let theirs = build_bvh2_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
    let mut rng = rng(21);
    let mut leaks = 0;
    for [a, b, _] in &sphere {
        let origin = 0.3 * in_cube(&mut rng);
        let d = (a.lerp(*b, rng.f32()) - origin).normalize();
        assert!(ours.occluded(&half_line(origin, d)));
        let test =
            |ray: &ObvhsRay, slot: usize| triangles[theirs.primitive_indices[slot] as usize].intersect(ray);
        leaks += usize::from(!theirs.ray_traverse(
            ObvhsRay::new_inf(origin.into(), d.into()),
            &mut RayHit::none(),
            test,
        ));
    }
    assert!(leaks > sphere.len() / 100, "{leaks} of {}: obvhs has become better", sphere.len());
}
