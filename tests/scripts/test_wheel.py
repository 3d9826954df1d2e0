"""The wheel, installed into an environment of its own: files, metadata, types, and a run.

Its dependencies are those of the environment of the tests, so that nothing is downloaded.
"""

import ast
import email
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from marched_jobs import ROOT, load_script

import parcontact

JOB = """
grid: {points: 16, size: 1.0e-3}
surface: {shape: wave, amplitude: 1.0e-6, waves: [1, 1]}
material: {include: synthetic_tyre}
history: [{pressure: 1.0e5}]
"""


PROVIDED_BY = {"PIL": "pillow", "markupsafe": "jinja2", "pydantic_core": "pydantic", "yaml": "pyyaml"}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with `env`, in which the wheel is installed, and a job."""
    place = tmp_path_factory.mktemp("wheel")
    shutil.copytree(ROOT / "parcontact", place / "source/parcontact", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, place / "source")
    (place / "job.yaml").write_text(JOB)
    pip = [sys.executable, "-m", "pip", "-q", "--disable-pip-version-check"]
    subprocess.run([*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", place, place / "source"], check=True)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", place / "env"], check=True)
    (wheel,) = place.glob("*.whl")
    subprocess.run([*pip, "--python", place / "env/bin/python", "install", "--no-deps", wheel], check=True)
    own = sysconfig.get_path("purelib", vars={"base": str(place / "env")})
    Path(own, "dependencies.pth").write_text(sysconfig.get_path("purelib"))  # whose own .pth files do not count
    return place


def ran(place: Path, *words: str) -> str:
    """What a command of the environment prints; it must end well. Loops are not compiled, which takes ten seconds."""
    variables = load_script("runs").environment() | {"NUMBA_DISABLE_JIT": "1"}
    command = [str(place / "env/bin" / words[0]), *words[1:]]
    done = subprocess.run(command, cwd=place, env=variables, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_wheel_runs(place: Path, outside_mpi: dict[str, str]) -> None:
    """Verbs that read files of the package: a material, pages, the template of reports."""
    where = Path(ran(place, "python", "-c", "import parcontact; print(parcontact.__file__)").strip())
    assert where.is_relative_to(place / "env")
    assert ran(place, "parcontact", "--version") == f"parcontact {parcontact.__version__}\n"
    ran(place, "parcontact", "job.yaml", "--quiet")
    ran(place, "parcontact", "report", "out/job")
    assert (place / "out/job/report.html").stat().st_size > 10_000
    assert "hurst" in ran(place, "parcontact", "manual", "job")


def test_the_metadata_of_the_wheel(place: Path, outside_mpi: dict[str, str]) -> None:
    """README is the description, and each package that is imported is one that the wheel depends on."""
    (path,) = place.glob("env/lib/*/site-packages/parcontact-*.dist-info/METADATA")
    facts = email.message_from_string(path.read_text())
    assert (facts["Name"], facts["Version"]) == ("parcontact", parcontact.__version__)
    assert str(facts.get_payload()).strip() == (ROOT / "README.md").read_text().strip()
    assert "viscoelasticity" in facts["Keywords"]
    needed = {re.split(r"[ >=;\[]", line)[0].lower() for line in facts.get_all("Requires-Dist", [])}
    trees = [ast.walk(ast.parse(path.read_text())) for path in (ROOT / "parcontact").rglob("*.py")]
    nodes = [node for tree in trees for node in tree]
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    packages = {name.split(".")[0] for name in names} - {*sys.stdlib_module_names, "parcontact"}
    assert len(packages) > 10
    assert {PROVIDED_BY.get(name, name).lower() for name in packages} <= needed


def test_types_of_a_program_of_a_user(place: Path, outside_mpi: dict[str, str]) -> None:
    """mypy --strict finds each mistake of a program (its comment would be unused otherwise), and no other."""
    program = Path(__file__).parents[1] / "python/typed_program.py"
    options = [
        "--strict",
        "--config-file=",
        f"--cache-dir={place}/types",
        f"--python-executable={place}/env/bin/python",
    ]
    command = [sys.executable, "-m", "mypy", *options, str(program)]
    done = subprocess.run(command, cwd=place, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
