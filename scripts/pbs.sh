#!/bin/bash
#PBS -N parcontact
#PBS -l select=1:ncpus=2:mpiprocs=2
#PBS -l walltime=24:00:00
#PBS -j oe

# A history as a chain of PBS jobs: each runs until shortly before its time limit, saves, and submits the next one.
#
#   cp scripts/pbs.sh .               (and edit the lines above in the copy: qsub's options last for one job; with Torque,
#                                      nodes=1:ppn=2 instead of select)
#   JOB=job.yaml qsub -v JOB pbs.sh   (from the directory that holds .venv, or with PARCONTACT_BIN naming its bin)
#
# More options for parcontact go into JOB too, names with spaces in quotes: JOB="'my job.yaml' --quiet".
# PARCONTACT_LAUNCHER starts the ranks: the mpirun beside parcontact unless you say otherwise. Name what you set:
#
#   JOB=job.yaml PARCONTACT_LAUNCHER="mpiexec --bind-to core" qsub -v JOB,PARCONTACT_LAUNCHER pbs.sh
#
# In a job array %a stands for the index, and each of its jobs is a chain of its own:
#
#   JOB="job.yaml --set surface.0.seed=%a --out out/seed-%a" qsub -J 1-8 -v JOB pbs.sh     (with Torque, -t 1-8)
#   JOB="job.yaml --case %a" qsub -J 0-8 -v JOB pbs.sh        (the nine cases of a job with a sweep)
#
# To end the chain, delete the job: qdel <id>.

# Modules that your machine needs to run parcontact go here:
# module load openmpi

start=$(date +%s)
cd "$PBS_O_WORKDIR" || exit 1
bin=${PARCONTACT_BIN:-$PBS_O_WORKDIR/.venv/bin}
[ -x "$bin/parcontact" ] || bin=$(dirname "$(type -P parcontact)")
[ -x "$bin/parcontact" ] || { echo "no parcontact: set PARCONTACT_BIN to the directory that it is in" >&2; exit 2; }
launcher=mpirun
[ -x "$bin/mpirun" ] && launcher=$bin/mpirun

# PBS does not tell a job when it will end: now, and the time it may last.
limit=$(qstat -f "$PBS_JOBID" | sed -n 's/.*Resource_List.walltime = //p')
if [ -n "$limit" ]; then
    IFS=: read -r hours minutes seconds <<<"$limit"
    export PARCONTACT_END_TIME=$((start + 10#$hours * 3600 + 10#$minutes * 60 + 10#$seconds))
fi

# A file of this name, or words, which may be in quotes.
index=${PBS_ARRAY_INDEX:-${PBS_ARRAYID:-%a}}
if [ -f "$JOB" ]; then words=("$JOB"); else mapfile -t words < <(xargs -n 1 printf '%s\n' <<<"${JOB//%a/$index}"); fi

# The next job goes on where this one ends, wherever this one was told to begin.
next=() skip=''
for word in "${words[@]}"; do
    case $skip$word in
        --r|--re|--res|--rest|--resta|--restar|--restart) skip=' ' ;;
        --r=*|--re=*|--res=*|--rest=*|--resta=*|--restar=*|--restart=*) ;;
        ' '*) skip='' ;;
        *) next+=("$word") ;;
    esac
done

# Launchers may end with a code of their own: parcontact leaves its code in a file too.
export PARCONTACT_EXIT_FILE=$PBS_O_WORKDIR/.parcontact-exit-$PBS_JOBID
# shellcheck disable=SC2086  # a launcher may have options
${PARCONTACT_LAUNCHER:-"$launcher"} -n "$(wc -l <"$PBS_NODEFILE")" "$bin/parcontact" "${words[@]}"
status=$?
[ -s "$PARCONTACT_EXIT_FILE" ] && status=$(<"$PARCONTACT_EXIT_FILE")
rm -f "$PARCONTACT_EXIT_FILE"
if [ "$status" = 3 ]; then   # stopped early with a good checkpoint
    JOB=$(printf '%q ' "${next[@]}") PARCONTACT_BIN=$bin
    export JOB PARCONTACT_BIN   # qsub takes the values from here: no comma or space in them can do harm
    qsub -v "JOB,PARCONTACT_BIN${PARCONTACT_LAUNCHER:+,PARCONTACT_LAUNCHER}" "$0" && exit 0
    echo "the next job was not submitted; submit it by hand to go on" >&2
fi
exit "$status"
