"""Lamps and the World come out as bright as they are in closed forms and in Cycles."""

import math

import bpy
import conftest as c
import numpy as np
import pytest


def from_a_rectangle(width, height, away):
    """The integral of cos²θ / r² over a rectangle that faces a point `away` below its middle: E / L.

    The corner's configuration factor, e.g. J. R. Howell, A catalog of radiation heat transfer configuration factors, B-3.
    """
    a, b = width / 2 / away, height / 2 / away
    one, other = math.hypot(1, a), math.hypot(1, b)
    return 4 * (a / one * math.atan(b / one) + b / other * math.atan(a / other)) / 2


def close(got, expected):
    """Within 1 %, so that 2 % off is refused."""
    assert got == pytest.approx(expected, rel=0.01)
    for wrong in (0.98, 1.02):
        assert got != pytest.approx(wrong * expected, rel=0.01)


def looking_down(**more):
    c.camera((0.0, 0.0, 0.5), type="ORTHO", ortho_scale=0.02, **more)


def test_the_rectangles_form_is_that_of_a_small_and_of_an_endless_one():
    assert from_a_rectangle(1e-3, 1e-3, 1) == pytest.approx(1e-6, rel=1e-5)
    assert from_a_rectangle(1e6, 1e6, 1) == pytest.approx(math.pi, rel=1e-5)


def test_a_rectangle_lights_the_floor_as_its_closed_form(scene):
    c.plane()
    c.add("Pane", c.lamp("AREA", 40, shape="RECTANGLE", size=1.5, size_y=0.5, color=(1, 0.5, 0.25)), location=(0, 0, 1))
    looking_down()
    got = c.rendered().mean((0, 1))
    radiance = 40 / math.pi / (1.5 * 0.5)
    expected = 0.5 / math.pi * radiance * from_a_rectangle(1.5, 0.5, 1)
    for channel, factor in zip(got, (1, 0.5, 0.25)):
        close(channel, factor * expected)


@pytest.mark.parametrize("shape", ["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"])
def test_every_shape_lights_as_in_cycles_where_it_is_turned_and_scaled(scene, shape):
    c.plane()
    parent = c.add("Stand", None, location=(0.3, 0.2, 0), rotation_euler=(0, 0.3, 0.4), scale=(1.2, 1.2, 1.2))
    light = c.lamp("AREA", 30, shape=shape, size=1.0)
    light.size_y = 0.4
    lamp = c.add("Pane", light, location=(0.1, 0, 1.5), rotation_euler=(0.4, 0.2, 0.9), scale=(1.0, 1.5, 1.0))
    lamp.parent = parent
    c.camera((0, 0, 5), type="ORTHO", ortho_scale=3)
    ours, cycles = c.rendered(), c.by_cycles(256)
    assert ours.mean() == pytest.approx(cycles.mean(), rel=0.01)
    blocks = [picture.reshape(4, 8, 4, 8, 3).mean((1, 3, 4)) for picture in (ours, cycles)]
    np.testing.assert_allclose(*blocks, rtol=0.04)


@pytest.mark.parametrize("kind", ["POINT", "SUN"])
def test_soft_lamps_light_and_shade_as_in_cycles(scene, kind):
    c.plane()
    c.plane("Shade", half=0.4, z=0.7)
    if kind == "POINT":
        # A soft falloff takes the square of radius over distance, which no sphere does.
        light = c.lamp("POINT", 60, shadow_soft_size=0.25, use_soft_falloff=False)
    else:
        light = c.lamp("SUN", 1.5, angle=math.radians(12))
    c.add("Lamp", light, location=(0.9, 0.2, 1.6), rotation_euler=(0.5, 0.3, 0))
    c.camera((0, 0, 1.2), type="ORTHO", ortho_scale=4)
    scene.halflight.method, scene.halflight.more = "path", "--samples 128"
    ours, cycles = c.rendered(), c.by_cycles(1024)
    assert ours.mean() == pytest.approx(cycles.mean(), rel=0.01)
    blocks = [picture.reshape(8, 4, 8, 4, 3).mean((1, 3, 4)) for picture in (ours, cycles)]
    np.testing.assert_allclose(*blocks, rtol=0.1)
    assert abs(blocks[0] / blocks[1] - 1).mean() < 0.02


def test_lamps_are_seen_by_the_camera_where_cycles_shows_them(scene):
    c.plane()
    pane = c.add("Pane", c.lamp("AREA", 40, shape="SQUARE", size=1), location=(0, 0, 2), rotation_euler=(math.pi, 0, 0))
    c.camera((0, 0, 5), type="ORTHO", ortho_scale=0.5)
    hidden = c.rendered().mean()
    pane.visible_camera = True
    seen = c.rendered().mean()
    assert hidden < 0.1 * seen
    close(seen, c.by_cycles(16).mean())


def test_a_world_of_one_colour_lights_the_open_floor(scene):
    c.plane()
    c.world((0.2, 0.4, 0.8), strength=1.5)
    looking_down()
    for got, colour in zip(c.rendered().mean((0, 1)), (0.2, 0.4, 0.8)):
        close(got, 0.5 * 1.5 * colour)


def ramps(packed=True):
    """A float picture whose red goes round and whose green goes down."""
    u, v = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(32) + 0.5) / 32)
    texels = np.stack([0.2 + u * (1 - u), v, 0.3 + 0 * u, 1 + 0 * u], -1)
    image = bpy.data.images.new("sky", 64, 32, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels.foreach_set(texels[::-1].astype(np.float32).ravel())
    if packed:
        image.pack()
    return image


@pytest.mark.parametrize(
    ("turned", "kind", "packed"), [(0.7, "POINT", True), (-2.1, "POINT", False), (0.7, "TEXTURE", True)]
)
def test_the_worlds_picture_lies_where_it_lies_in_cycles(scene, turned, kind, packed):
    made = c.world(image=ramps(packed), strength=2.0, turned=turned)
    [mapping] = [node for node in made.node_tree.nodes if node.type == "MAPPING"]
    mapping.vector_type = kind
    c.plane("Far", half=0.1, z=-50)
    c.camera((0, 0, 0), rotation=(1.3, 0.1, 0.4), angle=1.2)
    ours, cycles = c.rendered(), c.by_cycles(16)
    assert np.ptp(cycles, axis=(0, 1)).max() > 0.1
    blocks = [picture.reshape(8, 4, 8, 4, 3).mean((1, 3)) for picture in (ours, cycles)]
    np.testing.assert_allclose(*blocks, rtol=0.01, atol=0.002)


def test_a_picture_of_the_world_on_disk_is_taken_as_it_is(scene, tmp_path):
    image = ramps()
    image.filepath_raw, image.file_format = str(tmp_path / "a sky.hdr"), "HDR"
    image.save()
    own = bpy.data.images.load(str(tmp_path / "a sky.hdr"))
    c.world(image=own)
    import halflight

    options, notes = halflight.surroundings(scene, tmp_path)
    assert options[:2] == ["--environment", str(tmp_path / "a sky.hdr")] and not notes
    scene.render.film_transparent = True
    assert halflight.surroundings(scene, tmp_path)[0][-2:] == ["--background", "hidden"]


def test_what_the_world_has_besides_is_told(scene, tmp_path):
    import halflight

    made = c.world((1, 1, 1))
    nodes, links = made.node_tree.nodes, made.node_tree.links
    links.new(nodes.new("ShaderNodeTexSky").outputs["Color"], nodes["Background"].inputs["Color"])
    options, [note] = halflight.surroundings(scene, tmp_path)
    assert options == [] and "Sky Texture is left out; a colour or an Environment Texture" in note
    scene["environment"] = "studio"
    assert halflight.surroundings(scene, tmp_path) == ([], [])


#: 100 cd ahead, to nothing at a right angle: at 45° 50 cd to ±X and 20 cd to ±Y of the lamp.
PROFILE = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 2 3 2 1 2 0 0 0\n1 1 60\n0 45 90\n0 90\n50 25 0\n50 10 0\n"


@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
@pytest.mark.parametrize("of", ["light", "object"])
def test_a_measured_lamp_has_the_watts_of_its_light_and_the_form_of_its_file(scene, tmp_path, kind, of):
    (tmp_path / "my lamp.ies").write_text(PROFILE)
    c.plane()
    lamp = c.add("Lamp", c.lamp(kind, 60, shadow_soft_size=0.25), location=(0, 0, 1))
    (lamp.data if of == "light" else lamp)["ies"] = str(tmp_path / "my lamp.ies")
    shown = []
    for x, y in ((0, 0), (1, 0), (0, 1)):
        c.camera((x, y, 0.5), type="ORTHO", ortho_scale=0.01)
        shown.append(c.rendered().mean())
    # Lambert's law and that of squares.
    for got, (candela, square) in zip(shown[1:], ((50, 2), (20, 2))):
        close(got / shown[0], candela / 100 / square**1.5)
    # The integral of intensity over all directions, by the midpoint rule: linear in both angles between those of the file.
    polar = (np.arange(2000) + 0.5) / 2000 * math.pi / 2
    near, far = np.interp(polar, [0, math.pi / 4, math.pi / 2], [100, 50, 0]), np.interp(polar, [0, math.pi / 4, math.pi / 2], [100, 20, 0])
    power = 2 * math.pi * np.sum((near + far) / 2 * np.sin(polar)) * math.pi / 4000
    close(shown[0], 0.5 / math.pi * 100 * 60 / power)


def test_an_ies_file_that_is_not_there_is_told(scene, tmp_path):
    c.plane()
    lamp = c.add("Lamp", c.lamp("POINT", 60), location=(0, 0, 1))
    lamp.data["ies"] = str(tmp_path / "no.ies")
    looking_down()
    with pytest.raises(RuntimeError, match="ies names .*no.ies: No such file or directory; put it beside the .blend file"):
        bpy.ops.halflight.render()
