#!/bin/sh
#SBATCH --job-name=squirrel-study
#SBATCH --array=1-50
#SBATCH --cpus-per-task=4
#SBATCH --time=01:00:00
#SBATCH --requeue
# A study as an array of jobs, each of which flies its part into a folder of its own:
#
#     sbatch examples/slurm/study.sh OUT forest --trials 1000 --arms pc,phantom,twcc_plus
#     squirrel study merge OUT/part-* --out OUT/whole        when all of them are done
#
# What comes out has the bytes of the study in one go. A job that was stopped or is sent again goes on from the trials in its folder;
# another number of parts takes another OUT. The array must count from 1.
set -eu
out=$1
shift
if [ "$SLURM_ARRAY_TASK_MIN" -ne 1 ] || [ "$SLURM_ARRAY_TASK_MAX" -ne "$SLURM_ARRAY_TASK_COUNT" ]; then
    echo "--array=$SLURM_ARRAY_TASK_MIN-$SLURM_ARRAY_TASK_MAX: must be 1-N" >&2
    exit 2
fi
export RAYON_NUM_THREADS="${SLURM_CPUS_PER_TASK:-1}"
part="$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"
exec "${SQUIRREL:-squirrel}" study "$@" --shard "$part" --out "$out/part-$SLURM_ARRAY_TASK_ID"
