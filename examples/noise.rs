//! What the noise of a pass consists of, and where its time goes: by class of light, as Markdown.
//!
//! `cargo run --release --example noise -- SCENE [PASSES [FIRST [SIZE]]]`: relMSE of one pass by class of light, measured as the
//! spread of PASSES passes from pass FIRST on (radii shrink with it); seconds are wall time, medians.

use glam::{DVec3, Vec3};
use halflight::film::Layer;
use halflight::gather::{Gathered, Maps, gather};
use halflight::light::{Invisible, Light, Power};
use halflight::measure::mask::{brighter_than, dilated};
use halflight::plan::{Frame, Plan, Settings};
use halflight::render::learn;
use halflight::scene::Scene;
use halflight::shoot::shoot;
use std::time::Instant;

/// As in [`halflight::measure`]: keeps relative errors of dark pixels finite.
const EPSILON: f64 = 0.01;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().unwrap_or_else(|| "builtin:caustic-box".into());
    let mut number = |default: u32| arguments.next().map_or(default, |text| text.parse().expect("a number"));
    let (passes, first, size) = (number(8).max(2), number(0), number(512));
    let plan = Plan::new(Scene::load(&scene).expect("a scene"), Settings::for_film(size, size));
    let frame = learn(&plan);
    let photons = frame.photons.as_ref().expect("a scene with photons");
    let classes = [Layer::Direct, Layer::Caustic, Layer::Indirect, Layer::Visible];
    let mut sums = classes.map(|_| vec![[DVec3::ZERO; 2]; (size * size) as usize]);
    let mut emitted = vec![Vec3::ZERO; (size * size) as usize];
    let mut seconds = [(); 3].map(|()| Vec::new());
    let mut stored = [0; 3];
    for pass in first..first + passes {
        let took;
        let gathered;
        (gathered, took, stored) = if photons.both_halves {
            render::<Light>(&plan, &frame, pass)
        } else {
            render::<Invisible>(&plan, &frame, pass)
        };
        seconds.iter_mut().zip(took).for_each(|(all, took)| all.push(took));
        for (i, pixel) in gathered.pixels.iter().enumerate() {
            let parts = pixel.parts[0];
            emitted[i] += parts.emitted;
            for (sums, value) in
                sums.iter_mut().zip([parts.direct, parts.caustic, parts.indirect, parts.total()])
            {
                let value = value.as_dvec3();
                sums[i][0] += value;
                sums[i][1] += value * value;
            }
        }
    }
    let n = f64::from(passes);
    let total = &sums[3];
    let means: Vec<Vec3> = total.iter().map(|[sum, _]| (*sum / n).as_vec3()).collect();
    let lamps = brighter_than(&emitted, 0.0);
    let bright = brighter_than(&means, 3.0);
    let marked: Vec<bool> = lamps.iter().zip(&bright).map(|(a, b)| *a || *b).collect();
    let masked = dilated(&marked, size, 3);
    println!(
        "{scene}, {size}x{size}, passes {first} to {}, {} paths each",
        first + passes - 1,
        photons.paths
    );
    println!(
        "\n| class | relMSE of a pass | in its noisiest 5 % of pixels | share of light |\n|---|---|---|---|"
    );
    for (class, sums) in classes.iter().zip(&sums) {
        let mut relative: Vec<f64> = sums
            .iter()
            .zip(total)
            .zip(&masked)
            .filter(|(_, masked)| !**masked)
            .map(|(([sum, squares], [all, _]), _)| {
                let variance = (*squares - *sum * *sum / n) / (n - 1.0);
                let mean = *all / n;
                (variance / (mean * mean + EPSILON * EPSILON)).element_sum() / 3.0
            })
            .collect();
        relative.sort_by(f64::total_cmp);
        let all: f64 = relative.iter().sum();
        let most: f64 = relative[relative.len() - relative.len() / 20..].iter().sum();
        let light = |sums: &[[DVec3; 2]]| sums.iter().map(|[sum, _]| sum.element_sum()).sum::<f64>();
        let share = light(sums) / light(total);
        println!(
            "| {class} | {:.5} | {:.0} % | {share:.3} |",
            all / relative.len() as f64,
            100.0 * most / all
        );
    }
    println!("\nphotons stored: {stored:?} (direct, caustic, indirect)");
    let [shoot, map, gather] = seconds.map(|mut seconds| {
        seconds.sort_by(f64::total_cmp);
        seconds[seconds.len() / 2]
    });
    println!(
        "shoot {shoot:.3} s, map {map:.3} s, gather {gather:.3} s, together {:.3} s",
        shoot + map + gather
    );
}

/// One pass, the seconds of its three stages, and the photons stored by class.
fn render<P: Power>(plan: &Plan, frame: &Frame, pass: u32) -> (Gathered<1>, [f64; 3], [usize; 3]) {
    let begin = Instant::now();
    let shot = shoot::<P>(plan, frame, pass);
    let shooting = begin.elapsed().as_secs_f64();
    let stored = std::array::from_fn(|class| shot.by_class[class].len());
    let begin = Instant::now();
    let maps = Maps::build(shot, plan, frame, pass);
    let mapping = begin.elapsed().as_secs_f64();
    let begin = Instant::now();
    let gathered = gather(plan, frame, &maps, pass);
    (gathered, [shooting, mapping, begin.elapsed().as_secs_f64()], stored)
}
