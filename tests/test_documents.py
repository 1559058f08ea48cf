"""What the documents tell people to type is understood as it stands."""

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typer

from wavetank.cli import app
from wavetank.lab.cases import CASES
from wavetank.scene.summary import bundled_counts

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "notebook").glob("*.md"))]
PAGES = sorted(
    {*DOCUMENTS, *ROOT.glob("*.md"), *(ROOT / "validation").glob("*.md"), *(ROOT / "benchmarks").glob("*.md")}
)
COMMANDS = typer.main.get_command(app)
PLACE = re.compile(r"[A-Z]{3,}(=[A-Z]+)?")
#: Words in a document that stand for a person's own.
OWN = re.compile(r"[A-Z]{3,}|[\w-]+\.(toml|json|urdf|npz|h5)|night|out")


def lines_of(path: Path) -> list[str]:
    """Return the command lines of a document, in the text and in its blocks."""
    text = path.read_text("utf-8")
    blocks = "\n".join(re.findall(r"```.*?\n(.*?)```", text, re.DOTALL)).replace("\\\n", " ")
    typed = [line.split("#")[0].strip() for line in blocks.splitlines() if line.strip().startswith("wavetank ")]
    return typed + re.findall(r"`(wavetank [a-z][^`\n]*)`", text)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_command_lines_are_understood(path):
    for line in lines_of(path):
        name, *words = (word.strip("[]") for word in shlex.split(line)[1:])
        assert name in COMMANDS.commands, line
        command = COMMANDS.commands[name]
        if all(word.startswith("-") or PLACE.fullmatch(word) for word in words):  # the command or an option as such
            options = {option for parameter in command.params for option in parameter.opts}
            assert {word for word in words if word.startswith("-")} <= options, line
            continue
        given = command.make_context(name, words).params  # raises for what it does not know
        for word in (given[key] for key in ("scene", "world") if given.get(key)):
            assert word in bundled_counts() or OWN.fullmatch(word) or "/" in word, line
        if name == "validate":
            assert {str(case) for case in given.get("cases") or ()} <= {case.name for case in CASES}, line


def anchors_of(path: Path) -> set[str]:
    """Return the anchors that GitHub gives to the headings of a document."""
    text = re.sub(r"```.*?```", "", path.read_text("utf-8"), flags=re.DOTALL)
    titles = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title) for title in re.findall(r"^#+ (.+)$", text, re.MULTILINE)]
    slugs = [re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-") for title in titles]
    return {slug if (n := slugs[:i].count(slug)) == 0 else f"{slug}-{n}" for i, slug in enumerate(slugs)}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_links_and_anchors_resolve(path):
    text = re.sub(r"```.*?```", "", path.read_text("utf-8"), flags=re.DOTALL)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = (path.parent / name) if name else path
        assert target.exists(), link
        if anchor and target.suffix == ".md":
            assert anchor in anchors_of(target), link


def test_sections_of_the_notebook_that_code_names_exist():
    """Comments in the code say `notebook/calm.md, "Tanks that slosh"`."""
    sources = [path for room in ("src", "tests") for path in (ROOT / room).rglob("*.py")]
    named = [
        (path, page, section)
        for path in sources
        for page, section in re.findall(
            r'(?<!page/)\bnotebook/([\w-]+\.md)(?:,[\s#]+"([^"]+)")?', path.read_text("utf-8")
        )
    ]
    for path, page, section in named:
        assert (ROOT / "notebook" / page).exists(), path
        if section:
            title = re.sub(r"\s*\n\s*#?\s*", " ", section)
            headings = re.findall(r"^#+ (.+)$", (ROOT / "notebook" / page).read_text("utf-8"), re.MULTILINE)
            assert title in headings, (path, section)
    assert len(named) > 10


def test_paths_of_the_package_that_documents_name_exist():
    """Files and folders in backticks, below `src/wavetank/` or the root; `x.py` stands for one of your own."""
    for page in (
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        "README.md",
        "docs/performance.md",
        "docs/look.md",
    ):
        for name in re.findall(r"`([\w/.-]+/[\w.-]*|[\w/-]+\.py)`", (ROOT / page).read_text("utf-8")):
            own = re.search(r"\bx\.", name) or name.startswith(("out", "night"))
            found = [*(ROOT / "src" / "wavetank").rglob(name), *ROOT.glob(name)]
            assert own or found, (page, name)


def test_answers_of_contributing_are_in_the_files_that_they_name():
    rows = re.findall(
        r"^\| [^|]+\? \| ([^|]+) \| ([^|]+) \|$", (ROOT / "CONTRIBUTING.md").read_text("utf-8"), re.MULTILINE
    )
    assert len(rows) == 10
    for files, answer in rows:
        paths = [ROOT / "src" / "wavetank" / name for name in re.findall(r"`([^`]+)`", files)]
        text = "".join(path.read_text("utf-8") for path in paths)
        for word in re.findall(r"`([\w.]+)`", answer):
            assert word.endswith(".py") or re.search(rf"\b{word.split('.')[-1]}\b", text), word


def test_there_are_command_lines():
    assert sum(map(len, map(lines_of, DOCUMENTS))) > 100


@pytest.mark.parametrize("script", ["promises.py", "fuzz/long.py", "fuzz/soak.py"])
def test_studies_that_take_hours_still_begin(script):
    asked = subprocess.run(
        [sys.executable, ROOT / "tests" / script, "--help"], capture_output=True, text=True, check=False
    )
    assert asked.returncode == 0, asked.stderr[-500:]


def test_readme_gives_a_reason_for_each_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = {name: needs for name, needs in project["optional-dependencies"].items() if name not in ("all", "dev")}
    needed = {re.match(r"[\w.-]+", need)[0] for needs in (project["dependencies"], *extras.values()) for need in needs}
    cells = re.findall(r"^\| ([^|\n]+) \| [^|\n]+ \|$", (ROOT / "README.md").read_text("utf-8"), re.MULTILINE)
    named = {name for cell in cells for name in re.findall(r"[\w.-]+", cell)}
    missing = needed - named
    assert not missing
