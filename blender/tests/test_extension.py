"""The add-on as an extension, as Blender 4.2 and later install them."""

import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import addon_utils
import bpy
import conftest as c
import pytest

import halflight

MANIFEST = tomllib.loads((c.ROOT / "blender" / "blender_manifest.toml").read_text())


def tool(*arguments):
    """What `blender --command extension` runs."""
    script = next(Path(path) / "bl_pkg" / "cli" / "blender_ext.py" for path in addon_utils.paths()
                  if (Path(path) / "bl_pkg").is_dir())
    return subprocess.run([sys.executable, str(script), *arguments], capture_output=True, text=True)


@pytest.fixture
def package(tmp_path):
    """The extension, built."""
    built = tool("build", "--source-dir", str(c.ROOT / "blender"), "--output-dir", str(tmp_path))
    assert built.returncode == 0, built.stdout + built.stderr
    return tmp_path / f"halflight-{MANIFEST['version']}.zip"


def test_the_manifest_says_what_the_add_on_and_the_crate_say():
    crate = tomllib.loads((c.ROOT / "Cargo.toml").read_text())
    version = crate["package"].get("version", crate.get("workspace", {}).get("package", {}).get("version"))
    dotted = {key: ".".join(map(str, halflight.bl_info[key])) for key in ("version", "blender")}
    assert MANIFEST["version"] == version == dotted["version"]
    assert MANIFEST["blender_version_min"] == dotted["blender"]
    assert MANIFEST["name"] == MANIFEST["id"] == halflight.bl_info["name"]
    assert " OR ".join(name.removeprefix("SPDX:") for name in MANIFEST["license"]) == crate["package"]["license"]


def test_what_is_built_holds_the_add_on_and_nothing_else(package):
    names = zipfile.ZipFile(package).namelist()
    assert sorted(names) == ["__init__.py", "blender_manifest.toml", "halflight.py"]
    checked = tool("validate", str(package))
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_what_is_built_is_installed_with_settings_of_its_own_and_goes_again(package):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    installed = bpy.ops.extensions.package_install_files(filepath=str(package), repo="user_default", enable_on_install=True)
    assert installed == {"FINISHED"}
    name = "bl_ext.user_default.halflight"
    try:
        assert bpy.context.preferences.addons[name].preferences.binary is not None
        assert hasattr(bpy.types.Scene, "halflight") and bpy.types.HALFLIGHT_PT_render.is_registered
    finally:
        addon_utils.disable(name, default_set=True)
    assert not hasattr(bpy.types.Scene, "halflight")
