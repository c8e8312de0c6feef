#!/bin/sh
# render_mpi beside render: the same bytes by any number of ranks; a rank that is killed loses its own samples alone.
#   sh tests/mpi.sh RENDER MERGE RENDER_MPI      without RENDER_MPI, which takes MPI to build, it is skipped
set -eu
render=$1 merge=$2 render_mpi=${3:-}
if [ -z "$render_mpi" ] || ! command -v mpirun >/dev/null 2>&1; then
    echo 'SKIPPED: render_mpi: no MPI here (sh cmake/install_packages.sh mpi)'
    exit 0
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
wrong() {
    echo "mpi: $1" >&2
    [ ! -f said ] || cat said >&2
    exit 1
}
# Root may start it where the version asks; temporary files of its own in a short path.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
ranks() {
    n=$1
    shift
    timeout 120 mpirun --oversubscribe -n "$n" "$@" >said 2>&1
}
scene='builtin:cornell --size 32x24 --quiet'
counts() { grep -e '"samples"' -e 'rays' -e '"background_samples"' "$1" | grep -v per_s; }

# shellcheck disable=SC2086
{
"$render" $scene --spp 13 --checkpoint --out whole.exr --stats whole.json
counts whole.json >whole.counts
[ "$(wc -l <whole.counts)" = 6 ] || wrong 'render does not count samples, four kinds of rays and background'
for n in 1 2 4; do
    ranks "$n" "$render_mpi" $scene --spp 13 --checkpoint --out a.exr --stats s.json || wrong "$n ranks: exit code $?"
    counts s.json | cmp whole.counts - || wrong "$n ranks count otherwise"
    cmp whole.exr a.exr || wrong "$n ranks write another image"
    cmp whole.film a.film || wrong "$n ranks write another film"
    rm a.exr a.film
    [ -z "$(ls | grep '^a\.')" ] || wrong "$n ranks leave files behind"
done
# More ranks than samples, and a film to go on with.
"$render" $scene --sample-range 3:5 --out b.exr
ranks 4 "$render_mpi" $scene --spp 6 --resume b.film --out c.exr || wrong "resumed: exit code $?"
"$render" $scene --spp 6 --out six.exr
cmp six.exr c.exr || wrong 'resumed by ranks, it is another image'
# What ranks of an earlier run left is taken up.
"$render" $scene --sample-range 6:9 --out d.6-13.exr
ranks 2 "$render_mpi" $scene --spp 13 --out d.exr --stats s.json || wrong "taken up: exit code $?"
grep -q "\"samples\": $((32 * 24 * 10))," s.json || wrong 'what was taken up is rendered again'
cmp whole.exr d.exr || wrong 'taken up by ranks, it is another image'
code=0
ranks 2 "$render_mpi" $scene --spp x || code=$?
[ "$code" = 2 ] || wrong "a wrong command line: exit code $code"
[ "$(grep -c 'is not a whole number' said)" = 1 ] || wrong 'not one rank speaks'

# Rank 1 is killed when it has saved something; the others go on until their time is up.
cat >deadly.sh <<'S'
if [ "$OMPI_COMM_WORLD_RANK" = 1 ]; then
    (while [ -z "$(ls e.1000-2000.film 2>/dev/null)" ]; do sleep 0.1; done; kill -9 $$) >/dev/null 2>&1 &
fi
exec "$@"
S
# With --enable-recovery, Open MPI's mpirun says 0 whatever becomes of its ranks.
timeout 120 mpirun --oversubscribe --enable-recovery -n 3 sh deadly.sh "$render_mpi" $scene --size 320x240 --spp 3000 --time-limit 4 \
    --checkpoint --out e.exr >said 2>&1 || wrong "a rank was killed: exit code $?"
grep -q 'render_mpi: rank 1 died' said || wrong 'the death of rank 1 is not told'
grep -Eq 'samples .*\[1[0-9]*, 2000\).* are missing' said || wrong 'the missing samples are not named'
grep -q -e '--resume e.film' said || wrong 'it does not say how to go on'
# The film is the one that render makes of the samples that it says it has.
parts=
"$merge" again.film e.film >said
for range in $(sed -n 's/^samples [^:]*: //p' said | sed 's/\[\([0-9]*\), \([0-9]*\))/\1:\2/g'); do
    "$render" $scene --size 320x240 --spp 3000 --sample-range "$range" --out "part$range.exr"
    parts="$parts part$range.film"
done
"$merge" truth.film $parts >said
cmp truth.film e.film || wrong 'what was saved is not what was rendered'
}
