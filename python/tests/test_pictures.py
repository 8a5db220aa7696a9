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
    ],
)
def test_pictures_are_those_of_the_command_bit_for_bit(halflight, tmp_path, settings, arguments):
    picture = hl.render(hl.Scene.load(SPHERES), size=(40, 32), passes=3, **settings)
    file = tmp_path / "a.exr"
    halflight("render", SPHERES, "--size", "40x32", "--passes", 3, *arguments, "-o", file)
    theirs = hl.Picture.load(file)
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
