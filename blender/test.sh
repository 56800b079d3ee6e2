#!/usr/bin/env bash
# Installs Blender as a Python module into a new environment, and the add-on into it, and runs its tests there.
#   blender/test.sh [WHEEL]       (WHEEL: test with this one, in place of building it)
# BPY is the version of Blender (5.0.1); PYTHON is a Python that it exists for (python3.11). Needs no display.
set -euo pipefail
cd "$(dirname "$0")"
environment=$(mktemp -d)
trap 'rm -rf "$environment"' EXIT
zip=$(./build.sh "$@" | tail -n 1)
"${PYTHON:-python3.11}" -m venv "$environment"
"$environment/bin/pip" install --quiet "bpy==${BPY:-5.0.1}" pytest
STERADIAN_ZIP=$zip BLENDER_USER_RESOURCES=$environment/user \
    "$environment/bin/python" -m pytest --quiet -p no:cacheprovider tests
