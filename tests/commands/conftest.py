import pytest


@pytest.fixture(autouse=True)
def quick_processes(one_server):
    """The commands are tested here, not the processes that they start."""
