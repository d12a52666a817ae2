"""The summary of peers divides by our algorithm's figures on the same surface."""

from benchmarks.pages import Table
from benchmarks.peers_summary import peers_summary

COLUMNS = "mesh,algorithm,title,target,external,status,angle_error_mean_deg,seconds,solve_seconds"
LINES = """
a,direct-cem,Direct CEM,disk,,ok,2,1,
a,theirs,Theirs (external program),disk,program,ok,3,9,4
b,direct-cem,Direct CEM,disk,,ok,0.001,1,
b,theirs,Theirs (external program),disk,program,ok,0.009,9,2
c,direct-cem,Direct CEM,disk,,ok,2,1,
c,theirs,Theirs (external program),disk,program,invalid,,,
c,xatlas,xatlas,atlas,library,ok,1,1,
"""


def test_figures_are_over_those_of_ours_where_both_have_a_valid_map(tmp_path):
    (tmp_path / "records.csv").write_text(COLUMNS + LINES)
    table = peers_summary(report=tmp_path).parts[1]
    assert isinstance(table, Table)
    ours, theirs = table.rows
    assert (ours["title"], ours["ok"], ours["angle"], ours["seconds"]) == ("Direct CEM", 3, 1, 1)
    assert theirs["title"] == "Theirs †"
    assert (theirs["ok"], theirs["surfaces"]) == (2, 3)
    assert (theirs["angle"], theirs["seconds"], theirs["span"]) == (1.25, 3, "2 to 4")
