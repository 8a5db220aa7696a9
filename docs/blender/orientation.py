"""Says which way Blender's World lies about a scene that it exports to glTF: the numbers of tests/inputs/orientation.rs.

    python3.11 -m venv /tmp/blender && /tmp/blender/bin/pip install 'bpy==4.5.*' 'numpy<2'
    /tmp/blender/bin/python docs/blender/orientation.py

Cameras look along directions of Blender's axes. For each, one line: that direction, the same one in the exported file (by the
node of the camera), what Cycles sees there of a picture of six patches, and where in a picture of ramps that is: u from its left,
v from its top.
"""

import json
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion, Vector

AXES = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0.03, 0.04, 0.99875), (0.03, 0.04, -0.99875)]  # the poles are edges
OBLIQUE = [(0.48, 0.6, 0.64), (0.8, -0.48, -0.36), (-0.48, -0.64, 0.6), (-0.6, 0.64, -0.48)]
SIDES = [(0, 1, 0), (1, 0, 0), (0, 0, 1), (1, 1, 0)]  # from the left, each a quarter, the first from −1/8 to 1/8
ABOVE, BELOW = (1, 1, 1), (1, 0, 1)


def patches():
    """8 × 4 texels, top row first."""
    ring = [SIDES[(x + 1) // 2 % 4] for x in range(8)]
    return np.array([[ABOVE] * 8, ring, ring, [BELOW] * 8], float)


def ramps():
    """What is u and v at every texel's middle, and stays so between them but at the seam."""
    u, v = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(32) + 0.5) / 32)
    return np.stack([u, v, 0 * u], -1)


def world(texels, interpolation):
    height, width, _ = texels.shape
    image = bpy.data.images.new("sky", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.dstack([texels, np.ones((height, width))])[::-1].astype(np.float32).ravel())
    image.pack()
    made = bpy.data.worlds.new("World")
    made.use_nodes = True
    texture = made.node_tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image, texture.interpolation = image, interpolation
    made.node_tree.links.new(texture.outputs["Color"], made.node_tree.nodes["Background"].inputs["Color"])
    bpy.context.scene.world = made


def camera(direction):
    data = bpy.data.cameras.new(str(direction))
    data.angle = 0.001
    made = bpy.data.objects.new(str(direction), data)
    made.rotation_euler = Vector(direction).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(made)
    return made


def seen(eye, folder):
    scene = bpy.context.scene
    scene.camera = eye
    scene.render.filepath = str(folder / "seen.exr")
    bpy.ops.render.render(write_still=True)
    pixels = np.array(bpy.data.images.load(scene.render.filepath, check_existing=False).pixels).reshape(-1, 4)
    return pixels[:, :3].mean(0)


def exported(folder):
    """The direction of view of every camera in the file, by its name."""
    path = folder / "scene.gltf"
    bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLTF_SEPARATE", export_cameras=True)
    nodes = json.loads(path.read_text())["nodes"]
    turns = {node["name"]: node.get("rotation", [0, 0, 0, 1]) for node in nodes}
    return {name: Quaternion((w, x, y, z)) @ Vector((0, 0, -1)) for name, (x, y, z, w) in turns.items()}


def main():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 4
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    eyes = [camera(direction) for direction in AXES + OBLIQUE]
    print("Blender", bpy.app.version_string)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        in_file = exported(folder)
        world(patches(), "Closest")
        colours = [seen(eye, folder) for eye in eyes]
        world(ramps(), "Linear")
        places = [seen(eye, folder)[:2] for eye in eyes]
        for eye, colour, place in zip(eyes, colours, places):
            to = ", ".join(f"{x:.2f}" for x in in_file[eye.name])
            print(f"{eye.name:22} ({to})  {colour.round(3).tolist()}  {place.round(4).tolist()}")


main()
