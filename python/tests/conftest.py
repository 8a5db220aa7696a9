"""What tests share."""

import os
import pathlib
import subprocess

import halflight as hl
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def halflight():
    """Runs the command `halflight`, which HALFLIGHT names, else that of the repository."""
    built = [ROOT / "target" / profile / "halflight" for profile in ("release", "quick")]
    named = [pathlib.Path(os.environ["HALFLIGHT"])] if "HALFLIGHT" in os.environ else built
    there = [path for path in named if path.exists()]
    assert there, f"none of {named} is there: cargo build --release, or set HALFLIGHT"

    def run(*arguments):
        subprocess.run([there[0], *map(str, arguments)], check=True, capture_output=True)

    return run


@pytest.fixture
def veil():
    """A floor (albedo 0.5) under a veil that lets a quarter of invisible light through, lit by a point 2 m above."""
    camera = hl.Camera((0, 0.5, 0), (0, 0, 0), up=(0, 0, 1), yfov=0.01)
    scene = hl.Scene("veil", camera=camera, illumination="global")
    corners = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]])
    scene.add_mesh(corners, [[0, 1, 2], [0, 2, 3]], material=hl.Material.diffuse("Floor", 0.5))
    veil = hl.Material.diffuse("Veil", 0)
    veil.straight = np.array([[0.25, 0], [0, 1]])
    scene.add_quad(corners + [0, 1, 0], material=veil)
    scene.add_luminaire(hl.Luminaire.point((0, 2, 0), 3.0))
    return scene
