"""What a figure of speed was measured on: the processor, the system, the versions. No name of a host, no path."""

import importlib.metadata
import os
import platform
import shutil
import subprocess
from pathlib import Path
from typing import Any


def machine(arch: str = "cpu", threads: int | None = None) -> dict[str, Any]:
    """Describe this machine as plain data."""
    found = {
        "processor": processor(),
        "cores": cores(),
        "threads": threads or cores(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "wavetank": importlib.metadata.version("wavetank"),
        "quadrants": importlib.metadata.version("quadrants"),
        "numpy": importlib.metadata.version("numpy"),
        "arch": arch,
    }
    if arch == "cuda":
        found["card"] = _first_line("nvidia-smi", "--query-gpu=name,memory.total", "--format=csv,noheader")
    return found


def load() -> float | None:
    """Return how many programs want to run [mean of the last minute]; None where the system does not say."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def cores() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processor() -> str:
    """Return the processor's name, and its widest vector instructions where the system tells."""
    if platform.system() == "Darwin":
        return _first_line("sysctl", "-n", "machdep.cpu.brand_string") or platform.processor()
    cpu = Path("/proc/cpuinfo")
    if not cpu.is_file():
        return platform.processor()
    lines = dict(line.split(":", 1) for line in cpu.read_text(errors="replace").splitlines() if ":" in line)
    fields = {key.strip(): value.strip() for key, value in lines.items()}
    flags = fields.get("flags", fields.get("Features", "")).split()
    wide = next((flag for flag in ("avx512f", "avx2", "sve", "asimd") if flag in flags), "")
    family = f"family {fields['cpu family']} model {fields['model']}" if "cpu family" in fields else ""
    return ", ".join(part for part in (fields.get("model name", platform.machine()), family, wide) if part)


def _first_line(*command: str) -> str:
    if shutil.which(command[0]) is None:
        return ""
    try:
        result = subprocess.run(command, capture_output=True, text=True, timeout=20)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return (result.stdout.strip().splitlines() or [""])[0]
