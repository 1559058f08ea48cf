"""Every test computes on the CPU back end, started once. What takes long is marked as such, by the list in slow.txt."""

import pathlib
import subprocess

import pytest

from wavetank import cli
from wavetank.device import compiler

#: Names of files, of tests, for all that they are tried with, or of tests with one of that in brackets.
SLOW = frozenset(pathlib.Path(__file__).with_name("slow.txt").read_text("utf-8").splitlines())


def pytest_collection_modifyitems(items):
    for item in items:
        if not SLOW.isdisjoint((item.nodeid, item.nodeid.split("[")[0], item.nodeid.split("::")[0])):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session", autouse=True)
def cpu() -> str:
    return compiler.start("cpu")


@pytest.fixture
def wavetank(monkeypatch, capsys):
    """The command line in this process, where the start and the end of one are not what is tested."""

    def run(*arguments: str) -> subprocess.CompletedProcess:
        monkeypatch.setattr("sys.argv", ["wavetank", *arguments])
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            cli.main()
        said = capsys.readouterr()
        return subprocess.CompletedProcess(arguments, end.value.code or 0, said.out, said.err)

    return run
