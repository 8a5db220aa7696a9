use super::*;
use crate::light::Invisible;
use crate::rims::{PLANE_SHARE, SAME_SIDE_COSINE};
use crate::sampling::{Rng, Stream};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

fn photon(position: Vec3, normal: Vec3) -> Photon<Invisible> {
    Photon::new(position, normal, Invisible(Vec3::ONE), 1)
}

/// Photons on a floor, on a wall that meets it, and many in one point.
fn corner() -> Vec<Photon<Invisible>> {
    let mut rng = Rng::new(1, Stream::Test, 0, 0);
    let floor = (0..60_000).map(|_| rng.f32x2()).map(|[x, z]| photon(Vec3::new(x, 0.0, z), Vec3::Y));
    let floor: Vec<_> = floor.collect();
    let wall = (0..30_000).map(|_| rng.f32x2()).map(|[y, z]| photon(Vec3::new(0.0, y, z), Vec3::X));
    let pile = (0..5_000).map(|_| photon(Vec3::splat(0.5), Vec3::Z));
    floor.into_iter().chain(wall).chain(pile).collect()
}

#[test]
fn queries_find_what_brute_force_finds() {
    let photons = corner();
    let map = PhotonMap::build(photons.clone());
    let mut rng = Rng::new(2, Stream::Test, 0, 0);
    for _ in 0..200 {
        let [x, z] = rng.f32x2();
        let (p, r) = (Vec3::new(x, 0.0, z), 0.01 + 0.1 * rng.f32());
        // The rotation rounds: photons within 1e-5 of the rim may fall on either side of it.
        let within = |r: f32| {
            photons.iter().filter(|q| q.cos_to(Vec3::Y) > 0.9 && q.position.distance(p) <= r).count()
        };
        let found = map.count(p, Vec3::Y, r);
        assert!((within(r * 0.99999)..=within(r * 1.00001)).contains(&found), "{found} near {p}, radius {r}");
    }
    assert_eq!(map.count(Vec3::splat(0.5), Vec3::Z, 1e-6), 5_000);
}

#[test]
fn neighbourhoods_hold_all_that_is_asked_for() {
    let map = PhotonMap::build(corner());
    let mut rng = Rng::new(5, Stream::Test, 0, 0);
    let (mut near, mut found) = (Neighbourhood::default(), Found::default());
    let mut met = 0;
    for _ in 0..100 {
        let [x, z, r] = rng.f32x3();
        let (centre, radius) = (Vec3::new(x, 0.0, z), 0.001 + 0.1 * r);
        map.neighbourhood(centre, 1.5 * radius, &mut near);
        for _ in 0..10 {
            let aside = 0.49 * radius * Vec3::from(rng.f32x3().map(|u| 2.0 * u - 1.0)).normalize();
            let place = [centre + aside, Vec3::Y];
            let flux = map.flux_near(&near, place, radius, 9);
            assert_eq!(flux, map.flux(place[0], place[1], radius, 9));
            assert_eq!(map.find(&near, place, radius, 9, &mut found), flux);
            assert_eq!(found.places().len() as f32, flux.whole.0.x);
            met += found.places().len();
        }
    }
    assert!(met > 100_000, "{met}");
    map.neighbourhood(Vec3::splat(30.0), 1.0, &mut near);
    assert!(near.is_empty());
}

#[test]
fn queries_find_what_kiddo_finds() {
    let photons = corner();
    let points: Vec<[f32; 3]> = photons.iter().map(|photon| photon.position.to_array()).collect();
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&points).expect("finite positions");
    let map = PhotonMap::build(photons.clone());
    let (mut near, mut found) = (Neighbourhood::default(), Found::default());
    let mut rng = Rng::new(3, Stream::Test, 0, 0);
    let mut all = 0;
    for _ in 0..300 {
        let [x, y, z] = rng.f32x3();
        let (place, normal) = if y < 0.5 { ([x, 0.0, z], Vec3::Y) } else { ([0.0, x, z], Vec3::X) };
        let r = 0.001 + 0.2 * rng.f32();
        let mut theirs: Vec<[u32; 3]> = Vec::new();
        tree.query(&place).within::<SquaredEuclidean<f32>>(r * r).unsorted().visit(|near| {
            let photon = &photons[near.item as usize];
            let height = (photon.position - Vec3::from_array(place)).dot(normal).abs();
            if photon.cos_to(normal) > SAME_SIDE_COSINE && height < PLANE_SHARE * r {
                theirs.push(photon.position.to_array().map(f32::to_bits));
            }
        });
        let place = Vec3::from_array(place);
        map.neighbourhood(place, 1.01 * r, &mut near);
        map.find(&near, [place, normal], r, u16::MAX, &mut found);
        let photons = found.places().iter().map(|place| &map.photons()[*place as usize]);
        let mut ours: Vec<_> = photons.map(|photon| photon.position.to_array().map(f32::to_bits)).collect();
        theirs.sort_unstable();
        ours.sort_unstable();
        assert!(ours == theirs, "{} instead of {} near {place:?}, radius {r}", ours.len(), theirs.len());
        all += ours.len();
    }
    assert!(all > 300_000, "{all} photons met");
}

#[test]
fn what_is_found_is_what_is_added_up() {
    let mut rng = Rng::new(4, Stream::Test, 0, 0);
    let photons = corner().into_iter().map(|photon| Photon { reflections: (rng.u32() % 7) as u16, ..photon });
    let mut map = PhotonMap::build(photons.collect());
    map.weigh(|photon| 1.0 + f32::from(photon.reflections));
    let (mut near, mut found) = (Neighbourhood::default(), Found::default());
    let centre = Vec3::new(0.4, 0.0, 0.3);
    map.neighbourhood(centre, 0.11, &mut near);
    for most in [3, u16::MAX] {
        let flux = map.find(&near, [centre, Vec3::Y], 0.1, most, &mut found);
        assert!(flux == map.flux(centre, Vec3::Y, 0.1, most) && flux.inner.0.x > 100.0);
        let photons = found.places().iter().map(|place| &map.photons()[*place as usize]);
        let whole: f32 = photons.map(|photon| 1.0 + f32::from(photon.reflections)).sum();
        assert!((whole / flux.whole.0.x - 1.0).abs() < 1e-5, "{whole} for {:?}", flux.whole);
        assert!(found.places().is_sorted_by(|a, b| a < b));
    }
}

#[test]
fn photons_of_another_side_or_plane_do_not_count() {
    let thin = [photon(Vec3::ZERO, Vec3::Y), photon(Vec3::ZERO, -Vec3::Y), photon(Vec3::Y * 0.05, Vec3::Y)];
    let map = PhotonMap::build(thin.to_vec());
    assert_eq!(map.count(Vec3::ZERO, Vec3::Y, 0.1), 1);
    assert_eq!(map.count(Vec3::ZERO, -Vec3::Y, 0.1), 1);
    assert_eq!(map.count(Vec3::ZERO, Vec3::X, 0.1), 0);
}

#[test]
fn a_uniform_floor_has_uniform_flux() {
    let photons: Vec<_> = corner().into_iter().filter(|photon| photon.cos_to(Vec3::Y) > 0.9).collect();
    let map = PhotonMap::build(photons);
    let r = 0.05_f32;
    let n = 100;
    let sums: Vec<f32> = (0..n)
        .map(|i| {
            map.flux(
                Vec3::new(0.1 + 0.8 * (i % 10) as f32 / 9.0, 0.0, 0.1 + 0.08 * (i / 10) as f32),
                Vec3::Y,
                r,
                u16::MAX,
            )
            .whole
            .0
            .x
        })
        .collect();
    let mean = sums.iter().sum::<f32>() / n as f32;
    let expected = 60_000.0 * std::f32::consts::PI * r * r;
    assert!((mean / expected - 1.0).abs() < 0.01, "{mean} against {expected}");
}

#[test]
fn no_photons_no_light() {
    let map = PhotonMap::<Invisible>::build(Vec::new());
    assert!(map.is_empty() && map.flux(Vec3::ZERO, Vec3::Y, 1.0, 9) == Flux::default());
}

#[test]
#[should_panic(expected = "not finite")]
fn a_photon_that_is_nowhere_is_a_bug_and_is_said() {
    // kiddo would build and lose other photons.
    PhotonMap::build(vec![photon(Vec3::ZERO, Vec3::Y), photon(Vec3::new(f32::NAN, 0.0, 0.0), Vec3::Y)]);
}
