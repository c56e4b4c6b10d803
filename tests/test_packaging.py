"""The package as users get it: every folder installed, importable from a wheel, with its examples true."""

import ast
import doctest
import importlib
import os
import pkgutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FOLDERS = ("simulate", "features", "models", "classify")
LISTED = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]


def modules() -> list[str]:
    found = []
    for folder in FOLDERS:
        package = importlib.import_module(f"bladewing.{folder}")
        found += [f"bladewing.{folder}"]
        found += [m.name for m in pkgutil.walk_packages(package.__path__, f"bladewing.{folder}.")]
    return found


def test_every_package_folder_is_listed_for_setuptools():
    folders = {
        "bladewing." + ".".join(path.parent.relative_to(ROOT).parts)
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("__init__.py")
    }
    assert folders == set(LISTED)


@pytest.mark.parametrize("name", modules())
def test_examples_in_docstrings_are_true(name):
    failed, _ = doctest.testmod(importlib.import_module(name))
    assert failed == 0


def test_every_pin_is_one_exact_version():
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert lines
    names = [line.split("==")[0].lower().replace("_", "-") for line in lines]
    assert all(line.count("==") == 1 for line in lines)
    assert len(set(names)) == len(names)


def imported(node: ast.AST, package: list[str]) -> list[str]:
    """Full names of what a statement in a module of a package imports."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    above = package[: len(package) - node.level + 1] if node.level else []
    base = ".".join([*above, *([node.module] if node.module else [])])
    return [f"{base}.{alias.name}" for alias in node.names]


def test_an_import_is_known_however_it_is_written():
    package = ["bladewing", "features", "graph"]
    written = {
        "from ...simulate.radar import Radar": "bladewing.simulate.radar.Radar",
        "from ... import simulate": "bladewing.simulate",
        "from . import parts": "bladewing.features.graph.parts",
        "from bladewing import models": "bladewing.models",
        "import bladewing.models.cnn": "bladewing.models.cnn",
    }
    for text, name in written.items():
        assert imported(ast.parse(text).body[0], package) == [name]


def test_no_folder_imports_what_flows_from_it():
    allowed = {"simulate": set(), "features": set(), "models": {"features"}, "classify": set(FOLDERS)}
    for folder in FOLDERS:
        for path in (ROOT / folder).rglob("*.py"):
            text, package = path.read_text(), ["bladewing", *path.parent.relative_to(ROOT).parts]
            for other in set(FOLDERS) - {folder} - allowed[folder]:
                assert f"bladewing.{other}" not in text, f"{path} reaches into {other}"
            for node in ast.walk(ast.parse(text)):
                for name in imported(node, package):
                    other = name.split(".")[1] if name.startswith("bladewing.") else folder
                    assert other == folder or other in allowed[folder], f"{path} imports {name}"


RUN = """
import importlib, sys
import numpy as np
for name in {packages!r}:
    module = importlib.import_module(name)
    assert "site-packages" in module.__path__[0], module.__path__
from bladewing.classify import Classifier
from bladewing.simulate.scene import Scene, shipped
assert Scene.load("type1").radar.pulses == 3000, shipped()
rng = np.random.default_rng(0)
iq = rng.standard_normal((3, 2000)) + 1j * rng.standard_normal((3, 2000))
answer = Classifier.load().predict(iq, carrier_hz=9.85e9, prf_hz=25e3)
assert answer.probabilities.shape == (3, 3), answer
assert not [m for m in ("torch", "sklearn", "onnx", "matplotlib") if m in sys.modules]
"""


def test_wheel_installs_into_a_clean_environment_and_predicts(tmp_path):
    def run(*command: object, **kwargs) -> subprocess.CompletedProcess:
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True, cwd=tmp_path, **kwargs)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        return done

    # A copy: building in the tree would leave build/ and *.egg-info that a later build could pick up.
    source = tmp_path / "source"
    source.mkdir()
    names = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    for name in names:
        if (ROOT / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
    run(*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", tmp_path / "dist", source)
    (wheel,) = (tmp_path / "dist").glob("bladewing-*.whl")
    run(sys.executable, "-m", "venv", tmp_path / "clean")
    python = tmp_path / "clean" / "bin" / "python"
    run(python, *pip[1:], "install", "--no-compile", "-c", ROOT / "constraints.txt", wheel)
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    run(python, "-c", RUN.format(packages=LISTED), env=environment)
    asked = run(python.parent / "bladewing", "--help", env=environment)
    assert "predict" in asked.stdout
