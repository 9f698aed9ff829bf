"""What several tests of the command line share."""

import gc
import os

import pytest
from hypothesis import settings

import laws
from cyclopean.analysis import safety_margins
from cyclopean.cli import main

# The same examples in every run, however busy the machine is; --hypothesis-profile=default draws new ones.
settings.register_profile("same", deadline=None, derandomize=True, max_examples=10)
settings.register_profile("thorough", deadline=None, derandomize=True)
settings.load_profile("same")


def pytest_addoption(parser):
    parser.addoption("--thorough", action="store_true", help="try every law on all of its examples, as at night")


def pytest_configure(config):
    gc.set_threshold(50_000)
    laws.chosen(config.getoption("--thorough"))
    if not laws.quick() and settings.get_current_profile_name() == "same":
        settings.load_profile("thorough")


def pytest_collection_finish():
    """What has been loaded stays; garbage is looked for among what tests make, not among some million objects."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    """Tests leave nothing in the cache of whoever runs them."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


@pytest.fixture
def unasked():
    """Margins are found without being asked for, as users have them."""


@pytest.fixture(autouse=True)
def margins_only_where_asked(request, monkeypatch):
    """They take most of the time of a check; tests of what is told without being asked use `unasked`."""
    if "unasked" not in request.fixturenames:
        monkeypatch.setattr(safety_margins, "POINTS", -1)


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Run a command in an empty folder: status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def command(*argv):
        status = main([str(a) for a in argv])
        return (status, *capsys.readouterr())

    return command


@pytest.fixture(scope="session")
def chromium():
    """One browser for all tests of pages."""
    from chromium import FOUND, Chromium

    if FOUND is None:
        pytest.skip("no Chromium on PATH")
    with Chromium("about:blank") as window:
        yield window


@pytest.fixture
def browser(chromium):
    """The browser, with nothing of other tests."""
    yield chromium
    chromium("Page.navigate", url="about:blank")
    chromium("Emulation.clearDeviceMetricsOverride")
    chromium("Emulation.setEmulatedMedia", features=[])


def pytest_xdist_auto_num_workers(config):
    """One more than there are processors: some tests wait for a server, a browser or a time limit."""
    return (os.cpu_count() or 1) + 1
