#!/bin/sh
# One task of submit.sh's array: task.sh TASKS SPP OUT.exr SCENE [render's options]
# Saves its film as it goes, goes on from what it has saved, and when Slurm's time is up, render saves what there is.
set -eu
tasks=$1 spp=$2 out=$3
shift 3
first=$((spp * SLURM_ARRAY_TASK_ID / tasks)) end=$((spp * (SLURM_ARRAY_TASK_ID + 1) / tasks))
[ "$first" -lt "$end" ] || exit 0
part=${out%.exr}.task$SLURM_ARRAY_TASK_ID
[ ! -f "$part.film" ] || set -- "$@" --resume "$part.film"
exec "${RENDER:-render}" "$@" --spp "$spp" --sample-range "$first:$end" --checkpoint --out "$part.exr"
