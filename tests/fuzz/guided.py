"""Coverage-guided fuzzing of every reader with atheris, where it is installed.

    python -m tests.fuzz.guided [--inputs 10000] [--seed 1] [--reader NAME]

Only bladewing's code is instrumented. The inputs grow from the real files of `readers`. Each reader runs in a process
of its own. An input that makes it crash, hang or refuse wrongly is kept as crash-... in the current folder.
"""

import argparse
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

_LONGEST = 1 << 16


def grow(name: str, inputs: int, seed: int) -> None:
    """Try a number of inputs on one reader; ends the process, with exit code 0 if nothing went wrong."""
    import atheris

    with atheris.instrument_imports(include=["bladewing"]):
        from .readers import readers, verdict

    with tempfile.TemporaryDirectory() as place:
        folder, corpus = Path(place) / "under way", Path(place) / "corpus"
        for made in (folder, corpus):
            made.mkdir()
        reader = readers(Path(place) / "seeds")[name]
        for number, content in enumerate(reader.seeds):
            (corpus / f"{number}").write_bytes(content)

        def one(content: bytes) -> None:
            said = verdict(reader, content, folder)
            if said not in ("read", "refused"):
                raise RuntimeError(said)

        settings = [f"-runs={inputs}", f"-seed={seed}", f"-max_len={_LONGEST}", "-verbosity=0"]
        settings += ["-rss_limit_mb=6144", f"-artifact_prefix=crash-{name.replace(' ', '-')}-"]
        atheris.Setup([sys.argv[0], *settings, str(corpus)], one)
        atheris.Fuzz()


def main() -> int:
    """Print a line per reader; 1 if anything went wrong."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--inputs", type=int, default=10_000)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--reader")
    arguments.add_argument("--here", action="store_true", help="in this process")
    given = arguments.parse_args()
    if find_spec("atheris") is None:
        print("no atheris: no guided fuzzing (pip install atheris)")
        return 0
    if given.here:
        grow(given.reader, given.inputs, given.seed)
        return 0
    from .readers import readers

    with tempfile.TemporaryDirectory() as place:
        names = [given.reader] if given.reader else list(readers(Path(place)))
    worst = 0
    for name in names:
        how = ["--reader", name, "--inputs", str(given.inputs), "--seed", str(given.seed), "--here"]
        done = subprocess.run([sys.executable, "-m", "tests.fuzz.guided", *how], capture_output=True, check=False)
        print(f"{name}: {given.inputs} inputs, {'nothing wrong' if done.returncode == 0 else 'WRONG'}", flush=True)
        if done.returncode:
            print(done.stderr.decode(errors="replace")[-2000:])
        worst = max(worst, min(1, abs(done.returncode)))
    return worst


if __name__ == "__main__":
    sys.exit(main())
