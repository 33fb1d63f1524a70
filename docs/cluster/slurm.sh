#!/usr/bin/env bash
# A sweep of compare_controllers as a Slurm array: one task a shard.
#
#   sbatch --array=1-8 docs/cluster/slurm.sh out/sweep --levels heavy --draws 64
#   compare_controllers --merge out/sweep/shard*/ --out out/sweep/merged
#
# A task that was killed is run again by `sbatch --array=3 ...` with the same --array-size:
#   SHARDS=8 sbatch --export=ALL --array=3 docs/cluster/slurm.sh out/sweep --levels heavy --draws 64
#SBATCH --job-name=compare
#SBATCH --cpus-per-task=1
#SBATCH --requeue
set -euo pipefail
out=$1
shift
program=${COMPARE:-target/release/examples/compare_controllers}
part=$SLURM_ARRAY_TASK_ID of=${SHARDS:-$SLURM_ARRAY_TASK_COUNT}
exec "$program" --threads "${SLURM_CPUS_PER_TASK:-1}" --resume --shard "$part/$of" \
  --out "$out/shard$part" "$@"
