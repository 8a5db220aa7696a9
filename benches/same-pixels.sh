#!/usr/bin/env bash
# Do two builds make the same pictures, bit for bit? All methods, the atlas, several points of the square.
#   cargo build --release --example pixels && benches/same-pixels.sh OLD_HALFLIGHT NEW_HALFLIGHT
# With one program: its hashes, to be kept and compared later.
set -euo pipefail
cd "$(dirname "$0")/.."
pixels=${PIXELS:-target/release/examples/pixels}
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

pictures() { # PROGRAM FOLDER
    mkdir "$2"
    render() { "$program" render "$@" -q --overwrite -o "$folder/$name.exr" >&2; }
    local program=$1 folder=$2 name
    for scene in caustic-box cornell-spheres concentric two-spheres scenes/gallery.glb scenes/peer-box.glb; do
        local file=$scene word
        [ -e "$scene" ] || file=builtin:$scene
        word=$(basename "$scene" .glb)
        name=$word-photon render "$file" --size 48x40 --passes 5 --photons 20e3 --layers all
        name=$word-local render "$file" --size 48x40 --passes 3 --photons 20e3 --illumination local --layers all
        name=$word-half render "$file" --size 32x24 --passes 3 --photons 10e3 --illumination .4,.3 --direct photons
        name=$word-path render "$file" --method path --size 32x24 --passes 3 --layers visible,invisible,emitted,error
        name=$word-kept render "$file" --size 32x24 --passes 2 --photons 5e3 --keep-everything
        [ "$word" = concentric ] || name=$word-plain render "$file" --method path-plain --size 32x24 --passes 3
        [ "$word" = gallery ] || name=$word-atlas render "$file" --illumination .3,.6 --atlas --size 32x24 --passes 6 --photons 10e3
    done
}

hashes() { # PROGRAM FOLDER
    pictures "$1" "$out/$2"
    (cd "$out/$2" && "$pixels" ./*.exr)
}

case $pixels in /*) ;; *) pixels=$PWD/$pixels ;; esac
hashes "$(realpath "$1")" old >"$out/old.txt"
[ $# -gt 1 ] || { cat "$out/old.txt"; exit; }
hashes "$(realpath "$2")" new >"$out/new.txt"
diff "$out/old.txt" "$out/new.txt" && echo "$(wc -l <"$out/new.txt") layers, all equal bit for bit"
