"""Break guards one at a time in a copy of the source tree; for each, a test must fail.

python -m tests.fuzz.mutations
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]


class Mutation(NamedTuple):
    """A guard: its file, its code, the code that replaces it, and the tests that must fail then."""

    guard: str
    file: str
    old: str
    new: str
    tests: str


MUTATIONS = (
    Mutation(
        "phases are reduced in float64",
        "simulate/motion.py",
        "return (phase_rad - TWO_PI * np.rint(phase_rad / TWO_PI)).astype(np.float32)",
        "return phase_rad.astype(np.float32)",
        "tests/classify/test_stability.py -k simulator",
    ),
    Mutation(
        "long blades are summed in float64",
        "simulate/rotor.py",
        "LARGEST_GAMMA = 3e4",
        "LARGEST_GAMMA = 3e14",
        "tests/classify/test_stability.py -k simulator",
    ),
    Mutation(
        "records are scaled before they are squared",
        "features/samples.py",
        "return np.ldexp(np.float32(1), -np.minimum(np.maximum(exponent, -126), 126))",
        "return np.ones(exponent.shape, np.float32)",
        "tests/classify/test_stability.py -k features",
    ),
    Mutation(
        "records of denormal numbers are unknown",
        "classify/inference.py",
        "live = largest >= LEAST_PART",
        "live = largest > 0",
        "tests/classify/test_inference.py -k digits",
    ),
    Mutation(
        "one writer at a time",
        "classify/files.py",
        "fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))",
        "pass",
        "tests/classify/test_dataset.py -k one_writer",
    ),
    Mutation(
        "a file is written beside the old one",
        "classify/files.py",
        'beside = target.with_name(f".bladewing-{secrets.token_hex(8)}.tmp")',
        "beside = target.with_name(target.name); target.unlink(missing_ok=True)",
        "tests/classify/test_files.py",
    ),
    Mutation(
        "a journal moves only what a writer left",
        "classify/files.py",
        'if Path(beside).match(".bladewing-*.new") and all(Path(one).name == one for one in (beside, name)):',
        "if True:",
        "tests/classify/test_write_together.py -k journal",
    ),
    Mutation(
        "a shard's header is what is written here",
        "classify/shards.py",
        "if len(content) != size or not content.startswith(header):",
        "if len(content) != size:",
        "tests/classify/test_dataset.py -k forged",
    ),
    Mutation(
        "a shard's digest is checked",
        "classify/shards.py",
        "if hashlib.sha256(content).hexdigest() != sha256:",
        "if False:",
        "tests/classify/test_dataset.py -k damaged",
    ),
    Mutation(
        "a header may claim no more than the file holds",
        "classify/arrays.py",
        "if length > _MOST_HEADER_BYTES:",
        "if False:",
        "tests/classify/test_hostile_files.py -k oversized_header",
    ),
    Mutation(
        "no object is unpickled",
        "classify/arrays.py",
        "return np.lib.format.read_array(file, allow_pickle=False)",
        "return np.lib.format.read_array(file, allow_pickle=True)",
        "tests/classify/test_hostile_files.py -k unpickled",
    ),
    Mutation(
        "packed files unpack to so much and no more",
        "classify/limits.py",
        "    if unpacked > most:",
        "    if False:",
        "tests/classify/test_hostile_files.py -k bomb",
    ),
    Mutation(
        "types and sizes within MATLAB arrays are checked",
        "classify/arrays.py",
        "            require_sound(path)",
        "            pass",
        "tests/classify/test_hostile_files.py -k scipy_would_follow",
    ),
    Mutation(
        "a model refers to no other file",
        "models/seal.py",
        'if b"location" in onnx_bytes:',
        "if False:",
        "tests/classify/test_hostile_files.py -k another_file",
    ),
    Mutation(
        "a model is judged before it is opened",
        "classify/inference.py",
        "        self.envelope, self.accept = checked_metadata(self.metadata, source)\n"
        "        self._session = open_session(onnx_bytes, source, threads)\n",
        "        self._session = open_session(onnx_bytes, source, threads)\n"
        "        self.envelope, self.accept = checked_metadata(self.metadata, source)\n",
        "tests/classify/test_hostile_files.py -k foreign_model",
    ),
    Mutation(
        "text nested beyond reason is refused",
        "classify/settings_file.py",
        "except (ValueError, RecursionError) as error:",
        "except ValueError as error:",
        "tests/classify/test_hostile_files.py -k hostile_toml",
    ),
)


def copy_tree(place: Path) -> None:
    """Copy the files that git tracks, so that the checkout itself stays unchanged."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
    for name in listed.decode().split("\0"):
        if name and (ROOT / name).is_file():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, place / name)
    (place / "build" / "ns").mkdir(parents=True)
    (place / "build" / "ns" / "bladewing").symlink_to(place, target_is_directory=True)


def run_tests(place: Path, tests: str) -> int:
    """Run tests in the copy, with the copy's own package, and give pytest's exit code."""
    environment = os.environ | {"PYTHONPATH": str(place / "build" / "ns"), "PYTHONDONTWRITEBYTECODE": "1", "CI": "1"}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests.split()]
    return subprocess.run(command, cwd=place, env=environment, capture_output=True).returncode


def main() -> int:
    """Break each guard and print a line for each; 1 if a test still passed, or had failed before."""
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        copy_tree(place)
        for mutation in MUTATIONS:
            path = place / mutation.file
            text = path.read_text()
            if text.count(mutation.old) != 1:
                raise SystemExit(
                    f"{mutation.guard}: {mutation.file} holds {mutation.old!r} {text.count(mutation.old)} times"
                )
            before = run_tests(place, mutation.tests)
            path.write_text(text.replace(mutation.old, mutation.new))
            after = run_tests(place, mutation.tests)
            path.write_text(text)
            # pytest's exit codes: 1: tests failed; below 0 or 3: pytest itself died; 4 and 5: no test was found.
            good = before == 0 and after not in (0, 4, 5)
            failed += not good
            print(f"{'red' if good else 'NOT NOTICED'}  {mutation.guard}  ({before} -> {after})", flush=True)
    print(f"{len(MUTATIONS) - failed} of {len(MUTATIONS)} guards are watched by a test")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
