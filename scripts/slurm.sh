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
# PARCONTACT_LAUNCHER starts the ranks: the mpirun beside parcontact unless you say otherwise, like
#
#   PARCONTACT_LAUNCHER="srun --mpi=pmix" sbatch slurm.sh job.yaml
#
# In a job array %a stands for the index, and each of its jobs is a chain of its own:
#
#   sbatch --array=1-8 slurm.sh job.yaml --set surface.0.seed=%a --out out/seed-%a
#   sbatch --array=0-8 slurm.sh job.yaml --case %a            (the nine cases of a job with a sweep)
#
# The end of a job is SLURM_JOB_END_TIME, which parcontact knows. To end the chain, cancel the job: scancel <id>.

# Modules that your machine needs to run parcontact go here:
# module load openmpi

cd "$SLURM_SUBMIT_DIR" || exit 1
bin=${PARCONTACT_BIN:-$SLURM_SUBMIT_DIR/.venv/bin}
[ -x "$bin/parcontact" ] || bin=$(dirname "$(type -P parcontact)")
[ -x "$bin/parcontact" ] || { echo "no parcontact: set PARCONTACT_BIN to the directory that it is in" >&2; exit 2; }
launcher=mpirun
[ -x "$bin/mpirun" ] && launcher=$bin/mpirun

# Newer Slurms set this themselves; with others, what is there would be that of the job that has submitted this one.
end=$(squeue --noheader --job "$SLURM_JOB_ID" --format %e)
SLURM_JOB_END_TIME=$(date -d "$end" +%s) && export SLURM_JOB_END_TIME

# The next job goes on where this one ends, wherever this one was told to begin; so does one that Slurm has requeued.
words=("${@//%a/${SLURM_ARRAY_TASK_ID:-%a}}") next=() skip=''
for word in "${words[@]}"; do
    case $skip$word in
        --r|--re|--res|--rest|--resta|--restar|--restart) skip=' ' ;;
        --r=*|--re=*|--res=*|--rest=*|--resta=*|--restar=*|--restart=*) ;;
        ' '*) skip='' ;;
        *) next+=("$word") ;;
    esac
done
[ "${SLURM_RESTART_COUNT:-0}" = 0 ] || words=("${next[@]}")

# Launchers may end with a code of their own: parcontact leaves its code in a file too.
export PARCONTACT_EXIT_FILE=$SLURM_SUBMIT_DIR/.parcontact-exit-$SLURM_JOB_ID
# shellcheck disable=SC2086  # a launcher may have options
${PARCONTACT_LAUNCHER:-"$launcher"} -n "$SLURM_NTASKS" "$bin/parcontact" "${words[@]}"
status=$?
[ -s "$PARCONTACT_EXIT_FILE" ] && status=$(<"$PARCONTACT_EXIT_FILE")
rm -f "$PARCONTACT_EXIT_FILE"
if [ "$status" = 3 ]; then   # stopped early with a good checkpoint
    sbatch ${SLURM_ARRAY_TASK_ID:+--array="$SLURM_ARRAY_TASK_ID"} "$0" "${next[@]}" && exit 0
    echo "the next job was not submitted; submit it by hand to go on" >&2
fi
exit "$status"
