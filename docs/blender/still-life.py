"""Writes scenes/still-life.glb: wine, fruit and silver on a table by a window, with Blender and nothing but Blender.

    python3.11 -m venv /tmp/blender && /tmp/blender/bin/pip install 'bpy==4.5.*' 'numpy<2'
    /tmp/blender/bin/python docs/blender/still-life.py              # or: … still-life.py OTHER.glb

Every mesh and every texture is computed here. Lengths are metres; as in Blender, z is up and y leads away from the viewer.
"""

import math
import sys
import tempfile
from pathlib import Path

import bpy  # first: it brings the other two
import bmesh
import numpy as np
from mathutils import Vector

ROOT = Path(__file__).resolve().parent.parent.parent
SKY = "sky:elevation=40,turbidity=3,azimuth=296"  # azimuth 0 is away from the viewer, 270 is left
TABLE = 0.75  # height of its top
LEFT, RIGHT, FRONT, BACK, CEILING = -0.75, 2.0, -1.7, 1.2, 2.5  # the room
SILL, LINTEL, NEAR, FAR, REVEAL = 0.9, 2.15, -0.08, 1.0, 0.16  # the window in its left wall


# -------------------------------------------------------------------------------------------------------- textures

def noise(shape, cells, seed):
    """Smooth noise in [0, 1] of so many cells along either axis; it repeats."""
    rows, columns = (np.arange(n) * c / n for n, c in zip(shape, cells))
    lattice = np.random.default_rng(seed).random(cells)

    def parts(at, count):
        low = np.floor(at).astype(int)
        t = at - low
        return low % count, (low + 1) % count, t * t * (3 - 2 * t)

    r0, r1, rt = parts(rows, cells[0])
    c0, c1, ct = parts(columns, cells[1])
    near, far = (lattice[r][:, c0] * (1 - ct) + lattice[r][:, c1] * ct for r in (r0, r1))
    return near * (1 - rt[:, None]) + far * rt[:, None]


def fractal(shape, cells, seed, octaves=4):
    """Noise of several octaves, each half as strong as the one before; in [0, 1], its mean about 1/2."""
    layers = [noise(shape, (cells[0] << i, cells[1] << i), seed + i) for i in range(octaves)]
    weights = [0.5**i for i in range(octaves)]
    return sum(w * layer for w, layer in zip(weights, layers)) / sum(weights)


def smooth(low, high, x):
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def blend(a, b, t):
    """From colour a to colour b, by an image of shares."""
    return np.asarray(a, float) * (1 - t[..., None]) + np.asarray(b, float) * t[..., None]


def spotted(colour, spot, mask):
    return colour * (1 - mask[..., None]) + np.asarray(spot, float) * mask[..., None]


def slopes(height, size):
    """A normal map of a height in metres over a surface of size (along u, along v) metres."""
    rows, columns = height.shape
    du = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) * columns / (2 * size[0])
    dv = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) * rows / (2 * size[1])
    n = np.stack([-du, -dv, np.ones_like(du)], -1)
    return 0.5 + 0.5 * n / np.linalg.norm(n, axis=-1, keepdims=True)


def wood(size, planks):
    """Oak in planks along u: colour, roughness and height (m)."""
    shape = (768, 1536)
    v, u = np.mgrid[0:shape[0], 0:shape[1]]
    x, y = u / shape[1] * size[0], v / shape[0] * size[1]
    width = size[1] / planks
    plank = (y // width).astype(int)
    across = y - (plank + 0.5) * width
    rng = np.random.default_rng(5)
    heart, depth, tilt, tone = (rng.uniform(*r, planks)[plank] for r in ((-0.12, 0.12), (0.03, 0.1), (-0.05, 0.05), (-1, 1)))
    bend = 0.05 * (fractal(shape, (6, 5), 11, 3) - 0.5) + 0.012 * (fractal(shape, (24, 8), 17, 3) - 0.5)
    rings = np.hypot(across - heart + tilt * (x - 0.5) + bend, depth + 0.04 * (noise(shape, (4, 3), 23) - 0.5)) / 0.0062
    late = smooth(0.35, 0.95, rings % 1) * (1 - smooth(0.95, 1, rings % 1))
    fibre = fractal(shape, (256, 14), 31, 2)
    pores = smooth(0.66, 0.86, noise(shape, (384, 40), 41)) * (1 - 0.6 * late)
    seam = 1 - smooth(0.0004, 0.0017, np.minimum(y % width, width - y % width))
    colour = blend((0.70, 0.52, 0.345), (0.53, 0.355, 0.205), 0.75 * late + 0.35 * (fibre - 0.5))
    colour *= (1 + 0.07 * tone + 0.16 * (fractal(shape, (3, 4), 47, 3) - 0.5))[..., None]
    colour = spotted(colour, (0.33, 0.21, 0.12), 0.55 * pores)
    colour = spotted(colour, (0.12, 0.075, 0.045), 0.9 * seam)
    worn = fractal(shape, (4, 6), 53, 4)
    rough = 0.30 + 0.16 * worn + 0.12 * pores - 0.05 * late + 0.25 * seam
    height = 6e-5 * late - 1.2e-4 * pores + 5e-5 * fibre - 1.1e-3 * seam
    return colour, rough, height


def pear_skin():
    """Green-gold with a blush on one side, freckles, and russet about both ends; v runs from the bottom to the stem."""
    shape = (256, 512)
    v, u = (np.mgrid[0:shape[0], 0:shape[1]].T / np.array([shape[0], shape[1]])).T
    colour = blend((0.66, 0.66, 0.24), (0.80, 0.70, 0.28), fractal(shape, (4, 6), 61))
    blush = smooth(0.45, 0.95, 0.5 + 0.5 * np.cos(2 * math.pi * (u - 0.62)) + 0.5 * (fractal(shape, (5, 7), 67) - 0.5))
    colour = spotted(colour, (0.74, 0.30, 0.16), 0.65 * blush * smooth(0.05, 0.4, v))
    freckles = smooth(0.80, 0.92, noise(shape, (72, 120), 71))
    colour = spotted(colour, (0.47, 0.36, 0.16), 0.5 * freckles)
    russet = smooth(0.90, 1, v + 0.14 * (fractal(shape, (8, 16), 79) - 0.5)) + 1 - smooth(0, 0.08, v)
    return spotted(colour, (0.43, 0.31, 0.16), 0.75 * np.clip(russet, 0, 1))


def leaf_half(u):
    """Half the width of the leaf, as a share of half its picture."""
    return 0.93 * np.sin(math.pi * np.clip((u - 0.12) / 0.87, 0, 1) ** 0.78) ** 0.85


def leaf_face():
    """A leaf with a few holes as red, green, blue and alpha; u runs from stalk to tip."""
    shape = (144, 336)
    v, u = (np.mgrid[0:shape[0], 0:shape[1]].T / np.array([shape[0], shape[1]])).T
    side = 2 * v - 1
    ragged = 0.05 * (noise(shape, (1, 48), 83) - 0.5)
    half = leaf_half(u) + ragged
    stalk = (np.abs(side) < 0.035) & (u < 0.2)
    lateral = np.abs(((u - 0.42 * np.abs(side)) * 11) % 1 - 0.5) / 11
    veins = np.maximum(1 - smooth(0.004, 0.011, lateral), 1 - smooth(0.012, 0.04 - 0.025 * u, np.abs(side)))
    colour = blend((0.26, 0.38, 0.10), (0.40, 0.50, 0.14), fractal(shape, (4, 8), 89))
    rim = 1 - smooth(0, 0.22, half - np.abs(side))
    colour = spotted(colour, (0.62, 0.50, 0.16), 0.6 * rim * smooth(0.3, 0.7, fractal(shape, (3, 7), 97)))
    colour = spotted(colour, (0.56, 0.62, 0.30), 0.7 * veins)
    alpha = (np.abs(side) < half) & (u > 0.12) | stalk
    for cu, cv, r in ((0.47, 0.45, 0.036), (0.53, -0.30, 0.026), (0.70, 0.28, 0.022), (0.34, -0.42, 0.020)):
        away = np.hypot(u - cu, (side - cv) * 0.21) + 0.012 * (noise(shape, (9, 20), 101) - 0.5)
        alpha &= away > r
        colour = spotted(colour, (0.42, 0.30, 0.12), 1 - smooth(r, r + 0.012, away))
    return np.concatenate([colour, alpha[..., None]], -1)


def weave(n=256):
    """Height of a plain weave of 32 by 32 threads, in [0, 1]."""
    v, u = np.mgrid[0:n, 0:n] / n
    warp = np.abs(np.sin(32 * math.pi * u)) * (0.5 + 0.5 * np.sin(32 * math.pi * v + math.pi * np.floor(32 * u)))
    weft = np.abs(np.sin(32 * math.pi * v)) * (0.5 - 0.5 * np.sin(32 * math.pi * u + math.pi * np.floor(32 * v)))
    return np.maximum(warp, weft)


def stripes():
    """Unbleached linen with blue stripes along its sides; u leads across."""
    shape = (64, 256)
    u = np.broadcast_to((np.arange(shape[1]) + 0.5) / shape[1], shape)
    slub = 0.07 * (noise(shape, (4, 128), 107) + noise(shape, (32, 8), 109) - 1)
    cloth = np.array([0.72, 0.68, 0.60]) * (1 + slub)[..., None]
    for middle, half in ((0.10, 0.030), (0.16, 0.008), (0.84, 0.008), (0.90, 0.030)):
        cloth = spotted(cloth, (0.17, 0.25, 0.42), 0.9 * (1 - smooth(half - 0.003, half + 0.003, np.abs(u - middle))))
    return cloth


def picture(name, pixels, kind="JPEG", colour=True, quality=80):
    """A Blender image of numbers in [0, 1] as a display shows them, packed as a file of that kind."""
    pixels = np.repeat(pixels[..., None], 3, -1) if pixels.ndim == 2 else pixels
    rows, columns, channels = pixels.shape
    full = np.concatenate([pixels, np.ones((rows, columns, 4 - channels))], -1)
    made = bpy.data.images.new(name, columns, rows, alpha=channels == 4)
    made.colorspace_settings.name = "sRGB" if colour else "Non-Color"
    made.pixels.foreach_set(np.clip(full, 0, 1).astype(np.float32).ravel())
    made.file_format = kind
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{name}.{'jpg' if kind == 'JPEG' else 'png'}"
        made.save(filepath=str(file), quality=quality)
        stored = bpy.data.images.load(str(file))
        stored.pack()
    stored.colorspace_settings.name = made.colorspace_settings.name
    stored.name = name
    bpy.data.images.remove(made)
    return stored


# ------------------------------------------------------------------------------------------------------- materials

def material(name, colour, roughness=0.5, one_sided=True, extras=None, **sockets):
    """A Principled material; `sockets` are its inputs by name, with _ for a space."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.use_backface_culling = one_sided
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = roughness
    for key, value in sockets.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    for key, value in (extras or {}).items():
        made[key] = value
    return made


def image_node(made, image):
    node = made.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    return node


def textured(made, colour=None, roughness=None, normal=None, repeat=None):
    """Hangs images into a Principled material; the normal map is repeated so many times along u and v."""
    tree = made.node_tree
    inputs = tree.nodes["Principled BSDF"].inputs
    if colour:
        tree.links.new(image_node(made, colour).outputs["Color"], inputs["Base Color"])
    if roughness:
        split = tree.nodes.new("ShaderNodeSeparateColor")
        tree.links.new(image_node(made, roughness).outputs["Color"], split.inputs["Color"])
        tree.links.new(split.outputs["Green"], inputs["Roughness"])
        # A factor of 0: nothing is metal, and the exporter passes the image on as it is stored.
        none = tree.nodes.new("ShaderNodeMath")
        none.operation = "MULTIPLY"
        none.inputs[1].default_value = 0
        tree.links.new(split.outputs["Blue"], none.inputs[0])
        tree.links.new(none.outputs[0], inputs["Metallic"])
    if normal:
        bump = tree.nodes.new("ShaderNodeNormalMap")
        node = image_node(made, normal)
        if repeat:
            mapping = tree.nodes.new("ShaderNodeMapping")
            mapping.inputs["Scale"].default_value = (*repeat, 1)
            tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["UV"], mapping.inputs["Vector"])
            tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
        tree.links.new(node.outputs["Color"], bump.inputs["Color"])
        tree.links.new(bump.outputs["Normal"], inputs["Normal"])
    return made


def cut_out(made, image):
    """Colour of an image where its alpha is at least 1/2, nothing elsewhere."""
    tree = made.node_tree
    inputs = tree.nodes["Principled BSDF"].inputs
    node = image_node(made, image)
    cut = tree.nodes.new("ShaderNodeMath")
    cut.operation = "ROUND"
    tree.links.new(node.outputs["Color"], inputs["Base Color"])
    tree.links.new(node.outputs["Alpha"], cut.inputs[0])
    tree.links.new(cut.outputs[0], inputs["Alpha"])
    return made


def absorbing(made, colour, distance):
    """White light is of that colour after so many metres in the solid. The exporter wants a thickness, which says nothing here."""
    tree = made.node_tree
    volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
    volume.inputs["Color"].default_value = (*colour, 1)
    volume.inputs["Density"].default_value = 1 / distance
    tree.links.new(volume.outputs["Volume"], tree.nodes["Material Output"].inputs["Volume"])
    group = bpy.data.node_groups.new("glTF Material Output", "ShaderNodeTree")
    thickness = group.interface.new_socket("Thickness", in_out="INPUT", socket_type="NodeSocketFloat")
    thickness.default_value = distance
    tree.nodes.new("ShaderNodeGroup").node_tree = group
    return made


# ---------------------------------------------------------------------------------------------------------- shapes

def body(name, points, faces, *materials, uv=None, slots=None, flat=()):
    """An object of points (m) and faces (tuples of indices), smooth but for those in `flat`; `slots` and `uv` are by face."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, p)) for p in points], [], faces)
    mesh.polygons.foreach_set("use_smooth", [i not in flat for i in range(len(faces))])
    for each in materials:
        mesh.materials.append(each)
    if slots is not None:
        mesh.polygons.foreach_set("material_index", slots)
    if uv is not None:
        mesh.uv_layers.new().data.foreach_set("uv", np.concatenate([np.asarray(c, float) for c in uv]).ravel())
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)
    return made


def place(made, at, turn=(0, 0, 0), rest=True):
    """Turns an object (degrees about x, y, z), moves it, and lets it rest a fifth of a millimetre above the height it is given."""
    made.rotation_euler = [math.radians(a) for a in turn]
    matrix = made.rotation_euler.to_matrix()
    low = min((matrix @ v.co).z for v in made.data.vertices) if rest else 0
    made.location = Vector(at) - Vector((0, 0, low - 2e-4 if rest else 0))
    return made


def spline(points, count):
    """So many points, evenly by length, on the Catmull-Rom spline through the given ones."""
    p = np.asarray(points, float)
    p = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    t = np.linspace(0, 1, 40, endpoint=False)[:, None]
    pieces = [
        0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
        for a, b, c, d in zip(p, p[1:], p[2:], p[3:])
    ]
    return even(np.vstack([*pieces, p[-2]]), count)


def even(line, count):
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]
    at = np.linspace(0, length[-1], count)
    return np.stack([np.interp(at, length, line[:, i]) for i in range(line.shape[1])], -1)


def turned(profile, count):
    """The surface that a profile of (radius, height), from the axis to the axis, sweeps about z: points, faces, uv and row of each face."""
    profile = np.asarray(profile, float)
    angles = 2 * math.pi * np.arange(count) / count
    middle = profile[1:-1]
    ring = np.stack([np.cos(angles), np.sin(angles)], -1)
    rings = np.concatenate([middle[:, None, :1] * ring[None], np.broadcast_to(middle[:, None, 1:], (len(middle), count, 1))], -1)
    points = np.vstack([[0, 0, profile[0, 1]], rings.reshape(-1, 3), [0, 0, profile[-1, 1]]])
    last = len(points) - 1
    v = np.r_[0, np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))]
    v /= v[-1]
    faces, uv, rows = [], [], []
    for row in range(len(profile) - 1):
        for i in range(count):
            j, a, b = (i + 1) % count, i / count, (i + 1) / count
            below, above = 1 + (row - 1) * count, 1 + row * count
            if row == 0:
                corners = (0, above + j, above + i), [((a + b) / 2, 0), (b, v[1]), (a, v[1])]
            elif row == len(profile) - 2:
                corners = (below + i, below + j, last), [(a, v[row]), (b, v[row]), ((a + b) / 2, 1)]
            else:
                corners = (below + i, below + j, above + j, above + i), [(a, v[row]), (b, v[row]), (b, v[row + 1]), (a, v[row + 1])]
            faces.append(corners[0])
            uv.append(corners[1])
            rows.append(row)
    return points, faces, uv, rows


def inwards(line, by):
    """A profile moved by so much towards its left, which is the axis for one that rises."""
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return line + np.asarray(by)[..., None] * np.stack([-along[:, 1], along[:, 0]], -1)


def grid(rows, columns, at):
    """A net of points `at(u, v)` for u, v in [0, 1]: points, faces, uv."""
    v, u = np.mgrid[0:rows + 1, 0:columns + 1] / np.array([rows, columns])[:, None, None]
    points = np.stack(at(u, v), -1).reshape(-1, 3)
    uvs = np.stack([u, v], -1).reshape(-1, 2)
    faces = [
        (r * (columns + 1) + c, r * (columns + 1) + c + 1, (r + 1) * (columns + 1) + c + 1, (r + 1) * (columns + 1) + c)
        for r in range(rows) for c in range(columns)
    ]
    return points, faces, [uvs[list(f)] for f in faces]


def box(name, low, high, made, bevel=0.0, uv=None):
    """A box with rounded edges; `uv` maps a point and the normal of its face to texture coordinates."""
    shape = bmesh.new()
    bmesh.ops.create_cube(shape, size=1)
    for vertex in shape.verts:
        vertex.co = Vector(l + (c + 0.5) * (h - l) for l, h, c in zip(low, high, vertex.co))
    if bevel:
        bmesh.ops.bevel(shape, geom=shape.edges[:], offset=bevel, segments=3, profile=0.5, affect="EDGES")
    points = [tuple(v.co) for v in shape.verts]
    faces = [tuple(v.index for v in f.verts) for f in shape.faces]
    shape.normal_update()
    flat = {i for i, f in enumerate(shape.faces) if max(map(abs, f.normal)) > 0.999}
    corners = [[uv(v.co, f.normal) for v in f.verts] for f in shape.faces] if uv else None
    shape.free()
    return body(name, points, faces, made, uv=corners, flat=flat)


# ------------------------------------------------------------------------------------------------------------ room

def wall(name, corners, made):
    """A flat polygon that faces the side from which its corners run anticlockwise."""
    return body(name, corners, [tuple(range(len(corners)))], made, flat={0})


def room():
    plaster = material("Plaster", (0.80, 0.785, 0.75), 0.9, Specular_IOR_Level=0)
    floor = material("Floor", (0.24, 0.15, 0.09), 0.5)
    l, r, f, b, c = LEFT, RIGHT, FRONT, BACK, CEILING
    wall("Floor", [(l, f, 0), (r, f, 0), (r, b, 0), (l, b, 0)], floor)
    wall("Ceiling", [(l, f, c), (l, b, c), (r, b, c), (r, f, c)], plaster)
    wall("Wall behind", [(l, b, 0), (r, b, 0), (r, b, c), (l, b, c)], plaster)
    wall("Wall at right", [(r, b, 0), (r, f, 0), (r, f, c), (r, b, c)], plaster)
    wall("Wall in front", [(r, f, 0), (l, f, 0), (l, f, c), (r, f, c)], plaster)
    outer = [(l, f, 0), (l, b, 0), (l, b, c), (l, f, c)]
    hole = [(l, NEAR, SILL), (l, FAR, SILL), (l, FAR, LINTEL), (l, NEAR, LINTEL)]
    outside = [(x - REVEAL, y, z) for x, y, z in hole]
    around = [(i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4)]
    body("Wall of the window", outer + hole, around, plaster, flat=set(range(4)))
    body("Reveal", hole + outside, around, plaster, flat=set(range(4)))


def window():
    paint = material("White paint", (0.80, 0.80, 0.77), 0.35)
    x, thick = LEFT - 0.11, 0.04
    middle = 0.69  # a wide casement and a narrow one, so that the shadow of the post passes behind the glass
    frame, bar = 0.05, 0.012
    parts = [
        (NEAR, NEAR + frame, SILL, LINTEL, thick), (FAR - frame, FAR, SILL, LINTEL, thick),
        (NEAR + frame, FAR - frame, SILL, SILL + frame, thick), (NEAR + frame, FAR - frame, LINTEL - frame, LINTEL, thick),
        (middle - 0.02, middle + 0.02, SILL + frame, LINTEL - frame, thick),
    ]
    for z in (1.12, 1.84):
        for side in ((NEAR + frame, middle - 0.02), (middle + 0.02, FAR - frame)):
            parts.append((*side, z - bar, z + bar, 0.022))
    for i, (y0, y1, z0, z1, t) in enumerate(parts):
        box(f"Window bar {i}", (x, y0, z0), (x + t, y1, z1), paint)
    box("Sill", (LEFT - 0.07, NEAR - 0.05, SILL - 0.03), (LEFT + 0.05, FAR + 0.05, SILL + 0.001), paint, bevel=0.004)


def table():
    x0, x1, y0, y1, thick = -0.66, 0.98, -0.31, 0.50, 0.034
    size = (x1 - x0, y1 - y0)
    colour, rough, height = wood(size, 5)
    oak = textured(
        material("Oak", (1, 1, 1)),
        picture("oak", colour, quality=66),
        picture("oak-roughness", rough[::2, ::2], colour=False, quality=75),
        picture("oak-normals", slopes(height, size), colour=False, quality=74),
    )

    def uv(p, n):
        return (p.x - x0) / size[0], (p.y - y0 + (p.z - TABLE) * (1 if n.y < 0 else -1)) / size[1]

    box("Table top", (x0, y0, TABLE - thick), (x1, y1, TABLE), oak, bevel=0.004, uv=uv)
    under = TABLE - thick - 0.001
    dark = material("Dark oak", (0.20, 0.12, 0.06), 0.5)
    for x in (x0 + 0.05, x1 - 0.12):
        for y in (y0 + 0.05, y1 - 0.12):
            box("Leg", (x, y, 0), (x + 0.07, y + 0.07, under), dark, bevel=0.003)
    box("Apron", (x0 + 0.12, y0 + 0.065, under - 0.09), (x1 - 0.12, y0 + 0.09, under), dark)


# --------------------------------------------------------------------------------------------------------- objects

def wine_glass(at):
    """The glass, and the wine as a solid of its own that reaches a third of a millimetre into it."""
    foot = [(0, 0.0022), (0.016, 0.0016), (0.0310, 0.0002), (0.0336, 0.0006), (0.0342, 0.0016), (0.0330, 0.0026)]
    stem = [(0.022, 0.0042), (0.0115, 0.0070), (0.0062, 0.0120), (0.0045, 0.0200), (0.0039, 0.0320), (0.0040, 0.0420)]
    bowl = [(0.0052, 0.0500), (0.0105, 0.0550), (0.0220, 0.0620), (0.0325, 0.0745), (0.0378, 0.0905), (0.0390, 0.1050),
            (0.0375, 0.1260), (0.0345, 0.1480), (0.0322, 0.1680)]
    outer = spline(foot + stem + bowl, 76)
    cup = outer[(outer[:, 1] > 0.0640) & (outer[:, 0] > 0.02)]
    wall = inwards(cup, np.interp(cup[:, 1], [0.0640, 0.0940, 0.1680], [0.0022, 0.0012, 0.0010]))
    wall = spline([(0, 0.0615), (0.006, 0.0618), (0.0135, 0.0634), *wall[1::3]], 38)
    lip = [outer[-1] * (1 - t) + wall[-1] * t + np.array([0, 0.0005 * math.sin(math.pi * t)]) for t in (0.2, 0.5, 0.8)]
    clear = material("Glass", (1, 1, 1), 0, Transmission_Weight=1, IOR=1.5)
    points, faces, _, _ = turned(np.vstack([outer, lip, wall[::-1]]), 64)
    place(body("Wine glass", points, faces, absorbing(clear, (0.97, 0.99, 0.98), 0.1)), at)
    wine(at, inwards(wall, -0.00035))


def wine(at, wall):
    level = 0.1230
    side = even(wall[wall[:, 1] <= level], 26)
    side[0, 0] = 0
    points, faces, _, rows = turned(np.vstack([side, [(0, side[-1, 1])]]), 64)
    red = material("Wine", (1, 1, 1), 0, Transmission_Weight=1, IOR=1.34)
    made = body("Wine", points, faces, absorbing(red, (0.92, 0.10, 0.10), 0.03), flat={i for i, r in enumerate(rows) if r == max(rows)})
    made.location = at


def porcelain_bowl(at):
    outer = [(0, 0.0030), (0.026, 0.0030), (0.0285, 0.0004), (0.0315, 0.0004), (0.0325, 0.0060), (0.0420, 0.0120), (0.0600, 0.0260),
             (0.0720, 0.0430), (0.0790, 0.0620)]
    rim = [(0.0796, 0.0640), (0.0788, 0.0650), (0.0776, 0.0642)]
    inner = [(0.0760, 0.0600), (0.0690, 0.0430), (0.0570, 0.0275), (0.0390, 0.0150), (0.0200, 0.0095), (0, 0.0085)]
    profile = spline(outer + rim + inner, 50)
    points, faces, _, rows = turned(profile, 72)
    glaze = dict(Coat_Weight=1.0, Coat_Roughness=0.02)
    white = material("Porcelain", (0.84, 0.83, 0.79), 0.5, **glaze)
    blue = material("Cobalt", (0.03, 0.07, 0.30), 0.5, **glaze)
    height, outside = profile[:-1, 1], np.arange(len(profile) - 1) < int(np.argmax(profile[:, 1]))
    band = outside & (((height > 0.0535) & (height < 0.0575)) | ((height > 0.0482) & (height < 0.0500)))
    place(body("Bowl", points, faces, white, blue, slots=[int(band[r]) for r in rows]), at)


def egg(name, at, turn, made):
    t = np.linspace(0, math.pi, 25)
    profile = np.stack([0.0215 * np.sin(t) * (1 + 0.16 * np.cos(t)), -0.0285 * np.cos(t)], -1)
    profile[[0, -1], 0] = 0
    points, faces, _, _ = turned(profile, 36)
    place(body(name, points, faces, made), at, turn)


def pear(at, turn, extras):
    outline = [(0, 0.0035), (0.006, 0.0022), (0.014, 0.0002), (0.026, 0.0065), (0.0345, 0.022), (0.0350, 0.034), (0.0300, 0.048),
               (0.0225, 0.060), (0.0178, 0.070), (0.0160, 0.079), (0.0125, 0.0865), (0.0065, 0.0895), (0.0025, 0.0880), (0, 0.0872)]
    points, faces, uv, _ = turned(spline(outline, 38), 48)
    points[:, 0] += lean(points[:, 2])
    skin = textured(material("Pear", (1, 1, 1), 0.42, extras=extras), picture("pear", pear_skin(), quality=80))
    place(body("Pear", points, faces, skin, uv=uv), at, turn)
    stem = [(0, 0.084), (0.0016, 0.0845), (0.0015, 0.094), (0.0016, 0.104), (0.0024, 0.1095), (0.0020, 0.1108), (0, 0.1110)]
    points, faces, _, _ = turned(spline(stem, 18), 12)
    points[:, 0] += lean(points[:, 2]) + 3.0 * np.clip(points[:, 2] - 0.084, 0, 1) ** 1.5
    bark = material("Stalk", (0.16, 0.10, 0.05), 0.7, extras=extras)
    made = place(body("Stalk", points, faces, bark), at, turn, rest=False)
    made.location = bpy.data.objects["Pear"].location


def lean(z):
    return 6.0 * np.clip(z - 0.03, 0, 1) ** 2.2


def spoon(at, turn):
    """A table spoon, 19 cm long, as rings about its middle line."""
    s = np.r_[0, 0.004, 0.012, np.linspace(0.03, 0.97, 50), 0.988, 0.996, 1]
    end = np.sqrt(np.clip(1 - ((0.17 - s) / 0.17).clip(0) ** 2, 0, 1))
    tail = np.sqrt(np.clip(1 - ((s - 0.955) / 0.045).clip(0) ** 2, 0, 1))
    half = 0.0035 + (0.0215 - 0.0035) * (1 - smooth(0.13, 0.37, s)) + 0.0052 * smooth(0.5, 0.95, s)
    half = np.maximum(half * end * tail, 2e-5)
    dip = 0.0085 * np.sin(math.pi * np.clip(s / 0.34, 0, 1)) ** 0.8
    line = 0.0085 + 0.0125 * smooth(0.28, 0.45, s) - 0.017 * smooth(0.45, 0.97, s) + 0.002 * smooth(0.93, 1, s)
    thick = np.minimum(0.0009 + 0.0011 * smooth(0.25, 0.4, s), half)
    around = np.linspace(0, 2 * math.pi, 24, endpoint=False)
    y = half[:, None] * np.cos(around)
    z = (line - dip)[:, None] + dip[:, None] * np.cos(around) ** 2 + thick[:, None] * np.sin(around)
    x = np.broadcast_to(0.19 * s[:, None], y.shape)
    n = len(around)
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    faces = [
        (r * n + i, r * n + (i + 1) % n, (r + 1) * n + (i + 1) % n, (r + 1) * n + i)
        for r in range(len(s) - 1) for i in range(n)
    ]
    faces = [tuple(range(n))[::-1], *faces, tuple(range((len(s) - 1) * n, len(s) * n))]
    silver = material("Silver", (0.93, 0.90, 0.85), 0.2, Metallic=1.0)
    place(body("Spoon", points, faces, silver), at, turn)


def ball(at, radius):
    t = np.linspace(0, math.pi, 27)
    profile = np.stack([radius * np.sin(t), -radius * np.cos(t)], -1)
    profile[[0, -1], 0] = 0
    points, faces, _, _ = turned(profile, 48)
    place(body("Steel ball", points, faces, material("Mirror", (0.92, 0.91, 0.89), 0, Metallic=1.0)), at)


def leaf(at, turn):
    def surface(u, v):
        side = (2 * v - 1) * np.minimum(leaf_half(u) + 0.06, 1)
        x, y = 0.125 * (u - 0.5), 0.027 * side + 0.006 * np.sin(math.pi * u)
        z = 0.017 * np.sin(math.pi * np.clip(u * 1.08, 0, 1)) ** 1.2 + 0.0075 * side**2 * np.sin(math.pi * u)
        return x, y, z + 0.0015 * np.sin(9 * u + 2 * side)

    points, faces, uv = grid(12, 28, surface)
    uv = [np.stack([c[:, 0], 0.5 + (c[:, 1] - 0.5) * np.minimum(leaf_half(c[:, 0]) + 0.06, 1)], -1) for c in uv]
    face = cut_out(material("Leaf", (1, 1, 1), 0.45, one_sided=False), picture("leaf", leaf_face(), kind="PNG"))
    place(body("Leaf", points, faces, face, uv=uv), at, turn)


def napkin(at, turn, size, flat_at, flat_radius):
    """A cloth on the table that hangs over its front edge, flat about one place; local v = 0 is its hanging end."""
    edge = -0.31
    bend = 0.008

    def surface(u, v):
        x, along = (u - 0.5) * size[0], v * size[1]
        y0 = at[1] + (along - size[1])
        over = np.clip(edge - 0.002 - y0, 0, None)
        turn_by = np.clip(over / bend, 0, math.pi / 2)
        hang = np.clip(over - bend * math.pi / 2, 0, None)
        y = np.maximum(y0, edge - 0.002) - bend * np.sin(turn_by)
        z = TABLE + 0.0022 - bend * (1 - np.cos(turn_by)) - hang
        calm = smooth(flat_radius, flat_radius + 0.07, np.hypot(x + at[0] - flat_at[0], y0 - flat_at[1]))
        fold = 0.5 + 0.5 * np.sin(70 * x + 13 * y0 + 2 * np.sin(11 * y0)) * np.cos(17 * x - 24 * y0)
        wave = calm * (0.013 * fold * smooth(0, 0.05, y0 - edge) + 0.001)
        sway = (0.004 + 0.10 * hang) * (0.5 + 0.5 * np.sin(52 * x + 1.0))
        across = at[0] + x + turn * (along - size[1]) + 0.006 * np.sin(17 * along)
        return across, y - sway * smooth(0, 0.02, over), z + wave

    points, faces, uv = grid(66, 36, surface)
    threads = picture("weave", slopes(0.00028 * weave(), (0.032, 0.032)), colour=False, quality=80)
    made = material("Linen", (1, 1, 1), 0.85, one_sided=False, Sheen_Weight=1.0, Sheen_Roughness=0.45, Sheen_Tint=(0.10, 0.10, 0.11, 1))
    linen = textured(made, picture("linen", stripes()), normal=threads, repeat=(size[0] / 0.032, size[1] / 0.032))
    body("Napkin", points, faces, linen, uv=uv)


def still_life():
    wine_glass((-0.13, 0.115, TABLE))
    napkin((0.245, 0.22), -0.16, (0.23, 0.64), (0.235, 0.10), 0.045)
    porcelain_bowl((0.235, 0.10, TABLE + 0.0040))
    shell = dict(roughness=0.55)
    brown = material("Egg", (0.62, 0.37, 0.23), **shell)
    pale = material("Egg without shadow", (0.80, 0.70, 0.58), extras={"illumination": "shadowless"}, **shell)
    egg("Egg", (0.03, -0.10, TABLE), (90, 0, 60), brown)
    egg("Egg without shadow", (0.108, -0.115, TABLE), (82, 0, -35), pale)
    pear((0.045, 0.185, TABLE), (0, 0, 200), {"illumination": [1.0, 0.5]})
    spoon((-0.165, -0.222, TABLE), (0, 0, 13))
    ball((-0.235, 0.015, TABLE), 0.021)
    leaf((-0.24, -0.115, TABLE), (16, 0, 24))


def camera():
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width, data.sensor_fit = 50, 36, "HORIZONTAL"
    data["fstop"], data["focus"] = 5.6, 1.15
    made = bpy.data.objects.new("Camera", data)
    made.location = (0.12, -1.02, 1.14)
    made.rotation_euler = (Vector((-0.035, 0.01, 0.82)) - made.location).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(made)
    bpy.context.scene.camera = made


def build():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = "Still life"
    scene["environment"] = SKY
    scene.render.resolution_x, scene.render.resolution_y = 1500, 1000
    room()
    window()
    table()
    still_life()
    camera()


def export(path):
    bpy.ops.export_scene.gltf(
        filepath=str(path), export_format="GLB", export_extras=True, export_cameras=True, export_lights=True, export_yup=True,
        export_apply=True, export_animations=False, export_image_format="AUTO", export_materials="EXPORT",
    )


if __name__ == "__main__":
    build()
    export(sys.argv[1] if len(sys.argv) > 1 else ROOT / "scenes" / "still-life.glb")
