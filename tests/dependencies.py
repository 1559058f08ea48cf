"""Tests with the lowest and with the newest versions that pyproject.toml allows, each in an environment of its own.

    python tests/dependencies.py lowest     .venv-lowest: the lower bound of every dependency
    python tests/dependencies.py newest     .venv-newest: whatever is newest today
    python tests/dependencies.py licences   the licence of every dependency, as docs/licences.md lists them

`make lowest` and `make newest` call this; both need a package index. They run the tests that lean on packages: files,
pictures, the page, the command line, bodies, meshes.
"""

import importlib.metadata
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent
TESTS = [
    "tests/foundation",
    "tests/scene",
    "tests/formats",
    "tests/session",
    "tests/simulation",
    "tests/page/test_gate.py",
    "tests/page/test_floods.py",
    "tests/run/test_checkpoints.py",
    "tests/test_cli.py",
    "tests/fuzz/test_attacks.py",
]


def declared() -> dict[str, str]:
    """Every dependency with what is allowed of it, by name; tools of developers as well."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = [*project["dependencies"], *(line for group in project["optional-dependencies"].values() for line in group)]
    found = {}
    for line in lines:
        name, bounds = re.fullmatch(r"([\w.\-]+)(?:\[[^\]]*\])?(.*)", line).groups()
        if name != "wavetank":
            found[name] = bounds
    return found


def lowest() -> list[str]:
    """The lower bounds, as pip's constraints."""
    least = {name: re.search(r">=([\w.]+)", bounds) for name, bounds in declared().items()}
    return [f"{name}=={found[1]}" for name, found in least.items() if found]


def run(which: str) -> int:
    folder = ROOT / f".venv-{which}"
    pip = [str(folder / "bin" / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
    constraints = folder / "constraints.txt"
    constraints.write_text("\n".join(lowest() if which == "lowest" else []) + "\n")
    subprocess.run([*pip, "--upgrade", "-c", str(constraints), "-e", f"{ROOT}[dev]"], check=True, cwd=ROOT)
    return subprocess.run(
        [str(folder / "bin" / "python"), "-m", "pytest", "-q", "-n", "2", *TESTS], cwd=ROOT
    ).returncode


def licences() -> list[tuple[str, str, str]]:
    """Name, licence and group of every dependency that is installed."""
    rows = []
    own = {
        re.match(r"[\w.\-]+", line)[0]
        for line in tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    }
    for name in sorted(declared(), key=str.lower):
        try:
            about = importlib.metadata.metadata(name)
        except importlib.metadata.PackageNotFoundError:
            continue
        classes = [line.split(" :: ")[-1] for line in about.get_all("Classifier", []) if line.startswith("License")]
        licence = (
            about.get("License-Expression")
            or ", ".join(c for c in classes if c != "OSI Approved")
            or str(about.get("License"))[:40]
        )
        rows.append((name, licence, "always" if name in own else "optional"))
    return rows


def main() -> int:
    which = sys.argv[1] if len(sys.argv) == 2 else ""
    if which in ("lowest", "newest"):
        return run(which)
    if which == "licences":
        for name, licence, group in licences():
            print(f"| {name} | {licence} | {group} |")
        return 0
    print(__doc__)
    return 2


if __name__ == "__main__":
    sys.exit(main())
