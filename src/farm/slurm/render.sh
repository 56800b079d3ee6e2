#!/bin/bash
# Renders one shard of a picture, or of a frame: sbatch --array=1-@SHARDS@ render.sh [FRAME]
#SBATCH --job-name=@JOB@
#SBATCH --output=@LOG@
#SBATCH --open-mode=append
#SBATCH --ntasks=1
# A task of a node that fails, or that has to make room, is queued again; it goes on from its checkpoint.
#SBATCH --requeue
#SBATCH --signal=B:USR1@120
@SBATCH@
set -u
program=@PROGRAM@
scene=@SCENE@
folder=@FOLDER@
shards=@SHARDS@
retries=@RETRIES@
options=(@OPTIONS@)

frame=${1:-}
shard=$SLURM_ARRAY_TASK_ID
task=${SLURM_ARRAY_JOB_ID}_$shard
part="$folder/shards/${frame:+frame$frame.}$shard-of-$shards"
echo "$(date -u +%FT%TZ) task $task on ${SLURMD_NODENAME:-?}, started ${SLURM_RESTART_COUNT:-0} times before"

if [ -e "$part.shard" ]; then
    echo "complete already"
    exit 0
fi

# Slurm sends SIGUSR1 two minutes before the time limit, SIGTERM where a job that matters more needs the node: the render writes its
# checkpoint and ends, and the task is queued again.
signals=0
child=
trap 'signals=$((signals + 1)); [ -z "$child" ] || kill -TERM "$child" 2>/dev/null' USR1 TERM

# The render puts the frame's number in the place of the #.
name="$folder/shards/${frame:+frame#.}$shard-of-$shards"
"$program" render "$scene" ${frame:+"--frames=$frame"} "${options[@]}" --shard "$shard/$shards" -o "$name.shard" \
    --checkpoint "$name.checkpoint" --every @EVERY@ --resume --progress plain &
child=$!
# A signal ends `wait` before the render has ended, or tells of itself and not of the render.
while seen=$signals; wait "$child"; code=$?; [ "$signals" != "$seen" ]; do :; done

again() {
    echo "$1: queued again"
    scontrol requeue "$task"
}

if [ "$code" = 0 ]; then
    rm -f "$part.checkpoint" "$part.failures"
elif [ "$signals" != 0 ]; then
    # Who cancels a job does not want it back.
    case $(squeue --noheader --jobs="$task" --format=%T 2>/dev/null) in
        RUNNING | PREEMPTED | TIMEOUT) again "stopped" ;;
    esac
else
    case $code in
        # Wrong usage, a faulty scene, a missing file, a foreign checkpoint: these do not mend themselves.
        2 | 3 | 4 | 6) echo "failed with exit code $code" ;;
        *)
            failures=$(($(cat "$part.failures" 2>/dev/null || echo 0) + 1))
            echo "$failures" >"$part.failures"
            if [ "$failures" -le "$retries" ]; then
                again "failed with exit code $code, $failures of at most $((retries + 1)) times"
            else
                echo "failed with exit code $code, $failures times: given up"
            fi
            ;;
    esac
fi
exit "$code"
