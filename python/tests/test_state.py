"""What a render stores, goes on from and merges is the same as a single render, bit for bit, here and on the command line."""

import halflight as hl
import numpy as np
import pytest

BOX = "builtin:caustic-box"
HOW = dict(size=(20, 14), photons=3000, layers=["all"])
AS_TYPED = ["--size", "20x14", "--photons", 3000, "--layers", "all"]


def begun(**more):
    return hl.Render(hl.Scene.load(BOX), **{**HOW, **more})


def after(passes, **more):
    render = begun(**more)
    render.advance(passes)
    return render


def same(one, other):
    """All layers, bit for bit, and the number of passes and of photons."""
    assert one.layers == other.layers
    for name in one.layers:
        assert one[name].tobytes() == other[name].tobytes(), name
    assert one.visible.mean() > 0
    for fact in ("passes", "photons", "scene_hash", "paths_per_pass"):
        assert one.facts[fact] == other.facts[fact], fact


@pytest.fixture(scope="module")
def whole():
    return hl.render(hl.Scene.load(BOX), passes=6, **HOW)


def test_a_render_that_was_stored_and_resumed_is_one_that_never_ended(tmp_path, whole):
    after(2).state.save(tmp_path / "a.halflight")
    for total in (3, 6):
        render = begun()
        render.resume(hl.State.load(tmp_path / "a.halflight"))
        render.run(passes=total)
        render.state.save(tmp_path / "a.halflight")
    same(render.picture(), whole)
    same(hl.State.load(tmp_path / "a.halflight").picture(), whole)


def test_one_pass_less_is_another_picture(whole):
    assert after(5).picture().visible.tobytes() != whole.visible.tobytes()


def test_shards_in_any_order_make_the_whole(whole):
    first, second, third = (after(2, shard=(k, 3)).state for k in (1, 2, 3))
    assert [state.pass_numbers for state in (first, second, third)] == [[0, 3], [1, 4], [2, 5]]
    same((third + first + second).picture(), whole)
    same(hl.State.merge([second, third, first]).picture(), whole)
    render = begun()
    for state in (third, first, second):
        render.resume(state)
    assert render.passes == 6
    same(render.picture(), whole)


def test_a_state_stays_as_it_was_when_its_render_goes_on():
    render = after(1)
    state = render.state
    before = state.picture().visible
    render.advance(2)
    assert (state.passes, render.passes) == (1, 3)
    assert np.array_equal(state.picture().visible, before)
    assert (state.size, state.layers[0], repr(state)) == (
        (20, 14),
        "visible",
        "<halflight.State 20x14, 1 passes (0..1)>",
    )
    assert state.seconds > 0 and state.key["--size"] == "20x14"


def test_the_command_goes_on_from_here(tmp_path, halflight, whole):
    after(2).state.save(tmp_path / "a.halflight")
    halflight("render", BOX, *AS_TYPED, "--passes", 6, "--extend", "-o", tmp_path / "a.exr")
    same(hl.Picture.load(tmp_path / "a.exr"), whole)


def test_a_render_of_the_command_goes_on_here(tmp_path, halflight, whole):
    halflight("render", BOX, *AS_TYPED, "--passes", 4, "--resume", "-o", tmp_path / "a.exr")
    render = begun()
    render.resume(hl.State.load(tmp_path / "a.halflight"))
    assert render.passes == 4
    render.advance(2)
    same(render.picture(), whole)


def test_shards_of_both_are_merged_by_either(tmp_path, halflight, whole):
    after(3, shard=(1, 2)).state.save(tmp_path / "1.halflight")
    halflight("render", BOX, *AS_TYPED, "--passes", 6, "--shard", "2/2", "-o", tmp_path / "2.exr")
    halflight("merge", tmp_path / "1.halflight", tmp_path / "2.halflight", "-o", tmp_path / "all.exr")
    same(hl.Picture.load(tmp_path / "all.exr"), whole)
    states = [hl.State.load(tmp_path / f"{k}.halflight") for k in (1, 2)]
    same((states[0] + states[1]).picture(), whole)


def test_what_does_not_belong_together_is_refused_and_changes_nothing(tmp_path):
    render, other = after(2), after(2, seed=1).state
    before = render.picture().visible
    with pytest.raises(hl.UsageError, match="another picture .--seed: 1 there, 0 here"):
        render.resume(other)
    with pytest.raises(hl.UsageError, match="pass 0 of the state is here already"):
        render.resume(after(1).state)
    with pytest.raises(hl.UsageError, match="do not belong together: --seed"):
        render.state + other
    with pytest.raises(hl.UsageError, match="do not belong together: pass 1 is in both"):
        hl.State.merge([render.state, after(1, shard=(2, 2)).state])
    with pytest.raises(hl.UsageError, match="--photons: 4000 there, 3000 here"):
        render.resume(after(1, photons=4000).state)
    assert render.passes == 2 and np.array_equal(render.picture().visible, before)
    with pytest.raises(TypeError):
        render.state + 1
    with pytest.raises(hl.UsageError, match="no state in the list"):
        hl.State.merge([])
    for shard in ((0, 2), (3, 2), (1, 0), "1/2"):
        with pytest.raises(hl.UsageError, match="shard=.*numbered from 1"):
            begun(shard=shard)


def test_files_that_are_no_states_are_refused_in_a_line(tmp_path):
    path = tmp_path / "a.halflight"
    path.write_bytes(b"halflight-state\n and then nothing")
    with pytest.raises(hl.FileError, match="no state to go on from"):
        hl.State.load(path)
    after(1).state.save(path)  # what is there is ours by its first bytes
    stored = path.read_bytes()
    path.write_bytes(stored[:-9] + bytes([stored[-9] ^ 1]) + stored[-8:])
    with pytest.raises(hl.FileError, match="damaged"):
        hl.State.load(path)
    foreign = tmp_path / "notes.txt"
    foreign.write_text("mine")
    with pytest.raises(hl.FileError, match="did not write the file that is there"):
        after(1).state.save(foreign)
    assert foreign.read_text() == "mine"


def test_limits_of_time_leave_passes_of_a_shard_as_large_as_they_are():
    render = begun(shard=(1, 2), size=(64, 64), photons=400_000)
    render.run(seconds=0.5)
    assert render.picture().facts["paths_per_pass"] == 400_000 and render.passes >= 1


def test_a_denoised_picture_is_the_same_of_states_that_are_gone_on_from_and_merged(tmp_path, halflight):
    how = dict(HOW, layers=["error"], denoise=True)
    alone = hl.render(hl.Scene.load(BOX), passes=4, **how)
    halflight(
        "render", BOX, "--size", "20x14", "--photons", 3000, "--passes", 2, "--denoise", "--resume", "-o", tmp_path / "a.exr"
    )
    render = hl.Render(hl.Scene.load(BOX), **how)
    render.resume(hl.State.load(tmp_path / "a.halflight"))
    assert "too few" in render.picture().facts["denoised"]
    render.advance(2)
    same(render.picture(), alone)
    shards = [hl.Render(hl.Scene.load(BOX), **how, shard=(k, 2)) for k in (1, 2)]
    for shard in shards:
        shard.advance(2)
    merged = hl.State.merge([shard.state for shard in shards])
    assert np.array_equal(merged.picture(denoise=True).denoised, alone.denoised)
    assert "denoised" not in merged.picture().layers and "denoised" not in merged.picture().facts


def test_states_without_what_the_denoiser_looks_at_are_refused():
    state = hl.Render(hl.Scene.load(BOX), size=(8, 8), photons=500).state
    words = "no layer denoising-albedo, which denoise=True looks at; leave it out, or render anew with denoise=True"
    with pytest.raises(hl.UsageError, match=words):
        state.picture(denoise=True)
    with pytest.raises(hl.UsageError, match=words):
        hl.Render(hl.Scene.load(BOX), size=(8, 8), photons=500, denoise=True).resume(state)
