"""Recipes of containers: both are made of the same, from what their build can see. Nothing here builds one."""

import re
import subprocess
import tomllib
from fnmatch import fnmatch

import pytest
from marched_jobs import ROOT

RECIPES = [(ROOT / "scripts" / name).read_text() for name in ("Dockerfile", "parcontact.def")]
KEPT = [line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")]


def test_the_base_is_one_image() -> None:
    """By its digest, as a tag may name another image tomorrow."""
    bases = {base for text in RECIPES for base in re.findall(r"^F(?:ROM|rom:) (\S+:\S+)", text, re.M)}
    assert len(bases) == 1
    assert re.fullmatch(r"debian:12-slim@sha256:[0-9a-f]{64}", bases.pop())


def test_the_packages_are_the_same() -> None:
    """Those of the system, for the run and for the build."""
    names = r"\b(?:openmpi-bin|lib[\w-]+|gcc|pkg-config|python3[\w-]*)(?=[ \"]|$)"
    found = [set(re.findall(names, re.sub(r"^#.*", "", text, flags=re.M), re.M)) for text in RECIPES]
    assert found[0] == found[1] >= {"openmpi-bin", "libhdf5-openmpi-103-1", "gcc", "python3", "python3-venv"}


def test_the_build_sees_what_it_needs_and_no_more() -> None:
    """The same for both: what pyproject.toml names, and what scripts/into_image reads."""
    assert re.findall(r"^ +(\S+) /source/\1$", RECIPES[1], re.M) == KEPT
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    steps = (ROOT / "scripts/into_image").read_text()
    needed = {project["readme"], *project["license-files"], "pyproject.toml", "parcontact", "scripts/into_image"}
    needed |= set(re.findall(r"scripts/[\w.]+", steps))
    assert needed == set(KEPT)
    assert all((ROOT / name).exists() for name in KEPT)
    assert not any(fnmatch(name, pattern) for name in ("tests", "jobs", ".git") for pattern in KEPT)
    assert "[topography,xarray]" in steps  # no extras of tests


@pytest.mark.parametrize(
    "text", [(ROOT / "scripts/into_image").read_text(), *re.findall(r"(?s)%post(.*?)%", RECIPES[1])]
)
def test_the_steps_are_shell(text: str) -> None:
    assert subprocess.run(["sh", "-n"], input=text, capture_output=True, text=True).stderr == ""


def test_loops_are_compiled_as_the_user_that_runs() -> None:
    """They are read from directories of one's own alone."""
    user, doctor = (RECIPES[0].index(word) for word in ("USER parcontact", "RUN parcontact doctor"))
    assert user < doctor
    assert "mpirun" in RECIPES[0].partition("FROM")[0]  # says how to start several ranks
