#!/bin/bash
# Merges the shards of a picture, or of a frame, when all are there: sbatch --dependency=afterok:ARRAY merge.sh "[FRAME]" OUTPUT...
#SBATCH --job-name=@JOB@-merge
#SBATCH --output=@LOG@
#SBATCH --open-mode=append
#SBATCH --ntasks=1
#SBATCH --requeue
@SBATCH@
set -u
program=@PROGRAM@
folder=@FOLDER@
shards=@SHARDS@

frame=$1
shift
outputs=()
for output in "$@"; do outputs+=(-o "$output"); done
parts=()
for ((i = 1; i <= shards; i++)); do parts+=("$folder/shards/${frame:+frame$frame.}$i-of-$shards.shard"); done

# Started again, it finds what it had done.
merged="$folder/shards/${frame:+frame$frame.}merged"
if [ ! -e "$merged" ]; then
    "$program" merge "${parts[@]}" "${outputs[@]}" || exit
    touch "$merged"
fi
rm -f "${parts[@]}"
