//! What is stored of an atlas comes back, and what makes no sense is none.

use super::*;

fn sample(t: f64, kappa: f64) -> Sample {
    Sample { t, kappa, error: 0.125 }
}

fn some() -> Facts {
    let mut colour = ColourSpread::default();
    for (i, spread) in colour.spread.iter_mut().enumerate() {
        *spread = DVec3::new(0.1 * i as f64, 1.0 / 3.0, 1e-300);
    }
    Facts {
        most: MostOrders { n: 19, m: 9, cut: true },
        at: (0.5, 0.1),
        passes: 12,
        groups: 10,
        frontier: Frontier::from_samples(vec![sample(0.0, 0.9), sample(0.3, 1.0 / 7.0), sample(1.0, 1.3)])
            .expect("rising"),
        colour,
    }
}

#[test]
fn facts_come_back_to_the_last_bit() {
    let bytes = some().to_bytes();
    assert_eq!(Facts::of_bytes(&bytes), Some(some()));
    (0..bytes.len()).for_each(|end| assert_eq!(Facts::of_bytes(&bytes[..end]), None, "{end} bytes"));
    assert_eq!(Facts::of_bytes(&[&bytes[..], &[0]].concat()), None);
}

#[test]
fn facts_that_make_no_sense_are_none() {
    let with = |change: fn(&mut Facts)| {
        let mut facts = some();
        change(&mut facts);
        Facts::of_bytes(&facts.to_bytes())
    };
    assert!(with(|facts| facts.groups = 12).is_some());
    assert_eq!(with(|facts| facts.groups = 13), None, "more groups than passes");
    assert_eq!(with(|facts| facts.groups = 0), None, "passes in no group");
    assert_eq!(with(|facts| facts.most.n = 18), None, "powers that are not stored");
    assert_eq!(with(|facts| facts.most.m = 255), None, "powers that are not stored");
    assert_eq!(with(|facts| facts.at.0 = 1.5), None, "outside the square");
    assert_eq!(with(|facts| facts.at.1 = f32::NAN), None, "outside the square");
}

#[test]
fn sums_of_damaged_facts_are_still_sums() {
    let (good, mut read) = (some().to_bytes(), 0);
    let mut state = 1_u64;
    for _ in 0..300 {
        let mut bad = good.clone();
        for _ in 0..3 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            bad[(state >> 33) as usize % good.len()] = (state >> 20) as u8;
        }
        let Some(Facts { most, at, passes, groups, frontier, colour }) = Facts::of_bytes(&bad) else {
            continue;
        };
        let sums = AtlasSums { passes, groups, colour, ..AtlasSums::new((3, 2), most, at, frontier) };
        assert_eq!(sums.atlas().planes.len(), sums.tables.n.len() * sums.tables.m.len());
        read += 1;
    }
    assert!((1..300).contains(&read), "{read}");
}
