"""The files of a fitted compound: a material file that jobs include, and a picture beside it."""

from collections.abc import Iterator
from pathlib import Path

from ..errors import InputError, RunError
from ..rubber.compound import TITLE, Compound
from ..storage import files


def refuse_foreign(target: Path) -> None:
    """Raise InputError for a file that is there and was not written by a fit: it is never replaced."""
    if target.suffix not in (".yaml", ".yml"):
        raise InputError(f"--out must end in .yaml, got {str(target)!r}")
    try:
        if target.exists() and not target.read_text(errors="replace").startswith(TITLE):
            raise InputError(f"{target} is there and was not written by parcontact fit; choose another --out")
    except OSError as error:
        raise InputError(f"{target} cannot be read: {error}") from error


def write(compound: Compound, target: Path, job_band: tuple[float, float] | None) -> Iterator[str]:
    """Write both files; what to say of them, line by line. Raises RunError."""
    from . import compound as pictures  # slow to import

    text, picture = compound.text(), target.with_suffix(".png")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        files.write(target, text)
        with files.replaced(picture, files.is_marked) as file:
            pictures.draw(compound, file, job_band)
    except OSError as error:
        raise RunError(f"{target} cannot be written: {error}") from error
    yield from (line.removeprefix("# ") for line in text.splitlines() if line.startswith("#"))
    if compound.shift is not None:
        yield f"shift: {compound.shift}"
    yield f"material file: {target}, picture: {picture}"
    yield from (f"warning: {text}" for text in compound.doubts())
    if job_band:
        yield from warnings(compound, job_band)


def warnings(compound: Compound, job_band: tuple[float, float]) -> Iterator[str]:
    """By how much the frequencies of a job [Hz] reach beyond the measured band."""
    from math import log10

    low, high = compound.material()["band"]
    for decades, side in ((log10(low / job_band[0]), "below"), (log10(job_band[1] / high), "above")):
        if decades > 0.0:
            yield f"warning: the job's frequencies reach {decades:.1f} decades {side} the measured band"
