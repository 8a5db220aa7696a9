from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, TypedDict, Union

import numpy as np
import numpy.typing as npt

__version__: str

Array = npt.NDArray[np.float32]
Numbers = npt.ArrayLike
Path = Union[str, PathLike[str]]
#: Three linear numbers, or one for grey.
Color = Union[float, Sequence[float], npt.NDArray[Any]]
#: A name ("global", "local", "shadowless", "one-bounce", "whitted", "S,T", eight numbers) or a point (s, t) of the square.
Illumination = Union[str, tuple[float, float]]
Halves = Union[Literal["both", "invisible"], tuple[float, float]]
Method = Literal["photon", "path", "path-plain", "nearest"]
View = Literal["standard", "neutral", "agx"]

class Progress(TypedDict):
    passes: int
    seconds: float
    noise: float | None
    bias: float | None
    trusted: bool | None

class PlanRow(TypedDict):
    what: str
    how: str
    because: str
    pass_share: float | None
    planning_seconds: float | None
    bytes: int | None

class Factor(TypedDict):
    k: float
    error: float
    image_exists: bool

class CheckRow(TypedDict):
    case: str
    promise: str
    what: str
    expected: float | None
    got: float | None
    error: float | None
    expected_words: str | None
    got_words: str | None
    z: float | None
    relative_error: float | None
    seconds: float
    passes: bool

class CompareRow(TypedDict):
    method: str
    seed: int
    budget: float
    seconds: float
    setup_seconds: float
    passes: int
    photon_paths: int
    camera_samples: int
    relmse_measured: float
    relmse: float
    rmse: float
    bias: float
    relative_bias: float | None
    e_pixel: float
    e_pixel_max: float
    mean_colour: float
    not_finite: int
    compared: int
    flip: float
    reference_too_noisy: bool

class Sample(TypedDict):
    t: float
    kappa: float
    error: float

class Camera:
    def __init__(
        self,
        position: Numbers,
        target: Numbers,
        *,
        up: Numbers = (0, 1, 0),
        yfov: float | None = 0.7,
        half_height: float | None = None,
        aspect: float | None = None,
        aperture: float | None = None,
        focus: float | None = None,
    ) -> None: ...

class Luminaire:
    @staticmethod
    def point(position: Numbers, intensity: Color, *, halves: Halves | None = None) -> Luminaire: ...
    @staticmethod
    def spot(
        position: Numbers,
        direction: Numbers,
        intensity: Color,
        *,
        inner: float = 0.0,
        outer: float = ...,
        halves: Halves | None = None,
    ) -> Luminaire: ...
    @staticmethod
    def warn(
        position: Numbers,
        direction: Numbers,
        intensity: Color,
        *,
        exponent: float = 0.0,
        attenuation: tuple[float, float, float] = (0.0, 0.0, 1.0),
        halves: Halves | None = None,
    ) -> Luminaire: ...
    @staticmethod
    def profile(
        position: Numbers,
        direction: Numbers,
        file: Path,
        *,
        intensity: Color | None = None,
        multiplier: Color | None = None,
        up: Numbers | None = None,
        halves: Halves | None = None,
    ) -> Luminaire: ...
    @staticmethod
    def directional(direction: Numbers, irradiance: Color, *, halves: Halves | None = None) -> Luminaire: ...
    @staticmethod
    def sun(
        direction: Numbers, irradiance: Color, *, angle: float = 0.53, halves: Halves | None = None
    ) -> Luminaire: ...

class Material:
    def __init__(
        self,
        name: str,
        *,
        base_color: Color = 1,
        metallic: float = 0,
        roughness: float = 1,
        specular: float = 1,
        specular_color: Color = 1,
        transmission: float = 0,
        ior: float = 1.5,
        thin: bool = False,
        absorption: Color = 0,
        dispersion: float = 0,
        diffuse_transmission: float = 0,
        diffuse_transmission_color: Color = 1,
        clearcoat: float = 0,
        clearcoat_roughness: float = 0,
        sheen_color: Color = 0,
        sheen_roughness: float = 0,
        iridescence: float = 0,
        iridescence_ior: float = 1.3,
        iridescence_thickness: tuple[float, float] = (100, 400),
        anisotropy: float = 0,
        anisotropy_rotation: float = 0,
        alpha: float = 1,
        alpha_mode: Literal["opaque", "mask", "blend"] = "opaque",
        alpha_cutoff: float = 0.5,
        emission: Color = 0,
        halves: Halves | None = "both",
        unlit: bool = False,
        double_sided: bool = False,
        backs: Literal["seen", "unseen"] = "seen",
        textures: Mapping[str, npt.NDArray[np.uint8]] | None = None,
        illumination: Illumination | None = None,
        opaque: Numbers | None = None,
        straight: Numbers | None = None,
        fluorescence: Numbers | None = None,
        gain: bool = False,
    ) -> None: ...
    @staticmethod
    def diffuse(name: str, albedo: Color | None = None, *, emission: Color | None = None) -> Material: ...
    @staticmethod
    def mirror(name: str, tint: Color | None = None) -> Material: ...
    @staticmethod
    def metal(name: str, base: Color) -> Material: ...
    @staticmethod
    def glass(
        name: str, ior: float = 1.5, *, absorption: Color | None = None, dispersion: float = 0.0
    ) -> Material: ...
    @property
    def name(self) -> str: ...
    @property
    def illumination(self) -> str | None: ...
    @illumination.setter
    def illumination(self, value: Illumination | None) -> None: ...
    @property
    def opaque(self) -> Array | None: ...
    @opaque.setter
    def opaque(self, value: Numbers | None) -> None: ...
    @property
    def straight(self) -> Array | None: ...
    @straight.setter
    def straight(self, value: Numbers | None) -> None: ...

class Scene:
    def __init__(
        self,
        name: str = "scene",
        *,
        camera: Camera | None = None,
        illumination: Illumination | None = None,
        environment: str | float | None = None,
        environment_rotation: float | None = None,
        environment_strength: float | None = None,
        background: str | float | None = None,
    ) -> None: ...
    @staticmethod
    def load(
        path: Path,
        *,
        scene: str | int | None = None,
        camera: str | int | None = None,
        pose: str | float | None = None,
        variant: str | int | None = None,
        environment: str | float | None = None,
        environment_rotation: float | None = None,
        environment_strength: float | None = None,
        background: str | float | None = None,
        max_triangles: int | None = 50_000_000,
    ) -> Scene: ...
    def add_mesh(
        self,
        positions: Numbers,
        triangles: Numbers,
        *,
        material: Material | str,
        normals: Numbers | None = None,
        uvs: Numbers | None = None,
        uvs1: Numbers | None = None,
        colors: Numbers | None = None,
        tangents: Numbers | None = None,
        name: str | None = None,
        closed: bool | None = None,
    ) -> None: ...
    def add_sphere(
        self,
        center: Numbers,
        radius: float,
        *,
        material: Material | str,
        around: int = 64,
        name: str = "sphere",
    ) -> None: ...
    def add_quad(self, corners: Numbers, *, material: Material | str, name: str = "quad") -> None: ...
    def add_luminaire(self, luminaire: Luminaire) -> None: ...
    @property
    def materials(self) -> Mapping[str, Material]: ...
    @property
    def illumination(self) -> str | None: ...
    @illumination.setter
    def illumination(self, value: Illumination | None) -> None: ...
    def set_camera(self, camera: Camera) -> None: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def name(self) -> str: ...
    def hash(self) -> str: ...

class Picture:
    @staticmethod
    def load(path: Path) -> Picture: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def layers(self) -> tuple[str, ...]: ...
    def layer(self, name: str) -> Array: ...
    def __getitem__(self, name: str) -> Array: ...
    @property
    def visible(self) -> Array: ...
    @property
    def invisible(self) -> Array: ...
    @property
    def error(self) -> Array: ...
    @property
    def bias(self) -> Array: ...
    @property
    def denoised(self) -> Array: ...
    @property
    def facts(self) -> dict[str, str | int | float]: ...
    def save(
        self,
        path: Path,
        *,
        exposure: float | Literal["auto"] | None = None,
        view: View | None = None,
        overwrite: bool = False,
    ) -> None: ...
    def png(
        self, *, exposure: float | Literal["auto"] | None = None, view: View | None = None
    ) -> bytes: ...
    def _repr_png_(self) -> bytes: ...

class Render:
    def __init__(
        self,
        scene: Scene,
        *,
        size: tuple[int, int] | None = None,
        illumination: Illumination | None = None,
        method: Method = "photon",
        seed: int = 0,
        layers: Sequence[str] | None = None,
        denoise: bool = False,
        photons: int | None = None,
        samples: int | None = None,
        direct: Literal["auto", "connection", "photons"] = "auto",
        max_reflections: int | None = None,
        indirect_radius: float | None = None,
        caustic_radius: float | None = None,
        nearest: int | None = None,
        cone: float | None = None,
        even_starts: bool = False,
        one_path: bool = False,
        keep_everything: bool = False,
        keep: Sequence[str] = (),
        shard: tuple[int, int] | None = None,
    ) -> None: ...
    def advance(self, passes: int = 1) -> int: ...
    def run(
        self,
        *,
        passes: int | None = None,
        seconds: float | None = None,
        error: float | None = None,
        progress: bool | Callable[[Progress], object] = False,
    ) -> None: ...
    def picture(self) -> Picture: ...
    @property
    def state(self) -> State: ...
    def resume(self, state: State) -> None: ...
    @property
    def passes(self) -> int: ...
    @property
    def noise(self) -> float | None: ...
    @property
    def bias(self) -> float | None: ...
    @property
    def trusted(self) -> bool | None: ...
    @property
    def error(self) -> float | None: ...
    @property
    def plan(self) -> list[PlanRow]: ...

class State:
    @staticmethod
    def load(path: Path) -> State: ...
    def save(self, path: Path, *, overwrite: bool = False) -> None: ...
    @staticmethod
    def merge(states: Sequence[State]) -> State: ...
    def __add__(self, other: State) -> State: ...
    def picture(self, *, denoise: bool = False) -> Picture: ...
    @property
    def passes(self) -> int: ...
    @property
    def pass_numbers(self) -> list[int]: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def layers(self) -> list[str]: ...
    @property
    def seconds(self) -> float: ...
    @property
    def key(self) -> dict[str, str]: ...

class Atlas:
    def __init__(
        self,
        scene: Scene,
        *,
        size: tuple[int, int] | None = None,
        illumination: Illumination | None = None,
        passes: int | None = None,
        seconds: float | None = None,
        error: float | None = None,
        seed: int = 0,
        photons: int | None = None,
        direct: Literal["auto", "connection", "photons"] = "auto",
        max_reflections: int | None = None,
        indirect_radius: float | None = None,
        caustic_radius: float | None = None,
        progress: bool | Callable[[Progress], object] = False,
    ) -> None: ...
    @staticmethod
    def load(path: Path) -> Atlas: ...
    def at(self, s: float, t: float) -> Picture: ...
    def save(self, path: Path, *, overwrite: bool = False) -> None: ...
    def left_out(self, s: float, t: float) -> float: ...
    def frontier(self) -> list[Sample]: ...
    @property
    def passes(self) -> int: ...
    @property
    def size(self) -> tuple[int, int]: ...

def render(
    scene: Scene,
    *,
    size: tuple[int, int] | None = None,
    illumination: Illumination | None = None,
    passes: int | None = None,
    seconds: float | None = None,
    error: float | None = None,
    method: Method = "photon",
    seed: int = 0,
    layers: Sequence[str] | None = None,
    denoise: bool = False,
    photons: int | None = None,
    samples: int | None = None,
    direct: Literal["auto", "connection", "photons"] = "auto",
    max_reflections: int | None = None,
    indirect_radius: float | None = None,
    caustic_radius: float | None = None,
    nearest: int | None = None,
    cone: float | None = None,
    even_starts: bool = False,
    one_path: bool = False,
    keep_everything: bool = False,
    keep: Sequence[str] = (),
    progress: bool | Callable[[Progress], object] = False,
) -> Picture: ...
def plan(
    scene: Scene,
    *,
    savings: bool = False,
    size: tuple[int, int] | None = None,
    illumination: Illumination | None = None,
    method: Method = "photon",
    seed: int = 0,
    layers: Sequence[str] | None = None,
    denoise: bool = False,
    photons: int | None = None,
    samples: int | None = None,
    direct: Literal["auto", "connection", "photons"] = "auto",
    max_reflections: int | None = None,
    indirect_radius: float | None = None,
    caustic_radius: float | None = None,
    nearest: int | None = None,
    cone: float | None = None,
    even_starts: bool = False,
    one_path: bool = False,
    keep_everything: bool = False,
    keep: Sequence[str] = (),
) -> list[PlanRow]: ...
def multiplication_factor(
    scene: Scene, *, illumination: Illumination | None = None, seed: int = 0
) -> Factor: ...
def check(scene: Scene | None = None, *, case: str | None = None, quick: bool = True) -> list[CheckRow]: ...
def compare(
    scene: Scene,
    variants: Sequence[Mapping[str, Any]],
    *,
    budgets: Sequence[float] = (1, 2, 4),
    seeds: int = 3,
    size: tuple[int, int] | None = None,
    illumination: Illumination | None = None,
    max_reflections: int | None = None,
    reference: Picture | None = None,
    reference_seconds: float = 30,
    reference_method: Method = "path",
) -> list[CompareRow]: ...
