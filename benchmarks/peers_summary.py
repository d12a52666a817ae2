"""Valid maps, angle errors and seconds of peers beside ours. From the records of a kept report."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from cembench.sharing.leaderboard import UNSEEN

from benchmarks.pages import ROOT, Section, Table
from cembench.results.columns import MARKS
from cembench.results.report_records import text_rows

#: The kept report, and the algorithm of ours that the others are compared with, by target.
KEPT, BESIDE = ROOT / "reports/peers", {"disk": "direct-cem", "free boundary": "lscm"}
FIGURES = ["angle", "seconds"]


def peers_summary(*, report: Path = KEPT) -> Section:
    """Tabulate each algorithm's valid maps, and its angle errors and seconds over those of ours."""
    frame = pd.DataFrame(text_rows(report))
    frame = frame[frame["target"].isin(list(BESIDE))]
    solved = frame["solve_seconds"].where(frame["solve_seconds"] != "", frame["seconds"])
    frame = frame.assign(seconds=solved, angle=frame["angle_error_mean_deg"])
    frame = frame.assign(**{name: pd.to_numeric(frame[name]) for name in FIGURES})
    frame["angle"] = frame["angle"].clip(lower=UNSEEN)
    ok, place = frame["status"] == "ok", ["target", "mesh"]
    ours = frame[ok & (frame["algorithm"] == frame["target"].map(BESIDE))].set_index(place)[FIGURES]
    there = ours.reindex(pd.MultiIndex.from_frame(frame[place])).to_numpy()
    frame[FIGURES] = frame[FIGURES].where(ok) / there
    rows = []
    for (target, _), group in frame.groupby(["target", "algorithm"]):
        seconds = group["seconds"]
        title = group["title"].iloc[0].replace(" (external program)", "")
        rows.append(
            {
                "target": target,
                "title": f"{title} {MARKS.get(group['external'].iloc[0], '')}".rstrip(),
                "ok": int((group["status"] == "ok").sum()),
                "surfaces": len(group),
                **group[FIGURES].median().to_dict(),
                "span": f"{seconds.min():.2g} to {seconds.max():.2g}",
            }
        )
    rows.sort(key=lambda row: (row["target"], row["seconds"]))
    layout = """
| target | algorithm | valid maps | angle error over ours | seconds over ours | least to most |
| :--- | :--- | ---: | ---: | ---: | ---: |
| {target} | {title} | {ok} of {surfaces} | {angle:.2f} | {seconds:.2g} | {span} |"""
    words = (
        "Medians over the disks of which both have a valid map. Ours is Direct CEM for maps to the "
        f"disk, LSCM for a free boundary. Angle errors below {UNSEEN} degrees count as {UNSEEN}. "
        f"{MARKS['program']} program: its solve time counts, not its start; "
        f"{MARKS['library']} library, called in the process."
    )
    return Section([words, Table(rows, layout)], "reports/peers/report.md")
