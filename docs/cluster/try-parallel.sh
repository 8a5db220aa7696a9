#!/bin/bash
# Tries shards by GNU parallel: it is ended on the way, and goes on; the merged picture must be the single render, bit for bit.
#
#   docs/cluster/try-parallel.sh target/release/halflight
set -euo pipefail
program=$(realpath "${1:-target/release/halflight}")
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
cd "$here"
render="$program render builtin:cornell-spheres --size 32x32 --photons 3000 --passes 360 --threads 1 -q"
$render -o single.exr
# shellcheck disable=SC2086
shards() { parallel --joblog jobs.log "$@" $render --shard {}/6 --checkpoint 200ms -o out.{}.exr ::: 1 2 3 4 5 6; }
# Parallel sends SIGTERM to its jobs, and they keep their states.
timeout 3 bash -c "$(declare -f shards); render='$render'; shards" || true
ls out.*.halflight >/dev/null
shards --resume-failed
"$program" merge out.[0-9].halflight -o out.exr
"$program" diff out.exr single.exr --fail-above rmse=0
echo "the six shards are the single render"
