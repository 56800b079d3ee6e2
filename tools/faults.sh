#!/bin/bash
# Faults of disks and files while a render keeps its state: each is to be told clearly and to leave earlier files as they were.
#
#   tools/faults.sh [BINARY]     as root, for a full disk and one that cannot be written are made of small file systems in memory
set -u
binary=$(realpath "${1:-target/release/steradian}")
scenes=$(realpath "$(dirname "$0")/../scenes")
folder=$(mktemp -d)
full=$folder/full
failures=0
trap 'umount "$full" 2>/dev/null; umount "$full" 2>/dev/null; rm -rf "$folder"' EXIT
cd "$folder" || exit 1
cp -r "$scenes/cornell.json" .

# expect WHAT CODE TEXT COMMAND...: the exit code and what stderr says.
expect() {
    local what=$1 code=$2 text=$3
    shift 3
    "$@" >out.txt 2>err.txt
    local got=$?
    if [ $got -eq "$code" ] && grep -qF -- "$text" err.txt; then
        echo "ok    $what: $got: $(grep -m1 -F -- "$text" err.txt)"
    else
        echo "WRONG $what: exit code $got instead of $code, or nothing of \"$text\":"
        cat err.txt
        failures=$((failures + 1))
    fi
}

# holds WHAT COMMAND...: a condition afterwards.
holds() {
    local what=$1
    shift
    if "$@"; then echo "ok    $what"; else
        echo "WRONG $what"
        failures=$((failures + 1))
    fi
}

render=("$binary" render cornell.json --size 128x128 -o a.exr)

if mkdir "$full" && mount -t tmpfs -o size=3m tmpfs "$full" 2>/dev/null; then
    expect "first checkpoint fits" 0 "wrote a.exr" "${render[@]}" --spp 4 --checkpoint "$full/a.state"
    before=$(sha256sum <"$full/a.state")
    head -c 1200000 /dev/zero >"$full/ballast"
    expect "disk full: the picture is written" 0 "wrote a.exr" "${render[@]}" --spp 64 --checkpoint "$full/a.state" --resume --every 0
    holds "disk full: it was told" grep -q "cannot write $full/a.state: No space left" err.txt
    holds "disk full: the earlier checkpoint is as it was" test "$before" = "$(sha256sum <"$full/a.state")"
    holds "disk full: nothing left over" test "$(ls -A "$full" | sort | tr '\n' ' ')" = "a.state ballast "
    rm "$full/ballast"
    expect "space again: continues" 0 "continuing after 4 samples" "${render[@]}" --spp 64 --checkpoint "$full/a.state" --resume
    "$binary" render cornell.json --size 128x128 --spp 64 -q -o b.exr
    holds "space again: the same picture" test "$("$binary" compare a.exr b.exr --json | grep -c '"mse": 0.0')" = 1
    head -c 3000000 /dev/zero >"$full/ballast" 2>/dev/null
    expect "disk full: a shard" 5 "No space left" "${render[@]:0:5}" --spp 8 --shard 1/2 -o "$full/a.shard"
    expect "disk full: a picture" 5 "No space left" "${render[@]:0:5}" --spp 1 --float -o "$full/p.exr"
    rm -f "$full/ballast"
    mount -o remount,ro "$full"
    expect "read-only from the start" 5 "Read-only file system" "${render[@]}" --checkpoint "$full/b.state"
    expect "read-only: what is there cannot be continued" 5 "Read-only file system" "${render[@]}" --checkpoint "$full/a.state" --resume
    mount -o remount,rw "$full"
    # The target becomes read-only while the render runs.
    rm "$full/a.state"
    "${render[@]}" --spp 3000 --time-limit 2 --checkpoint "$full/c.state" --every 0.1 >out.txt 2>err.txt &
    sleep 1
    mount --bind "$full" "$full" && mount -o remount,ro,bind "$full"
    wait $!
    holds "read-only on the way: the picture is written" grep -q "wrote a.exr" err.txt
    holds "read-only on the way: it was told" grep -q "cannot write $full/c.state: Read-only file system" err.txt
    umount "$full"
    expect "read-only on the way: continues" 0 "continuing after" "${render[@]}" --spp 3000 --time-limit 1 --checkpoint "$full/c.state" --resume
    umount "$full"
else
    echo "skip  full and read-only disks: no right to mount"
fi

# Inputs that vanish.
"${render[@]}" --spp 100000 --time-limit 2 --checkpoint d.state --every 0.1 2>err.txt &
sleep 1
mv cornell.json gone.json
wait $!
holds "scene removed while rendering: the picture is written" grep -q "wrote a.exr" err.txt
before=$(sha256sum <d.state)
expect "scene removed before it goes on" 4 "cornell.json" "${render[@]}" --spp 100000 --checkpoint d.state --resume
mv gone.json cornell.json
cat >mesh.json <<END
{ "camera": { "position": [0, 0, 4], "look_at": [0, 0, 0] }, "film": { "width": 64, "height": 64 }, "sampler": { "spp": 4 },
  "shapes": [{ "type": "mesh", "file": "m.obj" }], "lights": [{ "type": "environment", "radiance": [1, 1, 1] }] }
END
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >m.obj
expect "with a mesh" 0 "wrote m.exr" "$binary" render mesh.json --checkpoint m.state -o m.exr
printf 'v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n' >m.obj
expect "mesh changed" 6 "not the same m.obj" "$binary" render mesh.json --checkpoint m.state --resume -o m.exr
rm m.obj
expect "mesh removed" 4 "m.obj" "$binary" render mesh.json --checkpoint m.state --resume -o m.exr
holds "checkpoints are as they were" test "$before" = "$(sha256sum <d.state)"

# Damaged and foreign files.
for i in 1 2; do "$binary" render cornell.json --size 64x64 --spp 4 -q --shard $i/2; done
head -c 100000 cornell.2-of-2.shard >cut.shard
expect "shard cut short" 6 "cut.shard: the file is cut short" "$binary" merge cornell.1-of-2.shard cut.shard -o s.exr
expect "shard missing" 6 "shard 1 of 2" "$binary" merge cornell.1-of-2.shard -o s.exr
expect "shard of another picture" 6 "seed: 5 here, 0 there" bash -c "'$binary' render cornell.json --size 64x64 --spp 4 -q --seed 5 --shard 2/2 -o x.shard && '$binary' merge cornell.1-of-2.shard x.shard -o s.exr"
holds "no picture of wrong shards" test ! -e s.exr

# Two writers.
"${render[@]}" --spp 100000 --time-limit 3 --checkpoint w.state 2>/dev/null &
sleep 1
expect "two writers" 5 "another process (process $!) is writing it" "${render[@]}" --checkpoint w.state --resume
wait
holds "nothing left over" test -z "$(ls -A | grep '^\.')"
echo "$failures wrong"
exit $((failures > 0))
