"""Records, as pandas takes them, and what stubs say."""

import ast
import importlib.resources
import inspect

import halflight as hl
import pandas as pd
import pytest


def test_a_plan_is_a_table():
    scene = hl.Scene.load("builtin:cornell-spheres")
    table = pd.DataFrame(hl.plan(scene, size=(16, 16), illumination="local"))
    assert list(table.columns) == ["what", "how", "because", "pass_share", "planning_seconds", "bytes"]
    assert "photons" in set(table[table.how == "left out"].what)
    assert table.pass_share.isna().all()
    measured = pd.DataFrame(hl.plan(scene, size=(16, 16), illumination="local", savings=True))
    assert measured[measured.how == "left out"].pass_share.notna().all()


def test_multiplication_factors_over_a_sweep_are_a_table():
    scene = hl.Scene.load("builtin:cornell-spheres")
    points = [0.25, 0.5, 1]
    table = pd.DataFrame(hl.multiplication_factor(scene, illumination=(s, 0)) for s in points)
    assert list(table.columns) == ["k", "error", "image_exists"] and table.image_exists.all()
    # Reflected light is s times as much, and so is k, path by path.
    assert table.k[1] / table.k[0] == pytest.approx(2, rel=1e-3) == table.k[2] / table.k[1]


def test_checks_are_a_table():
    scene = hl.Scene.load("builtin:concentric")
    table = pd.DataFrame(hl.check(scene))
    assert table.passes.all() and {"existence", "pixels", "energy"} <= set(table.case)
    name = table.case[0]
    assert table[table.case == name].what.notna().all()
    with pytest.raises(hl.UsageError, match="none of that name"):
        hl.check(case="no such case")


def names_of(node):
    """The arguments of a function, `self` left out."""
    arguments = node.args
    names = [argument.arg for argument in arguments.posonlyargs + arguments.args + arguments.kwonlyargs]
    return [name for name in names if name != "self"]


def parameters(thing):
    return [name for name in inspect.signature(thing).parameters if name not in ("self", "more")]


def test_stubs_say_what_there_is():
    text = (importlib.resources.files("halflight") / "_core.pyi").read_text()
    assert (importlib.resources.files("halflight") / "py.typed").is_file()
    body = ast.parse(text).body
    functions = {node.name: node for node in body if isinstance(node, ast.FunctionDef)}
    classes = {node.name: node for node in body if isinstance(node, ast.ClassDef)}
    for name in set(hl.__all__) - {"__version__"}:
        thing = getattr(hl, name)
        if inspect.isclass(thing) and issubclass(thing, Exception):
            continue
        assert thing.__doc__, name
        if not inspect.isclass(thing):
            assert names_of(functions[name]) == parameters(thing), name
            continue
        members = {node.name: node for node in classes[name].body if isinstance(node, ast.FunctionDef)}
        there = {member for member in vars(thing) if not member.startswith("__")}
        assert there == {member for member in members if not member.startswith("__")}, name
        for member in there:
            value = getattr(thing, member)
            if callable(value):
                assert names_of(members[member]) == parameters(value), f"{name}.{member}"
        if "__init__" in members and name != "Atlas":
            assert names_of(members["__init__"]) == parameters(thing), name
