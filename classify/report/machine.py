"""Where a report was measured: processor, cores, load, versions."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from ..workers import workers_at_hand

# Packages whose versions change scores or timings.
PACKAGES = ("bladewing", "numpy", "scipy", "onnxruntime")


def describe_machine() -> dict[str, Any]:
    """Describe the machine that measures.

    Returns
    -------
    dict
        ``cpu`` (model name), ``cores`` (those this process may use), ``system``, ``python``, ``packages`` (name to
        version) and ``load`` (mean number of running processes over the last minute, None where unknown).
    """
    return {
        "cpu": _cpu_model(Path("/proc/cpuinfo")),
        "cores": workers_at_hand(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": {name: metadata.version(name) for name in PACKAGES},
        "load": round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None,
    }


def _cpu_model(cpuinfo: Path) -> str:
    """Give the processor's model name from Linux, else from the platform module."""
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name" and value.strip():
                return value.strip()
    return platform.processor() or platform.machine() or "unknown"
