#!/bin/bash
# Renders that are killed, ended, stopped and resumed at random, in shards, for some time: what is merged of them must be the
# uninterrupted render, bit for bit, in all layers.
#
#   docs/cluster/soak.sh [DURATION [PROGRAM [SEED]]]     as in 2h (which is the default), 15m, 60s
set -euo pipefail
duration=${1:-2h} program=$(realpath "${2:-target/release/halflight}") seed=${3:-$(date +%s)}
case $duration in
*h) seconds=$((${duration%h} * 3600)) ;;
*m) seconds=$((${duration%m} * 60)) ;;
*) seconds=${duration%s} ;;
esac
RANDOM=$((seed % 32768))
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
cd "$here"
echo "seed $seed"
declare -A ends=()
attempts=0

fail() {
    echo "FAILED (seed $seed): $*"
    cat log 2>/dev/null || true
    exit 1
}

# How many rounds there were, and how their renders ended.
told() {
    local all
    all=$(for code in "${!ends[@]}"; do echo "${ends[$code]} with $code"; done | paste -sd, | sed 's/,/, /g')
    echo "$rounds rounds, $attempts renders in $((SECONDS - begin)) s; exit codes: $all"
}

# A number from 1 to $1.
one_of() { echo $((RANDOM % $1 + 1)); }

render_of() {
    case $1 in
    1) echo "builtin:cornell-spheres --size 24x20 --photons 3000 --layers all" ;;
    2) echo "builtin:cornell-spheres --size 33x7 --photons 900 --layers visible,error,bias,depth" ;;
    3) echo "builtin:cornell-spheres --size 20x20 --method path --samples 2" ;;
    *) echo "builtin:cornell-spheres --size 16x16 --photons 1000 --illumination 0.4,0.6 --layers visible,invisible,normal" ;;
    esac
}

# The sums of a state: what comes after its head.
sums_begin() { echo $((16 + 4 + 4 + $(od -An -tu4 -j20 -N4 "$1") + 8)); }
same_sums() { cmp -s -i "$(sums_begin "$1"):$(sums_begin "$2")" "$1" "$2"; }

# Starts a render with the arguments, and lets something happen to it after a while. Its exit code is in $code.
attempt() {
    local happens wait
    happens=$(one_of 6) wait=$(one_of "$longest")
    local more=()
    if [ "$happens" = 5 ]; then more=(--stop-after "${wait}ms"); fi
    # shellcheck disable=SC2086
    "$program" render "$@" "${more[@]}" --threads "$(one_of 3)" -q 2>log &
    local process=$!
    if [ "$happens" -lt 5 ]; then
        sleep "$((wait / 1000)).$(printf %03d $((wait % 1000)))"
        case $happens in
        1 | 2) kill -9 $process 2>/dev/null || true ;;
        3) kill -TERM $process 2>/dev/null || true ;;
        4) { kill -STOP $process && sleep 0.3 && kill -CONT $process && kill -INT $process; } 2>/dev/null || true ;;
        esac
    fi
    code=0
    wait $process 2>/dev/null || code=$?
    attempts=$((attempts + 1))
    ends[$code]=$((${ends[$code]:-0} + 1))
    case $code in
    0 | 85 | 130 | 137 | 143) ;;
    2) grep -q "not one pass was complete" log || fail "exit code 2: $*" ;;
    *) fail "exit code $code: $*" ;;
    esac
}

# Until it is complete. Whatever happens to it, its state is whole.
complete() {
    local name=$1
    shift
    code=1
    while [ "$code" != 0 ]; do
        attempt "$@" -o "$name.exr"
        if [ -e "$name.halflight" ]; then
            "$program" merge "$name.halflight" -o now.exr -q 2>log || fail "the state after exit code $code: $*"
        fi
    done
}

rounds=0
begin=$SECONDS
while [ $rounds = 0 ] || [ $((SECONDS - begin)) -lt "$seconds" ]; do
    rm -rf ./*
    render=$(render_of "$(one_of 4)")
    passes=$((20 + $(one_of 100))) shards=$(one_of 5)
    before=$(date +%s%3N)
    # shellcheck disable=SC2086
    "$program" render $render --passes $passes --checkpoint 1h -q -o single.exr 2>log || fail "$render"
    # Most things happen before a shard ends, some never.
    longest=$(($(date +%s%3N) - before + 50))
    for shard in $(seq "$shards"); do
        # shellcheck disable=SC2086
        complete "$shard" $render --passes $passes --shard "$shard/$shards" --checkpoint 50ms
    done
    # shellcheck disable=SC2207
    states=($(seq "$shards" | shuf --random-source=<(yes "$RANDOM") | sed s/$/.halflight/))
    if [ "$shards" -gt 2 ]; then
        # As a tree.
        "$program" merge "${states[@]:1}" -o some.halflight -q 2>log || fail "merge ${states[*]:1}"
        states=(some.halflight "${states[0]}")
    fi
    "$program" merge "${states[@]}" -o all.halflight -q 2>log || fail "merge ${states[*]}"
    same_sums all.halflight single.halflight || fail "$render --passes $passes in $shards shards is another picture"
    # One that ended after some passes goes on to as many.
    # shellcheck disable=SC2086
    "$program" render $render --passes 3 --checkpoint 1h -q -o extended.exr 2>log || fail "$render"
    # shellcheck disable=SC2086
    complete extended $render --passes $passes --extend --checkpoint 50ms
    same_sums extended.halflight single.halflight || fail "$render --passes $passes extended is another picture"
    # Of those who were killed nothing is left once another has begun.
    left=$(find . -name '.halflight-*.part' | wc -l)
    [ "$left" = 0 ] || fail "$left temporary files are left"
    rounds=$((rounds + 1))
    told
done
echo "each was the uninterrupted render, bit for bit"
