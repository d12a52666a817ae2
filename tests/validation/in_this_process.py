"""Call algorithms in the tests' own process: the same outcomes without the start of processes."""

from cembench.registry import load_registry
from cembench.running.measure import check_cell
from cembench.validation.solver import Solver


def call_here(task):
    mesh = task.mesh
    own = type(mesh)(mesh.V.copy(), mesh.F.copy(), mesh.name, mesh.notices)
    return check_cell(task.algorithm, own, task.cell)


def solver_here(name, plugin=None):
    plugins = () if plugin is None else (str(plugin),)
    return Solver(load_registry(plugins).algorithm(name), plugins, call=call_here)
