#!/bin/bash
#SBATCH --job-name=halflight
#SBATCH --array=1-8
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:TERM@120
# A render dealt out to the tasks of a job array:
#
#   shards=$(sbatch --parsable --array=1-16 scripts/slurm/shards.sh scene.glb out/scene --passes 1024)
#   sbatch --dependency=afterok:$shards scripts/slurm/merge.sh out/scene
#
# Each task keeps its state beside its picture and goes on from it however it ended: two minutes before its time is over, by
# preemption, with its node. SHARDS is how many there are, where not all tasks are submitted at once.
set -u
if [ $# -lt 2 ]; then
    echo "usage: sbatch --array=1-N $0 SCENE OUTPUT [options of halflight render]" >&2
    exit 2
fi
scene=$1 output=$2
shift 2
shard=$SLURM_ARRAY_TASK_ID
shards=${SHARDS:-$SLURM_ARRAY_TASK_MAX}

"${HALFLIGHT:-halflight}" render "$scene" -o "$output.$shard.exr" --shard "$shard/$shards" "$@" &
render=$!
trap 'kill -TERM $render 2>/dev/null' TERM
wait $render
code=$?
# A trap ends `wait`, and not the render.
while kill -0 $render 2>/dev/null; do
    wait $render
    code=$?
done
# 85: not complete, state kept; above 128: killed. All else is for good.
if [ $code -eq 85 ] || [ $code -gt 128 ]; then
    if [ "${SLURM_RESTART_COUNT:-0}" -lt "${MOST_RESTARTS:-100}" ]; then
        scontrol requeue "$SLURM_JOB_ID"
        # Until the system ends this script.
        sleep 60
    fi
fi
exit $code
