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
    table = pd.DataFrame(hl.check(case="far"))
    assert set(table.case) == {"far-away", "sky-far-away"} and table.passes.all()
    assert table[table.z.notna()].expected.notna().all()
    with pytest.raises(hl.UsageError, match="none of that name"):
        hl.check(case="no such case")


def test_a_comparison_is_a_table():
    scene = hl.Scene.load("builtin:cornell-spheres")
    variants = [{"name": "wide", "indirect_radius": 24, "photons": 5000}, {"name": "path", "method": "path", "samples": 1}]
    settings = {"size": (24, 24), "budgets": [0.2, 0.1], "seeds": 2}
    table = pd.DataFrame(hl.compare(scene, variants, reference_seconds=2, **settings))
    assert list(table.method.unique()) == ["wide", "path"] and list(table.budget.unique()) == [0.1, 0.2]
    assert len(table) == 2 * 2 * 2 and (table.seconds >= table.budget).all() and (table.relmse_measured > 0).all()
    wide = table[table.method == "wide"]
    assert (wide.photon_paths == 5000 * wide.passes).all()
    denoised = {**variants[0], "name": "denoised", "denoise": True}
    both = pd.DataFrame(hl.compare(scene, [variants[0], denoised], reference_seconds=2, size=(24, 24), budgets=[0.4], seeds=1))
    assert list(both.method) == ["wide", "denoised"] and (both.passes >= 3).all()
    assert both.relmse_measured[0] != both.relmse_measured[1]
    reference = hl.render(scene, size=(24, 24), method="path", passes=50, seed=99)
    given = pd.DataFrame(hl.compare(scene, variants[:1], reference=reference, **settings))
    assert len(given) == 4 and (given.flip > 0).all()


@pytest.mark.parametrize(
    "variants, more, words",
    [
        ([{"photons": 5}], {}, "give each variant a name"),
        ([{"name": "a"}, {"name": "a"}], {}, "is called a like one before it"),
        ([{"name": "a", "methd": "path"}], {}, "no argument `methd`"),
        ([{"name": "a", "size": (4, 4)}], {}, "no argument `size`"),
        ([{"name": "a"}], {"budgets": []}, "at least one number"),
        ([{"name": "a"}], {"reference_method": "pth"}, "no 'pth'"),
        ([{"name": "a", "denoise": True, "method": "path-plain"}], {}, 'use method="photon"'),
    ],
)
def test_comparisons_that_are_wrong_are_told_in_a_line(variants, more, words):
    with pytest.raises((hl.UsageError, TypeError)) as told:
        hl.compare(hl.Scene.load("builtin:concentric"), variants, **more)
    assert words in str(told.value) and "\n" not in str(told.value)


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
