//! Whole passes and their stages: `cargo bench --bench frames`.

mod omission_scenes;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{Mat3, Vec3};
use halflight::film::Layer;
use halflight::gather::{Maps, gather};
use halflight::light::Invisible;
use halflight::photon::Photon;
use halflight::photon_map::PhotonMap;
use halflight::plan::{Plan, Settings};
use halflight::render::{learn, render_pass};
use halflight::scene::{Illumination, Scene};
use halflight::shoot::shoot;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use omission_scenes::What;
use std::hint::black_box;

fn plan(scene: &str, illumination: Option<Illumination>) -> Plan {
    let mut scene = Scene::load(format!("builtin:{scene}")).expect("built in");
    scene.illuminate(illumination, &[]).expect("no names");
    Plan::new(scene, Settings::default())
}

/// The stages of a pass of the caustic box: 262,144 photon paths, 512×512 camera paths.
fn stages(c: &mut Criterion) {
    let plan = plan("caustic-box", None);
    let frame = learn(&plan);
    let paths = frame.photons.as_ref().expect("global illumination").paths;
    let mut group = c.benchmark_group("caustic-box");
    group.sample_size(10);

    group.throughput(Throughput::Elements(paths.into()));
    group.bench_function("shoot (paths)", |b| {
        b.iter(|| black_box(shoot::<Invisible>(&plan, &frame, 0)));
    });

    let photons = shoot::<Invisible>(&plan, &frame, 0);
    let stored: usize = photons.by_class.iter().map(Vec::len).sum();
    group.throughput(Throughput::Elements(stored as u64));
    group.bench_function("map (photons stored)", |b| {
        b.iter(|| black_box(photons.clone().by_class.map(PhotonMap::build).map(|map| map.len())));
    });

    let maps = Maps::build(photons, &plan, &frame, 0);
    let pixels = frame.pixels() as u64;
    group.throughput(Throughput::Elements(pixels));
    group.bench_function("gather (camera paths)", |b| {
        b.iter(|| black_box(gather::<_, 1>(&plan, &frame, &maps, 0).pixels.len()));
    });
    group.bench_function("pass", |b| {
        b.iter(|| black_box(render_pass(&plan, &frame, 0, &[Layer::Visible])));
    });
    group.finish();
}

/// ns per photon that a query meets, at the photon density of the caustic box.
fn queries(c: &mut Criterion) {
    let plan = plan("caustic-box", None);
    let frame = learn(&plan);
    let photons = shoot::<Invisible>(&plan, &frame, 0).by_class[2].clone();
    let places: Vec<_> = photons
        .iter()
        .step_by(37)
        .map(|photon| (photon.position, Vec3::from_array(photon.normal.map(f32::from)).normalize()))
        .collect();
    let theirs = Kiddo::new(&photons);
    let map = PhotonMap::build(photons);
    let count = |radius: f32| -> u64 { places.iter().map(|(p, n)| map.count(*p, *n, radius) as u64).sum() };
    let mut group = c.benchmark_group("radius query (photons gathered)");
    group.sample_size(10);
    for radius in [0.02_f32, 0.04, 0.08] {
        group.throughput(Throughput::Elements(count(radius)));
        group.bench_function(format!("radius {radius}"), |b| {
            b.iter(|| places.iter().map(|(p, n)| map.flux(*p, *n, radius, u16::MAX).whole.0).sum::<Vec3>());
        });
        group.bench_function(format!("radius {radius}, kiddo"), |b| {
            b.iter(|| places.iter().map(|(p, n)| theirs.flux(*p, *n, radius)).sum::<Vec3>());
        });
    }
    group.finish();
}

/// The same queries by kiddo as it does best: positions turned by a generic rotation, powers in the order of the tree.
struct Kiddo {
    tree: ImmutableKdTree<f32, 3>,
    turn: Mat3,
    photons: Vec<Photon<Invisible>>,
}

impl Kiddo {
    fn new(photons: &[Photon<Invisible>]) -> Self {
        let turn = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 1.0);
        // In the order of our own tree, which is as near in memory as a Morton curve.
        let near = PhotonMap::build(photons.to_vec()).photons().to_vec();
        let turned: Vec<[f32; 3]> = near.iter().map(|photon| (turn * photon.position).to_array()).collect();
        let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&turned).expect("finite positions");
        Self { tree, turn, photons: near }
    }

    fn flux(&self, position: Vec3, normal: Vec3, radius: f32) -> Vec3 {
        let mut sum = Vec3::ZERO;
        let query = (self.turn * position).to_array();
        self.tree.query(&query).within::<SquaredEuclidean<f32>>(radius * radius).unsorted().visit(|near| {
            let photon = &self.photons[near.item as usize];
            if photon.cos_to(normal) > 0.5 && (photon.position - position).dot(normal).abs() < 0.25 * radius {
                sum += photon.power.0;
            }
        });
        sum
    }
}

/// Whole passes of the paper's Figure 1 scene at the corners of the square.
fn corners(c: &mut Criterion) {
    let mut group = c.benchmark_group("cornell-spheres pass");
    group.sample_size(10);
    let corners =
        [Illumination::GLOBAL, Illumination::SHADOWLESS, Illumination::ONE_BOUNCE, Illumination::LOCAL];
    for illumination in corners {
        let plan = plan("cornell-spheres", Some(illumination));
        let frame = learn(&plan);
        group.bench_function(illumination.describe(), |b| {
            b.iter(|| black_box(render_pass(&plan, &frame, 0, &[Layer::Visible])));
        });
    }
    group.finish();
}

/// Each omission off and on, on a scene where it matters; and all of them on one that needs everything, where they must
/// cost nothing.
fn omissions(c: &mut Criterion) {
    let settings = Settings { width: 256, height: 256, paths: Some(65_536), ..Settings::default() };
    let everything = Settings { keep_everything: true, ..settings.clone() };
    let mut pair = |group: &str, scene: &dyn Fn() -> Scene, keep: &Settings| {
        let mut group = c.benchmark_group(group);
        group.sample_size(10);
        for (name, settings) in [("with", keep), ("without", &settings)] {
            let plan = Plan::new(scene(), settings.clone());
            let frame = learn(&plan);
            group.bench_function(name, |b| {
                b.iter(|| black_box(render_pass(&plan, &frame, 0, &[Layer::Visible])));
            });
        }
        group.finish();
    };
    for row in omission_scenes::rows() {
        let keep = match row.what {
            What::One(what) => Settings { keep: vec![what], ..settings.clone() },
            What::Everything => everything.clone(),
        };
        pair(&format!("omission of {} on {}, {}", row.what.name(), row.scene, row.why), &row.make, &keep);
    }
}

criterion_group!(benches, stages, queries, corners, omissions);
criterion_main!(benches);
