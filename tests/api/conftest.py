import pytest


@pytest.fixture(autouse=True)
def quick_processes(one_server):
    """The verbs are tested here, not the processes that they start."""
