//! The same seed gives the same bits, whatever the threads.

use crate::support::small;
use halflight::film::Layer;
use halflight::plan::{Method, Settings};
use halflight::render::Render;
use halflight::scene::Scene;

fn bits(threads: usize, settings: &Settings) -> Vec<[u32; 3]> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    pool.install(|| {
        let scene = Scene::load("builtin:caustic-box").expect("built in");
        let mut render =
            Render::new(scene, settings.clone(), &[Layer::Visible, Layer::Error, Layer::Invisible])
                .expect("a render");
        (0..3).for_each(|_| render.pass());
        let film = render.film();
        let layers = [Layer::Visible, Layer::Error, Layer::Invisible];
        layers
            .iter()
            .flat_map(|layer| film.mean(*layer))
            .map(|rgb| rgb.to_array().map(f32::to_bits))
            .collect()
    })
}

#[test]
fn one_two_and_three_threads_give_the_same_bits() {
    // Enough photons that the map is built in parallel.
    let settings = Settings { seed: 5, ..small(64, 48, 200_000) };
    let one = bits(1, &settings);
    assert!(one.iter().any(|rgb| f32::from_bits(rgb[0]) > 0.0), "a black picture proves nothing");
    for threads in [2, 3] {
        let differing = bits(threads, &settings).iter().zip(&one).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 0, "{threads} threads: {differing} values differ");
    }
    let other_seed = bits(2, &Settings { seed: 6, ..settings });
    assert_ne!(one, other_seed);
}

#[test]
fn nor_do_threads_change_what_the_nearest_photons_say() {
    // So many that kiddo builds its tree in parallel.
    let settings = Settings { method: Method::Nearest, nearest: 30, ..small(32, 24, 200_000) };
    let one = bits(1, &settings);
    assert!(one.iter().any(|rgb| f32::from_bits(rgb[0]) > 0.0), "a black picture proves nothing");
    assert!(one == bits(3, &settings), "3 threads differ from one");
}
