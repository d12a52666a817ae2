import pytest

from cembench.validation import surfaces


@pytest.fixture(autouse=True)
def quick_processes(one_server):
    """Findings are tested here, not the processes that calls are made in."""


@pytest.fixture(scope="package", autouse=True)
def surfaces_made_once():
    """Meshes are frozen, so that one serves all tests."""
    made, make = {}, surfaces.make

    def kept(registry, name, faces, **parameters):
        key = (name, faces, *parameters.items())
        if key not in made:
            made[key] = make(registry, name, faces, **parameters)
        return made[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surfaces, "make", kept)
        yield
