//! What lobes make of a white room, by roughness and angle, as the table of docs/lobes.md: `cargo run --release --example lobes`.

use glam::Vec3;
use halflight::optics::{Glossy, Lobe, Normals, Transport};
use halflight::sampling::Sobol;

/// What a lobe passes on of light of radiance one from everywhere, by samples.
fn furnace(lobe: &Lobe, mu: f32) -> f64 {
    let n = 1 << 16;
    let from = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let sobol = Sobol::new(5);
    let normals = Normals::flat(Vec3::Z);
    let carried = |i: u32| {
        let sample = lobe.sample(&normals, from, Transport::Gathering, sobol.point::<3>(i, 0));
        sample.map_or(0.0, |sample| f64::from(sample.weight.x))
    };
    (0..n).map(carried).sum::<f64>() / f64::from(n)
}

fn main() {
    let mus = [1.0, 0.9, 0.5, 0.2, 0.1, 0.03, 0.01, 0.001];
    for r in [1e-3_f32, 0.01, 0.05, 0.1, 0.3, 0.6, 1.0] {
        let lobe = Lobe::Glossy(Glossy::new(Vec3::ONE, Vec3::ONE, [r * r; 2], Vec3::X, true));
        let row: Vec<String> = mus.iter().map(|mu| format!("{:.4}", furnace(&lobe, *mu))).collect();
        println!("| {r} | {} |", row.join(" | "));
    }
}
