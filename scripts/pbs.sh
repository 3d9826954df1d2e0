#!/bin/bash
#PBS -N parcontact
#PBS -l select=1:ncpus=2:mpiprocs=2
#PBS -l walltime=24:00:00
#PBS -j oe

# A history as a chain of PBS jobs: each runs until shortly before its time limit, saves, and submits the next one.
#
#   cp scripts/pbs.sh .               (and edit the lines above in the copy: qsub's options last for one job; with Torque,
#                                      nodes=1:ppn=2 instead of select)
#   qsub -v JOB=job.yaml pbs.sh       (from the directory that holds .venv, or with PARCONTACT_BIN naming its bin)
#
# More options for parcontact go into JOB too: JOB="job.yaml --quiet". To end the chain, delete the job: qdel <id>.

start=$(date +%s)
bin=${PARCONTACT_BIN:-$PBS_O_WORKDIR/.venv/bin}
cd "$PBS_O_WORKDIR" || exit 1

# PBS does not tell a job when it will end: now, and the time it may last.
limit=$(qstat -f "$PBS_JOBID" | sed -n 's/.*Resource_List.walltime = //p')
if [ -n "$limit" ]; then
    IFS=: read -r hours minutes seconds <<<"$limit"
    export PARCONTACT_END_TIME=$((start + 10#$hours * 3600 + 10#$minutes * 60 + 10#$seconds))
fi

# shellcheck disable=SC2086  # JOB is several words
"$bin/mpirun" -n "$(wc -l <"$PBS_NODEFILE")" "$bin/parcontact" $JOB
status=$?
if [ $status = 3 ]; then   # stopped early with a good checkpoint
    qsub -v JOB="$JOB",PARCONTACT_BIN="$bin" "$0" && exit 0
    echo "the next job was not submitted; submit it by hand to go on" >&2
fi
exit $status
