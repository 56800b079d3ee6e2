#!/usr/bin/env bash
# Samples per second beside Mitsuba 3 on the same scenes, interleaved, with set-up taken out; see docs/performance.md.
# usage: benches/peers.sh [PEERS]   PEERS (default ../shared/peers) holds sidebyside.py, which also says how the peers are installed.
# SCENES=cornell,glass,bunny_x ROUNDS=3 ONLY=mitsuba are its own variables; the meshes are read from PEERS/../scenes/common.
set -euo pipefail
cd "$(dirname "$0")/.."
peers=${1:-../shared/peers}
[ -e "$peers/sidebyside.py" ] || { echo "peers.sh: $peers/sidebyside.py is missing" >&2; exit 1; }
cargo build --release --locked
here=$PWD
export SCENES=${SCENES:-cornell,glass,bunny_x} ROUNDS=${ROUNDS:-3} ONLY=${ONLY-mitsuba}
export EXTRA="steradian=sh -c 'exec $here/target/release/steradian render $here/benches/scenes/\$(basename {scene}).json --spp {spp} --threads 2 -q -o {out} --json {stats}'"
exec python3 "$peers/sidebyside.py"
