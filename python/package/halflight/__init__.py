"""Renders scenes lit by vector-valued light: one half of it travels, the other is seen.

    import halflight as hl

    scene = hl.Scene.load("builtin:cornell-spheres")
    picture = hl.render(scene, size=(256, 256), illumination=(1, 0), passes=16)
    picture.save("spheres.png")

Lengths are metres, colours linear RGB, pictures radiance (W m⁻² sr⁻¹) as float32 arrays of shape (height, width, 3).
"""

from ._core import (
    Atlas,
    Camera,
    Luminaire,
    Material,
    Picture,
    Render,
    Scene,
    State,
    __version__,
    check,
    compare,
    multiplication_factor,
    plan,
    render,
)
from ._errors import Error, FileError, NoImage, NoLayer, SceneError, UsageError

__all__ = [
    "Atlas",
    "Camera",
    "Error",
    "FileError",
    "Luminaire",
    "Material",
    "NoImage",
    "NoLayer",
    "Picture",
    "Render",
    "Scene",
    "SceneError",
    "State",
    "UsageError",
    "__version__",
    "check",
    "compare",
    "multiplication_factor",
    "plan",
    "render",
]
