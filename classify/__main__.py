"""The program `bladewing`, and `python -m bladewing.classify`: Ctrl-C is handled also while modules are loading."""

import signal
import sys
import threading


def main() -> int:
    """Run the command line; return its exit code."""
    # SIGTERM (from `timeout`, a service) ends the program as tidily as Ctrl-C, workers included
    ours = threading.current_thread() is threading.main_thread()
    if ours and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        from .cli import main as run
    except KeyboardInterrupt:
        print("bladewing: stopped: interrupted", file=sys.stderr, flush=True)
        return 130
    return run()


if __name__ == "__main__":
    sys.exit(main())
