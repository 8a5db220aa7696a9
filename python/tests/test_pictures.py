"""Pictures, and that they are those of the command."""

import halflight as hl
import numpy as np
import pytest

SPHERES = "builtin:cornell-spheres"


@pytest.mark.parametrize(
    "settings, arguments",
    [
        ({}, []),
        ({"illumination": (0.5, 0.25), "seed": 7}, ["--illumination", "0.5,0.25", "--seed", "7"]),
        ({"illumination": "whitted", "photons": 5000}, ["--illumination", "whitted", "--photons", "5000"]),
        ({"method": "path", "samples": 2}, ["--method", "path", "--samples", "2"]),
        ({"layers": ["all"]}, ["--layers", "all"]),
        ({"max_reflections": 2, "direct": "photons"}, ["--max-reflections", "2", "--direct", "photons"]),
        ({"denoise": True}, ["--denoise"]),
        ({"denoise": True, "layers": ["depth", "denoising-normal"]}, ["--denoise", "--layers", "depth,denoising-normal"]),
        ({"denoise": True, "method": "nearest"}, ["--denoise", "--method", "nearest"]),
    ],
)
def test_pictures_are_those_of_the_command_bit_for_bit(halflight, tmp_path, settings, arguments):
    picture = hl.render(hl.Scene.load(SPHERES), size=(40, 32), passes=3, **settings)
    file = tmp_path / "a.exr"
    halflight("render", SPHERES, "--size", "40x32", "--passes", 3, *arguments, "-o", file)
    theirs = hl.Picture.load(file)
    assert set(picture.layers) - set(theirs.layers) <= {"bias"}
    for layer in theirs.layers:
        assert np.array_equal(picture[layer], theirs[layer], equal_nan=True), layer
    assert np.mean(picture.visible) > 0
    ours = {name: fact for name, fact in picture.facts.items() if name != "seconds"}
    assert ours == {name: fact for name, fact in theirs.facts.items() if name != "seconds"}
    picture.save(tmp_path / "b.png")
    assert (tmp_path / "b.png").read_bytes() == file.with_suffix(".png").read_bytes()
    assert picture._repr_png_() == file.with_suffix(".png").read_bytes()


def test_another_seed_makes_another_picture():
    scene = hl.Scene.load(SPHERES)
    one, other = (hl.render(scene, size=(8, 8), passes=2, seed=seed).visible for seed in (1, 2))
    assert not np.array_equal(one, other)


def test_layers_are_arrays_of_single_precision():
    scene = hl.Scene.load(SPHERES)
    picture = hl.render(scene, size=(12, 8), passes=2, layers=["invisible", "depth", "error"])
    assert picture.layers == ("visible", "invisible", "depth", "error")
    for name, shape in [("visible", (8, 12, 3)), ("invisible", (8, 12, 3)), ("depth", (8, 12))]:
        layer = picture[name]
        assert (layer.shape, layer.dtype) == (shape, np.float32), name
    assert picture.visible.flags.c_contiguous and picture.visible.flags.owndata is False
    picture.visible[:] = 0  # an array of its own
    assert picture.visible.mean() > 0
    with pytest.raises(hl.NoLayer, match="no layer `bias`; it has visible, invisible, depth, error"):
        picture.bias
    assert not hasattr(picture, "bias")


def test_a_saved_picture_is_loaded_as_it_was(tmp_path):
    picture = hl.render(hl.Scene.load(SPHERES), size=(10, 6), passes=3)
    picture.save(tmp_path / "a.exr")
    again = hl.Picture.load(tmp_path / "a.exr")
    assert again.layers == picture.layers == ("visible", "error", "bias")
    assert all(np.array_equal(again[layer], picture[layer]) for layer in again.layers)
    assert again.facts == picture.facts and picture.facts["passes"] == 3
    picture.save(tmp_path / "a.png", exposure=-1, view="agx")
    assert (tmp_path / "a.png").read_bytes() == picture.png(exposure=-1, view="agx") != picture.png()


def test_files_of_other_programs_are_not_replaced_unless_asked_for(tmp_path):
    picture = hl.render(hl.Scene.load(SPHERES), size=(4, 4), passes=1)
    other = tmp_path / "a.png"
    other.write_bytes(b"of another program")
    with pytest.raises(hl.FileError, match="overwrite=True"):
        picture.save(other)
    assert other.read_bytes() == b"of another program"
    picture.save(other, overwrite=True)
    picture.save(other)
    with pytest.raises(hl.UsageError, match="the ending decides"):
        picture.save(tmp_path / "a.tif")


def test_a_denoised_layer_stands_beside_the_picture_and_is_what_is_shown(halflight, tmp_path):
    scene = hl.Scene.load(SPHERES)
    plain, picture = (hl.render(scene, size=(24, 20), photons=3000, passes=6, denoise=denoise) for denoise in (False, True))
    assert picture.layers == (*plain.layers, "denoised")
    assert all(np.array_equal(plain[layer], picture[layer]) for layer in plain.layers)
    assert picture.denoised.shape == (20, 24, 3) and not np.array_equal(picture.denoised, picture.visible)
    assert "bilateral" in picture.facts["denoised"] and "denoised" not in plain.facts
    halflight("render", SPHERES, "--size", "24x20", "--photons", 3000, "--passes", 6, "--denoise", "--exposure", "auto", "-o", tmp_path / "c.exr")
    # Neither is the picture brought to its exposure by what is left of its noise.
    assert picture.png(exposure="auto") == (tmp_path / "c.png").read_bytes() != plain.png(exposure="auto")
    assert picture._repr_png_() != plain._repr_png_()
    picture.save(tmp_path / "a.exr")
    again = hl.Picture.load(tmp_path / "a.exr")
    assert np.array_equal(again.denoised, picture.denoised) and again._repr_png_() == picture._repr_png_()
    for name in ("a.pfm", "a.hdr", "a.jpg"):
        picture.save(tmp_path / name)
        plain.save(tmp_path / ("of_" + name))
        assert (tmp_path / name).read_bytes() != (tmp_path / ("of_" + name)).read_bytes()
    linear = np.frombuffer((tmp_path / "a.pfm").read_bytes()[-12 * 24 * 20 :], np.float32).reshape(20, 24, 3)
    assert np.array_equal(linear[::-1], picture.denoised)


def test_what_has_nothing_to_denoise_says_so():
    scene = hl.Scene.load(SPHERES)
    few = hl.render(scene, size=(8, 8), photons=500, passes=2, denoise=True)
    assert np.array_equal(few.denoised, few.visible) and "too few" in few.facts["denoised"]
    with pytest.raises(hl.NoLayer, match="no layer `denoised`; .* render it with denoise=True"):
        hl.render(scene, size=(8, 8), photons=500, passes=1).denoised
    for wrong, words in (
        ({"method": "path"}, 'method="path" does not tell; use method="photon", or leave it out'),
        ({"denoise": "very"}, "denoise='very': not True or False"),
    ):
        with pytest.raises(hl.UsageError) as told:
            hl.render(scene, size=(8, 8), **{"denoise": True, **wrong})
        assert words in str(told.value) and "\n" not in str(told.value)
    with pytest.raises(hl.UsageError, match="an atlas holds a hundred pictures as they are; leave it out"):
        hl.Atlas(scene, size=(8, 8), passes=1, denoise=True)
