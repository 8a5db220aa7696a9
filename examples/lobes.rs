//! What rough lobes pass on of the light of a white room, by roughness and angle: the table of docs/lobes.md.
//!
//! `cargo run --release --example lobes`

use glam::Vec3;
use halflight::optics::{
    Clear, Diffuse, Glossy, Layers, Lobe, Normals, RoughDielectric, RoughThin, Sheen, Transport,
};
use halflight::sampling::Sobol;

const ROUGHNESSES: [f32; 7] = [0.001, 0.01, 0.05, 0.1, 0.3, 0.6, 1.0];
/// Cosines of the angle at which light comes.
const COSINES: [f32; 3] = [1.0, 0.5, 0.1];
const SAMPLES: u32 = 1 << 16;

/// Power that leaves of one that comes at cosine `mu`, below zero from behind.
fn passed_on(lobes: &[Lobe], mu: f32) -> f64 {
    let normals = Normals::flat(Vec3::Z);
    let from = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let sobol = Sobol::new(5);
    let carried = |lobe: &Lobe| -> f64 {
        let one = |i| lobe.sample(&normals, from, Transport::Shooting, sobol.point::<3>(i, 0));
        (0..SAMPLES).filter_map(one).map(|sample| f64::from(sample.weight.x)).sum()
    };
    lobes.iter().map(carried).sum::<f64>() / f64::from(SAMPLES)
}

fn row(name: &str, side: f32, lobes: impl Fn(f32) -> Vec<Lobe>) {
    let cells = ROUGHNESSES.map(|roughness| {
        let lobes = lobes(roughness);
        COSINES.map(|mu| format!("{:.3}", passed_on(&lobes, side * mu))).join(" ")
    });
    println!("| {name} | {} |", cells.join(" | "));
}

fn main() {
    println!("| lobe | {} |", ROUGHNESSES.map(|roughness| roughness.to_string()).join(" | "));
    println!("|---|{}", "---|".repeat(ROUGHNESSES.len()));
    let mirror = |f0: f32, alpha: [f32; 2]| {
        Lobe::Glossy(Glossy::new(Vec3::splat(f0), Vec3::ONE, alpha, Vec3::X, false))
    };
    let square = |roughness: f32| roughness * roughness;
    let tint = Vec3::ONE;
    row("white metal", 1.0, |r| vec![mirror(1.0, [square(r); 2])]);
    row("brushed white metal, seen along", 1.0, |r| {
        vec![mirror(1.0, [square(r), square(0.5 * r).max(1e-6)])]
    });
    row("the same, seen across", 1.0, |r| vec![mirror(1.0, [square(0.5 * r).max(1e-6), square(r)])]);
    row("glaze of index 1.5 over white", 1.0, |r| {
        let clear = Clear { f0: 0.04, f90: 1.0, alpha: square(r) };
        let under = Some(Layers::NONE.with_clear(clear));
        vec![mirror(0.04, [square(r); 2]), Lobe::Diffuse(Diffuse { albedo: tint, two_sided: false, under })]
    });
    let glass = |r: f32| vec![Lobe::RoughDielectric(RoughDielectric { ior: 1.5, alpha: square(r), tint })];
    row("glass of index 1.5, from outside", 1.0, glass);
    row("the same, from inside", -1.0, glass);
    row("thin glass", 1.0, |r| vec![Lobe::RoughThin(RoughThin { ior: 1.5, alpha: square(r), tint })]);
    row("sheen of colour 1", 1.0, |r| {
        vec![Lobe::Sheen(Sheen { colour: tint, alpha: square(r), two_sided: false })]
    });
}
