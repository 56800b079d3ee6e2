#!/usr/bin/env bash
# Sets up a Debian (12 or newer) machine and runs Steradian.
#
#   ./setup.sh          install what is missing, build, render scenes/gallery.json to gallery.exr and gallery.png
#   ./setup.sh test     install what is missing, run all tests
#   ./setup.sh install  install what is missing, build with link-time optimization, put `steradian` into ~/.cargo/bin
#                       (both build for the processor of this machine)
#   ./setup.sh package  install what is missing, build, make a Debian package in target/debian
set -euo pipefail
cd "$(dirname "$0")"

case "${1:-render}" in
    render | test | install | package) ;;
    -h | --help) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "setup.sh: unknown command '$1' (render, test, install or package)" >&2; exit 2 ;;
esac

# Whether bindgen finds the library that it loads (libclang.so, libclang-14.so.1 or the like; libclang-cpp.so is another library).
has_libclang() {
    local file
    for file in ${LIBCLANG_PATH:+"$LIBCLANG_PATH"/libclang*.so*} /usr/lib/llvm-*/lib/libclang*.so* /usr/lib/*-linux-gnu*/libclang*.so* /usr/local/lib/libclang*.so*; do
        case "${file##*/}" in
            libclang-cpp*) ;;
            *) if [ -e "$file" ]; then return 0; fi ;;
        esac
    done
    return 1
}

# With the instructions of this machine, if it has them (AVX2 and others): a few per cent faster, with the same pictures.
build_for_this_machine() {
    local loader=/lib64/ld-linux-x86-64.so.2
    if [ -x "$loader" ] && "$loader" --help 2>/dev/null | grep 'x86-64-v3 (supported' >/dev/null; then
        export RUSTFLAGS="${RUSTFLAGS:-} -C target-cpu=x86-64-v3"
    fi
}

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }

# What the build needs, as Debian packages: a C compiler, libclang for bindgen, Embree's headers.
case "${1:-render}" in
    render) echo "Steradian: installs what is missing, builds (about 5 minutes with 2 cores), renders scenes/gallery.json (about a quarter of a minute) to $PWD/gallery.png and gallery.exr" >&2 ;;
    test) echo "Steradian: installs what is missing, builds and runs all tests (12 to 22 minutes with 2 cores)" >&2 ;;
esac
packages=()
command -v cc >/dev/null || packages+=(build-essential)
command -v curl >/dev/null || packages+=(curl ca-certificates)
has_libclang || packages+=(libclang-dev)
[ -e /usr/include/embree3/rtcore.h ] || [ -e /usr/include/embree4/rtcore.h ] || packages+=(libembree-dev)
if [ ${#packages[@]} -gt 0 ]; then
    echo "Installing: ${packages[*]}" >&2
    as_root apt-get update -qq
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null
fi

# Rust by rustup (Debian's own rustc is too old).
[ -e "$HOME/.cargo/env" ] && . "$HOME/.cargo/env"
if ! command -v cargo >/dev/null; then
    echo "Installing Rust" >&2
    curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y --profile minimal
    . "$HOME/.cargo/env"
fi

case "${1:-render}" in
    render)
        build_for_this_machine
        # Without benchmarks and their dependencies, which a render does not need.
        cargo run --release --locked --package steradian-cli --no-default-features -- render scenes/gallery.json -o gallery.exr -o gallery.png
        echo "The picture: $PWD/gallery.png (for a screen) and $PWD/gallery.exr (linear, for compositing)" >&2
        echo "The program: $PWD/target/release/steradian (./setup.sh install puts one with link-time optimization into ~/.cargo/bin)" >&2
        ;;
    # With the features of the Python module's dependencies, so that CI compiles the library once.
    test) cargo test --locked --workspace --exclude xtask --exclude steradian-benches ;;
    install)
        build_for_this_machine
        cargo install --locked --profile dist --path crates/cli
        ;;
    package)
        command -v cargo-deb >/dev/null || cargo install --locked cargo-deb
        command -v dpkg-shlibdeps >/dev/null || as_root apt-get install -y -qq --no-install-recommends dpkg-dev >/dev/null
        cargo build --profile dist --locked
        install -D target/dist/steradian target/release/steradian
        rm -rf target/man target/completions
        mkdir -p target/completions
        target/release/steradian man --dir target/man
        for shell in bash:steradian.bash zsh:_steradian fish:steradian.fish; do
            target/release/steradian completions "${shell%%:*}" >"target/completions/${shell#*:}"
        done
        cargo deb --no-build --locked --package steradian-cli
        ;;
esac
