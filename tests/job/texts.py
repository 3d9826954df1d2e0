"""Jobs as texts: a sound one, and what tests make of it."""

from pathlib import Path
from typing import Any

import pytest

from parcontact.job import JobError
from parcontact.march.mesh import load

SMALL = """\
grid: {points: 64, size: 1e-3}
surface: {shape: wave, amplitude: 1e-6, waves: [1, 0]}
material: {model: elastic, shear_modulus: 1e6}
history:
  - {pressure: 1e5}
"""


def job_of(directory: Path, text: str | bytes, *overrides: str, name: str = "job.yaml") -> Any:
    """The job of a text; Any, so that a test may say what it knows: this material has branches."""
    path = directory / name
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    return load(path, overrides)


def mistakes_of(directory: Path, text: str | bytes, *overrides: str, name: str = "job.yaml") -> list[str]:
    """The sentences about a job that cannot be read, without the name of its directory, if that is absolute."""
    with pytest.raises(JobError) as caught:
        job_of(directory, text, *overrides, name=name)
    assert str(caught.value) == "\n".join(caught.value.mistakes)
    mistakes = caught.value.mistakes
    return [mistake.replace(f"{directory}/", "") for mistake in mistakes] if directory.is_absolute() else mistakes


def with_surface(line: str) -> str:
    return SMALL.replace("{shape: wave, amplitude: 1e-6, waves: [1, 0]}", line)


def with_material(line: str) -> str:
    return SMALL.replace("{model: elastic, shear_modulus: 1e6}", line)


def with_stage(line: str) -> str:
    return SMALL.replace("{pressure: 1e5}", line)


def replaced(text: str, **sections: str) -> str:
    """SMALL with whole sections exchanged; sections are one line each."""
    kept = [line for line in text.split("\n") if line.split(":")[0] not in sections]
    return "\n".join([*(f"{name}: {value}" for name, value in sections.items()), *kept])
