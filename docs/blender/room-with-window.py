"""Writes scenes/room-with-window.glb with Blender: a room that is closed but for one window, and a glass ball in its sun.

    python3.11 -m venv /tmp/blender && /tmp/blender/bin/pip install 'bpy==4.5.*' 'numpy<2'
    /tmp/blender/bin/python docs/blender/room-with-window.py        # or: … room-with-window.py OTHER.glb

All light comes from the sky through 1.2 m² of a room of 5 m × 4 m × 2.8 m; nothing in it is glossy but the ball. Lengths
are metres; as in Blender, z is up and y leads away from the viewer.
"""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Vector

ROOT = Path(__file__).resolve().parent.parent.parent
SKY = "sky:elevation=35,turbidity=3,azimuth=283"  # azimuth 0 is along y, 270 is left
LEFT, RIGHT, FRONT, BACK, CEILING = -2.5, 2.5, -2.0, 2.0, 2.8
NEAR, FAR, SILL, LINTEL, REVEAL = -0.45, 0.75, 0.95, 1.95, 0.2  # the window in the left wall
TABLE, BALL = 0.74, 0.12  # height of the table's top, radius of the ball


def diffuse(name, colour):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.use_backface_culling = True
    shader = made.node_tree.nodes["Principled BSDF"].inputs
    shader["Base Color"].default_value = (*colour, 1)
    shader["Roughness"].default_value = 1
    shader["Specular IOR Level"].default_value = 0
    return made


def glass():
    made = diffuse("Glass", (1, 1, 1))
    shader = made.node_tree.nodes["Principled BSDF"].inputs
    for key, value in {"Roughness": 0, "Specular IOR Level": 0.5, "IOR": 1.5, "Transmission Weight": 1}.items():
        shader[key].default_value = value
    return made


def body(name, points, faces, material, smooth=False):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    mesh.materials.append(material)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)


def boxes(name, material, *corners):
    """Boxes of (lowest corner, highest corner) as one mesh."""
    points, faces = [], []
    for low, high in corners:
        n = len(points)
        points += [tuple((low, high)[i >> axis & 1][axis] for axis in range(3)) for i in range(8)]
        sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
        faces += [tuple(n + i for i in side) for side in sides]
    body(name, points, faces, material)


def room():
    plaster, floor, warm = diffuse("Plaster", (0.78, 0.76, 0.72)), diffuse("Floor", (0.42, 0.30, 0.20)), diffuse("Warm", (0.70, 0.45, 0.30))
    l, r, f, b, c = LEFT, RIGHT, FRONT, BACK, CEILING
    body("Floor", [(l, f, 0), (r, f, 0), (r, b, 0), (l, b, 0)], [(0, 1, 2, 3)], floor)
    body("Ceiling", [(l, f, c), (l, b, c), (r, b, c), (r, f, c)], [(0, 1, 2, 3)], plaster)
    body("Wall behind", [(l, b, 0), (r, b, 0), (r, b, c), (l, b, c)], [(0, 1, 2, 3)], warm)
    body("Wall at right", [(r, b, 0), (r, f, 0), (r, f, c), (r, b, c)], [(0, 1, 2, 3)], plaster)
    body("Wall in front", [(r, f, 0), (l, f, 0), (l, f, c), (r, f, c)], [(0, 1, 2, 3)], plaster)
    inner = [(l, f, 0), (l, b, 0), (l, b, c), (l, f, c)]
    hole = [(l, NEAR, SILL), (l, FAR, SILL), (l, FAR, LINTEL), (l, NEAR, LINTEL)]
    outside = [(x - REVEAL, y, z) for x, y, z in hole]
    around = [(i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4)]
    body("Wall of the window", inner + hole + outside, around + [tuple(4 + i for i in face) for face in around], plaster)


def furniture():
    oak, blue, white = diffuse("Oak", (0.50, 0.34, 0.20)), diffuse("Blue", (0.12, 0.22, 0.42)), diffuse("White", (0.75, 0.75, 0.75))
    x0, x1, y0, y1, thick = -2.0, -0.7, -0.75, 0.55, 0.04
    legs = [((x, y, 0), (x + 0.06, y + 0.06, TABLE - thick)) for x in (x0 + 0.05, x1 - 0.11) for y in (y0 + 0.05, y1 - 0.11)]
    boxes("Table", oak, ((x0, y0, TABLE - thick), (x1, y1, TABLE)), *legs)
    boxes("Cupboard", white, ((-0.15, 1.45, 0), (0.95, 1.99, 1.9)))
    boxes("Chest", blue, ((-1.5, 1.3, 0), (-0.3, 1.9, 0.5)))
    boxes("Books", blue, ((-1.05, 0.2, TABLE + 0.0005), (-0.83, 0.48, TABLE + 0.05)))


def ball(centre, radius, rows=28, columns=56):
    points = [(0, 0, -1)]
    for i in range(1, rows):
        t = math.pi * i / rows
        angles = (2 * math.pi * j / columns for j in range(columns))
        points += [(math.sin(t) * math.cos(a), math.sin(t) * math.sin(a), -math.cos(t)) for a in angles]
    points.append((0, 0, 1))
    last = len(points) - 1
    faces = []
    for j in range(columns):
        k = (j + 1) % columns
        faces.append((0, 1 + k, 1 + j))
        faces += [(1 + i * columns + j, 1 + i * columns + k, 1 + (i + 1) * columns + k, 1 + (i + 1) * columns + j) for i in range(rows - 2)]
        faces.append((last - columns + j, last - columns + k, last))
    body("Ball", [tuple(Vector(centre) + radius * Vector(p)) for p in points], faces, glass(), smooth=True)


def camera():
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width, data.sensor_fit = 30, 36, "HORIZONTAL"
    made = bpy.data.objects.new("Camera", data)
    made.location = (1.5, -1.85, 1.45)
    made.rotation_euler = (Vector((-0.98, 0.35, 0.98)) - made.location).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(made)
    bpy.context.scene.camera = made


def build():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = "Room with window"
    scene["environment"] = SKY
    scene.render.resolution_x, scene.render.resolution_y = 1500, 1000
    room()
    furniture()
    ball((-1.5, -0.1, TABLE + BALL + 0.0005), BALL)
    camera()


def export(path):
    bpy.ops.export_scene.gltf(
        filepath=str(path), export_format="GLB", export_extras=True, export_cameras=True, export_lights=True, export_yup=True,
        export_animations=False,
    )


if __name__ == "__main__":
    build()
    export(sys.argv[1] if len(sys.argv) > 1 else ROOT / "scenes" / "room-with-window.glb")
