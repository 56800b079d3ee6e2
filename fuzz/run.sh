#!/usr/bin/env bash
# Fuzzes the readers: each for as many seconds as the first argument says (default 1200), all kinds or those named.
#   fuzz/run.sh [SECONDS [KIND...]]
# Needs a nightly toolchain and cargo-fuzz (cargo install cargo-fuzz). What is found lies in fuzz/artifacts; the corpus, in fuzz/corpus, is
# made small again at the end of each.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-1200}
shift || true
kinds=${*:-scene_json obj ply image mitsuba_xml pbrt gltf recipe}

for kind in $kinds; do
    mkdir -p "fuzz/corpus/$kind"
    # The image target holds decoded pixels, which are many for their file.
    cargo +nightly fuzz run "$kind" "fuzz/corpus/$kind" -- -max_total_time="$seconds" -timeout=10 -rss_limit_mb=6000 -max_len=16384 -use_value_profile=1
    cargo +nightly fuzz cmin "$kind" "fuzz/corpus/$kind" -- -timeout=10 -rss_limit_mb=6000 -max_len=16384
done
