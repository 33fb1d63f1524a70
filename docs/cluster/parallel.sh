#!/usr/bin/env bash
# A sweep of compare_controllers under GNU parallel: N shards on this machine, or on others that
# share the folder (option --sshlogin of parallel). A shard that fails or is killed is run again and
# goes on where it stopped.
#
#   docs/cluster/parallel.sh 4 out/sweep --levels heavy --draws 64
set -euo pipefail
shards=$1 out=$2
shift 2
program=${COMPARE:-target/release/examples/compare_controllers}
mkdir -p "$out"
seq "$shards" | parallel --retries 3 --joblog "$out/jobs.log" \
  "$program" --threads 1 --resume --shard {}/"$shards" --out "$out/shard{}" "$@" \
  '>' "$out/shard{}.log" '2>&1'
"$program" --merge "$out"/shard*/ --out "$out/merged"
