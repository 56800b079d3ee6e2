#!/bin/bash
# Submits the job; run again, it submits what is missing. @SUMMARY@
set -euo pipefail
folder=@FOLDER@
overwrite=@OVERWRITE@
mkdir -p "$folder/shards" "$folder/log"

# submit FRAME OUTPUT...: an array of shards, and the job that merges them when all have been rendered.
submit() {
    local frame=$1 output array merge missing=
    local name="${frame:+frame $frame: }"
    for output in "${@:2}"; do [ -e "$output" ] || missing=1; done
    if [ -z "$missing$overwrite" ]; then
        echo "${name}there already"
        return
    fi
    rm -f "$folder/shards/${frame:+frame$frame.}"merged "$folder/shards/${frame:+frame$frame.}"*.failures
    array=$(sbatch --parsable --array=1-@SHARDS@ "$folder/render.sh" $frame)
    merge=$(sbatch --parsable --dependency="afterok:${array%%;*}" --kill-on-invalid-dep=yes "$folder/merge.sh" "$frame" "${@:2}")
    echo "${name}array ${array%%;*}, merge ${merge%%;*}"
}

@SUBMIT@
