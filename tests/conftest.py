"""What several tests of the command line share."""

import pytest
from hypothesis import settings

from cyclopean.cli import main

# The same examples in every run, however busy the machine is; --hypothesis-profile=default draws new ones.
settings.register_profile("same", deadline=None, derandomize=True)
settings.load_profile("same")


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    """Tests leave nothing in the cache of whoever runs them."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Run a command in an empty folder: status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def command(*argv):
        status = main([str(a) for a in argv])
        return (status, *capsys.readouterr())

    return command
