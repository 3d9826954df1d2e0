"""What else may happen to a run, for faults.py: races, planted links, files that vanish, locks, wishes, narrow limits.

After each the same command must finish with the undisturbed result; no exit code but those of the README, no traceback.
"""

import fcntl
import os
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from faults import Campaign

LINKS = (".lock", "fields.xdmf", "job.resolved.yaml", "job.yaml", "picture.png")
VANISHING = ("fields.xdmf", "run.log", "job.yaml", "job.resolved.yaml", ".lock", ".parcontact")
LIMITS = {"f": (1, 6000), "n": (8, 60), "v": (200_000, 1_500_000)}  # of ulimit: kB of a file, open files, kB of memory
CODES = (0, 1, 2, 3)


def race(campaign: "Campaign", trial: int) -> None:
    """Two runs begin together in a new directory: one runs, the other is refused or finds it finished."""
    out = campaign.where / f"race{trial}"
    both = [campaign.start(out), campaign.start(out)]
    codes = sorted(process.wait(600) for process in both)
    campaign.count[f"race, exit {codes}"] += 1
    if codes not in ([0, 0], [0, 2]):
        campaign.bad.append(f"race {trial}: ended with {codes}")
    campaign.judge(f"race {trial}", out)


def link(campaign: "Campaign", trial: int) -> None:
    """A link to a precious file, planted where a run writes."""
    out, precious = campaign.where / f"link{trial}", campaign.where / "precious"
    precious.write_text("years of work")
    _stop_part_way(campaign, out)
    name = campaign.random.choice(LINKS)
    (out / name).unlink(missing_ok=True)
    (out / name).symlink_to(precious)
    code = campaign.run(out)
    _noted(campaign, f"link at {name}", code)
    if precious.read_text() != "years of work":
        campaign.bad.append(f"link {trial} at {name}: followed")
    if (out / name).is_symlink():
        (out / name).unlink()
    campaign.judge(f"link {trial} at {name}", out)


def vanish(campaign: "Campaign", trial: int) -> None:
    """A file is removed, or replaced, while a run writes it."""
    out, name = campaign.where / f"vanish{trial}", campaign.random.choice(VANISHING)
    process = campaign.start(out)
    _under_way(campaign, process, out)
    (out / name).unlink(missing_ok=True)
    if campaign.random.random() < 0.5 and not name.startswith("."):
        (out / name).write_text("mine")
    _noted(campaign, f"{name} removed", process.wait(600))
    if name == ".parcontact":
        campaign.count["without its marker"] += 1
    campaign.judge(f"vanish {trial}: {name}", out)


def lock(campaign: "Campaign", trial: int) -> None:
    """Another program has locked fields.h5 when a run is to go on: refused, and nothing changes."""
    out = campaign.where / f"lock{trial}"
    _stop_part_way(campaign, out)
    if (out / "fields.h5").exists():
        before = (out / "fields.h5").read_bytes()
        with (out / "fields.h5").open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            code = campaign.run(out)
        _noted(campaign, "fields.h5 locked", code)
        if any(out.glob("checkpoint/step-*.h5")) and (code != 2 or (out / "fields.h5").read_bytes() != before):
            campaign.bad.append(f"lock {trial}: ended with {code}, or changed the file")
    campaign.judge(f"lock {trial}", out)


def wish(campaign: "Campaign", trial: int) -> None:
    """A wish to stop that is a directory, empty or not."""
    out = campaign.where / f"wish{trial}"
    process = campaign.start(out)
    _under_way(campaign, process, out)
    full = campaign.random.random() < 0.5
    (out / "stop").mkdir()
    if full:
        (out / "stop" / "file").touch()
    _noted(campaign, f"directory stop, {'full' if full else 'empty'}", process.wait(600))
    subprocess.run(["rm", "-rf", out / "stop"], check=True)
    campaign.judge(f"wish {trial}", out)


def narrow(campaign: "Campaign", trial: int) -> None:
    """The ranks may write no long files, open few, or use little memory."""
    out, kind = campaign.where / f"narrow{trial}", campaign.random.choice(list(LIMITS))
    most = campaign.random.randint(*LIMITS[kind])
    if campaign.random.random() < 0.5:
        _stop_part_way(campaign, out)
    process = campaign.start(out, ("sh", "-c", f'ulimit -{kind} {most}; exec "$@"', "sh"))
    _noted(campaign, f"ulimit -{kind}", process.wait(600))
    campaign.judge(f"narrow {trial}: ulimit -{kind} {most}", out)


def remove(campaign: "Campaign", trial: int) -> None:
    """The output directory is removed while a run is under way."""
    out = campaign.where / f"remove{trial}"
    process = campaign.start(out)
    _under_way(campaign, process, out)
    gone = out.rename(f"{out}-gone")  # at once: else the run may put measures.csv back meanwhile
    shutil.rmtree(gone, ignore_errors=True)
    _noted(campaign, "directory removed", process.wait(600))
    campaign.judge(f"remove {trial}", out)


ALL: tuple[Callable[["Campaign", int], None], ...] = (race, link, vanish, lock, wish, narrow, remove)


def disturb(campaign: "Campaign", trial: int) -> None:
    """Each kind in its turn."""
    ALL[trial % len(ALL)](campaign, trial)


def _noted(campaign: "Campaign", what: str, code: int) -> None:
    campaign.count[f"{what}, exit {code}"] += 1
    if code not in CODES:
        campaign.bad.append(f"{what}: ended with {code}")


def _under_way(campaign: "Campaign", process: "subprocess.Popen[str]", out: Path) -> None:
    """Until a checkpoint has been written, and a little longer."""
    while process.poll() is None and not any(out.glob("checkpoint/step-*.h5")):
        time.sleep(1e-3)
    time.sleep(campaign.random.uniform(0.0, 0.3))


def _stop_part_way(campaign: "Campaign", out: Path) -> None:
    process = campaign.start(out)
    _under_way(campaign, process, out)
    (out / "stop").touch()
    process.wait(600)
    if os.path.lexists(out / "stop"):
        (out / "stop").unlink()
