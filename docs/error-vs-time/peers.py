"""The still life beside Cycles and Mitsuba: relMSE after equal time, each against its own converged picture.

    python3.11 -m venv /tmp/peers && /tmp/peers/bin/pip install 'bpy==4.5.*' mitsuba 'numpy<2' pillow
    cargo build --release
    /tmp/peers/bin/python docs/error-vs-time/peers.py --seconds 60 --reference 600

Geometry, textures, camera (without its lens) and light (a picture of a sky with a sun, the same file for all) are the same. Matter is, as
far as these have it: Blender's importer makes Cycles' materials; for Mitsuba they are its `principled`, glass without absorption, and the
leaf a mask. Two materials of ours keep their own illumination. Nothing is clamped or filtered in any of them. Pictures and numbers are
left in target/peers.
"""

import argparse
import io
import json
import math
import struct
import subprocess
import time
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent.parent
WORK = ROOT / "target" / "peers"
SIZE = (360, 240)
VARIANT = "scalar_rgb"  # llvm_ad_rgb is another that may be faster, where there is an LLVM


def sky(path, width=2048):
    """A bright sky with a sun of 2 degrees across, as a Radiance picture."""
    v, u = np.mgrid[0 : width // 2, 0:width]
    theta, phi = math.pi * (v + 0.5) / (width // 2), 2 * math.pi * ((u + 0.5) / width - 0.5)
    d = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1)
    turn, height = math.radians(296), math.radians(40)
    sun = np.array([math.sin(turn) * math.cos(height), math.sin(height), -math.cos(turn) * math.cos(height)])
    up = np.clip(d[..., 1:2], 0, 1)
    light = np.where(d[..., 1:2] > 0, np.array([0.5, 0.7, 1.0]) * (1.2 - 0.7 * up), np.array([0.12, 0.1, 0.08]))
    light = light + 4000 * np.array([1.0, 0.9, 0.75]) * (d @ sun > math.cos(math.radians(1)))[..., None]
    exponent = np.ceil(np.log2(light.max(-1) * 1.0001))
    texels = np.concatenate([light * 2.0 ** (8 - exponent)[..., None], exponent[..., None] + 128], -1)
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {width // 2} +X {width}\n"
    path.write_bytes(head.encode() + texels.astype(np.uint8).tobytes())


def read_glb(path):
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def write_glb(path, document, binary):
    head = json.dumps(document).encode()
    head += b" " * (-len(head) % 4)
    chunks = struct.pack("<II", len(head), 0x4E4F534A) + head + struct.pack("<II", len(binary), 0x004E4942) + binary
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


def relmse(picture, reference):
    return float(np.mean((picture - reference) ** 2 / (reference**2 + 1e-4)))


# ------------------------------------------------------------------------------------------------------- halflight

def halflight(scene, environment, seconds, seed):
    out = WORK / f"halflight-{seed}.pfm"
    command = [ROOT / "target/release/halflight", "render", scene, "--environment", environment, "--size", f"{SIZE[0]}x{SIZE[1]}"]
    command += ["--time", f"{seconds}s", "--seed", str(seed), "-o", out, "--overwrite", "-q"]
    subprocess.run(command, check=True)
    data = out.read_bytes()
    return np.frombuffer(data[-12 * SIZE[0] * SIZE[1] :], "<f4").reshape(SIZE[1], SIZE[0], 3)[::-1].astype(float)


# ---------------------------------------------------------------------------------------------------------- Cycles

def cycles(scene, environment, seconds, seed):
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(scene))
    s = bpy.context.scene
    s.camera = next(o for o in s.objects if o.type == "CAMERA")
    s.world = bpy.data.worlds.new("Sky")
    s.world.use_nodes = True
    nodes, links = s.world.node_tree.nodes, s.world.node_tree.links
    picture = nodes.new("ShaderNodeTexEnvironment")
    picture.image = bpy.data.images.load(str(environment))
    links.new(picture.outputs["Color"], nodes["Background"].inputs["Color"])
    s.render.engine = "CYCLES"
    s.render.resolution_x, s.render.resolution_y, s.render.resolution_percentage = *SIZE, 100
    s.render.threads_mode = "AUTO"
    c = s.cycles
    c.samples, c.time_limit, c.seed = 1 << 24, seconds, seed
    c.use_adaptive_sampling = c.use_denoising = False
    c.sample_clamp_direct = c.sample_clamp_indirect = c.blur_glossy = 0
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = c.transparent_max_bounces = 64
    s.render.image_settings.file_format, s.render.image_settings.color_depth = "OPEN_EXR", "32"
    s.view_settings.view_transform = "Raw"
    out = WORK / f"cycles-{seed}.exr"
    s.render.filepath = str(out)
    begin = time.time()
    bpy.ops.render.render(write_still=True)
    print(f"Cycles: {time.time() - begin:.1f} s, asked for {seconds}")
    image = bpy.data.images.load(str(out))
    return np.array(image.pixels[:]).reshape(SIZE[1], SIZE[0], -1)[::-1, :, :3]


# --------------------------------------------------------------------------------------------------------- Mitsuba

def numbers(document, binary, index):
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    kind = {5126: "<f4", 5125: "<u4", 5123: "<u2", 5121: "u1"}[accessor["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    return np.frombuffer(binary, kind, accessor["count"] * width, begin).reshape(-1, width)


def placed(node):
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def mitsuba_scene(scene, environment):
    import mitsuba as mi

    document, binary = read_glb(scene)

    def bitmap(of, channels=slice(0, 3), raw=False):
        view = document["bufferViews"][document["images"][document["textures"][of["index"]]["source"]]["bufferView"]]
        begin = view.get("byteOffset", 0)
        pixels = np.asarray(Image.open(io.BytesIO(binary[begin : begin + view["byteLength"]])).convert("RGBA"))[..., channels]
        data = mi.Bitmap(np.ascontiguousarray(pixels))
        data.set_srgb_gamma(not raw)
        scale = of.get("extensions", {}).get("KHR_texture_transform", {}).get("scale", [1, 1])
        to_uv = mi.ScalarTransform4f().scale([scale[0], scale[1], 1])
        return {"type": "bitmap", "bitmap": data, "raw": raw, "to_uv": to_uv}

    def bsdf(material):
        pbr, more = material.get("pbrMetallicRoughness", {}), material.get("extensions", {})
        colour = {"type": "rgb", "value": pbr.get("baseColorFactor", [1, 1, 1])[:3]}
        rough, metal = pbr.get("roughnessFactor", 1.0), pbr.get("metallicFactor", 1.0)
        if "KHR_materials_transmission" in more:
            return {"type": "dielectric", "int_ior": more.get("KHR_materials_ior", {}).get("ior", 1.5)}
        if metal == 1.0 and rough == 0.0:
            return {"type": "twosided", "nested": {"type": "conductor", "specular_reflectance": colour}}
        if "baseColorTexture" in pbr:
            colour = bitmap(pbr["baseColorTexture"])
        if "metallicRoughnessTexture" in pbr:
            rough, metal = bitmap(pbr["metallicRoughnessTexture"], slice(1, 2), True), 0.0
        coat = more.get("KHR_materials_clearcoat", {}).get("clearcoatFactor", 0.0)
        made = {
            "type": "principled", "base_color": colour, "roughness": rough, "metallic": metal, "clearcoat": coat,
            "clearcoat_gloss": 0.98, "specular": 0.5 * more.get("KHR_materials_specular", {}).get("specularFactor", 1.0),
        }
        made = {"type": "twosided", "nested": made}
        if material.get("alphaMode") == "MASK":
            opacity = bitmap(pbr["baseColorTexture"], slice(3, 4), True)
            made = {"type": "mask", "opacity": opacity, "nested": made}
        return made

    made = [mi.load_dict(bsdf(material)) for material in document["materials"]]
    everything = {"type": "scene", "integrator": {"type": "path", "max_depth": 64, "rr_depth": 8}}
    # Mitsuba's pictures of all directions begin elsewhere: a quarter turn.
    turn = mi.ScalarTransform4f().rotate([0, 1, 0], 90)
    everything["sky"] = {"type": "envmap", "filename": str(environment), "to_world": turn}
    for i, node in enumerate(document["nodes"]):
        world = placed(node)
        if "camera" in node:
            yfov = document["cameras"][node["camera"]]["perspective"]["yfov"]
            film = {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1], "rfilter": {"type": "box"}, "pixel_format": "rgb"}
            look = mi.ScalarTransform4f().look_at(world[:3, 3], world[:3, 3] - world[:3, 2], world[:3, 1])
            everything["camera"] = {"type": "perspective", "fov": math.degrees(yfov), "fov_axis": "y", "to_world": look, "film": film}
        for j, part in enumerate(document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []):
            points = numbers(document, binary, part["attributes"]["POSITION"]) @ world[:3, :3].T + world[:3, 3]
            normals = numbers(document, binary, part["attributes"]["NORMAL"]) @ world[:3, :3].T
            faces = numbers(document, binary, part["indices"]).reshape(-1, 3)
            uv = part["attributes"].get("TEXCOORD_0")
            properties = mi.Properties()
            properties["mesh_bsdf"] = made[part["material"]]
            mesh = mi.Mesh(f"part {i}.{j}", len(points), len(faces), properties, True, uv is not None)
            fields = mi.traverse(mesh)
            fields["vertex_positions"], fields["vertex_normals"] = (np.float32(x).ravel() for x in (points, normals))
            fields["faces"] = np.uint32(faces).ravel()
            if uv is not None:
                # Their v runs upward.
                fields["vertex_texcoords"] = np.float32(numbers(document, binary, uv)).ravel()
            fields.update()
            everything[f"part-{i}-{j}"] = mesh
    return mi.load_dict(everything)


def mitsuba(scene, environment, seconds, seed):
    import mitsuba as mi

    mi.set_variant(VARIANT)
    world = mitsuba_scene(scene, environment)
    begin, passes, total = time.time(), 0, 0
    # It has no limit of time: passes of four samples a pixel, until the next would end too late.
    while passes == 0 or (time.time() - begin) * (passes + 1) / passes < seconds:
        total = total + np.array(mi.render(world, spp=4, seed=seed * 100_000 + passes))
        passes += 1
    print(f"Mitsuba: {time.time() - begin:.1f} s, asked for {seconds}, {4 * passes} samples a pixel")
    return (total / passes).astype(float)


def main():
    renderers = {"halflight": halflight, "cycles": cycles, "mitsuba": mitsuba}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--reference", type=float, default=600, help="seconds that each one's reference takes")
    parser.add_argument("who", nargs="*", default=list(renderers), help="all, or some of: " + ", ".join(renderers))
    asked = parser.parse_args()
    WORK.mkdir(parents=True, exist_ok=True)
    environment, scene = WORK / "sky.hdr", WORK / "scene.glb"
    sky(environment)
    document, binary = read_glb(ROOT / "scenes/still-life.glb")
    for part in document["scenes"] + document["cameras"]:
        part.pop("extras", None)
    write_glb(scene, document, binary)
    for name in asked.who:
        reference = renderers[name](scene, environment, asked.reference, 1)
        picture = renderers[name](scene, environment, asked.seconds, 2)
        np.savez(WORK / f"{name}.npz", reference=reference, picture=picture)
        for kind, pixels in (("reference", reference), ("picture", picture)):
            shown = 255 * np.clip(pixels, 0, 1) ** (1 / 2.2)
            Image.fromarray(shown.astype(np.uint8)).save(WORK / f"{name}-{kind}.png")
        print(f"{name}: relMSE {relmse(picture, reference):.5f} after {asked.seconds:g} s, mean {picture.mean():.4f} of {reference.mean():.4f}")


if __name__ == "__main__":
    main()
