#!/usr/bin/env bash
# Tests the add-on in Blender without its window (the package bpy), for each Python here that has one; HALFLIGHT names the command.
# Exit code 77: nothing was tested, and a line says why. The arguments are for pytest.
set -euo pipefail
cd "$(dirname "$0")"
if [ -z "${HALFLIGHT:-}" ]; then
    for profile in release quick; do
        [ -x "../target/$profile/halflight" ] && HALFLIGHT="$PWD/../target/$profile/halflight" && break
    done
fi
if [ -z "${HALFLIGHT:-}" ]; then
    echo "SKIPPED: the add-on for Blender was not tested: no halflight; cargo build --release, or set HALFLIGHT"
    exit 77
fi
export HALFLIGHT
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
tested=0

# try PYTHON PACKAGE…: tests with a Blender that this Python has.
try() {
    local python=$1 venv="$work/$1"
    shift
    "$python" -c '' 2>/dev/null && "$python" -m venv "$venv" || return 0
    if ! "$venv/bin/pip" install -q --disable-pip-version-check pytest "$@"; then
        echo "SKIPPED: the add-on was not tested in $1, which could not be installed"
        return 0
    fi
    "$venv/bin/python" -m pytest -q --show-capture=no -p no:cacheprovider --durations=3 tests "${arguments[@]}"
    tested=1
}

arguments=("$@")
try python3.11 'bpy==4.5.*' 'numpy<2'
if [ -n "${ALL_BLENDERS:-}" ]; then
    try python3.11 'bpy==4.2.*' 'numpy<2'
    try python3.13 'bpy==5.*' numpy
fi
if [ "$tested" = 0 ]; then
    echo "SKIPPED: the add-on for Blender was not tested: it takes Python 3.11 and the package bpy, of PyPI or of download.blender.org/pypi"
    exit 77
fi
