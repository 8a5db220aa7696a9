# SPDX-License-Identifier: MIT OR Apache-2.0
"""The add-on as an extension of Blender: blender_manifest.toml tells what it is, halflight.py is all of it."""

from .halflight import register, unregister

__all__ = ["register", "unregister"]
