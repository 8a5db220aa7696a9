# SPDX-License-Identifier: MIT OR Apache-2.0
"""Renders Blender's scene with halflight: Properties > Render > halflight.

An add-on of one file, for Blender 4.2 and later. It exports the scene as glTF, tells the command `halflight` what glTF cannot hold
(area lights, the World, the radius of lamps, depth of field), and shows the picture while it converges. The .blend file stays as it
is, but for the illumination that its panels set: a custom property of the scene or of a material, which every export takes along.
"""

import atexit
import json
import math
import os
import shlex
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from array import array
from pathlib import Path

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy_extras.object_utils import world_to_camera_view
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

bl_info = {
    "name": "halflight",
    "description": "Renders the scene with halflight, and moves materials between local and global illumination",
    "author": "The halflight authors",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "Properties > Render, Scene, Material",
    "category": "Render",
}

PICTURE = "halflight"  # the image that the Image Editor shows
MODULE = __package__ or __name__


class Refused(Exception):
    """What is wrong and what to do, in one line."""


# ------------------------------------------------------------------------------------------------------- illumination

CORNERS = {"one-bounce": (0, 0), "local": (0, 1), "global": (1, 0), "shadowless": (1, 1)}
STEPS = (0, 0.25, 0.5, 0.75, 1)


def point_of(owner):
    """The point (s, t) of a scene or a material. None: it has no illumination of its own, or one that is no point of the square."""
    value = owner.get("illumination") if owner else None
    if isinstance(value, str):
        return CORNERS.get(value)
    try:
        s, t = map(float, value)
    except (TypeError, ValueError):
        return None
    return s, t


def illuminate(owner, point):
    """Sets the point, as halflight reads it from the exported file."""
    owner["illumination"] = [float(x) for x in point]


def named(point):
    """The corner that a point is, or its coordinates."""
    names = [name for name, corner in CORNERS.items() if corner == tuple(point)]
    return names[0] if names else f"s {point[0]:.2f}, t {point[1]:.2f}"


class HALFLIGHT_OT_illuminate(bpy.types.Operator):
    """Set the illumination to this point: to the right more inter-reflection, upward less shadow"""

    bl_idname = "halflight.illuminate"
    bl_label = "Illuminate"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    s: FloatProperty(name="Inter-reflection", min=0, max=1, default=1)
    t: FloatProperty(name="Shadowlessness", min=0, max=1)
    of: EnumProperty(items=[("SCENE", "Scene", ""), ("MATERIAL", "Material", "")])
    own: BoolProperty(name="Own", default=True, description="Off: no illumination of its own")

    @classmethod
    def description(cls, context, properties):
        if not properties.own:
            return "No illumination of its own"
        return f"{named((properties.s, properties.t))}: to the right more inter-reflection, upward less shadow"

    def execute(self, context):
        owner = context.scene if self.of == "SCENE" else context.material
        if owner is None:
            self.report({"ERROR"}, "there is no material here")
            return {"CANCELLED"}
        if self.own:
            illuminate(owner, (self.s, self.t))
        elif "illumination" in owner:
            del owner["illumination"]
        redraw(context)
        return {"FINISHED"}


def draw_square(layout, owner, of, without):
    """The square to click in, two sliders, and what there is without either."""
    point = point_of(owner)
    column = layout.column(align=True)
    for t in reversed(STEPS):
        row = column.row(align=True)
        for s in STEPS:
            corner = [name for name, at in CORNERS.items() if at == (s, t)]
            near = point is not None and max(abs(point[0] - s), abs(point[1] - t)) < 0.125
            text = corner[0] if corner else ("•" if near else " ")
            button = row.operator(HALFLIGHT_OT_illuminate.bl_idname, text=text, depress=near)
            button.s, button.t, button.of, button.own = s, t, of, True
    if point is None:
        value = owner.get("illumination")
        layout.label(text=without if value is None else f"Custom property: {value}")
        return
    column = layout.column(align=True)
    column.prop(owner, "halflight_point", index=0, text="Inter-reflection s", slider=True)
    column.prop(owner, "halflight_point", index=1, text="Shadowlessness t", slider=True)
    button = layout.operator(HALFLIGHT_OT_illuminate.bl_idname, text=without, icon="X")
    button.of, button.own = of, False


def point_property():
    """The sliders. Nothing is stored beside the custom property."""
    return FloatVectorProperty(
        name="Illumination",
        description="A point of the square between local and global illumination",
        size=2,
        min=0,
        max=1,
        get=lambda owner: point_of(owner) or CORNERS["global"],
        set=illuminate,
    )


# ------------------------------------------------------------------------------------------------------ what is exported

WANTED = {
    "export_format": "GLTF_SEPARATE",
    "use_active_scene": True,
    "use_renderable": True,
    "export_extras": True,
    "export_cameras": True,
    "export_lights": True,
    "export_apply": True,
    "export_import_convert_lighting_mode": "SPEC",
}
# Poses, shape keys and modifiers are in the meshes as this frame has them.
UNWANTED = {"export_animations": False, "export_skins": False, "export_morph": False}


def export(scene, folder):
    """Writes the scene of the window into a folder. Returns the file and what is left out, in lines."""
    path = Path(folder) / "scene.gltf"
    try:
        bpy.ops.export_scene.gltf(filepath=str(path), **WANTED, **UNWANTED)
        document = json.loads(path.read_text(encoding="utf-8"))
    except AttributeError:
        raise Refused("enable Blender's own add-on `glTF 2.0 format`, which exports the scene") from None
    except (OSError, RuntimeError, ValueError) as error:
        raise Refused(f"the glTF exporter: {one_line(error)}") from None
    notes = complete(document, scene, Path(folder))
    path.write_text(json.dumps(document), encoding="utf-8")
    return path, notes


def complete(document, scene, folder):
    """Adds to an exported document in a folder what glTF has no place for. Returns what has no counterpart, in lines."""
    notes = []
    nodes = document.get("nodes", [])
    lights = document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    for node in list(nodes):
        item = bpy.data.objects.get(node.get("name", ""))
        if item is None:
            continue
        if item.type == "CAMERA" and "camera" in node:
            thin_lens(item, document["cameras"][node["camera"]])
            if item == scene.camera and (item.data.shift_x or item.data.shift_y):
                notes.append(f"camera {item.name}: its shift is left out")
        elif item.type == "LIGHT" and item.data.type == "AREA":
            area_light(nodes, node, item, notes)
        elif item.type == "LIGHT" and "extensions" in node:
            which = node["extensions"].get("KHR_lights_punctual", {}).get("light")
            if which is not None:
                extent_of_light(node, lights[which], item, notes)
                measured(node, item, folder / f"node-{nodes.index(node)}.ies")
                measured(lights[which], item.data, folder / f"light-{which}.ies")
    return notes


def extras(thing):
    """The extras of a part of the document."""
    return thing.setdefault("extras", {})


def thin_lens(item, exported):
    """The depth of field of a camera, unless its own custom properties tell."""
    camera, told = item.data, exported.get("extras", {}).keys()
    if not camera.dof.use_dof or camera.type != "PERSP" or {"focus", "fstop", "aperture"} & told:
        return
    focus = camera.dof.focus_distance
    if camera.dof.focus_object:
        away = camera.dof.focus_object.matrix_world.translation - item.matrix_world.translation
        focus = abs((item.matrix_world.to_quaternion().inverted() @ away).z)
    aperture = 0.001 * camera.lens / (2 * camera.dof.aperture_fstop)
    extras(exported).update(focus=focus, aperture=aperture)


EXTENTS = {"area", "disk", "sphere"}


def area_light(nodes, node, item, notes):
    """An empty node becomes a pane, unless its custom properties tell that already."""
    light = item.data
    if EXTENTS & node.get("extras", {}).keys():
        return
    place = node
    if light.shape in {"SQUARE", "RECTANGLE"}:
        height = light.size if light.shape == "SQUARE" else light.size_y
        extent = {"area": [light.size, height]}
        area = light.size * height
    else:
        height = light.size if light.shape == "DISK" else light.size_y
        extent = {"disk": light.size / 2}
        area = math.pi / 4 * light.size * height
    if light.shape == "ELLIPSE":
        place = {"name": f"{item.name} ellipse", "scale": [1, height / light.size, 1]}
        node.setdefault("children", []).append(len(nodes))
        nodes.append(place)
    pane = extras(place)
    pane.update(extent)
    if "radiance" not in pane:
        pane.setdefault("power", power(item, area))
    if seen_or_not(pane, item) and in_front(item):
        notes.append(f"area light {item.name}: it is hidden from the camera, and black where it stands in the picture")
    if light.spread < math.pi - 1e-3:
        notes.append(f"area light {item.name}: its spread is left out")


def power(item, area):
    """Watts of an area light in each colour."""
    light = item.data
    watts = light.energy * 2 ** getattr(light, "exposure", 0)
    if not getattr(light, "normalize", True):
        scale = item.matrix_world.to_scale()
        watts *= area * abs(scale.x * scale.y)
    colour = list(light.color)
    if getattr(light, "use_temperature", False):
        colour = [x * y for x, y in zip(colour, light.temperature_color)]
    return [watts * x for x in colour]


def extent_of_light(node, exported, item, notes):
    """The disk of a sun and the sphere of a point light, unless custom properties tell."""
    light, told = item.data, exported.get("extras", {}).keys()
    if light.type == "SUN":
        degrees = math.degrees(light.angle)
        extras(exported).setdefault("angle", degrees if degrees >= 0.002 else 0)
        seen_or_not(extras(exported), item)
    elif light.type == "POINT" and light.shadow_soft_size > 0 and "warn" not in told:
        if (EXTENTS | {"ies"}) & (told | node.get("extras", {}).keys()):
            return
        if not item.visible_camera and in_picture(item):
            notes.append(f"point light {item.name}: its shadows are sharp, as it would stand in the picture as a black ball")
            return
        extras(exported)["sphere"] = light.shadow_soft_size
        seen_or_not(extras(exported), item)


def measured(exported, thing, place):
    """Puts a copy of the IES file that a custom property names beside the exported scene, which takes files from there alone."""
    name = exported.get("extras", {}).get("ies")
    if not isinstance(name, str) or not name or name.startswith("data:") or place.exists():
        return
    own = Path(bpy.path.abspath(name if name.startswith("//") or Path(name).is_absolute() else f"//{name}", library=thing.library))
    try:
        shutil.copyfile(own, place)
    except OSError as error:
        raise Refused(f"{thing.name}: its custom property ies names {own}: {error.strerror}; put it beside the .blend file") from None
    extras(exported)["ies"] = place.name


def seen_or_not(own, item):
    """Blender's lamps are hidden from the camera unless their ray visibility says otherwise. True: this one is."""
    if not item.visible_camera:
        own.setdefault("emission", "invisible")
    return not item.visible_camera


def in_picture(item):
    """Whether the middle of a lamp lies before the camera, in the picture or not far beside it."""
    scene = bpy.context.scene
    if scene.camera is None:
        return True
    x, y, away = world_to_camera_view(scene, scene.camera, item.matrix_world.translation)
    return away > 0 and -0.2 < x < 1.2 and -0.2 < y < 1.2


def in_front(item):
    """Whether the camera is on the side to which an area light shines, and sees it."""
    eye = bpy.context.scene.camera
    if eye is None or not in_picture(item):
        return False
    return (item.matrix_world.inverted_safe() @ eye.matrix_world.translation).z < 0


# ---------------------------------------------------------------------------------------------------------- the World

READ = {".hdr", ".exr", ".png", ".jpg", ".jpeg", ".webp"}
ENDINGS = {"HDR": ".hdr", "PNG": ".png", "JPEG": ".jpg", "WEBP": ".webp"}


def surroundings(scene, folder):
    """The options of the command for the World, and what of it is left out, in lines."""
    if "environment" in scene:
        return [], []
    notes = []
    options = world_options(scene.world, Path(folder), notes) if scene.world else []
    if options and scene.render.film_transparent:
        options += ["--background", "hidden"]
    return options, notes


def world_options(world, folder, notes):
    if not world.node_tree or (bpy.app.version < (5, 0) and not world.use_nodes):
        return colour_options(world.color, 1)
    outputs = [node for node in world.node_tree.nodes if node.type == "OUTPUT_WORLD" and node.is_active_output]
    background = source(outputs[0].inputs["Surface"]) if outputs else None
    if background is None:
        return []
    if background.type != "BACKGROUND":
        notes.append(f"World: {background.name} is left out; a Background node is what is taken")
        return []
    strength, picture = background.inputs["Strength"], source(background.inputs["Color"])
    if source(strength):
        notes.append(f"World: what is linked to the strength is left out, and {strength.default_value:g} taken")
    if strength.default_value <= 0:
        return []
    if picture is None:
        return colour_options(background.inputs["Color"].default_value, strength.default_value)
    if picture.type != "TEX_ENVIRONMENT" or picture.image is None:
        notes.append(f"World: {picture.name} is left out; a colour or an Environment Texture is what is taken")
        return []
    if picture.projection != "EQUIRECTANGULAR":
        notes.append(f"World: {picture.name} is left out; its projection must be equirectangular")
        return []
    turned = rotation(picture.inputs["Vector"], notes)
    options = ["--environment", str(file_of(picture.image, folder))]
    return options + ["--environment-strength", repr(strength.default_value), "--environment-rotation", repr(turned)]


def colour_options(colour, strength):
    colour = [strength * x for x in list(colour)[:3]]
    return ["--environment", ",".join(map(repr, colour))] if any(colour) else []


def source(socket):
    """The node that a socket is linked to. None: it is not."""
    while socket.is_linked:
        node = socket.links[0].from_node
        if node.type != "REROUTE":
            return node
        socket = node.inputs[0]
    return None


def rotation(vector, notes):
    """Degrees by which a picture is turned, counter-clockwise as seen from above."""
    mapping = source(vector)
    if mapping is None or mapping.type == "TEX_COORD":
        return 0.0
    if mapping.type != "MAPPING":
        notes.append(f"World: {mapping.name} is left out, and the picture not turned")
        return 0.0
    turned = mapping.inputs["Rotation"].default_value
    moved = [abs(x) for x in mapping.inputs["Location"].default_value] if "Location" in mapping.inputs else [0]
    scaled = [abs(x - 1) for x in mapping.inputs["Scale"].default_value]
    if max(abs(turned[0]), abs(turned[1]), *moved, *scaled) > 1e-6:
        notes.append("World: of its Mapping node the rotation about z is taken, and nothing else")
    # A point that is turned looks up what lies turned back.
    return math.degrees(turned[2]) * (1.0 if mapping.vector_type == "TEXTURE" else -1.0)


def file_of(image, folder):
    """A file that holds the image: its own, else one that is written into the folder."""
    own = Path(bpy.path.abspath(image.filepath_from_user(), library=image.library)) if image.filepath else None
    if own and own.is_file() and own.suffix.lower() in READ and not image.packed_file and not image.is_dirty:
        return own
    # What Blender 5 packs as EXR has no table of its lines, and what it saves as EXR may be encoded as sRGB.
    if image.packed_file and not image.is_dirty and image.file_format in ENDINGS:
        return written(folder / f"environment{ENDINGS[image.file_format]}", image.packed_file.data)
    texels = array("f", bytes(4 * len(image.pixels)))
    image.pixels.foreach_get(texels)
    if image.is_float:
        return written(folder / "environment.hdr", radiance(image, texels))
    copy = bpy.data.images.new("environment", *image.size)
    try:
        copy.colorspace_settings.name = image.colorspace_settings.name
        copy.pixels.foreach_set(texels)
        copy.pack()
        return written(folder / "environment.png", copy.packed_file.data)
    except RuntimeError as error:
        raise Refused(f"the World's picture {image.name}: {one_line(error)}") from None
    finally:
        bpy.data.images.remove(copy)


def written(path, data):
    path.write_bytes(data)
    return path


def radiance(image, texels):
    """The bytes of a Radiance picture: https://radsite.lbl.gov/radiance/refer/filefmts.pdf, without run lengths."""
    width, height = image.size
    rgb = np.frombuffer(texels, np.float32).reshape(height, width, -1)[::-1, :, :3]
    if rgb.size == 0 or not np.isfinite(rgb).all() or rgb.min() < 0:
        raise Refused(f"the World's picture {image.name} has no texels, or some that are not finite or below zero; mend it")
    _, exponent = np.frexp(rgb.max(-1, keepdims=True))
    mantissas = np.minimum(np.round(np.ldexp(rgb, 8 - exponent)), 255)
    shining = rgb.max(-1, keepdims=True) > 0
    rgbe = np.where(shining, np.concatenate([mantissas, exponent + 128], -1), 0).astype(np.uint8)
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {height} +X {width}\n".encode() + rgbe.tobytes()


# -------------------------------------------------------------------------------------------------------- the command

def binary():
    """The command."""
    addon = bpy.context.preferences.addons.get(MODULE)
    asked = addon.preferences.binary if addon and addon.preferences else "halflight"
    found = shutil.which(bpy.path.abspath(asked) if asked.startswith("//") else os.path.expanduser(asked))
    if found is None:
        raise Refused(f"the command {asked} is not found; say in the add-on's preferences where halflight is")
    return found


def command(scene, file, picture, folder):
    """The words of the command for a file that was exported, and notes."""
    settings, render = scene.halflight, scene.render
    size = [max(1, side * render.resolution_percentage // 100) for side in (render.resolution_x, render.resolution_y)]
    words = [binary(), "render", str(file), "-o", str(picture), "--progress", "json"]
    words += ["--size", f"{size[0]}x{size[1]}", "--method", settings.method, "--seed", str(settings.seed)]
    words += ["--layers", "visible" if settings.layers == "PICTURE" else "all", "--exposure", f"{exposure(scene):g}"]
    if scene.camera:
        words += ["--camera", scene.camera.name]
    for option, value, unit in (("passes", settings.passes, ""), ("time", settings.seconds, "s")):
        words += [f"--{option}", f"{value}{unit}"] if value else []
    words += ["--error", f"{settings.error / 100:g}"] if settings.error else []
    options, notes = surroundings(scene, folder) if settings.use_world else ([], [])
    try:
        return words + options + shlex.split(settings.more), notes
    except ValueError as error:
        raise Refused(f"More Options: {error}") from None


def exposure(scene):
    return scene.view_settings.exposure


def one_line(error):
    return " ".join(str(error).split())


class Job:
    """A command under way. Its words are read by a thread of their own, so that asking never waits."""

    def __init__(self, words, picture):
        self.picture, self.shown = picture, None
        self.progress, self.lines = {}, []
        self.begin = time.monotonic()
        self.process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        self.listener = threading.Thread(target=self._listen, daemon=True)
        self.listener.start()

    def _listen(self):
        for line in self.process.stdout:
            try:
                told = json.loads(line)
            except ValueError:
                told = None
            if isinstance(told, dict):
                self.progress = told
            elif line.strip():
                self.lines.append(line.strip())

    def code(self):
        """The exit code. None: it is under way."""
        code = self.process.poll()
        if code is not None:
            self.listener.join(timeout=5)
        return code

    def stop(self):
        """Asks it to write the picture so far and to end."""
        if self.process.poll() is None:
            self.process.terminate() if os.name == "nt" else self.process.send_signal(signal.SIGINT)

    def kill(self):
        """Ends it at once."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def wait(self):
        self.process.wait()
        return self.code()

    def is_renewed(self):
        """True where the picture is another one than when it was last asked for."""
        try:
            there = os.stat(self.picture)
        except OSError:
            return False
        before, self.shown = self.shown, (there.st_mtime_ns, there.st_ino, there.st_size)
        return before != self.shown

    def error(self):
        """The one line of a command that failed."""
        begins = ("halflight: ", "error: ")
        own = [line.split(": ", 1)[1] for line in self.lines if line.startswith(begins)]
        return (own or self.lines or [f"halflight ended with exit code {self.process.returncode}"])[-1]


# What the command says of every file that was exported in units of the standard, as here.
AS_EXPORTED = "Blender exported watts times 683"


class Running:
    """What the panels show."""

    job = None
    stopped = False
    error = ""
    notes = []

    @classmethod
    def text(cls):
        now = cls.job.progress if cls.job else {}
        words = [f"{now['pass']} passes"] if now.get("pass") else ["begins"]
        words += [f"error {100 * now['error']:.2f} %"] if now.get("error") else []
        words += [f"{now['eta']:.0f} s left"] if now.get("eta") else []
        return ", ".join(words)

    @classmethod
    def share(cls):
        """The part that is done, as far as it is known."""
        now = cls.job.progress if cls.job else {}
        spent, left = now.get("seconds") or 0, now.get("eta")
        return spent / (spent + left) if left is not None and spent + left > 0 else 0.0


def begin(scene):
    """Exports the scene and starts the command."""
    if Running.job:
        raise Refused("a render is under way; stop it first")
    Running.error, Running.notes, Running.stopped = "", [], False
    binary()  # before the export, which takes its time
    folder = tempfile.mkdtemp(prefix="halflight-", dir=bpy.app.tempdir or None)
    file, left_out = export(scene, folder)
    output = scene.halflight.output
    picture = Path(bpy.path.abspath(output)) if output else Path(folder) / "picture.exr"
    words, notes = command(scene, file, picture, folder)
    Running.notes = left_out + notes
    try:
        Running.job = Job(words, picture)
    except OSError as error:
        raise Refused(f"{words[0]}: {one_line(error)}; say in the add-on's preferences where halflight is") from None


def end():
    """After the command ended. Returns its one line where it failed."""
    job, Running.job = Running.job, None
    code = job.code()
    told = [line.removeprefix("note: ") for line in job.lines if line.startswith(("note: ", "warning: "))]
    Running.notes += [line for line in told if not line.startswith(AS_EXPORTED)]
    if code and not (Running.stopped and job.shown):
        Running.error = "stopped before the first pass was complete" if Running.stopped else job.error()
    return Running.error


def forget():
    """No command outlives Blender, or the file that it renders."""
    job, Running.job = Running.job, None
    if job:
        job.kill()


@persistent
def on_load(*_):
    forget()
    Running.error, Running.notes = "", []


# -------------------------------------------------------------------------------------------------------- the picture

def show(path):
    """The picture as an image of Blender, anew where it is there."""
    image = bpy.data.images.get(PICTURE)
    if image is None:
        image = bpy.data.images.load(str(path))
        image.name = PICTURE
    image.source = "FILE"
    if image.filepath != str(path):
        image.filepath = str(path)
    image.reload()
    return image


def open_editor(context):
    """An Image Editor: one that is open, else a window of its own. None where there are no windows."""
    areas = [area for window in context.window_manager.windows for area in window.screen.areas]
    editors = [area for area in areas if area.type == "IMAGE_EDITOR" and area.ui_type == "IMAGE_EDITOR"]
    free = [area for area in editors if not area.spaces.active.image or area.spaces.active.image.name == PICTURE]
    if free or editors:
        return (free or editors)[0]
    if bpy.app.background:
        return None
    bpy.ops.wm.window_new()
    area = context.window_manager.windows[-1].screen.areas[0]
    area.ui_type = "IMAGE_EDITOR"
    return area


def redraw(context):
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"PROPERTIES", "IMAGE_EDITOR"}:
                area.tag_redraw()


class HALFLIGHT_OT_render(bpy.types.Operator):
    """Render the scene with halflight. Blender stays usable; Esc stops, and keeps the picture so far"""

    bl_idname = "halflight.render"
    bl_label = "Render with halflight"

    _timer = None
    _editor_wanted = False

    @classmethod
    def poll(cls, context):
        return Running.job is None

    def execute(self, context):
        """Waits until it ends: for scripts."""
        if not self._begin(context):
            return {"CANCELLED"}
        Running.job.wait()
        return self._finish(context)

    def invoke(self, context, event):
        if not self._begin(context):
            return {"CANCELLED"}
        self._editor_wanted = True
        self._timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if Running.job is None:  # another file was opened
            return self._leave(context, {"CANCELLED"})
        if event.type == "ESC" and event.value == "PRESS":
            bpy.ops.halflight.stop()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if Running.job.code() is not None:
            return self._leave(context, self._finish(context))
        self._renew(context)
        redraw(context)
        return {"PASS_THROUGH"}

    def cancel(self, context):
        forget()

    def _begin(self, context):
        try:
            begin(context.scene)
        except Refused as refused:
            Running.error = str(refused)
            self.report({"ERROR"}, Running.error)
            return False
        return True

    def _renew(self, context):
        if not Running.job.is_renewed():
            return
        image = show(Running.job.picture)
        editor = open_editor(context) if self._editor_wanted else None
        if editor:
            editor.spaces.active.image = image
        self._editor_wanted = False

    def _finish(self, context):
        self._renew(context)
        for note in Running.notes:
            self.report({"INFO"}, note)
        error = end()
        redraw(context)
        if error:
            self.report({"ERROR"}, error)
            return {"CANCELLED"}
        return {"FINISHED"}

    def _leave(self, context, result):
        context.window_manager.event_timer_remove(self._timer)
        return result


class HALFLIGHT_OT_stop(bpy.types.Operator):
    """Stop the render; the picture so far stays"""

    bl_idname = "halflight.stop"
    bl_label = "Stop"

    @classmethod
    def poll(cls, context):
        return Running.job is not None

    def execute(self, context):
        Running.stopped = True
        Running.job.stop()
        return {"FINISHED"}


# --------------------------------------------------------------------------------------------------------- the panels

class HalflightSettings(bpy.types.PropertyGroup):
    """How a scene is rendered."""

    passes: IntProperty(name="Passes", min=0, default=64, description="End after so many passes; 0: no such limit")
    seconds: FloatProperty(name="Seconds", min=0, description="End after so much time; 0: no such limit")
    error: FloatProperty(
        name="Error %", min=0, max=100, description="End when the relative error is below this; 0: no such limit"
    )
    method: EnumProperty(
        name="Method",
        items=[
            ("photon", "Photons", "Photon maps and a final gather"),
            ("path", "Paths", "Path tracing with connections to lamps"),
            ("path-plain", "Plain paths", "Path tracing as in the paper"),
        ],
    )
    layers: EnumProperty(
        name="Layers",
        items=[
            ("PICTURE", "Picture", "The picture alone"),
            ("ALL", "All", "Error, depth, normals, albedo, classes of light and all others too"),
        ],
    )
    seed: IntProperty(name="Seed", min=0, description="Everything random follows from it")
    use_world: BoolProperty(name="World", default=True, description="The World's picture or colour lights the scene")
    output: StringProperty(
        name="Output", subtype="FILE_PATH", description="The EXR file to write; empty: a temporary one"
    )
    more: StringProperty(name="More Options", description="Options of `halflight render`, as on the command line")


class HalflightPreferences(bpy.types.AddonPreferences):
    bl_idname = MODULE

    binary: StringProperty(
        name="Command", default="halflight", subtype="FILE_PATH", description="The program halflight, or its name"
    )

    def draw(self, context):
        self.layout.prop(self, "binary")
        try:
            self.layout.label(text=f"Found: {binary()}", icon="CHECKMARK")
        except Refused as refused:
            self.layout.label(text=str(refused), icon="ERROR")


class HALFLIGHT_PT_render(bpy.types.Panel):
    bl_label = "halflight"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, settings = self.layout, context.scene.halflight
        if Running.job:
            layout.progress(factor=Running.share(), text=Running.text())
            layout.operator(HALFLIGHT_OT_stop.bl_idname, icon="CANCEL")
        else:
            layout.operator(HALFLIGHT_OT_render.bl_idname, text="Render", icon="RENDER_STILL")
        if Running.error:
            layout.label(text=Running.error, icon="ERROR")
        for note in Running.notes:
            layout.label(text=note, icon="INFO")
        layout.use_property_split = True
        limits = layout.column(align=True)
        for name in ("passes", "seconds", "error"):
            limits.prop(settings, name)
        for name in ("method", "layers", "seed", "use_world", "output", "more"):
            layout.prop(settings, name)


class HALFLIGHT_PT_scene(bpy.types.Panel):
    bl_label = "Illumination (halflight)"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "scene"

    def draw(self, context):
        draw_square(self.layout, context.scene, "SCENE", "Global, as without this")


class HALFLIGHT_PT_material(bpy.types.Panel):
    bl_label = "Illumination (halflight)"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context):
        return context.material is not None

    def draw(self, context):
        draw_square(self.layout, context.material, "MATERIAL", "As the scene")


CLASSES = (
    HalflightSettings,
    HalflightPreferences,
    HALFLIGHT_OT_illuminate,
    HALFLIGHT_OT_render,
    HALFLIGHT_OT_stop,
    HALFLIGHT_PT_render,
    HALFLIGHT_PT_scene,
    HALFLIGHT_PT_material,
)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.halflight = PointerProperty(type=HalflightSettings)
    bpy.types.Scene.halflight_point = point_property()
    bpy.types.Material.halflight_point = point_property()
    bpy.app.handlers.load_pre.append(on_load)
    atexit.register(forget)


def unregister():
    forget()
    atexit.unregister(forget)
    bpy.app.handlers.load_pre.remove(on_load)
    for owner, name in ((bpy.types.Material, "halflight_point"), (bpy.types.Scene, "halflight_point")):
        delattr(owner, name)
    del bpy.types.Scene.halflight
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
