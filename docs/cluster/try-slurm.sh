#!/bin/bash
# Tries scripts/slurm on a Slurm of one machine, on the loopback interface: eight shards, one of which is killed and one requeued;
# what they make together must be the single render, bit for bit. As root, on Debian or Ubuntu; changes nothing outside a
# temporary folder but that it installs slurm-wlm where it is missing.
#
#   docs/cluster/try-slurm.sh target/release/halflight
set -euo pipefail
HALFLIGHT=$(realpath "${1:-target/release/halflight}")
export HALFLIGHT
scripts=$(realpath "$(dirname "$0")/../../scripts/slurm")
if ! command -v slurmctld slurmd munged >/dev/null; then
    apt-get update -qq
    apt-get install -y -qq --no-install-recommends slurm-wlm munge >/dev/null
fi

here=$(mktemp -d)
pids=()
end() {
    for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait
    [ -n "${KEEP_FOLDER:-}" ] || rm -rf "$here"
}
trap end EXIT
cd "$here"
chmod 755 "$here"
mkdir controller daemon

dd if=/dev/urandom of=munge.key bs=1024 count=1 status=none
chmod 400 munge.key
munged --foreground --force --key-file="$here/munge.key" --socket="$here/munge.socket" --pid-file="$here/munged.pid" \
    --log-file="$here/munged.log" --seed-file="$here/munge.seed" >munged.out 2>&1 &
pids+=($!)

node=$(hostname -s)
export SLURM_CONF=$here/slurm.conf
cat >slurm.conf <<END
ClusterName=try
SlurmctldHost=$node(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$here/munge.socket
CredType=cred/munge
SlurmctldPort=17002
SlurmdPort=17003
StateSaveLocation=$here/controller
SlurmdSpoolDir=$here/daemon
SlurmctldPidFile=$here/slurmctld.pid
SlurmdPidFile=$here/slurmd.pid
SlurmctldLogFile=$here/slurmctld.log
SlurmdLogFile=$here/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
JobRequeue=1
KillWait=10
MpiDefault=none
NodeName=$node NodeAddr=127.0.0.1 CPUs=4 State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
END
for _ in $(seq 50); do [ -S munge.socket ] && break; sleep 0.1; done
slurmctld -D >controller.out 2>&1 &
pids+=($!)
slurmd -D >daemon.out 2>&1 &
pids+=($!)
for _ in $(seq 100); do sinfo -h -o %t 2>/dev/null | grep -q idle && break; sleep 0.2; done
sinfo -h -o '%N %t %c processors'

render="builtin:cornell-spheres out --size 48x48 --photons 4000 --passes 480 --threads 1 --quiet --checkpoint 200ms"
# shellcheck disable=SC2086
set -- $render
"$HALFLIGHT" render "$1" --size 48x48 --photons 4000 --passes 480 --quiet -o single.exr
shards=$(sbatch --parsable --array=1-8 -o 'shard.%a.log' "$scripts/shards.sh" "$@")
merge=$(sbatch --parsable --dependency="afterok:$shards" -o merge.log "$scripts/merge.sh" out)
echo "shards: job $shards, merge: job $merge"

# The first two that have a state: one loses its render, the other its place.
for shard in 1 2; do
    for _ in $(seq 300); do [ -s out.$shard.halflight ] && break; sleep 0.1; done
done
victim=$(pgrep -f -- "$here.*--shard 1/8|--shard 1/8" | head -1 || true)
[ -n "$victim" ] && kill -KILL "$victim" && echo "killed the render of shard 1"
scontrol requeue "${shards}_2" && echo "requeued shard 2, as preemption does"

# Slurm lets what is requeued wait for two minutes.
for _ in $(seq 600); do
    [ -z "$(squeue -h -j "$shards,$merge" 2>/dev/null)" ] && break
    sleep 1
done
grep -h -v '^$' shard.*.log merge.log || true
scontrol show job "$shards" 2>/dev/null | grep -o 'Restarts=[1-9][0-9]*' | sed 's/^/one shard: /' || true
if ! [ -s out.exr ]; then
    tail -5 slurmctld.log slurmd.log
    echo "FAILED: there is no merged picture" >&2
    exit 1
fi
"$HALFLIGHT" diff out.exr single.exr --fail-above rmse=0
echo "the eight shards are the single render"
