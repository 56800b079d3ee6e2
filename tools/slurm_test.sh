#!/usr/bin/env bash
# A picture split over a real Slurm cluster of two nodes on this machine, one of which is lost in the middle, is bit for bit the picture of
# one run.
#
#   tools/slurm_test.sh [PROGRAM]     PROGRAM: target/release/steradian unless given
#
# SCENE (scenes/cornell.json), SIZE (256x256), SPP (512), SHARDS (4) and FRAMES (none) change what is rendered: a shard has to take some seconds. Needs
# root, Debian's munge and slurm-wlm, and python3; ends with 77 where one of them is missing. Everything happens in a temporary folder, and
# nothing is left running.
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/slurm_cluster.sh

program=$(realpath "${1:-target/release/steradian}")
scene=$(realpath "${SCENE:-scenes/cornell.json}")
spp=${SPP:-512}
shards=${SHARDS:-4}
frames=${FRAMES:-}
missing=$(cluster_missing)
if [ -n "$missing" ] || ! command -v python3 >/dev/null; then
    echo "skipped: ${missing:-no python3}"
    exit 77
fi

work=$(mktemp -d)
trap 'cluster_stop; [ -n "${KEEP:-}" ] || rm -rf "$work"' EXIT
fail() {
    echo "failed: $1" >&2
    squeue >&2 || true
    tail -n 20 "$work"/farm/log/* "$CLUSTER/slurmctld.log" >&2 || true
    exit 1
}
seconds() { date +%s; }
options=(--size "${SIZE:-256x256}" --threads 1 --float --layers Z,N,albedo,variance,samples)

echo "one run: $(basename "$scene"), $spp samples per pixel${frames:+, frames $frames}"
start=$(seconds)
"$program" render "$scene" ${frames:+--frames "$frames"} --spp "$spp" "${options[@]}" -o "$work/single.exr" -q
echo "  $(($(seconds) - start)) s"

cluster_start "$work/cluster"
start=$(seconds)
"$program" farm slurm "$scene" --shards "$shards" ${frames:+--frames "$frames"} --spp "$spp" -o "$work/merged.exr" --dir "$work/farm" \
    --every 1 --cpus 1 --submit -- "${options[@]}"

# In the middle: both nodes are at work and have kept some of it.
on() { squeue --noheader --nodelist="$1" --states=RUNNING --format=%i 2>/dev/null | head -n 1; }
checkpoints() { find "$work/farm/shards" -name '*.checkpoint' | wc -l; }
until [ -n "$(on n1)" ] && [ -n "$(on n2)" ] && [ "$(checkpoints)" -ge 2 ]; do
    sleep 0.2
    [ $(($(seconds) - start)) -lt 120 ] || fail "the tasks do not begin"
done
sleep "${DELAY:-1}"
until lost=$(on n2) && [ -n "$lost" ]; do sleep 0.1; done
cluster_kill n2
echo "after $(($(seconds) - start)) s: node n2 is lost with task $lost and $(checkpoints) checkpoints kept"
came_back=
while [ -n "$(squeue --noheader)" ]; do
    sleep 1
    [ $(($(seconds) - start)) -lt "${LIMIT:-900}" ] || fail "the job does not end"
    # The node comes back when Slurm has noticed its loss.
    if [ -z "$came_back" ] && sinfo --noheader --nodes=n2 --format=%t | grep -q down; then
        cluster_boot n2
        came_back=$(($(seconds) - start))
        echo "after $came_back s: Slurm has noticed, and the node is back"
    fi
done
echo "after $(($(seconds) - start)) s: all is done"

[ -n "$came_back" ] || fail "Slurm has not noticed that the node was lost"
grep -hE "^[0-9T:Z-]+ task" "$work"/farm/log/*.log | sed 's/^/  /'
grep -qE "task .* started [1-9][0-9]* times before" "$work"/farm/log/*.log || fail "no task was started again"

python3 - "$work" <<'PYTHON' || fail "the merged picture is another one"
"""Compares what EXR files say of pixels: everything after the header and the table of offsets, which the header's length moves."""
import glob, struct, sys
def chunks(path):
    data = open(path, "rb").read()
    at = 8
    while data[at]:
        at = data.index(b"\0", data.index(b"\0", at) + 1) + 1
        at += 4 + struct.unpack_from("<i", data, at)[0]
    return data[struct.unpack_from("<Q", data, at + 1)[0]:]
work = sys.argv[1]
singles = sorted(glob.glob(f"{work}/single*.exr"))
assert singles
for single in singles:
    merged = single.replace("single", "merged")
    one, many = chunks(single), chunks(merged)
    assert one == many, merged
    print(f"{merged[len(work) + 1:]}: {len(many)} bytes of pixels, the same as in one run")
PYTHON
[ "$(find "$work/farm/shards" -name '*.shard' -o -name '*.checkpoint' | wc -l)" = 0 ] || fail "shards or checkpoints are left"
echo "passed"
