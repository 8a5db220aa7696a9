use super::super::errors;
use super::super::frontier::Sample;
use super::*;
use std::ops::Range;

#[test]
fn spreads_are_those_of_two_sweeps() {
    let samples = [0.0, 1.0].map(|t| Sample { t, kappa: 0.5 + 0.3 * t, error: 0.0 });
    let frontier = Frontier::from_samples(samples.to_vec()).expect("rising");
    let tables = Tables::new(Nodes::up_to(9), Nodes::up_to(4), frontier);
    let mut record = vec![Colours::default(); tables.record()];
    let mut row = Row::default();
    // Orders between nodes too; some passes bring nothing.
    let passes: Vec<Vec<(u8, u8, Vec3)>> = (0..7_u8)
        .map(|pass| {
            let light = |i: u8| Vec3::new(f32::from(pass * i % 5), 1.0, f32::from((pass + i) % 3));
            (0..pass % 4).map(|i| (3 * i, i, light(i))).collect()
        })
        .collect();
    let brightness = |pixel: usize| 1.0 + pixel as f32;
    let mut colour = ColourSpread::default();
    // Groups of one, three, one and two of them.
    let groups = [0..1, 1..4, 4..5, 5..7];
    for group in &groups {
        let mut light = vec![[Vec4::ZERO; ABREAST]; 10 * 5];
        for (n, m, colour) in passes[group.clone()].iter().flatten() {
            let light = &mut light[usize::from(*n) * 5 + usize::from(*m)];
            light.iter_mut().enumerate().for_each(|(i, light)| *light += brightness(i) * colour.extend(0.0));
        }
        let group = Group { before: group.start as u32, passes: group.len() as u32 };
        tables.add(&mut record, &light, group, &mut row);
        colour.add(
            &row.away.map(|away| DVec3::from_array(away.map(|pixels| pixels[1].into()))),
            group.before,
            group.passes,
        );
        row.away = Row::default().away;
    }
    let (sums, spreads) = record.split_at(tables.bins());
    let totals = dispatch!(tables.level, simd => tables.at_grid.of(simd, sums));
    let colour_errors = colour.errors(7, groups.len() as u32);
    for at in 0..POINTS {
        let (s, t) = errors::point(&tables.frontier, at / 5, at % 5);
        let picture = |pass: &Vec<(u8, u8, Vec3)>, channel: usize| -> f64 {
            let term = |(n, m, light): &(u8, u8, Vec3)| {
                s.powi((*n).into()) * t.powi((*m).into()) * f64::from(light[channel])
            };
            pass.iter().map(term).sum()
        };
        for channel in 0..3 {
            let each: Vec<f64> = passes.iter().map(|pass| picture(pass, channel)).collect();
            let mean = each.iter().sum::<f64>() / 7.0;
            let of_group = |group: &Range<usize>| {
                let away = each[group.clone()].iter().sum::<f64>() / group.len() as f64 - mean;
                group.len() as f64 * away * away
            };
            let spread: f64 = groups.iter().map(of_group).sum();
            for (pixel, (total, found)) in totals[at][channel].iter().zip(spreads[at][channel]).enumerate() {
                let brightness = f64::from(brightness(pixel));
                let total = f64::from(*total) / brightness - 7.0 * mean;
                let found = f64::from(found) / (brightness * brightness);
                assert!(total.abs() < 2e-3, "{s} {t}: {mean}");
                assert!((found - spread).abs() < 2e-3 * (1.0 + spread), "{s} {t}: {spread}");
            }
            let (found, expected) = (colour_errors[at][channel], 2.0 * (spread / (7.0 * 3.0)).sqrt());
            assert!((found - expected).abs() < 2e-3 * (1.0 + expected), "{s} {t}: {found} for {expected}");
        }
    }
}
