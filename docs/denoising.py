"""The table of denoising.md: python docs/denoising.py HALFLIGHT FOLDER (with numpy and OpenEXR).

Renders five scenes with --denoise, and once more with another seed as what they are measured against. relMSE is less that one's own
noise; pixels that see a lamp or are brighter than 3, and those three beside them, are left out.
"""

import pathlib
import subprocess
import sys

import numpy as np
import OpenEXR

SCENES = ["builtin:caustic-box", "builtin:cornell-spheres", "builtin:two-spheres", "scenes/gallery.glb", "scenes/still-life.glb"]


def planes(path):
    """The layers of a file, height x width x 3."""
    return {name: np.asarray(channel.pixels, np.float64) for name, channel in OpenEXR.File(str(path)).channels().items()}


def grown(mask, by=3):
    """With the neighbours of what is set."""
    for _ in range(by):
        wide = np.pad(mask, 1)
        mask = np.any([np.roll(wide, (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1)], 0)[1:-1, 1:-1]
    return mask


def flip(halflight, folder, plane, reference):
    """By `halflight diff`, of two pictures."""
    for name, values in (("a", plane), ("b", reference)):
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        channels = {"RGB": np.ascontiguousarray(values, dtype=np.float32)}
        OpenEXR.File(header, channels).write(str(folder / f"{name}.exr"))
    told = subprocess.run([halflight, "diff", folder / "a.exr", folder / "b.exr"], check=True, capture_output=True, text=True)
    return next(line.split()[-1] for line in told.stdout.splitlines() if line.startswith("visible"))


def main(halflight, folder):
    """One line a scene and number of passes."""
    for scene in SCENES:
        name = pathlib.Path(scene.removeprefix("builtin:")).stem
        render = [halflight, "render", scene, "--size", "160x160", "-q", "--denoise", "--layers", "visible,error,emitted"]
        subprocess.run([*render, "--passes", "96", "--seed", "999", "-o", folder / f"{name}.exr"], check=True)
        truth = planes(folder / f"{name}.exr")
        reference, noise = truth["RGB"], truth["error"]
        seen = truth["emitted"].sum(-1) > 0.2 * reference.sum(-1)
        counts = ~grown((reference > 3).any(-1) | seen)
        for passes in (4, 16, 64):
            file = folder / f"{name}-{passes}.exr"
            subprocess.run([*render, "--passes", str(passes), "--seed", "1", "-o", file], check=True)
            cells = []
            for plane in (planes(file)["RGB"], planes(file)["denoised"]):
                square = ((plane - reference) ** 2 - noise**2) / (reference**2 + 1e-4)
                cells += [f"{square[counts].mean():.3g}", flip(halflight, folder, plane, reference)]
            print(f"| {name} | {passes} | {cells[0]} | {cells[2]} | {cells[1]} | {cells[3]} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], pathlib.Path(sys.argv[2]))
