#!/usr/bin/env bash
# Embree through the shim against bare loops in C over the same recorded rays and mesh: both programs in turn, medians over the rounds.
# usage: benches/bare_embree.sh [ROUNDS] [RESOLUTION] [PASSES]     (default 5 512 10; quick: 1 128 2)
# CC, CFLAGS (default -O3) and STERADIAN_SCANS (the folder of bunny.ply and dragon_res2.ply, default scenes/scans) are its variables.
set -euo pipefail
cd "$(dirname "$0")/.."
rounds=${1:-5} resolution=${2:-512} passes=${3:-10}
[ -e /usr/include/embree3/rtcore.h ] || { echo "bare_embree.sh: the loops in C are written for Embree 3 (Debian 12: libembree-dev)" >&2; exit 1; }
aside=$(mktemp -d)
trap 'rm -rf "$aside"' EXIT
shim=$(cargo bench --locked --package steradian-benches --bench shim --no-run 2>&1 | tee /dev/stderr | sed -n 's/.*Executable.*(\(.*\))$/\1/p')
# shellcheck disable=SC2086
${CC:-cc} ${CFLAGS:--O3} -std=gnu11 -Wall -Wextra -o "$aside/bare" benches/bare_embree/main.c -lembree3
"$shim" dump "$aside" "$resolution"
for ((round = 0; round < rounds; round++)); do
    for file in "$aside"/*.rays; do
        model=$(basename "$file" .rays)
        "$aside/bare" trace "$file" "$passes" | sed "s/^/$model bare /" >>"$aside/times"
        "$shim" trace "$file" "$passes" | sed "s/^/$model shim /" >>"$aside/times"
    done
done
awk -v rounds="$rounds" '
    function median(key,  i, j, t, n, list) {
        n = split(times[key], list, " ")
        for (i = 2; i <= n; i++) for (j = i; j > 1 && list[j] + 0 < list[j - 1] + 0; j--) { t = list[j]; list[j] = list[j - 1]; list[j - 1] = t }
        return (list[int((n + 1) / 2)] + list[int(n / 2) + 1]) / 2
    }
    {
        key = $1 " " $3 " " $4
        if (!(key in seen)) { seen[key] = $6 " " $7; order[++count] = key }
        if (seen[key] != $6 " " $7) { print "answers differ: " $0; bad = 1 }
        times[key " " $2] = times[key " " $2] " " $5
    }
    END {
        print "model  rays    query                bare ns  shim ns  difference  shim/bare rate"
        for (i = 1; i <= count; i++) {
            split(order[i], part, " ")
            bare = median(order[i] " bare"); shim = median(order[i] " shim")
            printf "%-6s %-7s %-20s %7.2f  %7.2f  %10.2f  %12.1f %%\n", part[1], part[2], part[3], bare, shim, shim - bare, 100 * bare / shim
        }
        exit bad
    }' "$aside/times"
