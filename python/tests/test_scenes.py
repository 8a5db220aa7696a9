"""Scenes that are built in code, and materials that are changed."""

import base64
import json
import math

import halflight as hl
import numpy as np
import pytest

#: A quarter of 3 W/sr arrives 2 m below; half of that is reflected, over π.
EXPECTED = 0.25 * 3 / 4 * 0.5 / math.pi


def mean(scene, **settings):
    picture = hl.render(scene, size=(8, 8), passes=4, photons=1000, **settings)
    return float(picture.visible.mean())


def agrees(found, expected):
    return abs(found / expected - 1) < 1e-3


def test_a_scene_built_in_code_has_its_closed_form(veil):
    found = mean(veil)
    assert agrees(found, EXPECTED)
    assert not agrees(found, 1.02 * EXPECTED) and not agrees(found, 0.98 * EXPECTED)


def test_materials_are_known_by_name_and_their_matrices_can_be_set(veil):
    assert list(veil.materials) == ["Floor", "Veil"]
    matter = veil.materials["Veil"]
    assert np.array_equal(matter.straight, np.float32([[0.25, 0], [0, 1]])) and matter.opaque is None
    matter.straight = [[0.5, 0], [0, 1]]
    assert agrees(mean(veil), 2 * EXPECTED)
    matter.straight = None
    assert mean(veil) == 0  # a veil like any other surface
    matter.illumination = (0, 1)
    assert matter.illumination == "local" and agrees(mean(veil), 4 * EXPECTED)
    veil.materials["Floor"].opaque = [[0, 0], [0.5, 0]]
    assert agrees(mean(veil), 2 * EXPECTED)


def test_an_illumination_asked_for_is_that_of_what_has_none_of_its_own(veil):
    assert veil.illumination == "global"
    veil.materials["Veil"].straight = None
    assert mean(veil, illumination="local") == pytest.approx(4 * EXPECTED, rel=1e-3)
    veil.illumination = "shadowless"
    assert mean(veil) == pytest.approx(4 * EXPECTED, rel=1e-3)


def test_materials_of_a_loaded_scene_are_changed_for_what_is_rendered_later():
    scene = hl.Scene.load("builtin:cornell-spheres")
    before = scene.hash()
    name = next(iter(scene.materials))
    scene.materials[name].illumination = "local"
    changed = scene.hash()
    scene.materials[name].illumination = None
    assert before == scene.hash() != changed


@pytest.mark.parametrize("textured", [False, True])
def test_a_scene_built_in_code_is_that_of_a_file_that_says_the_same(tmp_path, textured):
    positions = np.float32([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]])
    triangles = np.uint16([[0, 1, 2], [0, 2, 3]])
    (tmp_path / "a.bin").write_bytes(positions.tobytes() + triangles.tobytes())
    factors = {"baseColorFactor": [0.5, 0.25, 0.125, 1], "metallicFactor": 0.25, "roughnessFactor": 0.5}
    matter = {
        "name": "Floor",
        "pbrMetallicRoughness": factors,
        "doubleSided": True,
        "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25}},
        "extras": {"straight": [0.25, 0, 0, 1]},
    }
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_clearcoat"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 1.5}]}},
        "scenes": [{"nodes": [0, 1, 2], "extras": {"illumination": "shadowless"}}],
        "scene": 0,
        "nodes": [
            {"mesh": 0},
            {"camera": 0, "translation": [0, 1, 4]},
            {"translation": [0, 2, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [matter],
        "buffers": [{"uri": "a.bin", "byteLength": 60}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 4,
                "type": "VEC3",
                "min": [-1, 0, -1],
                "max": [1, 0, 1],
            },
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
    }
    file = tmp_path / "a.gltf"
    file.write_text(json.dumps(document))
    loaded = hl.Scene.load(file)
    camera = hl.Camera((0, 1, 4), (0, 1, 0), yfov=0.5)
    built = hl.Scene(camera=camera, illumination="shadowless")
    floor = hl.Material(
        "Floor",
        base_color=(0.5, 0.25, 0.125),
        metallic=0.25,
        roughness=0.5,
        clearcoat=0.5,
        clearcoat_roughness=0.25,
        double_sided=True,
        straight=[[0.25, 0], [0, 1]],
        textures={"base_color": np.full((2, 2, 3), 128, np.uint8)} if textured else None,
    )
    built.add_mesh(positions, triangles, material=floor, uvs=np.zeros((4, 2)) if textured else None)
    built.add_luminaire(hl.Luminaire.point((0, 2, 0), 1.5))
    pictures = [hl.render(scene, size=(8, 8), passes=2, photons=1000).visible for scene in (loaded, built)]
    assert np.array_equal(*pictures) is not textured and pictures[1].mean() > 0


def test_a_texture_multiplies_the_base_colour():
    def floor(texture, factor):
        scene = hl.Scene(camera=hl.Camera((0, 1, 0.001), (0, 0, 0), yfov=0.1))
        matter = hl.Material("Floor", base_color=factor, specular=0, textures=texture)
        square = [[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]]
        scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]], material=matter, uvs=[[0, 0], [0, 1], [1, 1], [1, 0]])
        scene.add_luminaire(hl.Luminaire.point((0, 2, 0), 1))
        return mean(scene)

    linear = ((188 / 255 + 0.055) / 1.055) ** 2.4
    grey = {"base_color": np.full((4, 4, 3), 188, np.uint8)}
    found, expected = floor(grey, 0.5), floor(None, 0.5 * linear)
    assert agrees(found, expected) and not agrees(found, 1.02 * expected)


def test_vertex_colours_multiply_the_base_colour():
    def floor(color, vertices):
        scene = hl.Scene(camera=hl.Camera((0, 1, 0.001), (0, 0, 0), yfov=0.1))
        square = [[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]]
        matter = hl.Material("Floor", base_color=color, specular=0)
        scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]], material=matter, colors=vertices)
        scene.add_luminaire(hl.Luminaire.point((0, 2, 0), 1))
        return mean(scene)

    found, expected = floor(0.5, np.full((4, 3), 0.5)), floor(0.25, None)
    assert agrees(found, expected) and not agrees(found, 1.02 * expected)


def test_a_dye_sends_out_blue_light_as_green():
    scene = hl.Scene(camera=hl.Camera((0, 1, 0.001), (0, 0, 0), yfov=0.1))
    matter = hl.Material("Floor", base_color=0.1, specular=0, fluorescence=[[0, 0, 0], [0, 0, 0.4], [0, 0, 0]])
    square = [[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]]
    scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]], material=matter)
    scene.add_luminaire(hl.Luminaire.point((0, 2, 0), (0, 0, 1)))
    seen = hl.render(scene, size=(8, 8), passes=2, photons=1000).visible.mean(axis=(0, 1))
    assert seen[0] == 0 and agrees(seen[1] / seen[2], 4)


def test_a_furnace_of_a_constant_environment_is_as_bright_as_it():
    scene = hl.Scene(camera=hl.Camera((0, 0, 5), (0, 0, 0), yfov=0.2), environment="0.5")
    scene.add_sphere((0, 0, 0), 1, material=hl.Material.mirror("Ball", 1))
    assert agrees(mean(scene), 0.5)


@pytest.mark.parametrize(
    "wrong, error, words",
    [
        (lambda: hl.Scene.load("nowhere.glb"), hl.FileError, "nowhere.glb: "),
        (lambda: hl.Scene.load("builtin:nothing"), hl.SceneError, "builtin:nothing"),
        (lambda: hl.render(hl.Scene("empty")), hl.SceneError, "empty: has no camera"),
        (lambda: hl.render(hl.Scene.load("builtin:concentric"), size=(0, 4)), hl.UsageError, "1 to 65536"),
        (lambda: hl.render(hl.Scene.load("builtin:concentric"), sise=4), TypeError, "no argument `sise`"),
        (
            lambda: hl.render(hl.Scene.load("builtin:concentric"), illumination=(2, 0)),
            hl.UsageError,
            "no illumination",
        ),
        (lambda: hl.render(hl.Scene.load("builtin:concentric"), passes=0), hl.UsageError, "passes=0"),
        (lambda: hl.render(hl.Scene.load("builtin:concentric"), seconds=-1), hl.UsageError, "seconds=-1"),
        (lambda: hl.render(hl.Scene.load("builtin:concentric"), samples=4), hl.UsageError, "samples=4"),
        (
            lambda: hl.render(hl.Scene.load("builtin:concentric"), layers=["visable"]),
            hl.UsageError,
            "no layer 'visable'",
        ),
        (lambda: hl.Material("m", roughness=2), hl.UsageError, "roughness=2"),
        (lambda: hl.Material("m", base_color=(1, 2)), hl.UsageError, "base_color: no colour"),
        (lambda: hl.Material("m", base_color=-1), hl.UsageError, "base_color"),
        (lambda: hl.Material("m", straight=[[1, 2]]), hl.UsageError, "no 2x2 matrix"),
        (lambda: hl.Material("m", opaque=[[1, -2], [0, 0]]), hl.UsageError, "none of them negative"),
        (lambda: hl.Material("m", fluorescence=[[1, 0], [0, 0]]), hl.UsageError, "no 3x3 or 6x6 matrix"),
        (lambda: hl.Material("m", textures={"x": np.zeros((2, 2), np.uint8)}), hl.UsageError, "there is no `x`"),
        (lambda: hl.Material("m", textures={"base_color": np.zeros((2, 2))}), hl.UsageError, "uint8"),
        (lambda: hl.Luminaire.point((0, 0), 1), hl.UsageError, "position: not three numbers"),
        (lambda: hl.Luminaire.sun((0, 0, 0), 1), hl.UsageError, "leads nowhere"),
        (lambda: hl.Luminaire.point((0, 0, 0), 1, halves="seen"), hl.UsageError, "halves"),
        (lambda: hl.Camera((0, 0, 1), (0, 0, 0), aperture=1), hl.UsageError, "give both or neither"),
        (
            lambda: hl.Scene.load("builtin:concentric").add_sphere((0, 0, 0), 1, material="x"),
            hl.UsageError,
            "was loaded from a file",
        ),
        (lambda: hl.Scene().add_sphere((0, 0, 0), 1, material="x"), hl.UsageError, "no material `x`"),
    ],
)
def test_what_is_wrong_is_told_in_a_line(wrong, error, words):
    with pytest.raises(error) as told:
        wrong()
    assert words in str(told.value) and "\n" not in str(told.value)


def test_meshes_that_are_wrong_are_told_in_a_line(veil):
    floor = veil.materials["Floor"]
    square = np.zeros((4, 3))
    for arguments, more, words in [
        ((square, [[0, 1, 2.5]]), {}, "2.5 is no index"),
        ((square, [[0, 1, -1]]), {}, "-1 is no index"),
        ((square, [0, 1, 2]), {}, "triangles: not numbers of shape (n, 3)"),
        ((np.zeros((4, 2)), [[0, 1, 2]]), {}, "positions: not numbers of shape (n, 3)"),
        ((square, [[0, 1, 2]]), {"normals": "up"}, "normals: not numbers"),
    ]:
        with pytest.raises(hl.UsageError) as told:
            veil.add_mesh(*arguments, material=floor, **more)
        assert words in str(told.value)
    with pytest.raises(hl.UsageError, match="another material `Floor`"):
        veil.add_sphere((0, 0, 0), 1, material=hl.Material.diffuse("Floor"))
    veil.add_mesh(square, [[0, 1, 7]], material="Floor")
    with pytest.raises(hl.SceneError, match="vertex 7 of 4"):
        hl.render(veil)


#: 100 cd ahead, to nothing at a right angle: at 45° 50 cd to ±X and 20 cd to ±Y.
PROFILE = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 2 3 2 1 2 0 0 0\n1 1 60\n0 45 90\n0 90\n50 25 0\n50 10 0\n"


def under(lamp, at):
    """What a floor (albedo 0.5) shows of a lamp at a point of it."""
    above = np.add(at, (0, 0.5, 0))
    scene = hl.Scene("floor", camera=hl.Camera(above, at, up=(0, 0, 1), yfov=0.001))
    corners = np.array([[-3, 0, -3], [-3, 0, 3], [3, 0, 3], [3, 0, -3]])
    scene.add_quad(corners, material=hl.Material.diffuse("Floor", 0.5))
    scene.add_luminaire(lamp)
    return mean(scene)


def test_a_measured_lamp_shines_as_its_file_says(tmp_path):
    file = tmp_path / "a.ies"
    file.write_text(PROFILE)
    position, down = (0, 1, 0), (0, -1, 0)

    def expected(candela, square):
        """Lambert's law and that of squares; one over the root of `square` is the cosine too."""
        return 0.5 / math.pi * candela / square**1.5

    plain = hl.Luminaire.profile(position, down, file)
    across = hl.Luminaire.profile(position, down, str(file), up=(1, 0, 0))
    halved = hl.Luminaire.profile(position, down, file, multiplier=0.5)
    aslant = hl.Luminaire.profile(position, (1, -1, 0), file)
    for lamp, at, candela, square in [
        (plain, (0, 0, 0), 100, 1),
        (plain, (1, 0, 0), 50, 2),
        (plain, (0, 0, 1), 20, 2),
        (across, (1, 0, 0), 20, 2),
        (across, (0, 0, 1), 50, 2),
        (halved, (1, 0, 0), 25, 2),
        (aslant, (1, 0, 0), 100, 2),
    ]:
        found = under(lamp, at)
        assert agrees(found, expected(candela, square)), (at, found / expected(candela, square))
        assert not agrees(found, 1.02 * expected(candela, square))
    own = hl.Luminaire.profile(position, down, file, intensity=(2, 1, 0))
    whole = under(own, (0, 0, 0))
    assert agrees(under(hl.Luminaire.profile(position, down, file, intensity=1), (0, 0, 0)), whole)
    with pytest.raises(hl.UsageError, match="up .* is along its direction"):
        hl.Luminaire.profile(position, down, file, up=(0, 2, 0))
    with pytest.raises(hl.UsageError, match="give intensity or multiplier, not both"):
        hl.Luminaire.profile(position, down, file, intensity=1, multiplier=1)
    with pytest.raises(hl.FileError, match="no.ies: .*check the path"):
        hl.Luminaire.profile(position, down, tmp_path / "no.ies")
    with pytest.raises(hl.FileError, match="is no file .*; name an IES file"):
        hl.Luminaire.profile(position, down, tmp_path)
    file.write_text("nothing")
    with pytest.raises(hl.FileError, match="a.ies: has no line TILT=.*download it again"):
        hl.Luminaire.profile(position, down, file)


def test_it_is_the_lamp_of_a_file_with_extras(tmp_path):
    (tmp_path / "a.ies").write_text(PROFILE)
    corners = np.float32([[-3, 0, -3], [-3, 0, 3], [3, 0, 3], [3, 0, -3]])
    triangles = np.uint16([0, 1, 2, 0, 2, 3])
    buffer = base64.b64encode(corners.tobytes() + triangles.tobytes()).decode()
    down = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]
    matter = {"name": "Floor", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0}}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"mesh": 0},
            {
                "translation": [0, 1, 0],
                "rotation": down,
                "extensions": {"KHR_lights_punctual": {"light": 0}},
                "extras": {"ies": "a.ies"},
            },
            {"translation": [1, 0.5, 0], "rotation": down, "camera": 0},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.001, "znear": 0.01}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{**matter, "extensions": {"KHR_materials_specular": {"specularFactor": 0}}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 7}]}},
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4, "min": [-3, 0, -3], "max": [3, 0, 3]},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 6},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64," + buffer}],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    loaded = mean(hl.Scene.load(tmp_path / "a.gltf"))
    lamp = hl.Luminaire.profile((0, 1, 0), (0, -1, 0), tmp_path / "a.ies", intensity=7)
    assert agrees(loaded, under(lamp, (1, 0, 0))) and loaded > 0
    assert not agrees(loaded, 1.02 * under(lamp, (1, 0, 0)))
