#!/usr/bin/env bash
# Checks the crate as it would be published: its size, its files, that it compiles from them alone, and that its documentation compiles as on
# docs.rs, without Embree and libclang.
#
#   tools/check_package.sh          type-checks the library and the program of the unpacked crate
#   tools/check_package.sh build    builds them, as `cargo publish` does
set -euo pipefail
cd "$(dirname "$0")/.."
limit=$((10 * 1000 * 1000)) # crates.io: 10 MB
case "${1:-check}" in check | build) ;; *) sed -n '5,6s/^# \{0,1\}//p' "$0" >&2; exit 2 ;; esac
fail() { echo "check_package.sh: $*" >&2; exit 1; }

# A work tree with changes is packaged as it is.
cargo package --locked --allow-dirty --no-verify --package steradian
crate=$(ls -t target/package/steradian-*.crate | head -1)
files=$(tar -tzf "$crate")
size=$(stat -c %s "$crate")
echo "$(basename "$crate"): $(wc -l <<<"$files") files, $size bytes"
[ "$size" -lt "$limit" ] || fail "more than $limit bytes"
for file in LICENSE-MIT LICENSE-APACHE README.md build.rs ffi/embree_docs.rs; do
    grep -q "/$file\$" <<<"$files" || fail "$file is missing in the crate"
done

# Outside of the repository, so that nothing of it is found; with its compiled dependencies.
target=${CARGO_TARGET_DIR:-$PWD/target}
aside=$(mktemp -d)
trap 'rm -rf "$aside"' EXIT
tar -xzf "$crate" -C "$aside"
cd "$aside"/steradian-*
cargo "${1:-check}" --locked --target-dir "$target"

# docs.rs has a C compiler, but neither Embree nor libclang: wrong paths do no harm.
DOCS_RS=1 EMBREE_DIR=/nonexistent LIBCLANG_PATH=/nonexistent cargo doc --locked --no-deps --lib --target-dir "$target"
