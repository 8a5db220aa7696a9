#!/bin/bash
#SBATCH --job-name=halflight-merge
# Adds up what shards.sh made: OUTPUT.1.halflight, OUTPUT.2.halflight, … become OUTPUT.exr and OUTPUT.png.
set -u
if [ $# -lt 1 ]; then
    echo "usage: sbatch --dependency=afterok:JOB $0 OUTPUT" >&2
    exit 2
fi
exec "${HALFLIGHT:-halflight}" merge "$1".[0-9]*.halflight -o "$1.exr"
