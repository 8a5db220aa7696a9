"""Compares halflight's picture of glTF files with that of Cycles, and writes README.md and its pictures.

    python3.11 -m venv /tmp/fidelity && /tmp/fidelity/bin/pip install 'bpy==4.5.*' 'numpy<2' pillow
    cargo build --release
    /tmp/fidelity/bin/python docs/fidelity/make.py             # all of it: a quarter of an hour on two cores
    /tmp/fidelity/bin/python docs/fidelity/make.py sheen       # these models alone, printed; the page stays as it is

Models, EXR files and the numbers of each model are left in target/fidelity. `--page` writes the page from those numbers again.
"""

import argparse
import contextlib
import json
import math
import os
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

try:
    import bpy
except ImportError:
    bpy = None  # the page alone can be written without
import numpy as np
from PIL import Image

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WORK = ROOT / "target" / "fidelity"
SIZE = 96  # pixels
BLOCKS = 4  # regions in a row
SAMPLES = 48  # of Cycles for each pixel and seed
HALFLIGHT = ["--passes", "12", "--photons", "200000"]  # for each seed
SEEDS = [1, 2]
LOOKED_AT = 0.03  # a deviation that calls for a reason


# ---------------------------------------------------------------------------------------------------------- models

def png(pixels):
    """An 8-bit RGBA image as a PNG file."""
    h, w, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels.astype(np.uint8))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", w, h, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def image(of, n=64):
    """An image of n² texels from a function of u and v that gives four numbers in [0, 1]."""
    v, u = np.mgrid[0:n, 0:n] / n
    channels = [np.broadcast_to(np.asarray(c, float), (n, n)) for c in of(u + 0.5 / n, v + 0.5 / n)]
    return png(np.rint(255 * np.clip(np.stack(channels, -1), 0, 1)))


def stripes(x, count):
    return (np.floor(x * count) % 2).astype(float)


def checks(u, v, nu=8, nv=4):
    return (stripes(u, nu) + stripes(v, nv)) % 2


CHECKS = image(lambda u, v: (0.9 - 0.5 * checks(u, v), 0.5 + 0.3 * checks(u, v), 0.2 + 0.6 * v, 1))
STRIPES = image(lambda u, v: (0.95, 0.4 + 0.5 * stripes(v, 4), 0.3 + 0.6 * stripes(v, 4), 1))
ROUGH_METAL = image(lambda u, v: (0, 0.2 + 0.6 * stripes(v, 8), stripes(u, 8), 1))
WAVES = image(lambda u, v: (0.5 + 0.25 * np.sin(16 * math.pi * u), 0.5 + 0.25 * np.sin(8 * math.pi * v), 0.93, 1), 128)
HOLES = image(lambda u, v: (0.8, 0.5, 0.3, 1 - checks(u, v)))
GLOW = image(lambda u, v: (1 - checks(u, v), 0.6 * (1 - checks(u, v)), 0.2, 1))
GRAIN = image(lambda u, v: (1, 0.5, 1, 1), 2)


def sphere(nu=96, nv=48, radius=0.6, centre=(0, 0.65, 0)):
    u, v = np.meshgrid(np.linspace(0, 1, nu + 1), np.linspace(0, 1, nv + 1))
    phi, theta = 2 * math.pi * u, math.pi * v
    n = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1).reshape(-1, 3)
    n[: nu + 1], n[-nu - 1:] = [0, 1, 0], [0, -1, 0]
    n[nu :: nu + 1] = n[0 :: nu + 1]
    i = np.arange(nu)[None] + (nu + 1) * np.arange(nv)[:, None]
    a, b, c, d = i, i + 1, i + nu + 1, i + nu + 2
    upper = np.stack([a, c, d], -1)[:-1].reshape(-1, 3)
    lower = np.stack([a, d, b], -1)[1:].reshape(-1, 3)
    uv = np.stack([u, v], -1).reshape(-1, 2)
    return {"position": radius * n + np.array(centre), "normal": n, "uv": uv, "triangles": np.concatenate([upper, lower])}


def quad(corner, right, up):
    corner, right, up = (np.array(x, float) for x in (corner, right, up))
    normal = np.cross(right, up)
    points = np.array([corner, corner + right, corner + right + up, corner + up])
    return {
        "position": points, "normal": np.tile(normal / np.linalg.norm(normal), (4, 1)),
        "uv": np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float), "triangles": np.array([[0, 1, 2], [0, 2, 3]]),
    }


def card():
    """A card that leans back a little and is turned, so that light falls on both sides of it."""
    right = np.array([math.cos(0.35), 0, math.sin(0.35)])
    up = np.array([0.342 * 0.343, 0.9397, -0.342 * 0.9394])
    return quad(np.array([0, 0.65, 0]) - 0.6 * right - 0.6 * up, 1.2 * right, 1.2 * up)


def coloured(mesh):
    p = mesh["position"] - mesh["position"].min(0)
    return {**mesh, "colour": np.clip(np.c_[p / p.max(0), np.ones(len(p))], 0.05, 1)}


def with_second_uv(mesh):
    return {**mesh, "uv1": 0.5 * mesh["uv"][:, ::-1] + 0.25}


def glb(path, mesh, material, images):
    """Writes a model in its box, with lamp and camera."""
    # A closed room with the lamp in its ceiling, seen from inside alone, light enough that nothing is dark.
    grey, light, dark, lamp = range(1, 5)
    x, y, back, front = 1.5, 2.8, -1.2, 3.8
    half, near, far = 1.0, 1.6, -0.4  # the lamp
    room = [
        (quad([-x, 0, front], [2 * x, 0, 0], [0, 0, back - front]), grey),
        (quad([-x, 0, back], [2 * x, 0, 0], [0, y, 0]), grey),
        (quad([x, 0, front], [-2 * x, 0, 0], [0, y, 0]), grey),
        (quad([-x, 0, front], [0, 0, back - front], [0, y, 0]), light),
        (quad([x, 0, back], [0, 0, front - back], [0, y, 0]), dark),
        (quad([-x, y, back], [2 * x, 0, 0], [0, 0, far - back]), grey),
        (quad([-x, y, near], [2 * x, 0, 0], [0, 0, front - near]), grey),
        (quad([-x, y, far], [x - half, 0, 0], [0, 0, near - far]), grey),
        (quad([half, y, far], [x - half, 0, 0], [0, 0, near - far]), grey),
        (quad([-half, y, far], [2 * half, 0, 0], [0, 0, near - far]), lamp),
    ]

    def plain(value, name):
        return {
            "name": name, "pbrMetallicRoughness": {"baseColorFactor": [value] * 3 + [1], "metallicFactor": 0},
            "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
        }

    light_source = plain(0, "lamp")
    light_source["emissiveFactor"] = [1, 1, 1]
    light_source["extensions"]["KHR_materials_emissive_strength"] = {"emissiveStrength": 4}
    materials = [{"name": "model", **material}, plain(0.6, "grey"), plain(0.75, "light"), plain(0.45, "dark"), light_source]

    blob, views, accessors = bytearray(), [], []

    def view(data):
        blob.extend(b"\0" * (-len(blob) % 4))
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)})
        blob.extend(data)
        return len(views) - 1

    def accessor(array, kind):
        array = np.ascontiguousarray(array, np.uint32 if kind == "SCALAR" else np.float32)
        made = {"bufferView": view(array.tobytes()), "componentType": 5125 if kind == "SCALAR" else 5126,
                "count": len(array), "type": kind}
        if kind == "VEC3":
            made |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        accessors.append(made)
        return len(accessors) - 1

    names = {"position": ("POSITION", "VEC3"), "normal": ("NORMAL", "VEC3"), "uv": ("TEXCOORD_0", "VEC2"),
             "uv1": ("TEXCOORD_1", "VEC2"), "colour": ("COLOR_0", "VEC4")}
    meshes = []
    for shape, of in [(mesh, 0), *room]:
        attributes = {names[key][0]: accessor(shape[key], names[key][1]) for key in names if key in shape}
        indices = accessor(shape["triangles"].reshape(-1), "SCALAR")
        meshes.append({"primitives": [{"attributes": attributes, "indices": indices, "material": of}]})
    # The camera looks at the model, slightly from above.
    tilt = -math.atan2(0.35, 3.5)
    nodes = [{"mesh": i, "name": f"mesh {i}"} for i in range(len(meshes))]
    nodes.append({"camera": 0, "translation": [0, 1.05, 3.5], "rotation": [math.sin(tilt / 2), 0, 0, math.cos(tilt / 2)]})
    perspective = {"yfov": 2 * math.atan(0.85 / 3.5), "aspectRatio": 1, "znear": 0.1}
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes,
        "meshes": meshes, "materials": materials, "cameras": [{"type": "perspective", "perspective": perspective}],
    }
    if images:
        document["images"] = [{"bufferView": view(data), "mimeType": "image/png"} for data in images]
        document["textures"] = [{"source": i, "sampler": 0} for i in range(len(images))]
        document["samplers"] = [{"magFilter": 9729, "minFilter": 9729, "wrapS": 10497, "wrapT": 10497}]
    document |= {"accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(blob)}]}
    document["extensionsUsed"] = sorted({key for made in materials for key in extensions_in(made)})
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    blob.extend(b"\0" * (-len(blob) % 4))
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + bytes(blob)
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


def extensions_in(value):
    if isinstance(value, dict):
        yield from value.get("extensions", {})
        for inner in value.values():
            yield from extensions_in(inner)


def pbr(base=(0.8, 0.4, 0.2), metal=0.0, rough=0.5, **more):
    """A material; what begins with KHR_ is an extension, what else glTF has goes to the material."""
    inner = {"baseColorFactor": [*base, 1.0][:4], "metallicFactor": metal, "roughnessFactor": rough}
    inner |= {key: more.pop(key) for key in list(more) if key in ("baseColorTexture", "metallicRoughnessTexture")}
    extensions = {key: more.pop(key) for key in list(more) if key.startswith("KHR_")}
    return {"pbrMetallicRoughness": inner, **({"extensions": extensions} if extensions else {}), **more}


MATT = {"specularFactor": 0}
WHITE, GOLD, RED = (1, 1, 1), (1, 0.766, 0.336), (0.7, 0.1, 0.08)


def texture(index=0, **more):
    return {"index": index, **more}


def glass(rough, base=WHITE, **more):
    solid = {"thicknessFactor": 0.1, **more.pop("volume", {})}
    return pbr(base, rough=rough, KHR_materials_transmission={"transmissionFactor": 1}, KHR_materials_volume=solid, **more)


def pane(rough):
    return pbr(WHITE, rough=rough, doubleSided=True, KHR_materials_transmission={"transmissionFactor": 1})


# ---------------------------------------------------------------------------------------- what Blender does not import

def principled():
    return next(node for node in bpy.data.materials["model"].node_tree.nodes if node.type == "BSDF_PRINCIPLED")


def put(name, value):
    """Sets an input of the model's Principled BSDF, whatever was linked to it."""
    socket = principled().inputs[name]
    for link in list(socket.links):
        bpy.data.materials["model"].node_tree.links.remove(link)
    socket.default_value = value


def set_film():
    put("Thin Film Thickness", 400.0)
    put("Thin Film IOR", 1.3)


def set_leaf():
    tree = bpy.data.materials["model"].node_tree
    out = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    mix, front, back = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "BsdfDiffuse", "BsdfTranslucent"))
    front.inputs["Color"].default_value, back.inputs["Color"].default_value = (0.8, 0.4, 0.2, 1), (0.3, 0.8, 0.2, 1)
    mix.inputs[0].default_value = 0.6
    tree.links.new(mix.inputs[1], front.outputs[0])
    tree.links.new(mix.inputs[2], back.outputs[0])
    tree.links.new(out.inputs[0], mix.outputs[0])


def set_slab():
    """The pane as the thing that it stands for: a slab with two faces."""
    for thing in bpy.data.objects:
        if thing.type == "MESH" and thing.data.materials[0].name == "model":
            if "custom_normal" in thing.data.attributes:
                thing.data.attributes.remove(thing.data.attributes["custom_normal"])
            thing.data.shade_flat()
            modifier = thing.modifiers.new("slab", "SOLIDIFY")
            modifier.thickness = 0.001


def set_absorption():
    """Blender absorbs density · (1 − colour), glTF −ln(colour) / distance."""
    absorbed = -np.log(np.array([0.8, 0.5, 0.25])) / 0.6
    node = next(node for node in bpy.data.materials["model"].node_tree.nodes if node.type == "VOLUME_ABSORPTION")
    node.inputs["Density"].default_value = absorbed.max()
    node.inputs["Color"].default_value = (*(1 - absorbed / absorbed.max()), 1)


def set_tint():
    """glTF multiplies by the base colour at each face, Cycles by its root."""
    put("Base Color", [channel**2 for channel in principled().inputs["Base Color"].default_value])


def set_shade():
    """Blender's importer lets all light but that of camera rays through what is unlit."""
    tree = bpy.data.materials["model"].node_tree
    mix = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    black = tree.nodes.new("ShaderNodeBsdfDiffuse")
    black.inputs["Color"].default_value = (0, 0, 0, 1)
    tree.links.new(mix.inputs[1], black.outputs[0])


def set_plain():
    """Lambert about the normal of the map, as glTF says: by default Cycles darkens what is seen or lit at a grazing angle."""
    bpy.data.materials["model"].cycles.use_bump_map_correction = False


def set_grain():
    """The two α of KHR_materials_anisotropy: Blender has roughness² / a and · a with a² = 1 − 0.9 anisotropic."""
    across = 0.3**2
    along = across + (1 - across) * 0.6**2
    put("Roughness", (along * across) ** 0.25)
    put("Anisotropic", (1 - across / along) / 0.9)


def set_index(channel):
    """The index of one colour where dispersion is 1 (Abbe's number 20)."""
    put("IOR", 1.5 + (1.5 - 1) * 0.025 * (channel - 1))


# A model: its mesh, its material, its images; what is set by hand in Blender; what is said of the deviation.
MODELS = {
    "diffuse": dict(material=pbr(KHR_materials_specular=MATT)),
    "dielectric-0.1": dict(material=pbr(RED, rough=0.1)),
    "dielectric-0.5": dict(material=pbr(RED, rough=0.5)),
    "dielectric-1": dict(material=pbr(RED, rough=1.0)),
    "metal-0": dict(material=pbr(WHITE, 1.0, 0.0)),
    "metal-0.1": dict(material=pbr(WHITE, 1.0, 0.1)),
    "metal-0.3": dict(material=pbr(WHITE, 1.0, 0.3)),
    "metal-0.6": dict(material=pbr(WHITE, 1.0, 0.6)),
    "metal-1": dict(material=pbr(WHITE, 1.0, 1.0)),
    "gold-0": dict(material=pbr(GOLD, 1.0, 0.0)),
    "gold-0.3": dict(material=pbr(GOLD, 1.0, 0.3)),
    "gold-1": dict(material=pbr(GOLD, 1.0, 1.0)),
    "ior-1.2": dict(material=pbr(RED, rough=0.2, KHR_materials_ior={"ior": 1.2})),
    "ior-2": dict(material=pbr(RED, rough=0.2, KHR_materials_ior={"ior": 2.0})),
    "specular-factor": dict(material=pbr(RED, rough=0.2, KHR_materials_specular={"specularFactor": 0.4})),
    "specular-colour": dict(material=pbr(
        RED, rough=0.2, KHR_materials_ior={"ior": 2.0}, KHR_materials_specular={"specularColorFactor": [0.2, 0.6, 1.0]})),
    "coat-smooth": dict(material=pbr(
        RED, rough=0.6, KHR_materials_clearcoat={"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.03})),
    "coat-rough": dict(material=pbr(
        GOLD, 1.0, 0.3, KHR_materials_clearcoat={"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.5})),
    "sheen": dict(material=pbr(
        (0.1, 0.05, 0.2), rough=0.8, KHR_materials_specular=MATT,
        KHR_materials_sheen={"sheenColorFactor": [0.9, 0.7, 0.5], "sheenRoughnessFactor": 0.5})),
    "anisotropy": dict(
        material=pbr(WHITE, 1.0, 0.3, KHR_materials_anisotropy={"anisotropyStrength": 0.6, "anisotropyTexture": texture()}),
        images=[GRAIN], by_hand=(set_grain, "both α of the grain")),
    "iridescence": dict(
        material=pbr((0.05, 0.05, 0.05), rough=0.15, KHR_materials_ior={"ior": 1.8}, KHR_materials_iridescence={
            "iridescenceFactor": 1.0, "iridescenceIor": 1.3, "iridescenceThicknessMaximum": 400.0}),
        by_hand=(set_film, "the film")),
    "diffuse-transmission": dict(
        mesh=card, material=pbr(doubleSided=True, KHR_materials_specular=MATT, KHR_materials_diffuse_transmission={
            "diffuseTransmissionFactor": 0.6, "diffuseTransmissionColorFactor": [0.3, 0.8, 0.2]}),
        by_hand=(set_leaf, "a mix of Diffuse and Translucent BSDF")),
    "glass-smooth": dict(material=glass(0.0)),
    "glass-rough": dict(material=glass(0.3)),
    "glass-tinted": dict(
        material=glass(0.0, (0.9, 0.7, 0.4)), by_hand=(set_tint, "the colour squared, of which Cycles takes the root")),
    "thin-smooth": dict(mesh=card, material=pane(0.0), by_hand=(set_slab, "a slab of 1 mm")),
    "thin-rough": dict(mesh=card, material=pane(0.3), by_hand=(set_slab, "a slab of 1 mm")),
    "volume": dict(
        material=glass(0.0, volume={"attenuationColor": [0.8, 0.5, 0.25], "attenuationDistance": 0.6}),
        by_hand=(set_absorption, "absorption")),
    "dispersion": dict(
        material=glass(0.0, KHR_materials_dispersion={"dispersion": 1.0}), channels=set_index,
        by_hand=(None, "the index of each colour, three renders")),
    "base-texture": dict(material=pbr(WHITE, KHR_materials_specular=MATT, baseColorTexture=texture()), images=[CHECKS]),
    "metal-rough-texture": dict(material=pbr(GOLD, 1.0, 1.0, metallicRoughnessTexture=texture()), images=[ROUGH_METAL]),
    "normal-map": dict(
        material=pbr((0.6, 0.6, 0.6), KHR_materials_specular=MATT, normalTexture=texture()), images=[WAVES],
        by_hand=(set_plain, "without *Bump Map Correction*")),
    "vertex-colours": dict(mesh=lambda: coloured(sphere()), material=pbr(WHITE, KHR_materials_specular=MATT)),
    "alpha-blend": dict(
        mesh=card, material=pbr((0.8, 0.4, 0.2, 0.4), alphaMode="BLEND", doubleSided=True, KHR_materials_specular=MATT)),
    "alpha-mask": dict(
        material=pbr(WHITE, KHR_materials_specular=MATT, baseColorTexture=texture(), alphaMode="MASK", doubleSided=True),
        images=[HOLES]),
    "emissive-strength": dict(material=pbr(
        (0.3, 0.3, 0.3), KHR_materials_specular=MATT, emissiveFactor=[1.0, 0.6, 0.3],
        KHR_materials_emissive_strength={"emissiveStrength": 1.5})),
    "emissive-texture": dict(
        material=pbr((0.3, 0.3, 0.3), KHR_materials_specular=MATT, emissiveFactor=[1, 1, 1], emissiveTexture=texture()),
        images=[GLOW]),
    "unlit": dict(
        material=pbr((0.8, 0.4, 0.2), KHR_materials_unlit={}), by_hand=(set_shade, "black to light that falls on it")),
    "spec-gloss": dict(material=pbr(KHR_materials_pbrSpecularGlossiness={
        "diffuseFactor": [0.5, 0.1, 0.08, 1], "specularFactor": [0.3, 0.25, 0.2], "glossinessFactor": 0.7})),
    "texture-transform": dict(
        mesh=card, material=pbr(WHITE, doubleSided=True, KHR_materials_specular=MATT, baseColorTexture=texture(
            extensions={"KHR_texture_transform": {"offset": [0.2, 0.1], "rotation": 0.5, "scale": [1.5, 0.7]}})),
        images=[CHECKS]),
    "two-uv-sets": dict(
        mesh=lambda: with_second_uv(card()), material=pbr(
            WHITE, doubleSided=True, KHR_materials_specular=MATT, baseColorTexture=texture(0, texCoord=1),
            emissiveFactor=[0.1, 0.1, 0.1], metallicRoughnessTexture=texture(1)),
        images=[CHECKS, STRIPES]),
}


# --------------------------------------------------------------------------------------------------------- renderers

def read_exr(path):
    """Linear pixels, from the top."""
    loaded = bpy.data.images.load(str(path), check_existing=False)
    loaded.colorspace_settings.name = "Non-Color"
    pixels = np.array(loaded.pixels[:], np.float64).reshape(loaded.size[1], loaded.size[0], 4)[::-1, :, :3]
    bpy.data.images.remove(loaded)
    return pixels


@contextlib.contextmanager
def silence():
    """Blender prints every tile."""
    sys.stdout.flush()
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)


def cycles(path, model):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with silence():
        bpy.ops.import_scene.gltf(filepath=str(path))
    scene = bpy.context.scene
    scene.camera = next(thing for thing in bpy.data.objects if thing.type == "CAMERA")
    scene.world = None
    render, settings = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode, render.image_settings.color_depth = "RGB", "32"
    settings.device, settings.samples = "CPU", SAMPLES
    settings.use_adaptive_sampling = settings.use_denoising = False
    settings.caustics_reflective = settings.caustics_refractive = True
    settings.sample_clamp_direct = settings.sample_clamp_indirect = settings.blur_glossy = 0.0
    settings.light_sampling_threshold = 0.0
    settings.pixel_filter_type = "BOX"
    for name in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(settings, f"{name}_bounces", 64)
    by_hand = model.get("by_hand", (None, None))[0]
    if by_hand:
        by_hand()

    def picture(seed):
        settings.seed = seed
        render.filepath = str(path.with_suffix(f".cycles{seed}.exr"))
        with silence():
            bpy.ops.render.render(write_still=True)
        return read_exr(render.filepath)

    if "channels" not in model:
        return [picture(seed) for seed in SEEDS]
    pictures = [np.zeros((SIZE, SIZE, 3)) for _ in SEEDS]
    for channel in range(3):
        model["channels"](channel)
        for made, seed in zip(pictures, SEEDS):
            made[:, :, channel] = picture(seed)[:, :, channel]
    return pictures


def halflight(program, path, options):
    pictures = []
    for seed in SEEDS:
        out = path.with_suffix(f".halflight{seed}.exr")
        more = ["--size", f"{SIZE}x{SIZE}", "--layers", "visible", "--seed", str(seed), "--overwrite", "--quiet"]
        subprocess.run([program, "render", str(path), *options, *more, "-o", str(out)], check=True)
        pictures.append(read_exr(out))
    return pictures


def regions(picture):
    n = SIZE // BLOCKS
    return picture.reshape(BLOCKS, n, BLOCKS, n, 3).mean((1, 3)).reshape(-1, 3)


def deviation(one, other):
    """Of each region: in the colour in which they differ most, over the mean of its colours, with its sign."""
    one, other = regions(one), regions(other)
    difference = (one - other) / other.mean(1, keepdims=True)
    return np.take_along_axis(difference, np.abs(difference).argmax(1)[:, None], 1)[:, 0]


def side_by_side(path, ours, theirs):
    def shown(linear):
        x = np.clip(linear / 1.2, 0, 1)
        return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)

    scale = theirs.mean()
    # Noise of single pixels is not what is shown.
    smooth = (ours - theirs).reshape(SIZE // 2, 2, SIZE // 2, 2, 3).mean((1, 3)).repeat(2, 0).repeat(2, 1)
    difference = np.clip(0.5 + smooth / scale / 0.4 * 0.5, 0, 1)
    row = np.concatenate([shown(ours), shown(theirs), difference], 1)
    pixels = np.rint(255 * row).astype(np.uint8)
    made = Image.fromarray(pixels, "RGB").quantize(128, dither=Image.Dither.NONE)
    made.save(path, optimize=True)


def compare(name, model, program, options, keep=False):
    path = WORK / f"{name}.glb"
    glb(path, model.get("mesh", sphere)(), model["material"], model.get("images", []))
    started = time.monotonic()
    ours = halflight(program, path, options)
    halfway = time.monotonic()
    if keep:
        with np.load(WORK / f"{name}.npz") as kept:
            theirs = kept["theirs"]
        known = json.loads((WORK / f"{name}.json").read_text())["seconds"][1]
    else:
        theirs = np.stack(cycles(path, model))
        known = time.monotonic() - halfway
    mean_ours, mean_theirs = sum(ours) / 2, theirs.mean(0)
    off = deviation(mean_ours, mean_theirs)
    noise = [np.abs(deviation(*pair)).max() / 2 for pair in (ours, theirs)]
    np.savez(WORK / f"{name}.npz", ours=mean_ours, theirs=theirs)
    found = {
        "regions": off.tolist(), "largest": off[np.abs(off).argmax()], "median": float(np.median(np.abs(off))),
        "noise": noise, "mean": float(mean_ours.mean() / mean_theirs.mean() - 1),
        "seconds": [halfway - started, known], "options": options,
        "blender": bpy.app.version_string,
    }
    (WORK / f"{name}.json").write_text(json.dumps(found))
    return found


# Why they differ: the models of which it is said, and what.
REASONS = {
    "layers": (
        ["dielectric-0.1", "dielectric-0.5", "ior-1.2", "ior-2", "specular-factor", "specular-colour", "coat-smooth", "spec-gloss"],
        """A body below a clear layer gets what the layer does not mirror. halflight multiplies by what gets in *and* by what gets out,
over their mean ([Lobes](../lobes.md)): reciprocal, as shooting needs it. Cycles multiplies by what gets out alone. Both are white
where all is white. By these formulas, of an index of 1.5, what comes straight from the lamp is 20 % darker in halflight at the middle
of these balls, where it falls in at 60° to 90°, and 7 % brighter at 60° above it. Fresnel's law is Schlick's curve in halflight and in
glTF, the real one in Cycles, which is lower between 60° and 80°: most where the index is 1.2."""),
    "specular": (
        ["specular-factor"],
        """glTF's `specularFactor` takes away at grazing angles too, so that halflight's picture has less of a rim. Cycles' *Specular IOR
Level* changes the index: at grazing angles all is mirrored."""),
    "specular-glossiness": (
        ["spec-gloss"],
        "Blender's importer makes it a body of index 1000, whose Fresnel curve is almost flat, so that Cycles' rim is darker."),
    "facets": (
        ["metal-0.6", "metal-1", "gold-1", "metal-rough-texture"],
        """Light that meets several facets: halflight adds a broad lobe for it (Kulla & Conty), Cycles brightens the lobe of those who
meet one. In a white room both give all of it back. In this one, at a roughness of 0.6, halflight's highlight is lower and what is
around it brighter; at 1 its ball is brighter below the lamp and darker in the middle."""),
    "mirrors": (
        ["gold-0"],
        """The numbers and the picture are from before metal of roughness 0 followed Schlick's law: its rim was too yellow."""),
    "brushed": (
        ["anisotropy"],
        """Cycles loses light on brushed metal: in a white room its ball has 0.92 in the middle and 0.90 half way to the rim, where
halflight's has 1.00 (`cargo run --release --example lobes`)."""),
    "sheen": (
        ["sheen"],
        "Other fibres: Estevez & Kulla in glTF and halflight, Zeltner et al. in Cycles, whose roughness means something else."),
    "films": (
        ["iridescence"],
        """Both follow Belcour & Barla. halflight does as glTF's sample code does, whose interference is in XYZ made Rec. 709 without
a balance of white: beside a spectrum computed wavelength by wavelength for these indices, its blue is 9 % too small and its red
swings too far (at cosine 0.8 blue is 0.078, not 0.086). With Schlick's curve the rim is too bright (at cosine 0.3 green is 0.161, not
0.159, at 0.15 0.47, not 0.42)."""),
    "rough-glass": (
        ["glass-rough"],
        """The numbers and the picture are from before light that meets several facets was sent on in `RoughDielectric`: it was too
dark."""),
    "texels": (
        ["base-texture", "texture-transform", "two-uv-sets", "metal-rough-texture", "alpha-mask"],
        """Between two texels halflight mixes light, as glTF says; Cycles mixes the file's encoded numbers and is darker there. Seen
along the edges of the squares."""),
    "normal-maps": (
        ["normal-map"],
        """**halflight is brighter than glTF says**, by 2 / (1 + cos t) where the map leans by t: `Diffuse` makes up for what of the
cosine about the map's normal lies below the surface, so that a white surface is white whatever its map. It is as much as 6 % at 27°
and 17 % at 45°, and takes contrast from small bumps. A map that leans by 45° everywhere was 17.6 % brighter than in Cycles.
It is kept: light below the surface's horizon falls on the next bump, which is as white and sends it on, so that a real relief loses
none of it, while glTF's formula loses (1 − cos t) / 2 at every bounce, and coarse bodies with smooth normals would lose it too. It is
one constant for a pair of normals, the same for light that is shot and for light that is gathered."""),
    "emissive-images": (
        ["emissive-texture"],
        "The numbers and the picture are from before luminaires shone where their image is bright: they show the mean of it."),
}


def page():
    """Writes README.md and its pictures from what was found."""
    pictures = HERE / "pictures"
    pictures.mkdir(exist_ok=True)
    rows, spent = [], [0.0, 0.0]
    for name, model in MODELS.items():
        found = json.loads((WORK / f"{name}.json").read_text())
        kept = np.load(WORK / f"{name}.npz")
        side_by_side(pictures / f"{name}.png", kept["ours"], kept["theirs"].mean(0))
        reasons = ", ".join(f"[{why}](#{why.replace(' ', '-')})" for why, (of, _) in REASONS.items() if name in of)
        if not reasons and abs(found["largest"]) > LOOKED_AT:
            reasons = "noise" if abs(found["largest"]) < 2.5 * math.hypot(*found["noise"]) else "not known"
        noise = " ".join(f"{100 * one:.1f}" for one in found["noise"])
        by_hand = model.get("by_hand", (None, ""))[1]
        passes = found["options"][found["options"].index("--passes") + 1]
        rows.append(
            f"| {name} | ![{name}](pictures/{name}.png) | {100 * found['largest']:+.1f} | {100 * found['median']:.1f} "
            f"| {100 * found['mean']:+.1f} | {noise} | {passes} | {by_hand} | {reasons} |")
        spent = [sum(pair) for pair in zip(spent, found["seconds"])]
    why = "\n\n".join(f"### {title}\n\n{text}" for title, (_, text) in REASONS.items())
    text = PAGE.format(
        version=found["blender"], size=SIZE, count=len(rows), rows="\n".join(rows), why=why, samples=SAMPLES,
        seeds=" and ".join(map(str, SEEDS)), options=" ".join(HALFLIGHT), seed=SEEDS[0], side=SIZE // BLOCKS,
        minutes=math.ceil(sum(spent) / 60))
    (HERE / "README.md").write_text(text)


PAGE = """# The same files in Cycles

<!-- Written by make.py: change it there. -->

What halflight makes of a glTF file beside what Blender {version} makes of it: its own importer, Cycles on the CPU. {count} models,
one for each feature, stand in the same closed grey room with one lamp of 4 W m⁻² sr⁻¹ in its ceiling. Pictures are linear
radiance, {size}×{size} pixels, with nothing clamped, denoised or left out (64 bounces, caustics on).

```sh
python3.11 -m venv /tmp/fidelity && /tmp/fidelity/bin/pip install 'bpy==4.5.*' 'numpy<2' pillow
cargo build --release
/tmp/fidelity/bin/python docs/fidelity/make.py          # this page, in {minutes} minutes of two cores that others used too
/tmp/fidelity/bin/python docs/fidelity/make.py sheen    # one model, printed
```

The second leaves `target/fidelity/sheen.glb`, which is rendered by this, with as many passes as the table says:

```sh
halflight render target/fidelity/sheen.glb --size {size}x{size} --layers visible {options} --seed {seed} -o sheen.exr
```

**How they are compared.** A picture is the mean of two, of seeds {seeds}; Cycles takes {samples} samples a pixel for each. It is cut
into 16 regions of {side}×{side} pixels. The deviation of a region is halflight − Cycles in the colour in which they differ most, over
Cycles' mean of the three: so a colour of which there is little counts little. *Noise* is half of what the two seeds differ by in the
region where they differ most, of halflight and of Cycles. All are in per cent. In the pictures halflight is on the left, Cycles in
the middle; on the right grey is no difference, black and white are 20 % of the picture's mean.

*By hand* is what `make.py` sets in Blender after it has imported the file, since its importer does not read it or Cycles has another
convention.

| model | | largest | median | whole | noise | passes | by hand | why |
|---|---|--:|--:|--:|--:|--:|---|---|
{rows}

## Why they differ

{why}
"""


def line(name, found):
    noise = max(found["noise"])
    return f"{name:22} largest {found['largest']:+7.1%}  median {found['median']:6.1%}  mean {found['mean']:+6.1%}  noise {noise:5.2%}  {found['seconds'][0]:4.0f} s {found['seconds'][1]:4.0f} s"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", help="these alone; the page is not written")
    parser.add_argument("--halflight", default=str(ROOT / "target" / "release" / "halflight"), help="the program")
    parser.add_argument("--options", help="options of halflight instead of: " + " ".join(HALFLIGHT))
    parser.add_argument("--keep", action="store_true", help="Cycles' pictures of before: only halflight renders")
    parser.add_argument("--page", action="store_true", help="only write the page, from numbers of before")
    asked = parser.parse_args()
    unknown = set(asked.models) - set(MODELS)
    if unknown:
        parser.error(f"no such models: {', '.join(sorted(unknown))}; there are {', '.join(MODELS)}")
    if bpy is None and not asked.page:
        parser.error("bpy is missing: pip install 'bpy==4.5.*'")
    if asked.options and "--passes" not in asked.options:
        parser.error("--options must name --passes")
    WORK.mkdir(parents=True, exist_ok=True)
    options = asked.options.split() if asked.options else HALFLIGHT
    for name in asked.models or MODELS:
        if not asked.page:
            print(line(name, compare(name, MODELS[name], asked.halflight, options, asked.keep)), flush=True)
    if not asked.models:
        page()


if __name__ == "__main__":
    main()
