#!/usr/bin/env bash
# Undefined behaviour, wrong addresses, leaks and data races, by Rust's nightly toolchain (with the components miri and rust-src).
#
#   tools/sanitize.sh miri       what needs no Embree, interpreted by Miri
#   tools/sanitize.sh address    renders and checks through Embree under AddressSanitizer and LeakSanitizer
#   tools/sanitize.sh thread     the same under ThreadSanitizer, with a standard library built for it
#   tools/sanitize.sh            all three
set -euo pipefail
cd "$(dirname "$0")/.."

target=x86_64-unknown-linux-gnu

# None of this has unsafe code of ours: what is looked at is the use of the libraries below it, threads among them. crossbeam-epoch, below rayon,
# keeps the rules of tree borrows, not those of stacked borrows.
miri() {
    MIRIFLAGS="-Zmiri-disable-isolation -Zmiri-tree-borrows -Zmiri-ignore-leaks -Zmiri-deterministic-floats" cargo +nightly miri test --target-dir target/miri --lib -- \
        a_small_picture math:: geometry::triangle::tests::hits geometry::sphere geometry::disk geometry::frustum geometry::quad
}

# Meshes, analytic shapes, instances, motion, holes and media: every callback is called, from every thread.
renders() {
    local program=target/sanitize-$1/$target/debug/steradian out
    out=$(mktemp -d)
    for scene in gallery classic motion glassware tree shapes; do
        echo "$1: $scene" >&2
        "$program" render "scenes/$scene.json" --spp 1 --size 64x48 --threads 4 -q -o "$out/a.exr" -o "$out/a.png"
    done
    for accel in bvh kdtree octree; do
        echo "$1: gallery through $accel" >&2
        "$program" render scenes/gallery.json --accel $accel --spp 1 --size 32x24 --threads 4 -q -o "$out/a.exr"
    done
    echo "$1: checks" >&2
    "$program" bench stability -q --quick E1 E2 E8 E9 F5 B5 B7 I9 >/dev/null
    rm -r "$out"
}

address() {
    RUSTFLAGS="-Zsanitizer=address" cargo +nightly build --target $target --target-dir target/sanitize-address --bin steradian
    ASAN_OPTIONS=detect_leaks=1:halt_on_error=1 renders address
}

thread() {
    RUSTFLAGS="-Zsanitizer=thread" cargo +nightly build -Zbuild-std --target $target --target-dir target/sanitize-thread --bin steradian
    TSAN_OPTIONS=suppressions=$PWD/tools/tsan.supp renders thread
}

case "${1:-all}" in
    miri | address | thread) "$1" ;;
    all) miri && address && thread ;;
    *) sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac
