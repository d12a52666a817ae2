#!/bin/sh
# Start a Slurm of one node, this machine, for tests: tests/slurm/start.sh FOLDER
# Needs root, and Debian's slurm-wlm and munge (apt-get install slurm-wlm munge). Then
#   SLURM_CONF=FOLDER/slurm.conf python -m pytest -m slurm
# and tests/slurm/stop.sh FOLDER ends it. Nothing outside FOLDER and /run/munge is written.
set -eu
folder=$(mkdir -p "$1" && cd "$1" && pwd)
mkdir -p "$folder/state" "$folder/spool"
node=$(hostname -s)
facts=$(slurmd -C | head -1 | sed 's/^NodeName=[^ ]* //')
cat > "$folder/slurm.conf" <<CONF
ClusterName=test
SlurmctldHost=$node(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=1,bf_interval=1
ReturnToService=2
MpiDefault=none
NodeName=$node NodeAddr=127.0.0.1 $facts State=UNKNOWN
PartitionName=cpu Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
install -d -o munge -g munge -m 755 /run/munge
runuser -u munge -- /usr/sbin/munged --pid-file=/run/munge/munged.pid || true # it may run already
SLURM_CONF="$folder/slurm.conf"
export SLURM_CONF
slurmctld -c
slurmd -c
for _ in $(seq 60); do
  sinfo --noheader --format=%T 2>/dev/null | grep -q idle && break
  sleep 1
done
sinfo
