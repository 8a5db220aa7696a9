"""How renders go on and end."""

import _thread
import threading
import time

import halflight as hl
import numpy as np
import pytest

BOX = "builtin:caustic-box"


def test_pass_by_pass_is_the_same_as_at_once():
    scene = hl.Scene.load(BOX)
    render = hl.Render(scene, size=(16, 16), photons=2000)
    assert (render.passes, render.error) == (0, None)
    assert [render.advance(), render.advance(3)] == [1, 4]
    assert render.error == pytest.approx(np.hypot(render.noise, render.bias))
    at_once = hl.render(scene, size=(16, 16), photons=2000, passes=4)
    assert np.array_equal(render.picture().visible, at_once.visible)
    assert {row["how"] for row in render.plan} >= {"left out"}


def test_each_limit_ends_a_render():
    scene = hl.Scene.load(BOX)
    heard = []
    hl.render(scene, size=(8, 8), photons=500, passes=3, progress=heard.append)
    assert [record["passes"] for record in heard] == [1, 2, 3]
    assert heard[0]["trusted"] is None and heard[2]["trusted"] in (True, False)
    assert heard[0]["noise"] is None and heard[2]["noise"] > 0 and heard[2]["seconds"] > 0
    render = hl.Render(scene, size=(8, 8), photons=2000)
    render.run(error=0.2)
    assert 8 <= render.passes and render.error <= 0.2
    begin = time.perf_counter()
    render.run(seconds=0.5)
    assert 0.3 < time.perf_counter() - begin < 2


def test_progress_is_told_on_standard_error(capsys):
    hl.render(hl.Scene.load(BOX), size=(8, 8), photons=500, passes=2, progress=True)
    told = capsys.readouterr()
    assert told.out == "" and "2 passes" in told.err and told.err.endswith("\n")


def test_an_exception_of_progress_ends_the_render():
    def stop(record):
        raise LookupError(record["passes"])

    with pytest.raises(LookupError, match="1"):
        hl.render(hl.Scene.load(BOX), size=(8, 8), photons=500, passes=1000, progress=stop)


def test_ctrl_c_ends_a_pass_under_way():
    scene = hl.Scene.load(BOX)
    render = hl.Render(scene, size=(64, 64), photons=40_000_000)
    begin = time.perf_counter()
    threading.Timer(0.3, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        render.advance()
    assert time.perf_counter() - begin < 5
    assert render.passes == 0


def test_a_render_that_was_interrupted_goes_on():
    render = hl.Render(hl.Scene.load(BOX), size=(32, 32), photons=2000)
    threading.Timer(0.3, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        render.advance(1_000_000)
    done = render.passes
    assert 0 < done < 1_000_000 and render.advance(2) == done + 2
    whole = hl.render(hl.Scene.load(BOX), size=(32, 32), photons=2000, passes=done + 2)
    assert np.array_equal(render.picture().visible, whole.visible)


def test_two_renders_in_two_threads_are_those_one_after_the_other():
    scene = hl.Scene.load(BOX)

    def render(seed):
        return hl.render(scene, size=(16, 16), photons=2000, passes=4, seed=seed).visible

    found = {}
    threads = [threading.Thread(target=lambda seed=seed: found.update({seed: render(seed)})) for seed in (1, 2)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    for seed in (1, 2):
        assert np.array_equal(found[seed], render(seed))
    assert not np.array_equal(found[1], found[2])


def test_one_render_in_two_threads_loses_no_pass():
    render = hl.Render(hl.Scene.load(BOX), size=(8, 8), photons=500)
    threads = [threading.Thread(target=lambda: [render.advance(1) for _ in range(5)]) for _ in range(2)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    once = hl.render(hl.Scene.load(BOX), size=(8, 8), photons=500, passes=render.passes)
    assert 5 <= render.passes <= 10 and np.array_equal(render.picture().visible, once.visible)


def test_other_threads_run_while_a_render_does():
    render = hl.Render(hl.Scene.load(BOX), size=(64, 64))
    worker = threading.Thread(target=lambda: render.run(seconds=1))
    worker.start()
    counted = 0
    while worker.is_alive():
        counted += 1
        time.sleep(0.01)
    assert counted > 20


def test_no_image_tells_the_factor():
    scene = hl.Scene(camera=hl.Camera((0, 0, 0), (0, 0, 1)))
    shell = hl.Material("Shell", base_color=0.95, specular=0, double_sided=True, illumination="shadowless")
    scene.add_sphere((0, 0, 0), 2, material=shell, around=16)
    scene.add_luminaire(hl.Luminaire.point((0, 0.5, 0), 1))
    scene.add_sphere((0, 0, 0), 1.5, material=shell, around=16)
    with pytest.raises(hl.NoImage, match="no image exists: multiplication factor") as told:
        hl.render(scene, size=(8, 8))
    factor = hl.multiplication_factor(scene)
    assert told.value.k == pytest.approx(factor["k"], abs=5 * factor["error"])
    assert factor["k"] > 1 and not factor["image_exists"]
    assert hl.render(scene, size=(8, 8), passes=1, photons=500, max_reflections=2).visible.mean() > 0
