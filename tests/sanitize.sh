#!/usr/bin/env bash
# Undefined behaviour, wrong addresses, leaks and data races, by Rust's nightly toolchain (with the components miri and rust-src).
#
#   tests/sanitize.sh miri       what needs no Embree, interpreted by Miri (about 20 minutes)
#   tests/sanitize.sh address    renders through Embree under AddressSanitizer and LeakSanitizer
#   tests/sanitize.sh thread     renders through Embree under ThreadSanitizer, with a standard library built for it
#   tests/sanitize.sh            all three
set -euo pipefail
cd "$(dirname "$0")/.."

target=x86_64-unknown-linux-gnu

# Own code without FFI: numbers, shapes, trees, samplers, distributions, film.
miri() {
    MIRIFLAGS="-Zmiri-disable-isolation" cargo +nightly miri test --target-dir target/miri --lib -- \
        math:: geometry::triangle geometry::sphere geometry::disk geometry::frustum geometry::quad sampling::discrete sampling::mis \
        film::image accel::bvh::tests::boxes light::ies
}

# Scenes with meshes, analytic shapes, instances, motion, holes and media: every callback is called, from every thread.
renders() {
    local program=target/sanitize-$1/$target/debug/steradian out
    out=$(mktemp -d)
    for scene in gallery classic motion glassware leaves; do
        [ -e "scenes/$scene.json" ] || continue
        echo "$1: $scene" >&2
        "$program" render "scenes/$scene.json" --spp 2 --size 96x64 --threads 4 -q -o "$out/$scene.exr" -o "$out/$scene.png"
    done
    for accel in bvh kdtree octree; do
        "$program" render scenes/gallery.json --accel $accel --spp 1 --size 48x32 --threads 4 -q -o "$out/$accel.exr"
    done
    rm -r "$out"
}

address() {
    RUSTFLAGS="-Zsanitizer=address" cargo +nightly build --target $target --target-dir target/sanitize-address --bin steradian
    ASAN_OPTIONS=detect_leaks=1:halt_on_error=1 LSAN_OPTIONS=suppressions=tests/lsan.supp:print_suppressions=0 renders address
}

thread() {
    RUSTFLAGS="-Zsanitizer=thread" cargo +nightly build -Zbuild-std --target $target --target-dir target/sanitize-thread --bin steradian
    TSAN_OPTIONS=halt_on_error=1:suppressions=tests/tsan.supp renders thread
}

case "${1:-all}" in
    miri | address | thread) "$1" ;;
    all) miri && address && thread ;;
    *) sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac
