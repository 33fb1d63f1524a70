#!/usr/bin/env bash
# Starts a Slurm of one node from the distribution's packages, for trying docs/cluster/slurm.sh
# without a cluster. As root, on Debian or Ubuntu:
#
#   apt-get install -y slurm-wlm munge
#   . docs/cluster/one_node_slurm.sh /tmp/slurm     # sets SLURM_CONF
#   sinfo
#
# Stop it with: kill $(pidof slurmctld slurmd munged)
folder=${1:-/tmp/slurm}
host=$(hostname -s)
mkdir -p "$folder"/{spool,state,log} /run/munge
chown munge: /run/munge
[ -s /etc/munge/munge.key ] || /usr/sbin/create-munge-key -f >/dev/null
chown munge: /etc/munge/munge.key
pgrep -x munged >/dev/null || setpriv --reuid munge --regid munge --clear-groups /usr/sbin/munged
cat >"$folder/slurm.conf" <<CONF
ClusterName=one
SlurmctldHost=$host
AuthType=auth/munge
SlurmUser=root
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
SlurmdSpoolDir=$folder/spool
StateSaveLocation=$folder/state
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/log/slurmctld.log
SlurmdLogFile=$folder/log/slurmd.log
NodeName=$host CPUs=$(nproc) RealMemory=2000 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$folder/slurm.conf
pgrep -x slurmctld >/dev/null || slurmctld
pgrep -x slurmd >/dev/null || slurmd
