"""The program `bladewing`, and `python -m bladewing.classify`: Ctrl-C is heard while what it needs is still loading."""

import sys


def main() -> int:
    """Run the command line; give its exit code."""
    try:
        from .cli import main as run
    except KeyboardInterrupt:
        print("bladewing: stopped: interrupted", file=sys.stderr, flush=True)
        return 130
    return run()


if __name__ == "__main__":
    sys.exit(main())
