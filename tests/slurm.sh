#!/bin/sh
# examples/slurm with an sbatch that runs jobs at once, in place of Slurm's.
#   sh tests/slurm.sh RENDER MERGE
set -eu
RENDER=$1 MERGE=$2
export RENDER MERGE
slurm=$(CDPATH='' cd -- "$(dirname -- "$0")/../examples/slurm" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
mkdir bin spool 'shared folder'
# Scripts run from a copy, as Slurm's do; tasks in no order; LOST is a task whose machine fails.
cat >bin/sbatch <<'S'
#!/bin/sh
tasks=none
while :; do
    case $1 in
    --array=0-*) tasks=${1#--array=0-} ;;
    --dependency=afterany:7) ;;
    --dependency=*) echo "no such job: $1" >&2; exit 1 ;;
    --*) ;;
    *) break ;;
    esac
    shift
done
cp "$1" spool/script
shift
if [ "$tasks" = none ]; then
    sh spool/script "$@" >merge.said 2>&1 || echo "job failed: $?" >>merge.said
else
    while [ "$tasks" -ge 0 ]; do
        [ "$tasks" = "${LOST:-}" ] || SLURM_ARRAY_TASK_ID=$tasks sh spool/script "$@" >&2
        tasks=$((tasks - 1))
    done
fi
echo 7
S
chmod +x bin/sbatch
PATH=$folder/bin:$PATH
wrong() {
    echo "slurm: $1" >&2
    cat merge.said >&2
    exit 1
}
options='--size 32x24 --quiet'
# shellcheck disable=SC2086
"$RENDER" builtin:cornell $options --spp 13 --checkpoint --out whole.exr
# shellcheck disable=SC2086
submit() { sh "$slurm/submit.sh" 4 13 'shared folder/a.exr' builtin:cornell $options --stats task.json >ids; }

LOST=2 submit
grep -q 'merge: samples \[6, 9) are missing' merge.said || wrong 'the samples of the lost task are not named'
grep -q 'job failed: 1' merge.said || wrong 'the job after a lost task succeeds'
submit
grep -q 'failed' merge.said && wrong 'the job fails'
grep -q '"samples": 0,' task.json || wrong 'a task renders again what it has saved'
for kind in exr film; do
    cmp "whole.$kind" "shared folder/a.$kind" || wrong "the merged $kind is not that of one process"
done
[ "$(ls 'shared folder' | wc -l)" = 2 ] || wrong 'parts are left behind'
[ "$(cat ids)" = 7 ] || wrong 'the job is not named'
