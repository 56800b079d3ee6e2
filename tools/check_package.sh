#!/usr/bin/env bash
# Checks the crate as it would be published: its size, that it builds from its own files, and that its documentation builds as on docs.rs,
# without Embree and libclang.
#
#   tools/check_package.sh        --locked builds offline if the dependencies are there: CARGO_NET_OFFLINE=true
set -euo pipefail
cd "$(dirname "$0")/.."
limit=$((10 * 1000 * 1000)) # crates.io: 10 MB

# A work tree with changes is packaged as it is.
cargo package --locked --allow-dirty --no-verify --package steradian
crate=$(ls -t target/package/steradian-*.crate | head -1)
size=$(stat -c %s "$crate")
echo "$(basename "$crate"): $(tar -tzf "$crate" | wc -l) files, $size bytes"
[ "$size" -lt "$limit" ] || { echo "check_package.sh: more than $limit bytes" >&2; exit 1; }
for file in LICENSE-MIT LICENSE-APACHE README.md build.rs ffi/embree_docs.rs; do
    tar -tzf "$crate" | grep -q "/$file\$" || { echo "check_package.sh: $file is missing in the crate" >&2; exit 1; }
done

# It compiles from its own files.
unpacked=$(mktemp -d)
trap 'rm -rf "$unpacked"' EXIT
tar -xzf "$crate" -C "$unpacked" --strip-components=1
target=${CARGO_TARGET_DIR:-$PWD/target}
(cd "$unpacked" && cargo check --locked --target-dir "$target")

# Neither is looked for on docs.rs, so that wrong paths do no harm.
(cd "$unpacked" && DOCS_RS=1 EMBREE_DIR=/nonexistent LIBCLANG_PATH=/nonexistent CC=/nonexistent cargo doc --locked --no-deps --lib --target-dir "$target")
