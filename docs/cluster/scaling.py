#!/usr/bin/env python3
"""How renders scale over shards: measured parts, a simulation from them, and real shards that it is held against.

    docs/cluster/scaling.py target/release/halflight [check|simulate]       the tables of docs/scaling.md, as Markdown; both, or one

Times are processor seconds of one thread, so that other work on the machine hardly matters. Nothing but Python is needed.
"""

import os
import random
import subprocess
import sys
import tempfile
from math import ceil

SCENE = "builtin:cornell-spheres"
CHECK = f"{SCENE} --size 64x64 --photons 5000"
CHECKED = 240  # passes
LARGE = f"{SCENE} --size 480x270"
WANTED = 16384  # passes of it
TREE = 32  # states that are merged at once
SEED = 1


class Program:
    def __init__(self, path, folder):
        self.path, self.folder = os.path.realpath(path), folder

    def __call__(self, arguments):
        """Processor seconds."""
        with open(os.devnull, "w") as nowhere:
            child = subprocess.Popen([self.path, *arguments.split()], cwd=self.folder, stdout=nowhere)
            _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode:
            sys.exit(f"{arguments}: exit code {child.returncode}")
        return used.ru_utime + used.ru_stime

    def render(self, scene, passes, more=""):
        return self(f"render {scene} {passes} --threads 1 --checkpoint 1h -q {more} -o r.exr")


def least(count, of):
    """The least of so many: others were disturbed."""
    return min(of() for _ in range(count))


def parts(program, scene, passes, count):
    """What a shard consists of: seconds before its first pass and after its last, seconds of a pass, bytes of its state, seconds that
    one state more takes to merge, and merging one alone."""
    few, many = passes
    short = least(count, lambda: program.render(scene, f"--passes {few}"))
    long = least(count, lambda: program.render(scene, f"--passes {many}"))
    each = (long - short) / (many - few)
    for k in range(8):
        program(f"render {scene} --passes {k}..{k + 1} --threads 1 -q -o m{k}.exr")
    merge = [least(count, lambda: program("merge " + " ".join(f"m{k}.halflight" for k in range(n)) + " -q -o m.halflight")) for n in (1, 8)]
    state = os.path.getsize(os.path.join(program.folder, "m.halflight"))
    for k in range(8):
        os.remove(os.path.join(program.folder, f"m{k}.halflight"))
    more = (merge[1] - merge[0]) / 7
    return {"setup": short - few * each, "pass": each, "state": state, "merge": more, "merge one": merge[0]}


def merged(n, part):
    """Seconds until n states are one: by one process, and by a tree of processes beside each other."""
    alone = part["merge one"] + (n - 1) * part["merge"]
    tree, left = 0.0, n
    while left > 1:
        at_once = min(TREE, left)
        tree += part["merge one"] + (at_once - 1) * part["merge"]
        left = ceil(left / TREE)
    return alone, max(tree, part["merge one"])


def slowest(shards, passes, part, uneven, rng):
    """Seconds of the last of the shards, whose machines differ by a relative deviation of `uneven`."""
    most = ceil(passes / shards)
    with_most = passes - (most - 1) * shards
    speeds = [max(0.2, rng.gauss(1.0, uneven)) for _ in range(shards)]
    own = [most if i < with_most else most - 1 for i in range(shards)]
    return max((part["setup"] + n * part["pass"]) * speed for n, speed in zip(own, speeds))


def check(program, part):
    print("| shards | a shard, s: measured, mean | the slowest | simulated | merge, s: measured | simulated | mean and merge: measured / simulated |")
    print("|---|---|---|---|---|---|---|")
    for n in (1, 2, 4, 8, 16):
        shards = [program(f"render {CHECK} --passes {CHECKED} --shard {k}/{n} --threads 1 -q -o s{k}.exr") for k in range(1, n + 1)]
        states = " ".join(f"s{k}.halflight" for k in range(1, n + 1))
        merge = program(f"merge {states} -q -o all{n}.halflight")
        for k in range(1, n + 1):
            os.remove(os.path.join(program.folder, f"s{k}.halflight"))
        expected, by_one = slowest(n, CHECKED, part, 0.0, random.Random(SEED)), merged(n, part)[0]
        mean = sum(shards) / n
        ratio = (mean + merge) / (expected + by_one)
        print(f"| {n} | {mean:.2f} | {max(shards):.2f} | {expected:.2f} | {merge:.3f} | {by_one:.3f} | {ratio:.2f} |", flush=True)
    same = {sums(os.path.join(program.folder, f"all{n}.halflight")) for n in (1, 2, 4, 8, 16)}
    print(f"\nThe sums of all five are {'the same, bit for bit' if len(same) == 1 else 'NOT THE SAME'}.")
    if len(same) > 1:
        sys.exit(1)


def sums(path):
    """What comes after the head of a state."""
    with open(path, "rb") as file:
        state = file.read()
    return state[24 + int.from_bytes(state[20:24], "little") + 8 :]


def simulate(part):
    print("| shards | passes each | set-up of all | the slowest shard, s | merge by one, s | by a tree, s | speed-up, by one | by a tree | share of N | states, GB |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    rng = random.Random(SEED)
    alone = part["setup"] + WANTED * part["pass"]
    for n in (1, 10, 100, 300, 1000, 3000, 10000):
        uneven = 0.05 if n > 1 else 0.0
        shard, (by_one, by_tree) = slowest(n, WANTED, part, uneven, rng), merged(n, part)
        if n == 1:
            by_one = by_tree = 0.0
        flat, tree = alone / (shard + by_one), alone / (shard + by_tree)
        share = n * part["setup"] / (n * part["setup"] + WANTED * part["pass"])
        print(
            f"| {n} | {ceil(WANTED / n)} | {100 * share:.1f} % | {shard:.1f} | {by_one:.1f} | {by_tree:.1f} | {flat:.0f} | {tree:.0f} | {100 * tree / n:.0f} % | {1e-9 * n * part['state']:.1f} |"
        )


def tell(what, part):
    names = ", ".join(f"{name} {part[name]:.3f} s" for name in ("setup", "pass", "merge one", "merge"))
    print(f"\n{what}: {names}, state {1e-6 * part['state']:.2f} MB\n")


def main():
    which = sys.argv[2:] or ["check", "simulate"]
    with tempfile.TemporaryDirectory() as folder:
        program = Program(sys.argv[1], folder)
        if "check" in which:
            part = parts(program, CHECK, (8, 72), 3)
            tell(CHECK, part)
            check(program, part)
        if "simulate" in which:
            part = parts(program, LARGE, (1, 3), 2)
            tell(LARGE, part)
            simulate(part)


if __name__ == "__main__":
    main()
