"""Files as other programs read them."""

import json
import struct

import cv2
import halflight as hl
import mmh3
import numpy as np
import OpenEXR
import pytest

SPHERES = "builtin:cornell-spheres"


@pytest.fixture(scope="module")
def picture():
    return hl.render(hl.Scene.load(SPHERES), size=(20, 12), passes=2, layers=["all"])


def test_opencv_reads_float_maps_bit_for_bit_and_radiance_pictures_closely(tmp_path, picture):
    for name in ("a.pfm", "a.hdr"):
        picture.save(tmp_path / name)
        picture.save(tmp_path / name)  # in place of our own
    read = [cv2.imread(str(tmp_path / name), cv2.IMREAD_UNCHANGED)[..., ::-1] for name in ("a.pfm", "a.hdr")]
    assert np.array_equal(read[0], picture.visible)
    largest = picture.visible.max(axis=2, keepdims=True)
    assert (abs(read[1] - picture.visible) <= largest / 255).all() and read[1].mean() > 0


def test_openexr_reads_every_layer_bit_for_bit(tmp_path, picture):
    picture.save(tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        channels = file.channels()
        assert np.array_equal(channels["RGB"].pixels, picture.visible)
        depth = channels["depth.Z"].pixels
        assert np.array_equal(depth, picture["depth"])
        assert file.header()["halflight.passes"] == 2


@pytest.fixture(scope="module")
def mattes(halflight, tmp_path_factory):
    path = tmp_path_factory.mktemp("mattes") / "a.exr"
    halflight("render", SPHERES, "--size", "40x40", "--passes", 1, "--cryptomatte", "-o", path)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        pixels = {name: channel.pixels.copy() for name, channel in file.channels().items()}
        return dict(file.header()), pixels


@pytest.mark.parametrize("kind", ["CryptoObject", "CryptoMaterial"])
def test_mattes_are_what_the_specification_says(mattes, kind):
    header, channels = mattes
    key = f"{mmh3.hash(kind, 0, signed=False):08x}"[:7]
    fact = {name: header[f"cryptomatte/{key}/{name}"] for name in ("name", "hash", "conversion", "manifest")}
    assert (fact["name"], fact["hash"], fact["conversion"]) == (kind, "MurmurHash3_32", "uint32_to_float32")
    manifest = json.loads(fact["manifest"])
    for name, stored in manifest.items():
        number = mmh3.hash(name, 0, signed=False)
        if (number >> 23) & 255 in (0, 255):
            number ^= 1 << 23
        assert stored == f"{number:08x}", name
    names = {struct.unpack(">f", bytes.fromhex(stored))[0]: name for name, stored in manifest.items()}
    total = np.zeros((40, 40))
    before = np.full((40, 40), 1.0)
    seen = set()
    for layer in range(3):
        for number, coverage in ("RG", "BA"):
            numbers = channels[f"{kind}{layer:02}.{number}"]
            covered = channels[f"{kind}{layer:02}.{coverage}"]
            assert (covered <= before).all() and ((covered > 0) == (numbers != 0)).all()
            seen |= {names[float(found)] for found in np.unique(numbers[covered > 0])}
            total, before = total + covered, covered
    assert (total <= 1 + 1e-6).all() and total.mean() > 0.5
    assert len(seen) > 2 and seen <= set(manifest)
