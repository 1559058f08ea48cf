"""Every test computes on the CPU back end, started once."""

import subprocess

import pytest

from wavetank import cli
from wavetank.device import compiler


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
