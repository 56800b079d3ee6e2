#!/usr/bin/env bash
# Checks the crates as they would be published: their sizes, their files, that they compile from these alone, and that their documentation compiles,
# that of private items too, the library's as on docs.rs, without Embree and libclang.
#
#   tools/check_package.sh          type-checks the unpacked crates
#   tools/check_package.sh build    builds them, as `cargo publish` does
set -euo pipefail
cd "$(dirname "$0")/.."
limit=$((10 * 1000 * 1000)) # crates.io: 10 MB
case "${1:-check}" in check | build) ;; *) sed -n '5,6s/^# \{0,1\}//p' "$0" >&2; exit 2 ;; esac
fail() { echo "check_package.sh: $*" >&2; exit 1; }

# A work tree with changes is packaged as it is.
packages=(steradian steradian-bench steradian-cli)
cargo package --locked --allow-dirty --no-verify "${packages[@]/#/--package=}"

# Outside of the repository, so that nothing of it is found; with its compiled dependencies, and the crates for each other in place of a registry.
target=${CARGO_TARGET_DIR:-$PWD/target}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)
aside=$(mktemp -d)
trap 'rm -rf "$aside"' EXIT
for package in "${packages[@]}"; do
    crate=$target/package/$package-$version.crate
    files=$(tar -tzf "$crate")
    size=$(stat -c %s "$crate")
    echo "$(basename "$crate"): $(wc -l <<<"$files") files, $size bytes"
    [ "$size" -lt "$limit" ] || fail "more than $limit bytes"
    needed=(LICENSE-MIT LICENSE-APACHE README.md)
    [ "$package" = steradian ] && needed+=(build.rs ffi/embree_docs.rs)
    for file in "${needed[@]}"; do
        grep -q "/$file\$" <<<"$files" || fail "$file is missing in $package"
    done
    tar -xzf "$crate" -C "$aside"
    mv "$aside/$package-$version" "$aside/$package"
    rm "$aside/$package/Cargo.lock"
done
{
    printf '[workspace]\nresolver = "3"\nmembers = ["steradian*"]\n[patch.crates-io]\n'
    for package in steradian steradian-bench; do echo "$package = { path = \"$package\" }"; done
    sed -n '/^\[profile/,$p' Cargo.toml
} >"$aside/Cargo.toml"
cp Cargo.lock "$aside"
cd "$aside"
cargo "${1:-check}" --offline --workspace --target-dir "$target"

export RUSTDOCFLAGS="-D warnings"
document() { cargo doc --offline --no-deps --lib --target-dir "$target" "$@"; }
document --document-private-items --package steradian --package steradian-bench
# As docs.rs shows it, which has a C compiler, but neither Embree nor libclang: wrong paths do no harm.
DOCS_RS=1 EMBREE_DIR=/nonexistent LIBCLANG_PATH=/nonexistent document --package steradian
