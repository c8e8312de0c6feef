#!/bin/sh
# The job after submit.sh's array: merge.sh TASKS SPP OUT.exr
# Makes OUT.exr and OUT.film of the tasks' films, and names the tasks that have not delivered all of their samples.
set -eu
tasks=$1 spp=$2 stem=${3%.exr}
set --
task=0
while [ "$task" -lt "$tasks" ]; do
    [ ! -f "$stem.task$task.film" ] || set -- "$@" "$stem.task$task.film"
    task=$((task + 1))
done
[ $# -gt 0 ] || { echo "merge.sh: no task has saved a film beside $stem.exr" >&2; exit 1; }
said=$("${MERGE:-merge}" "$stem.film" "$@")
echo "$said"
case $said in
"samples          $spp a pixel: [0, $spp)"*) ;;
*)
    echo "merge.sh: samples are missing of [0, $spp); $stem.exr is made of the others. Submit the same again to go on." >&2
    exit 1
    ;;
esac
task=0
while [ "$task" -lt "$tasks" ]; do
    rm -f "$stem.task$task.film" "$stem.task$task.exr"
    task=$((task + 1))
done
