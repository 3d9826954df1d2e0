#!/bin/bash
#SBATCH --job-name=parcontact
#SBATCH --nodes=1
#SBATCH --ntasks-per-node=2
#SBATCH --cpus-per-task=1
#SBATCH --time=24:00:00
#SBATCH --output=slurm-%x.out
#SBATCH --open-mode=append

# A history as a chain of Slurm jobs: each runs until shortly before its time limit, saves, and submits the next one.
#
#   cp scripts/slurm.sh .       (and edit the lines above in the copy: options on sbatch's command line last for one job)
#   sbatch slurm.sh job.yaml    (from the directory that holds .venv, or with PARCONTACT_BIN naming its bin)
#
# The end of a job is SLURM_JOB_END_TIME, which parcontact knows. To end the chain, cancel the job: scancel <id>.

bin=${PARCONTACT_BIN:-$SLURM_SUBMIT_DIR/.venv/bin}

# Newer Slurms set this themselves; with others, what is there would be that of the job that has submitted this one.
end=$(squeue --noheader --job "$SLURM_JOB_ID" --format %e)
SLURM_JOB_END_TIME=$(date -d "$end" +%s) && export SLURM_JOB_END_TIME

"$bin/mpirun" -n "$SLURM_NTASKS" "$bin/parcontact" "$@"
status=$?
if [ $status = 3 ]; then   # stopped early with a good checkpoint
    cd "$SLURM_SUBMIT_DIR" && sbatch "$0" "$@" && exit 0
    echo "the next job was not submitted; submit it by hand to go on" >&2
fi
exit $status
