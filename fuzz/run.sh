#!/usr/bin/env bash
# Fuzzes the readers: each for as many seconds as the first argument gives (default 1200), all kinds or those named.
#   fuzz/run.sh [SECONDS [KIND...]]
# Needs a nightly toolchain and cargo-fuzz (cargo install cargo-fuzz). Findings are in fuzz/artifacts. The corpus, fuzz/corpus.tar.gz, is unpacked
# to fuzz/corpus, minimised after each kind, and packed again at the end; tests/regressions has further files to begin with.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-1200}
shift || true
kinds=${*:-scene_json obj ply strands image mitsuba_xml pbrt gltf recipe config volume vdb measured}

[ -d fuzz/corpus ] || tar -xzf fuzz/corpus.tar.gz -C fuzz
for kind in $kinds; do
    mkdir -p "fuzz/corpus/$kind"
    # The image target holds decoded pixels, which are many for their file.
    cargo +nightly fuzz run "$kind" "fuzz/corpus/$kind" "tests/regressions/$kind" -- -max_total_time="$seconds" -timeout=10 -rss_limit_mb=6000 -max_len=16384 -use_value_profile=1
    cargo +nightly fuzz cmin "$kind" "fuzz/corpus/$kind" -- -timeout=10 -rss_limit_mb=6000 -max_len=16384
done
# The same files make the same archive.
tar --sort=name --mtime=@0 --owner=0 --group=0 --numeric-owner --mode=a=rX,u+w -C fuzz -cf - corpus | gzip -n9 >fuzz/corpus.tar.gz.part
mv fuzz/corpus.tar.gz.part fuzz/corpus.tar.gz
