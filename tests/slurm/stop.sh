#!/bin/sh
# End what tests/slurm/start.sh started: tests/slurm/stop.sh FOLDER
set -u
for name in slurmd slurmctld; do
  test -f "$1/$name.pid" && kill "$(cat "$1/$name.pid")"
done
test -f /run/munge/munged.pid && kill "$(cat /run/munge/munged.pid)"
exit 0
