use super::super::frontier::Sample;
use super::*;
use fearless_simd::{Level, dispatch};
use glam::Vec3;

fn frontier(kappa: impl Fn(f64) -> f64) -> Frontier {
    let samples = [0.0, 0.03, 0.1, 0.25, 0.5, 0.75, 1.0].map(|t| Sample { t, kappa: kappa(t), error: 0.0 });
    Frontier::from_samples(samples.to_vec()).expect("rising")
}

/// The pairs of nodes that stand for (n, m), and their weights.
fn of(shares: &Shares, n: u8, m: u8) -> Vec<(usize, f32)> {
    let colour = [1.0, 2.0, -0.5];
    // The second pixel is twice as bright as the first, and so on.
    let mut light = vec![[Vec4::ZERO; ABREAST]; usize::from(n) * shares.across + usize::from(m) + 1];
    for (i, light) in light.last_mut().expect("one").iter_mut().enumerate() {
        *light = (i as f32 + 1.0) * Vec3::from_array(colour).extend(7.0);
    }
    let mut sums = vec![Colours::default(); shares.nodes.len() * shares.across_powers.len()];
    let mut room = Room::default();
    for _ in 0..2 {
        dispatch!(Level::new(), simd => shares.share_out(simd, &light, &mut room, &mut sums));
    }
    let of_bin = |(bin, sum): (usize, &Colours)| {
        let weight = sum[0][0];
        for (pixels, colour) in sum.iter().zip(colour) {
            for (i, x) in pixels.iter().enumerate() {
                let expected = (i as f32 + 1.0) * colour * weight;
                assert!((x - expected).abs() < 1e-5 * (1.0 + expected.abs()), "{sum:?}");
            }
        }
        (weight != 0.0).then_some((bin, weight))
    };
    sums.iter().enumerate().filter_map(of_bin).collect()
}

/// The largest error of sⁿ tᵐ over all points that have an image, over the largest that it is.
fn worst(frontier: &Frontier, most: u8, pairs: &[(u8, u8)]) -> f64 {
    let (nodes_n, nodes_m) = (Nodes::up_to(most), Nodes::up_to(28));
    let shares = Shares::new(&nodes_n, &nodes_m, frontier);
    let points: Vec<(f64, f64)> = (0..=40)
        .flat_map(|i| {
            let t = f64::from(i) / 40.0;
            let most_s = frontier.largest_s(t);
            (0..=40).map(move |j| (most_s * f64::from(j) / 40.0, t))
        })
        .collect();
    let off = |&(n, m): &(u8, u8)| {
        let (mut error, mut largest) = (0.0_f64, 0.0_f64);
        let shares = of(&shares, n, m);
        for &(s, t) in &points {
            let (across, along) = (nodes_n.weights(s), nodes_m.weights(t));
            let mut fit = 0.0;
            for &(bin, w) in &shares {
                let (i, j) = (bin / along.len(), bin % along.len());
                fit += f64::from(w) * across[i] * along[j];
            }
            let truth = s.powi(n.into()) * t.powi(m.into());
            (error, largest) = (error.max((fit - truth).abs()), largest.max(truth));
        }
        error / largest
    };
    pairs.iter().map(off).fold(0.0, f64::max)
}

#[test]
fn every_pair_is_near_its_nodes_where_images_exist() {
    let pairs = [(5, 0), (5, 5), (7, 11), (11, 3), (16, 16), (24, 8), (24, 24), (28, 21)];
    let everywhere = frontier(|t| 0.5 + 0.2 * t);
    assert!(worst(&everywhere, 28, &pairs) < 1e-3, "{}", worst(&everywhere, 28, &pairs));
}

#[test]
fn pictures_are_those_of_the_whole_series() {
    // Light that is multiplied by a + b t from one reflection to the next: L[n][m] is binomial.
    for (a, b, allowed) in
        [(0.6, 0.2, 1e-4), (0.6, 0.39, 3e-4), (0.95, 0.196, 1.5e-3), (0.8, 0.5, 5e-3), (0.8, 1.2, 0.1)]
    {
        let kappa = |t: f64| a + b * t;
        let frontier = frontier(kappa);
        let (nodes_n, nodes_m) = (Nodes::up_to(92), Nodes::up_to(42));
        let shares = Shares::new(&nodes_n, &nodes_m, &frontier);
        let mut planes = vec![0.0; nodes_n.len() * nodes_m.len()];
        let mut terms = Vec::new();
        for n in 0..=92_u8 {
            let mut light = f64::powi(a, n.into());
            for m in 0..=n.min(42) {
                terms.push((n, m, light));
                for (bin, weight) in of(&shares, n, m) {
                    planes[bin] += f64::from(weight) * light;
                }
                light *= b / a * f64::from(n - m) / f64::from(m + 1);
            }
        }
        for t in [0.05, 0.3, 0.6, 0.8, 1.0] {
            for share in [0.2, 0.4, 0.6, 0.8, 0.9, 0.95] {
                let s = share * frontier.largest_s(t);
                if s * kappa(t) > 0.97 {
                    continue;
                }
                let (across, along) = (nodes_n.weights(s), nodes_m.weights(t));
                let of_plane =
                    |(i, plane): (usize, &f64)| across[i / along.len()] * along[i % along.len()] * plane;
                let mixed: f64 = planes.iter().enumerate().map(of_plane).sum();
                let of_term =
                    |(n, m, light): &(u8, u8, f64)| light * s.powi((*n).into()) * t.powi((*m).into());
                let whole: f64 = terms.iter().map(of_term).sum();
                let off = mixed / whole - 1.0;
                assert!(off.abs() < allowed, "{a} + {b} t at {s},{t}: {off:.1e}");
            }
        }
    }
}

#[test]
fn low_powers_are_their_own_and_weights_add_up() {
    let (n, m) = (Nodes::up_to(10), Nodes::up_to(3));
    assert_eq!(n.powers(), [0, 1, 2, 3, 4, 6, 9, 13]);
    let shares = Shares::new(&n, &m, &frontier(|_| 0.5));
    assert_eq!(of(&shares, 4, 2), [(4 * 4 + 2, 1.0)]);
    let sum: f32 = of(&shares, 5, 3).iter().map(|(_, w)| w).sum();
    assert!((sum - 1.0).abs() < 1e-5, "{sum}");
    assert_eq!(Nodes::up_to(0).powers(), [0]);
    assert_eq!(Nodes::up_to(200).last(), 92);
    assert_eq!(Nodes::from_powers(vec![0, 2, 2]), None);
}
