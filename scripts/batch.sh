#!/bin/bash
#SBATCH --job-name=parcontact
#SBATCH --nodes=1
#SBATCH --ntasks-per-node=2
#SBATCH --cpus-per-task=1
#SBATCH --time=24:00:00
#SBATCH --output=slurm-%x.out
#SBATCH --open-mode=append
#PBS -N parcontact
#PBS -l select=1:ncpus=2:mpiprocs=2
#PBS -l walltime=24:00:00
#PBS -j oe

# A history as a chain of jobs of Slurm or PBS: each runs until shortly before its time limit, saves, and submits the
# next one. Copy this file and edit the lines above in the copy, as options on the command line last for one job
# (with Torque, nodes=1:ppn=2 instead of select). Submit it from the directory that holds .venv, or with PARCONTACT_BIN
# naming its bin. PARCONTACT_LAUNCHER starts the ranks: the mpirun beside parcontact unless you say otherwise.
#
#   sbatch batch.sh job.yaml
#   PARCONTACT_LAUNCHER="srun --mpi=pmix" sbatch batch.sh job.yaml
#   JOB=job.yaml qsub -v JOB batch.sh              (more options go into JOB too, names with spaces in quotes)
#   JOB=job.yaml PARCONTACT_LAUNCHER="mpiexec --bind-to core" qsub -v JOB,PARCONTACT_LAUNCHER batch.sh
#
# In a job array %a stands for the index, and each of its jobs is a chain of its own:
#
#   sbatch --array=1-8 batch.sh job.yaml --set surface.0.seed=%a --out out/seed-%a
#   JOB="job.yaml --case %a" qsub -J 0-8 -v JOB batch.sh       (the nine cases of a job with a sweep; with Torque, -t 0-8)
#
# To end the chain, cancel the job: scancel <id>, qdel <id>.

# Modules that your machine needs to run parcontact go here:
# module load openmpi

start=$(date +%s) slurm=${SLURM_JOB_ID:-}
[ "$slurm${PBS_JOBID:-}" ] || { echo "submit this script: sbatch $0 job.yaml, or JOB=job.yaml qsub -v JOB $0" >&2; exit 2; }
there=${SLURM_SUBMIT_DIR:-${PBS_O_WORKDIR:-.}}
cd "$there" || exit 1
# the jobs of an array would all append to the file of the first of them
[ "${SLURM_ARRAY_TASK_ID:-}" ] && exec >>"slurm-${SLURM_JOB_NAME:-parcontact}-$SLURM_ARRAY_TASK_ID.out" 2>&1
bin=${PARCONTACT_BIN:-$there/.venv/bin}
[ -x "$bin/parcontact" ] || bin=$(dirname "$(type -P parcontact)")
[ -x "$bin/parcontact" ] || { echo "no parcontact: set PARCONTACT_BIN to the directory that it is in" >&2; exit 2; }
launcher=mpirun
[ -x "$bin/mpirun" ] && launcher=$bin/mpirun

if [ "$slurm" ]; then   # newer Slurms set its end themselves; with others it would be that of the job before
    ranks=$SLURM_NTASKS words=("${@//%a/${SLURM_ARRAY_TASK_ID:-%a}}")
    SLURM_JOB_END_TIME=$(date -d "$(squeue --noheader --job "$slurm" --format %e)" +%s) && export SLURM_JOB_END_TIME
else   # PBS does not tell a job when it will end: now, and the time it may last
    ranks=$(wc -l <"$PBS_NODEFILE") limit=$(qstat -f "$PBS_JOBID" | sed -n 's/.*Resource_List.walltime = //p')
    if [ "$limit" ]; then
        IFS=: read -r hours minutes seconds <<<"$limit"
        export PARCONTACT_END_TIME=$((start + 10#$hours * 3600 + 10#$minutes * 60 + 10#$seconds))
    fi
    index=${PBS_ARRAY_INDEX:-${PBS_ARRAYID:-%a}}   # JOB is a file of this name, or words, which may be in quotes
    if [ -f "$JOB" ]; then words=("$JOB"); else mapfile -t words < <(xargs -n 1 printf '%s\n' <<<"${JOB//%a/$index}"); fi
fi

# Launchers may end with a code of their own: parcontact leaves its code in a file, and the words of the command that goes
# on, a line each.
export PARCONTACT_EXIT_FILE=$there/.parcontact-exit-${slurm:-$PBS_JOBID}
# shellcheck disable=SC2086  # a launcher may have options
${PARCONTACT_LAUNCHER:-"$launcher"} -n "$ranks" "$bin/parcontact" "${words[@]}"
status=$?
next=()
[ -s "$PARCONTACT_EXIT_FILE" ] && mapfile -t next <"$PARCONTACT_EXIT_FILE" && status=${next[0]} next=("${next[@]:1}")
rm -f "$PARCONTACT_EXIT_FILE"
[ "$status" = 3 ] || exit "$status"   # 3: stopped early with a good checkpoint
if [ "$slurm" ]; then
    sbatch ${SLURM_ARRAY_TASK_ID:+--array="$SLURM_ARRAY_TASK_ID"} "$0" "${next[@]}" && exit 0
else
    JOB=$(printf '%q ' "${next[@]}") PARCONTACT_BIN=$bin
    export JOB PARCONTACT_BIN   # qsub takes the values from here: no comma or space in them can do harm
    qsub -v "JOB,PARCONTACT_BIN${PARCONTACT_LAUNCHER:+,PARCONTACT_LAUNCHER}" "$0" && exit 0
fi
echo "the next job was not submitted; submit it by hand to go on" >&2
exit 3
