"""Every picture of the illumination square."""

import time

import halflight as hl
import numpy as np
import pytest


@pytest.fixture(scope="module")
def atlas():
    scene = hl.Scene.load("builtin:cornell-spheres")
    return hl.Atlas(scene, size=(24, 24), passes=4, photons=5000)


def test_a_point_is_that_of_the_command_bit_for_bit(halflight, tmp_path, atlas):
    atlas.save(tmp_path / "atlas.exr")
    halflight("mix", tmp_path / "atlas.exr", "--at", "0.7,0.2", "-o", tmp_path / "mix.exr")
    theirs = hl.Picture.load(tmp_path / "mix.exr")
    ours = hl.Atlas.load(tmp_path / "atlas.exr").at(0.7, 0.2)
    for layer in ("visible", "error"):
        assert np.array_equal(ours[layer], theirs[layer]), layer
    # In the file numbers have 11 bits.
    assert np.allclose(atlas.at(0.7, 0.2).visible, ours.visible, rtol=1e-3, atol=1e-6)


def test_the_command_s_atlas_is_read(halflight, tmp_path):
    file = tmp_path / "a.exr"
    settings = ["--size", "16x16", "--passes", 4, "--photons", 2000]
    halflight("render", "builtin:cornell-spheres", *settings, "--atlas", "-o", file)
    scene = hl.Scene.load("builtin:cornell-spheres")
    ours = hl.Atlas(scene, size=(16, 16), passes=4, photons=2000)
    ours.save(tmp_path / "b.exr")
    theirs = hl.Atlas.load(file)
    assert (theirs.size, theirs.passes) == (ours.size, ours.passes) == ((16, 16), 4)
    for point in [(0, 0), (1, 0), (0.3, 0.9)]:
        mixed = [atlas.at(*point).visible for atlas in (theirs, hl.Atlas.load(tmp_path / "b.exr"))]
        assert np.array_equal(*mixed)


def test_a_picture_at_512_takes_no_longer_than_a_slider_waits():
    scene = hl.Scene.load("builtin:cornell-spheres")
    atlas = hl.Atlas(scene, size=(512, 512), passes=2, photons=20_000)
    times = []
    for i in range(7):
        begin = time.perf_counter()
        atlas.at(0.5, i / 6)
        times.append(time.perf_counter() - begin)
    print(f"atlas.at: {1000 * min(times):.1f} to {1000 * max(times):.1f} ms")
    assert min(times) < 0.05


def test_what_has_no_atlas_is_told(tmp_path, atlas):
    with pytest.raises(hl.UsageError, match="outside the square"):
        atlas.at(1.1, 0)
    scene = hl.Scene.load("builtin:cornell-spheres")
    with pytest.raises(hl.UsageError, match="makes no atlas"):
        hl.Atlas(scene, size=(8, 8), method="path")
    hl.render(scene, size=(4, 4), passes=1).save(tmp_path / "a.exr")
    with pytest.raises(hl.FileError, match="holds no atlas"):
        hl.Atlas.load(tmp_path / "a.exr")
    places = [sample["t"] for sample in atlas.frontier()]
    assert places[-1] == 1 and places == sorted(places)
