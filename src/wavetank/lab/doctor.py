"""What is installed and what works on this machine."""

import importlib.metadata
import os
import platform
import shutil
import sys
from pathlib import Path
from typing import Any

from wavetank.device import compiler, patches
from wavetank.foundation.folders import cache_folder
from wavetank.foundation.memory import in_words

_PACKAGES = {
    "quadrants": "",
    "numpy": "",
    "pydantic": "",
    "typer": "",
    "rich": "",
    "pillow": "",
    "av": "",
    "tomli-w": "",
    "platformdirs": "",
    "trimesh": "",
    "rapier3d": "",
    **dict.fromkeys(
        ("imgui-bundle", "moderngl", "glfw", "svg.path"),
        "the window of `wavetank play`: pip install 'wavetank[window]'",
    ),
    "pysplashsurf": "surfaces in OBJ, USD, PLY and others: pip install 'wavetank[surface]'",
    "usd-core": "USD: pip install 'wavetank[usd]'",
    "h5py": "VTKHDF and tables: pip install 'wavetank[hdf5]'",
    "anywidget": "`wt.show` in notebooks: pip install 'wavetank[notebook]'",
    "matplotlib": "plots of `wavetank converge` and `validate`: pip install 'wavetank[plot]'",
}


IN_FORCE = "in force"
PATCH = "patch: "


def examine(no_window: str | None = None) -> dict[str, Any]:
    """Return versions, back ends and what is missing, as plain data: {"ok": bool, "checks": [...]}.

    `no_window` is the reason why no window can open, None if one can.
    """
    checks = [
        _check("wavetank", importlib.metadata.version("wavetank"), ""),
        _check("python", platform.python_version(), sys.executable),
        _check("system", platform.platform(), f"{os.cpu_count()} processors"),
    ]
    missing = []
    for package, hint in _PACKAGES.items():
        try:
            checks.append(_check(package, importlib.metadata.version(package), ""))
        except importlib.metadata.PackageNotFoundError:
            checks.append(_check(package, "missing", hint or "pip install wavetank"))
            missing.append(package)
    available = compiler.available_backends()
    for name in compiler.BACKENDS:
        if name == "gpu":
            continue
        found = "works" if name == "cpu" and _runs() else "available" if name in available else "not here"
        checks.append(_check(f"back end {name}", found, _BACKEND_NOTES.get(name, "") if found == "not here" else ""))
    best = next(iter(available))
    checks.append(_check("--arch gpu", best if best != "cpu" else "not here", "the best graphics processor there is"))
    checks.append(_check("display", "page only" if no_window else "window", no_window or "`wavetank play` opens one"))
    checks += [
        _check(f"{PATCH}{patch.name}", "not applied" if patch.misfit else IN_FORCE, _about(patch))
        for patch in patches.PATCHES
    ]
    checks += [_cache("cache of kernels", compiler.cache_folder()), _cache("cache of meshes", cache_folder())]
    checks.append(_check("terminal", str(shutil.get_terminal_size()[0]), "columns"))
    return {"ok": not [name for name in missing if not _PACKAGES[name]], "checks": checks}


_BACKEND_NOTES = {
    "cuda": "needs an NVIDIA card and its driver",
    "vulkan": "needs a Vulkan 1.1 driver and the loader (libvulkan1)",
    "metal": "needs macOS",
    "amdgpu": "needs an AMD card and ROCm",
}


def _about(patch: patches.Patch) -> str:
    if patch.misfit is None:
        return patch.sentence
    return f"{patch.misfit}; made for Quadrants {' and '.join(patches.VERSIONS)}: kernels work, and start slower"


def told(checks: list[dict[str, str]]) -> list[dict[str, str]]:
    """Return the findings as a person wants them: packages that are there in one line, and patches of the compiler."""
    packages = [row for row in checks if row["name"] in _PACKAGES and row["found"] != "missing"]
    listed = ", ".join(f"{row['name']} {row['found']}" for row in packages)
    rows = [row for row in checks if not row["name"].startswith(PATCH) and row not in packages]
    rows.insert(3, _check("packages", str(len(packages)), listed))
    of_patches = [row for row in checks if row["name"].startswith(PATCH)]
    reasons = {row["note"] for row in of_patches if row["found"] != IN_FORCE}
    if len(reasons) == 1 and all(row["found"] != IN_FORCE for row in of_patches):
        return [*rows, _check("patches of the compiler", "not applied", *reasons)]
    rows += [row for row in of_patches if row["found"] != IN_FORCE]
    in_force = sum(row["found"] == IN_FORCE for row in of_patches)
    return [*rows, _check("patches of the compiler", f"{in_force} in force", "each is listed with --json")]


def _cache(name: str, folder: Path) -> dict[str, str]:
    """Say how much lies in a folder that may be deleted at any time."""
    files = [path for path in folder.rglob("*") if path.is_file()] if folder.is_dir() else []
    size = in_words(sum(path.stat().st_size for path in files)) if files else "empty"
    return _check(name, size, f"{folder} (may be deleted)")


def _runs() -> bool:
    """Start the CPU back end and move one array there and back."""
    import numpy as np

    compiler.start(compiler.current_backend() or "cpu")
    array = compiler.qd.ndarray(compiler.qd.f32, shape=(4,))
    array.from_numpy(np.arange(4, dtype=np.float32))
    return bool(array.to_numpy().sum() == 6.0)


def _check(name: str, found: str, note: str) -> dict[str, str]:
    return {"name": name, "found": found, "note": note}
