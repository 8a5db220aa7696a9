#!/bin/bash
# Runs halflight.openjd.yaml with the command-line program of Open Job Description; the merged picture must be the single render,
# bit for bit. Needs Python 3.9 or later, and installs openjd-cli into a temporary folder.
#
#   docs/cluster/try-openjd.sh target/release/halflight
set -euo pipefail
program=$(realpath "${1:-target/release/halflight}")
template=$(realpath "$(dirname "$0")/halflight.openjd.yaml")
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
cd "$here"
python3 -m venv tools
tools/bin/pip install -q --disable-pip-version-check openjd-cli
tools/bin/openjd check "$template"
job=(-p Scene=builtin:cornell-spheres -p Output="$here/out" -p Program="$program" -p Shards=4 -p Passes=10 -p Size=48x48)
tools/bin/openjd run "$template" --step Shards "${job[@]}" >shards.log
tools/bin/openjd run "$template" --step Merge "${job[@]}" >merge.log
"$program" render builtin:cornell-spheres --size 48x48 --passes 10 -q -o single.exr
"$program" diff out.exr single.exr --fail-above rmse=0
echo "the four shards are the single render"
