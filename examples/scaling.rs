//! How cost grows with triangles, photons and threads: the table of `docs/performance.md`, as Markdown.
//!
//! `cargo run --release --example scaling` goes to 10⁷ photons; `-- 8` to 10⁸ (12 GB of memory).

use glam::{DVec3, Vec3};
use halflight::film::Layer;
use halflight::light::{Invisible, Light};
use halflight::optics::{Diffuse, Lobe};
use halflight::photon::Photon;
use halflight::photon_map::PhotonMap;
use halflight::plan::{Plan, Settings};
use halflight::render::{learn, render_pass};
use halflight::sampling::{Rng, Stream};
use halflight::scene::{Camera, Luminaire, Material, Projection, Scene, Shape};
use halflight::shoot::shoot;
use std::time::Instant;

/// Each figure is the best of so many.
const TRIES: usize = 5;
/// Photons are asked for at so many places squared, about so many at each.
const SIDE: usize = 256;
const MET: f32 = 100.0;
/// In a render that many pixels lie along a gather radius.
const PIXELS: f32 = 7.0;

fn main() {
    let most: u32 = std::env::args().nth(1).map_or(7, |text| text.parse().expect("a power of ten"));
    println!("| triangles | index, s | shooting, ns a path | growth |\n|---|---|---|---|");
    let mut last: Option<f64> = None;
    for halvings in [3, 5, 7, 9, 10] {
        let scene = ball(halvings);
        let triangles = scene.mesh.triangles.len();
        let (index, plan) = best(1, || Plan::new(scene.clone(), Settings::default()));
        let frame = learn(&plan);
        let photons = frame.photons.as_ref().expect("global");
        let (seconds, _) = best(TRIES, || shoot::<Invisible>(&plan, &frame, 0));
        let path = 1e9 * seconds / f64::from(photons.paths);
        println!("| {triangles} | {index:.2} | {path:.0} | {} |", growth(&mut last, path));
    }
    println!(
        "\n| photons | map, ns a photon | query, places far apart, ns a photon met | growth | as close as pixels | growth |\n\
         |---|---|---|---|---|---|"
    );
    let mut last: [Option<f64>; 2] = [None; 2];
    for power in 4..=most {
        let count = 10_usize.pow(power);
        let photons = floor(count);
        let mut copies = vec![photons; if power < 7 { TRIES } else { 1 }];
        let (map_seconds, map) =
            best(copies.len(), || PhotonMap::build(copies.pop().expect("one for each try")));
        let radius = (MET / (count as f32 * std::f32::consts::PI)).sqrt();
        let build = 1e9 * map_seconds / count as f64;
        print!("| 10^{power} | {build:.1} |");
        for (last, step) in last.iter_mut().zip([f32::INFINITY, radius / PIXELS]) {
            // One behind the other, as pixels look at a floor: at all of it, or at a part in its middle.
            let side = (step * SIDE as f32).min(1.0);
            let along = |i: usize| 0.5 + side * ((i as f32 + 0.5) / SIDE as f32 - 0.5);
            let places: Vec<Vec3> =
                (0..SIDE * SIDE).map(|i| Vec3::new(along(i % SIDE), 0.0, along(i / SIDE))).collect();
            let met: usize = places.iter().map(|place| map.count(*place, Vec3::Y, radius)).sum();
            let (seconds, _) = best(TRIES, || {
                places.iter().map(|place| map.flux(*place, Vec3::Y, radius, u16::MAX).whole.0.x).sum::<f32>()
            });
            let query = 1e9 * seconds / met as f64;
            print!(" {query:.2} | {} |", growth(last, query));
        }
        println!();
    }
    println!("\n| threads | caustic box, s a pass | speed |\n|---|---|---|");
    let plan = Plan::new(Scene::load("builtin:caustic-box").expect("built in"), Settings::default());
    let frame = learn(&plan);
    let mut one = None;
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let pass = || render_pass(&plan, &frame, 0, &[Layer::Visible]);
        let (seconds, _) = pool.install(|| best(TRIES, pass));
        println!("| {threads} | {seconds:.3} | {:.2} |", *one.get_or_insert(seconds) / seconds);
    }
}

fn growth(last: &mut Option<f64>, value: f64) -> String {
    last.replace(value).map_or(String::new(), |last| format!("{:.2}", value / last))
}

/// The shortest time, s.
fn best<T>(tries: usize, mut work: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let begin = Instant::now();
        let made = work();
        (begin.elapsed().as_secs_f64(), made)
    };
    let first = timed();
    (1..tries).fold(first, |best, _| {
        let next = timed();
        if next.0 < best.0 { next } else { best }
    })
}

/// A ball of 8·4ⁿ triangles in a room, lit by a point.
fn ball(halvings: u32) -> Scene {
    let camera =
        Camera::look_at(Vec3::new(0.0, 0.5, 2.9), Vec3::ZERO, Vec3::Y, Projection::Perspective { yfov: 0.9 });
    let mut scene = Scene::builder("ball").camera(camera).origin(DVec3::ZERO);
    let diffuse = Lobe::Diffuse(Diffuse { albedo: Vec3::splat(0.7), two_sided: true, under: None });
    let [room, ball] = ["Room", "Ball"].map(|name| scene.material(Material::new(name, diffuse)));
    let mut triangles = Vec::new();
    for signs in 0..8 {
        let sign = |bit: u32| if signs >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let corners = [sign(0) * Vec3::X, sign(1) * Vec3::Y, sign(2) * Vec3::Z];
        let outwards = sign(0) * sign(1) * sign(2) > 0.0;
        triangles.push(if outwards { corners } else { [corners[0], corners[2], corners[1]] });
    }
    for _ in 0..halvings {
        triangles = triangles.into_iter().flat_map(in_four).collect();
    }
    let indices: Vec<_> = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let shape = Shape::new("Ball", ball, triangles.into_iter().flatten(), indices);
    scene.shape(Shape { closed: Some(false), ..shape });
    for axis in 0..3 {
        for side in [-3.0, 3.0] {
            let corner = |[x, y]: [f32; 2]| {
                let mut p = Vec3::ZERO;
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, x, y);
                p
            };
            let mut around = [[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]].map(corner);
            if side > 0.0 {
                around.reverse();
            }
            scene.shape(Shape::quad("Wall", room, around));
        }
    }
    scene.luminaire(Luminaire::Point {
        position: Vec3::new(1.0, 2.5, 1.5),
        intensity: Light::both(Vec3::ONE),
    });
    scene.build().expect("a good scene")
}

/// Both neighbours of an edge find the same middle.
fn in_four([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 4] {
    let middle = |a: Vec3, b: Vec3| (a + b).normalize();
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// Photons at random on a square of 1 m.
fn floor(count: usize) -> Vec<Photon<Invisible>> {
    let mut rng = Rng::new(1, Stream::Test, 0, 0);
    let mut photon = || {
        let [x, z] = rng.f32x2();
        Photon::new(Vec3::new(x, 0.0, z), Vec3::Y, Invisible(Vec3::ONE), 1)
    };
    (0..count).map(|_| photon()).collect()
}
