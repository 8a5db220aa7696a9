use super::*;

fn image(size: [u32; 2], texels: Vec<u8>, encoding: Encoding) -> Arc<Image> {
    Arc::new(Image::new("test", size, texels, encoding).expect("as many texels as it says"))
}

/// Black and white squares of one texel.
fn checker(size: u32) -> Arc<Image> {
    let texel = |i: u32| if (i % size + i / size).is_multiple_of(2) { 255 } else { 0 };
    image([size, size], (0..size * size).map(texel).collect(), Encoding::Colour)
}

fn nearest(image: &Arc<Image>, wrap: [Wrap; 2]) -> Texture {
    Texture { sampler: Sampler { wrap, linear: false }, ..Texture::new(Arc::clone(image)) }
}

#[test]
fn colours_are_decoded_and_numbers_stand_as_they_are() {
    let texels = vec![188, 255, 0, 51];
    let colour = Texture::new(image([1, 1], texels.clone(), Encoding::Colour)).at(Vec2::ZERO, 0.0);
    assert!((colour - Vec4::new(0.5029, 1.0, 0.0, 0.2)).length() < 1e-4, "{colour}");
    let data = Texture::new(image([1, 1], texels, Encoding::Data)).at(Vec2::ZERO, 0.0);
    assert!((data - Vec4::new(188.0 / 255.0, 1.0, 0.0, 0.2)).length() < 1e-6, "{data}");
}

#[test]
fn channels_that_say_nothing_are_not_kept() {
    let kept = |texels: Vec<u8>| image([2, 1], texels, Encoding::Data).channels();
    assert_eq!(kept(vec![1, 2]), 1);
    assert_eq!(kept(vec![1, 255, 2, 255]), 1);
    assert_eq!(kept(vec![1, 255, 2, 254]), 2);
    assert_eq!(kept(vec![1, 1, 1, 9, 9, 9]), 1);
    assert_eq!(kept(vec![1, 1, 2, 9, 9, 9]), 3);
    assert_eq!(kept(vec![1, 1, 1, 255, 9, 9, 9, 7]), 2);
    assert_eq!(kept(vec![1, 1, 2, 255, 9, 9, 9, 255]), 3);
    assert_eq!(kept(vec![1, 1, 2, 255, 9, 9, 9, 0]), 4);
    for (size, n) in [([2, 1], 3), ([2, 1], 0), ([0, 1], 0), ([2, 1], 10), ([1 << 31, 1 << 31], 4)] {
        assert_eq!(Image::new("test", size, vec![0; n], Encoding::Data), None, "{size:?} {n}");
    }
}

#[test]
fn images_go_on_beyond_their_edges() {
    let row = image([4, 1], vec![10, 20, 30, 40], Encoding::Data);
    let at = |wrap: Wrap, u: f32| {
        let texel = nearest(&row, [wrap, Wrap::Repeat]).at(Vec2::new(u, 0.5), 0.0).x;
        (255.0 * texel).round() as u8
    };
    let along = |wrap| (-6..10).map(|i| at(wrap, (i as f32 + 0.5) / 4.0)).collect::<Vec<_>>();
    assert_eq!(along(Wrap::Repeat), [30, 40, 10, 20, 30, 40, 10, 20, 30, 40, 10, 20, 30, 40, 10, 20]);
    assert_eq!(along(Wrap::Mirrored), [30, 40, 40, 30, 20, 10, 10, 20, 30, 40, 40, 30, 20, 10, 10, 20]);
    assert_eq!(along(Wrap::Clamp), [10, 10, 10, 10, 10, 10, 10, 20, 30, 40, 40, 40, 40, 40, 40, 40]);
    for wrap in [Wrap::Repeat, Wrap::Mirrored, Wrap::Clamp] {
        for u in [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, f32::MAX, -f32::MAX, 1e9, -0.0, 1.0] {
            for linear in [true, false] {
                for width in [0.0, 1e-3, 0.3, 1.0, f32::MAX, f32::INFINITY] {
                    let sampler = Sampler { wrap: [wrap; 2], linear };
                    let texture = Texture { sampler, ..Texture::new(Arc::clone(&row)) };
                    let value = texture.at(Vec2::new(u, u), width).x;
                    assert!((0.03..0.16).contains(&value), "{wrap:?} {u} {width}: {value}");
                }
            }
        }
    }
}

#[test]
fn between_texels_values_are_between() {
    let row = image([2, 1], vec![0, 255], Encoding::Data);
    let texture = |wrap| {
        let sampler = Sampler { wrap: [wrap, Wrap::Repeat], linear: true };
        Texture { sampler, ..Texture::new(Arc::clone(&row)) }
    };
    for (wrap, u, expected) in [
        (Wrap::Repeat, 0.25, 0.0),
        (Wrap::Repeat, 0.5, 0.5),
        (Wrap::Repeat, 0.625, 0.75),
        (Wrap::Repeat, 1.0, 0.5),
        (Wrap::Mirrored, 1.0, 1.0),
        (Wrap::Clamp, 1.0, 1.0),
        (Wrap::Clamp, 0.0, 0.0),
    ] {
        let value = texture(wrap).at(Vec2::new(u, 0.3), 0.0).x;
        assert!((value - expected).abs() < 1e-6, "{wrap:?} {u}: {value}");
    }
}

#[test]
fn smaller_versions_have_the_same_mean_in_linear_light() {
    for (size, n) in [([5, 3], 15), ([8, 8], 64), ([1, 7], 7), ([37, 2], 74), ([64, 1], 64)] {
        let texels: Vec<u8> = (0..3 * n).map(|i: u32| (i * i * 37 + i * 11) as u8).collect();
        for encoding in [Encoding::Colour, Encoding::Data] {
            let image = image(size, texels.clone(), encoding);
            let texture = Texture::new(Arc::clone(&image));
            let whole = texture.at(Vec2::new(0.37, 0.81), 1e3);
            assert!((whole - image.mean()).abs().max_element() < 1e-4, "{size:?}: {whole} {}", image.mean());
        }
    }
    // Half of the light of white is not half of its number.
    assert!((Texture::new(checker(64)).at(Vec2::ZERO, 1.0).x - 0.5).abs() < 1e-4);
    // What is dark is as true.
    let dark = image([4, 4], vec![10; 16], Encoding::Colour);
    let (fine, coarse) = (dark.mean().x, Texture::new(Arc::clone(&dark)).at(Vec2::ZERO, 1.0).x);
    assert!((coarse / fine - 1.0).abs() < 1e-3, "{fine} {coarse}");
}

#[test]
fn a_checker_that_is_far_away_is_grey() {
    let texture = Texture::new(checker(256));
    let spread = |width: f32| {
        let values: Vec<f32> = (0..1000)
            .map(|i| {
                let i = i as f32;
                texture.at(Vec2::new(0.618_034 * i, 0.414_214 * i), width).x
            })
            .collect();
        let mean = values.iter().sum::<f32>() / 1000.0;
        (mean, (values.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / 1000.0).sqrt())
    };
    let (mean, near) = spread(0.0);
    assert!((mean - 0.5).abs() < 0.02 && near > 0.15, "{mean} {near}");
    let (mean, far) = spread(4.0 / 256.0);
    assert!((mean - 0.5).abs() < 1e-3 && far < 1e-3, "{mean} {far}");
    let (_, between) = spread(2.0_f32.sqrt() / 256.0);
    assert!(between < 0.6 * near && between > 0.3 * near, "{between} of {near}");
}

#[test]
fn a_transform_comes_before_the_image_and_scales_what_looks() {
    let wide = Texture { transform: Affine2::from_scale(Vec2::splat(8.0)), ..Texture::new(checker(64)) };
    let plain = Texture::new(checker(64));
    let uv = Vec2::new(0.0123, 0.0345);
    assert_eq!(wide.at(uv, 0.01), plain.at(8.0 * uv, 0.08));
    let inputs = Inputs { uvs: [Vec2::ZERO, uv], widths: [0.0, 0.01], ..Inputs::default() };
    assert_eq!(Texture { set: 1, ..plain.clone() }.of(&inputs), plain.at(uv, 0.01));
}

#[test]
fn what_is_seen_of_an_image_is_its_content() {
    let texels: Vec<u8> = (0..75).collect();
    let content = |size, texels: &[u8], encoding| image(size, texels.to_vec(), encoding).content();
    let first = content([5, 5], &texels, Encoding::Data);
    assert_eq!(first, content([5, 5], &texels, Encoding::Data));
    assert_ne!(first, content([5, 5], &texels, Encoding::Colour));
    assert_ne!(first, content([25, 1], &texels, Encoding::Data));
    for i in 0..75 {
        let mut other = texels.clone();
        other[i] ^= 0x80;
        assert_ne!(first, content([5, 5], &other, Encoding::Data), "{i}");
    }
}
