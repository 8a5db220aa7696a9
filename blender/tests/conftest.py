"""What tests share: Blender without its window, with the add-on enabled, and the command that HALFLIGHT names."""

import os
import shutil
import sys
import tempfile
from pathlib import Path

# Before Blender starts: nobody's settings are read or written.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp()

import bpy  # noqa: E402
import numpy as np  # noqa: E402
import pytest  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "blender"))

import addon_utils  # noqa: E402


def command():
    built = [ROOT / "target" / profile / "halflight" for profile in ("release", "quick")]
    named = [Path(os.environ["HALFLIGHT"])] if "HALFLIGHT" in os.environ else built
    there = [path for path in named if path.exists()]
    assert there, f"none of {named} is there: cargo build --release, or set HALFLIGHT"
    return str(there[0])


@pytest.fixture
def scene():
    """An empty scene of black World, 32×32 pixels and few passes."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert addon_utils.enable("halflight", default_set=True)
    bpy.context.preferences.addons["halflight"].preferences.binary = command()
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.view_settings.view_transform = "Standard"
    scene.halflight.passes = 16
    scene.halflight.more = "--photons 20000"
    yield scene
    addon_utils.disable("halflight", default_set=True)


def add(name, data, **more):
    """An object in the scene."""
    item = bpy.data.objects.new(name, data)
    for key, value in more.items():
        setattr(item, key, value)
    bpy.context.scene.collection.objects.link(item)
    return item


def plane(name="Floor", half=20.0, z=0.0, albedo=0.5, **more):
    """A level square that reflects diffusely, with nothing above."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)], [], [(0, 1, 2, 3)])
    mesh.materials.append(matte(name, albedo))
    return add(name, mesh, **more)


def matte(name, albedo):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    principled = material.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value = (albedo, albedo, albedo, 1)
    principled.inputs["Roughness"].default_value = 1
    principled.inputs["Specular IOR Level"].default_value = 0
    return material


def lamp(kind, energy, **more):
    light = bpy.data.lights.new(kind.title(), kind)
    light.energy = energy
    for key, value in more.items():
        setattr(light, key, value)
    return light


def camera(location=(0, 0, 1), rotation=(0, 0, 0), **more):
    data = bpy.data.cameras.new("Eye")
    for key, value in {"clip_start": 0.001, **more}.items():
        setattr(data, key, value)
    bpy.context.scene.camera = add("Eye", data, location=location, rotation_euler=rotation)
    return bpy.context.scene.camera


def world(colour=None, image=None, strength=1.0, turned=0.0):
    made = bpy.data.worlds.new("World")
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    background = nodes["Background"]
    background.inputs["Strength"].default_value = strength
    if colour:
        background.inputs["Color"].default_value = (*colour, 1)
    if image:
        texture = nodes.new("ShaderNodeTexEnvironment")
        texture.image = image
        mapping, coordinates = nodes.new("ShaderNodeMapping"), nodes.new("ShaderNodeTexCoord")
        mapping.inputs["Rotation"].default_value[2] = turned
        links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
        links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
        links.new(texture.outputs["Color"], background.inputs["Color"])
    bpy.context.scene.world = made
    return made


def pixels(image):
    """Linear RGB, row 0 at the top."""
    width, height = image.size
    return np.array(image.pixels[:]).reshape(height, width, 4)[::-1, :, :3]


def rendered():
    """What halflight makes of the scene, as Blender shows it."""
    assert bpy.ops.halflight.render() == {"FINISHED"}
    return pixels(bpy.data.images["halflight"])


def by_cycles(samples=64):
    """What Cycles makes of it."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = samples, False, False
    scene.cycles.sample_clamp_indirect = 0
    scene.cycles.pixel_filter_type = "BOX"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(Path(tempfile.mkdtemp()) / "cycles.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    shown = pixels(image)
    shutil.rmtree(Path(scene.render.filepath).parent)
    return shown
