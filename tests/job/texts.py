"""Jobs as texts: a sound one, and what tests make of it."""

from pathlib import Path

import pytest

from parcontact.job import Job, JobError, load

SMALL = """\
grid: {points: 64, size: 1e-3}
surface: {shape: wave, amplitude: 1e-6, waves: [1, 0]}
material: {model: elastic, shear_modulus: 1e6}
history:
  - {pressure: 1e5}
"""


def job_of(directory: Path, text: str | bytes, *overrides: str) -> Job:
    """The job of a text."""
    path = directory / "job.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    return load(path, overrides)


def mistakes_of(directory: Path, text: str | bytes, *overrides: str) -> list[str]:
    """The sentences about a job that cannot be read, without the name of its directory."""
    with pytest.raises(JobError) as caught:
        job_of(directory, text, *overrides)
    return [mistake.replace(f"{directory}/", "") for mistake in caught.value.mistakes]


def with_surface(line: str) -> str:
    return SMALL.replace("{shape: wave, amplitude: 1e-6, waves: [1, 0]}", line)


def with_material(line: str) -> str:
    return SMALL.replace("{model: elastic, shear_modulus: 1e6}", line)


def with_stage(line: str) -> str:
    return SMALL.replace("{pressure: 1e5}", line)
