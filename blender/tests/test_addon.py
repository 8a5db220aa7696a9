"""The add-on as Blender uses it: what it registers, exports, runs and shows."""

import inspect
import json
import math
import subprocess
import time
from pathlib import Path
from types import SimpleNamespace

import addon_utils
import bpy
import conftest as c
import numpy as np
import pytest

import halflight


def exported(scene, folder):
    path, notes = halflight.export(scene, folder)
    return json.loads(path.read_text()), notes


def info(path):
    told = subprocess.run([c.command(), "info", "--json", str(path)], capture_output=True, text=True)
    assert told.returncode == 0, told.stderr
    return json.loads(told.stdout)


def test_it_comes_and_goes_without_a_trace(scene):
    for _ in range(2):
        assert hasattr(bpy.types.Scene, "halflight") and hasattr(bpy.types.Material, "halflight_point")
        addon_utils.disable("halflight", default_set=True)
        for owner, name in ((bpy.types.Scene, "halflight"), (bpy.types.Material, "halflight_point")):
            assert not hasattr(owner, name)
        assert not hasattr(bpy.types, "HALFLIGHT_PT_render") and halflight.on_load not in bpy.app.handlers.load_pre
        assert addon_utils.enable("halflight", default_set=True)


def test_one_file_tells_blender_what_it_is():
    told = halflight.bl_info
    assert told["name"] == "halflight" and told["blender"] <= bpy.app.version
    assert Path(halflight.__file__) == c.ROOT / "blender" / "halflight.py"


def test_the_square_is_a_custom_property_that_halflight_reads(scene, tmp_path):
    floor = c.plane()
    material = floor.data.materials[0]
    c.add("Sun", c.lamp("SUN", 1), rotation_euler=(0.3, 0, 0))
    c.camera()
    with bpy.context.temp_override(material=material):
        assert bpy.ops.halflight.illuminate(of="MATERIAL", s=0.5, t=0.25) == {"FINISHED"}
    assert bpy.ops.halflight.illuminate(of="SCENE", s=1, t=1) == {"FINISHED"}
    assert list(material["illumination"]) == [0.5, 0.25] and halflight.point_of(scene) == (1, 1)
    scene.halflight_point = (0.25, 0.75)
    assert list(scene["illumination"]) == [0.25, 0.75] and tuple(scene.halflight_point) == (0.25, 0.75)
    path, _ = halflight.export(scene, tmp_path)
    document = json.loads(path.read_text())
    assert document["materials"][0]["extras"]["illumination"] == [0.5, 0.25]
    assert document["scenes"][0]["extras"]["illumination"] == [0.25, 0.75]
    [read] = [material for material in info(path)["materials"] if material["name"] == "Floor"]
    assert "0.5" in json.dumps(read) and "0.25" in json.dumps(read)
    with bpy.context.temp_override(material=material):
        assert bpy.ops.halflight.illuminate(of="MATERIAL", own=False) == {"FINISHED"}
    assert "illumination" not in material and halflight.point_of(material) is None


def test_names_and_numbers_of_illuminations_are_read(scene):
    for value, point in (("local", (0, 1)), ("whitted", None), ([0.1, 0.2], (0.1, 0.2)), (3, None), ([1, 2, 3], None)):
        scene["illumination"] = value
        assert halflight.point_of(scene) == (pytest.approx(point) if point else None)
    assert halflight.named((1, 1)) == "shadowless" and halflight.named((0.5, 0.25)) == "s 0.50, t 0.25"


def test_illumination_changes_the_picture_as_it_should(scene):
    c.plane()
    c.plane("Lid", half=0.3, z=0.5)
    c.add("Point", c.lamp("POINT", 20, shadow_soft_size=0), location=(0, 0, 1))
    c.camera((0.0, 0.0, 0.3), type="ORTHO", ortho_scale=0.1)
    assert c.rendered().max() < 0.02
    scene.halflight_point = halflight.CORNERS["local"]
    # I / d² of 20 W / 4π, and ρ / π of it.
    assert c.rendered().mean() == pytest.approx(0.5 / math.pi * 20 / 4 / math.pi, rel=0.01)


def test_lamps_cameras_and_materials_come_with_what_gltf_has_no_place_for(scene, tmp_path):
    c.plane()["thickness"] = 3
    c.add("Pane", c.lamp("AREA", 10, shape="RECTANGLE", size=2, size_y=1), location=(0, 0, 2))
    c.add("Sun", c.lamp("SUN", 1, angle=math.radians(3)), visible_camera=True)
    c.add("Point", c.lamp("POINT", 1, shadow_soft_size=0.2), location=(0, 0, 9))
    own = c.add("Own", c.lamp("AREA", 10), location=(0, 0, 3))
    own["disk"], own["power"] = 0.5, 7.0
    eye = c.camera()
    eye.data.dof.use_dof, eye.data.dof.aperture_fstop, eye.data.lens = True, 2.0, 50
    eye.data.dof.focus_object = c.add("Focus", None, location=(0.5, 0, -3))
    before = {item.name: sorted(item.keys()) for item in bpy.data.objects}
    document, notes = exported(scene, tmp_path)
    nodes = {node["name"]: node for node in document["nodes"]}
    pane = nodes["Pane"]["extras"]
    assert pane["area"] == [2, 1] and pane["power"] == pytest.approx([10] * 3) and pane["emission"] == "invisible"
    assert nodes["Own"]["extras"] == {"disk": 0.5, "power": 7.0}
    assert nodes["Floor"]["extras"] == {"thickness": 3}
    lights = {light["name"]: light["extras"] for light in document["extensions"]["KHR_lights_punctual"]["lights"]}
    assert lights["Sun"] == {"angle": pytest.approx(3)}
    assert lights["Point"] == {"sphere": pytest.approx(0.2), "emission": "invisible"}
    assert document["cameras"][0]["extras"] == {"focus": pytest.approx(4), "aperture": pytest.approx(0.05 / 4)}
    assert notes == []
    assert {item.name: sorted(item.keys()) for item in bpy.data.objects} == before, "the .blend stays as it was"
    lit = info(tmp_path / "scene.gltf")
    assert {"Pane", "Own", "Point"} <= {material["name"] for material in lit["materials"]}


def test_hidden_lamps_in_the_picture_are_told(scene, tmp_path):
    c.plane()
    c.add("Point", c.lamp("POINT", 1, shadow_soft_size=0.2), location=(0, 0, 0.5))
    c.add("Pane", c.lamp("AREA", 1, spread=1.0), location=(0, 0, 0.5), rotation_euler=(math.pi, 0, 0))
    c.camera((0, 0, 2))
    document, notes = exported(scene, tmp_path)
    assert "extras" not in document["extensions"]["KHR_lights_punctual"]["lights"][0]
    for words in ("Point: its shadows are sharp", "Pane: it is hidden", "Pane: its spread is left out"):
        assert any(words in note for note in notes), notes


def test_what_is_not_rendered_is_not_exported(scene, tmp_path):
    c.plane(), c.plane("Hidden", z=1, hide_render=True)
    c.add("Sun", c.lamp("SUN", 1))
    document, _ = exported(scene, tmp_path)
    assert {node["name"] for node in document["nodes"]} == {"Floor", "Sun"}


def test_modifiers_are_applied(scene, tmp_path):
    c.plane().modifiers.new("More", "SUBSURF").levels = 2
    document, _ = exported(scene, tmp_path)
    [positions] = [mesh["primitives"][0]["attributes"]["POSITION"] for mesh in document["meshes"]]
    assert document["accessors"][positions]["count"] > 4


def lit(scene):
    c.plane()
    c.add("Sun", c.lamp("SUN", 2, angle=0))
    c.camera()


def test_the_picture_is_where_it_was_asked_for(scene, tmp_path):
    lit(scene)
    scene.halflight.output = str(tmp_path / "own.exr")
    scene.render.resolution_x, scene.render.resolution_percentage = 48, 50
    shown = c.rendered()
    assert halflight.Running.notes == [] and halflight.Running.error == ""
    assert shown.shape == (16, 24, 3) and shown.mean() == pytest.approx(0.5 * 2 / math.pi, rel=0.01)
    assert bpy.data.images["halflight"].filepath == str(tmp_path / "own.exr")
    assert (tmp_path / "own.exr").exists() and (tmp_path / "own.png").exists()


def test_a_second_render_renews_the_same_image(scene):
    lit(scene)
    first = c.rendered().mean()
    bpy.data.lights["Sun"].energy = 4
    assert c.rendered().mean() == pytest.approx(2 * first, rel=0.01)
    assert len([image for image in bpy.data.images if image.name.startswith("halflight")]) == 1


def refused(match):
    with pytest.raises(RuntimeError, match=match):
        bpy.ops.halflight.render()
    assert halflight.Running.job is None


def test_what_goes_wrong_is_told_in_the_commands_line(scene):
    lit(scene)
    scene.halflight.more = "--photons none"
    refused("invalid value 'none' for '--photons")
    scene.halflight.more = "--set Nothing=global"
    refused("Nothing")
    assert "Nothing" in halflight.Running.error and "\n" not in halflight.Running.error
    scene.halflight.more = "'"
    refused("More Options: No closing quotation")
    bpy.context.preferences.addons["halflight"].preferences.binary = "/nowhere/halflight"
    refused("/nowhere/halflight is not found; say in the add-on's preferences where halflight is")


def test_a_foreign_file_is_not_replaced(scene, tmp_path):
    lit(scene)
    (tmp_path / "mine.exr").write_text("mine")
    scene.halflight.output = str(tmp_path / "mine.exr")
    refused("did not write")
    assert (tmp_path / "mine.exr").read_text() == "mine"


def until(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.05)


def test_the_picture_converges_while_blender_goes_on_and_can_be_stopped(scene):
    lit(scene)
    scene.halflight.passes = 0
    scene.halflight.seconds = 3600
    halflight.begin(scene)
    job = halflight.Running.job
    with pytest.raises(halflight.Refused, match="under way"):
        halflight.begin(scene)
    until(job.is_renewed)
    assert halflight.show(job.picture).size[:] == (32, 32)
    until(lambda: job.progress.get("pass", 0) > 1 and job.is_renewed())
    assert "passes" in halflight.Running.text() and 0 <= halflight.Running.share() < 0.1
    assert not bpy.ops.halflight.render.poll()
    assert bpy.ops.halflight.stop() == {"FINISHED"}
    until(lambda: job.code() is not None, 20)
    assert halflight.end() == "" and halflight.Running.job is None
    assert c.pixels(halflight.show(job.picture)).mean() == pytest.approx(0.5 * 2 / math.pi, rel=0.01)


def test_no_command_outlives_the_file_or_the_add_on(scene):
    for leave in (bpy.ops.wm.read_homefile, lambda: addon_utils.disable("halflight", default_set=True)):
        lit(bpy.context.scene)
        bpy.context.scene.halflight.seconds = 3600
        bpy.context.scene.halflight.passes = 0
        halflight.begin(bpy.context.scene)
        process = halflight.Running.job.process
        leave()
        assert process.poll() is not None and halflight.Running.job is None
    assert addon_utils.enable("halflight", default_set=True)


class Layout:
    """Takes what panels draw, and refuses what Blender would: names, icons and arguments that are not there."""

    use_property_split = False
    icons = set(bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys())

    def __init__(self):
        self.drawn = []

    def _check(self, call, **given):
        known = bpy.types.UILayout.bl_rna.functions[call].parameters.keys()
        assert set(given) <= set(known), (call, given)
        assert given.get("icon", "NONE") in self.icons
        self.drawn.append((call, given.get("text")))

    def row(self, **given):
        self._check("row", **given)
        return self

    def column(self, **given):
        self._check("column", **given)
        return self

    def label(self, **given):
        self._check("label", **given)

    def progress(self, **given):
        self._check("progress", **given)

    def prop(self, owner, name, **given):
        assert name in owner.bl_rna.properties, name
        self._check("prop", **given)

    def operator(self, name, **given):
        kind, word = name.split(".")
        assert hasattr(bpy.types, f"{kind.upper()}_OT_{word}")
        self._check("operator", **given)
        return SimpleNamespace()


def drawn(panel, **context):
    layout = Layout()
    panel.draw(SimpleNamespace(layout=layout), SimpleNamespace(scene=bpy.context.scene, **context))
    return layout.drawn


def test_panels_draw_what_there_is(scene):
    lit(scene)
    material = bpy.data.materials["Floor"]
    assert ("operator", "Render") in drawn(halflight.HALFLIGHT_PT_render)
    square = drawn(halflight.HALFLIGHT_PT_material, material=material)
    buttons = [text for call, text in square if call == "operator"]
    assert len(buttons) == 25
    assert [buttons[i] for i in (0, 4, 20, 24)] == ["local", "shadowless", "one-bounce", "global"]
    assert ("label", "As the scene") in square
    halflight.illuminate(material, (0.5, 0.5))
    square = drawn(halflight.HALFLIGHT_PT_material, material=material)
    assert square.count(("operator", "•")) == 1 and ("prop", "Inter-reflection s") in square
    material["illumination"] = "whitted"
    assert ("label", "Custom property: whitted") in drawn(halflight.HALFLIGHT_PT_material, material=material)
    scene.halflight.more = "--photons none"
    refused("invalid value")
    assert ("label", halflight.Running.error) in drawn(halflight.HALFLIGHT_PT_render)
    scene.halflight.more, scene.halflight.seconds = "", 3600
    halflight.begin(scene)
    assert "progress" in [call for call, _ in drawn(halflight.HALFLIGHT_PT_render)]
    halflight.forget()
    assert halflight.HALFLIGHT_PT_material.poll(SimpleNamespace(material=material))
    drawn(halflight.HALFLIGHT_PT_scene)


def test_a_modal_render_passes_events_on_and_hears_esc(scene, monkeypatch):
    """Blender without a window has no events; they are made here."""
    lit(scene)
    scene.halflight.passes, scene.halflight.seconds = 0, 3600
    window = SimpleNamespace(windows=[], event_timer_remove=lambda timer: None)
    context = SimpleNamespace(scene=scene, window_manager=window)
    reports = []
    render = SimpleNamespace(_timer=None, _editor_wanted=True, report=lambda kind, line: reports.append((kind, line)))
    for name, method in inspect.getmembers(halflight.HALFLIGHT_OT_render, inspect.isfunction):
        if name in {"modal", "_begin", "_renew", "_finish", "_leave"}:
            setattr(render, name, method.__get__(render))
    assert render._begin(context)

    def event(kind, value="NOTHING"):
        return render.modal(context, SimpleNamespace(type=kind, value=value))

    assert event("MOUSEMOVE") == {"PASS_THROUGH"} and event("ESC", "RELEASE") == {"PASS_THROUGH"}
    until(lambda: event("TIMER") == {"PASS_THROUGH"} and "halflight" in bpy.data.images)
    assert event("ESC", "PRESS") == {"RUNNING_MODAL"}
    until(lambda: event("TIMER") == {"FINISHED"} if halflight.Running.job else True, 20)
    assert halflight.Running.job is None and not [kind for kind, _ in reports if kind == {"ERROR"}]
    assert np.isfinite(c.pixels(bpy.data.images["halflight"])).all()
