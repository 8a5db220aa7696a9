#!/usr/bin/env bash
# Builds the wheel, installs it into a fresh environment, and runs its tests and notebooks there. The argument is a profile of cargo.
set -euo pipefail
cd "$(dirname "$0")"
profile=${1:-release}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Dependencies that the repository has built are not built again.
export CARGO_TARGET_DIR="$PWD/../target"
export HALFLIGHT="$CARGO_TARGET_DIR/$profile/halflight"
[ -x "$HALFLIGHT" ] || (cd .. && cargo build --locked --profile "$profile" --bin halflight)

python3 -m venv "$work/venv"
pip() { "$work/venv/bin/pip" install -q --disable-pip-version-check "$@"; }
pip "maturin>=1.9,<2"
# Tests need no more speed than sixteen units have, and a single one takes minutes.
"$work/venv/bin/maturin" build --quiet --locked --profile "$profile" --out "$work/wheels" \
    --config 'profile.release.package.halflight.codegen-units=16'
pip "$(echo "$work"/wheels/*.whl)[test,notebooks]"
"$work/venv/bin/python" -m pytest -q --durations=5 tests
