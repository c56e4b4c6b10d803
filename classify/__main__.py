"""The program `bladewing`, and `python -m bladewing.classify`: Ctrl-C is heard while what it needs is still loading."""

import signal
import sys


def main() -> int:
    """Run the command line; give its exit code."""
    # who ends it otherwise (`timeout`, a service) gets the same tidy end, workers and all
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        from .cli import main as run
    except KeyboardInterrupt:
        print("bladewing: stopped: interrupted", file=sys.stderr, flush=True)
        return 130
    return run()


if __name__ == "__main__":
    sys.exit(main())
