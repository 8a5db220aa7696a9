#!/usr/bin/env python3
"""The tables in src/measure/flip/nvidia.rs, made anew by NVIDIA's own tool.

    python3 -m venv /tmp/flip && /tmp/flip/bin/pip install flip-evaluator==1.7 numpy
    /tmp/flip/bin/python docs/flip/against_nvidia.py

The pictures are closed formulas of whole numbers, so that Rust makes the same ones, bit by bit. Those of the LDR kind are
sRGB bytes, those of the HDR kind linear and exact as f32. None has a black pixel: whether those count for
the median is where the two differ.
"""

from importlib.metadata import version

import flip_evaluator
import numpy as np


def hashed(x, y, channel, seed):
    """Sixteen bits that look random."""
    wrap = lambda v: v.astype(np.uint64) & 0xFFFF_FFFF
    v = wrap(x * 374761393 + y * 668265263 + channel * 2246822519 + seed * 3266489917)
    v = wrap((v ^ (v >> 13)) * 1274126177)
    return ((v ^ (v >> 16)) & 0xFFFF).astype(np.int64)


def picture(width, height, formula):
    y, x, channel = np.meshgrid(np.arange(height), np.arange(width), np.arange(3), indexing="ij")
    return formula(x, y, channel).astype(np.float32)


def gradient(x, y, c):
    return 8 + x + c * y


def noisy_gradient(x, y, c):
    return gradient(x, y, c) + hashed(x, y, c, 1) % 24


def checks(x, y, c):
    return 20 + 60 * c + 100 * ((x // 8 + y // 8) % 2)


def shifted_checks(x, y, c):
    return 20 + 60 * c + 100 * (((x + y // 29) // 8 + y // 8) % 2)


def noise(x, y, c):
    return 1 + hashed(x, y, c, 2) % 255


def other_noise(x, y, c):
    return 1 + hashed(x, y, c, 3) % 255


def ramp(x, y, c):
    return (1 + (y + 5 * c) % 16) * 2.0 ** (x // 8 - 5)


def noisy_ramp(x, y, c):
    return ramp(x, y, c) * (32 + hashed(x, y, c, 4) % 16) / 32


def lamp(x, y, c):
    return np.where((x - 12) ** 2 + (y - 30) ** 2 < 50, 96.0 - 16 * c, (x + y + 8 * c + 1) / 64)


def dimmer_lamp(x, y, c):
    return np.where((x - 13) ** 2 + (y - 30) ** 2 < 50, 80.0 - 16 * c, (x + y + 6 * c + 1) / 64)


def bright_noise(x, y, c):
    return (1 + hashed(x, y, c, 5)) / 4096


def other_bright_noise(x, y, c):
    return (1 + hashed(x, y, c, 6)) / 4096


PAIRS = [
    ("LDR", 96, 64, noisy_gradient, gradient),
    ("LDR", 61, 87, shifted_checks, checks),
    ("LDR", 7, 5, other_noise, noise),
    ("HDR", 80, 48, noisy_ramp, ramp),
    ("HDR", 33, 47, dimmer_lamp, lamp),
    ("HDR", 6, 9, other_bright_noise, bright_noise),
]


def main():
    print(f"// flip-evaluator {version('flip-evaluator')}")
    for kind, width, height, formula, reference in PAIRS:
        scale = 255 if kind == "LDR" else 1
        pair = [picture(width, height, f) / np.float32(scale) for f in (reference, formula)]
        assert all((p > 0).all() for p in pair) and (kind == "HDR" or all((p <= 1).all() for p in pair))
        errors, _, _ = flip_evaluator.evaluate(*pair, kind, applyMagma=False)
        errors = errors.reshape(height, width)
        # Two corners, the middle, and three more places.
        places = [(0, 0), (width - 1, height - 1), (width // 2, height // 2)]
        places += [(width - 1, 1), (width // 3, height // 4), (2 * width // 3, 4 * height // 5)]
        pixels = ", ".join(f"({x}, {y}, {errors[y, x]:.6f})" for x, y in places)
        print(f"Known {{ size: [{width}, {height}], picture: {formula.__name__}, reference: {reference.__name__},")
        print(f"mean: {errors.mean(dtype=np.float64):.7f}, pixels: [{pixels}] }},")


if __name__ == "__main__":
    main()
