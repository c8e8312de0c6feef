#!/bin/sh
# One image by many tasks of a Slurm array, each of which renders a part of the samples; a job after them merges the parts.
#   sh submit.sh TASKS SPP OUT.exr SCENE [render's options]      as: sh submit.sh 16 4096 /shared/a.exr /shared/scene.glb
# OUT.exr lies in a folder that all machines see. RENDER and MERGE are the programs (render and merge of the PATH),
# SBATCH_OPTIONS go to sbatch, as in SBATCH_OPTIONS="--partition=cpu --cpus-per-task=16 --time=60 --requeue".
# To go on after a time limit or a lost machine, submit the same again: tasks take up what they had saved.
set -eu
[ $# -ge 4 ] || { sed -n '2,7s/^# //p' "$0" >&2; exit 2; }
here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
# shellcheck disable=SC2086  # lists of words
tasks=$(sbatch --parsable ${SBATCH_OPTIONS:-} --job-name=lambent --array="0-$(($1 - 1))" "$here/task.sh" "$@")
# shellcheck disable=SC2086
sbatch --parsable ${SBATCH_OPTIONS:-} --job-name=lambent-merge --dependency="afterany:$tasks" "$here/merge.sh" "$1" "$2" "$3"
