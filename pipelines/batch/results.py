"""The folder of a batch: one folder with a record per job, one CSV file and one overview page.

The folder and the record of a job are named by the job's options, and the tables are made from the
records in the folder. So two batches may write to one folder at the same time.
"""

from __future__ import annotations

import html
import json
import os
import urllib.parse
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from a2v.errors import A2VError
from a2v.io import atomic_path, read_bytes, write_csv
from pipelines.batch.tasks import Job, Result
from pipelines.engine.run import Outcome
from pipelines.engine.store import Store
from pipelines.outputs import write_blob, write_results

RECORD = "job.json"
THUMBNAIL = "thumbnail.jpg"
_MAX_RECORD_BYTES = 1 << 20
_COLUMNS = (
    "folder",
    "status",
    "name",
    "photo",
    "action",
    "model",
    "motion",
    "seed",
    "frames",
    "views",
    "size",
    "seconds",
    "problem",
    "notes",
)


def write_job(out: Path, job: Job, result: Result, store: Store) -> dict[str, Any]:
    """Write the files of a job, its thumbnail and then its record, and return the record."""
    folder = out / job.name
    written: list[Path] = []
    if not result.problem:
        video = job.tasks[-1]
        outcome = Outcome(result.values, {}, result.seconds, result.peak_memory, store)
        written = write_results(
            outcome, folder, video.parameters["render"].views, edit=video.parameters["edit"]
        )
        written.append(write_blob(outcome, result.values["thumbnail"], folder / THUMBNAIL))
    row, request = job.row, job.row.request
    record = {
        "folder": job.name,
        "status": "failed" if result.problem else "done",
        "name": row.name,
        "photo": request.person.photo,
        "action": request.motion.action,
        "model": request.motion.model,
        "motion": request.motion.motion or "",
        "seed": request.motion.seed,
        "frames": request.motion.frames,
        "views": request.film.views or "",
        "size": request.film.size,
        "seconds": round(result.seconds, 3),
        "problem": result.problem,
        "notes": " ".join((*job.notes, *result.notes)),
        "trace": result.trace,
        "key": job.tasks[-1].key if job.tasks else "",
        "files": {path.name: path.stat().st_size for path in written},
    }
    with atomic_path(folder / RECORD) as temporary:
        temporary.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return record


def read_record(folder: Path) -> dict[str, Any] | None:
    """Return the record of a job's folder, or None if it has none that can be read."""
    try:
        record = json.loads(read_bytes(folder / RECORD, limit=_MAX_RECORD_BYTES))
    except (A2VError, ValueError, RecursionError):
        return None
    good = (
        isinstance(record, dict)
        and record.get("folder") == folder.name
        and record.get("status") in ("done", "failed")
    )
    return record if good and isinstance(record.get("files"), dict) else None


def is_over(out: Path, job: Job, *, retry_failed: bool) -> bool:
    """Return whether a job needs no work.

    Either its files are there as today's code wrote them, or it has failed already.
    """
    record = read_record(out / job.name)
    if record is None or record.get("key") != (job.tasks[-1].key if job.tasks else ""):
        return False
    if record["status"] == "failed":
        return not retry_failed
    try:
        return all(
            (out / job.name / Path(name).name).stat().st_size == size
            for name, size in record["files"].items()
        )
    except (OSError, ValueError):  # ValueError: a name with a zero byte
        return False


def write_tables(out: Path) -> dict[str, int]:
    """Write ``results.csv`` and ``index.html`` of all records.

    Return the number of jobs per status.
    """
    rows = sorted(_records(out), key=lambda record: (record["status"] == "done", record["folder"]))
    plain_rows = [{name: _cell(record.get(name, "")) for name in _COLUMNS} for record in rows]
    if rows:
        write_csv(out / "results.csv", plain_rows)
    with atomic_path(out / "index.html") as temporary:
        temporary.write_text(_page(rows), encoding="utf-8", errors="backslashreplace")
    done = sum(record["status"] == "done" for record in rows)
    return {"done": done, "failed": len(rows) - done}


def _records(out: Path) -> Iterator[dict[str, Any]]:
    for folder in out.iterdir():
        if (folder / RECORD).is_file() and (record := read_record(folder)) is not None:
            yield record


def _cell(value: object) -> object:
    """Return a value that spreadsheets do not read as a formula."""
    return (
        f"'{value}"
        if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t", "\r")
        else value
    )


_STYLE = """:root{color-scheme:light dark;--ink:#222;--page:#fafafa;--line:#ddd;--link:#1d5c96;--bad:#a3261c}
@media(prefers-color-scheme:dark){:root{--ink:#e8edf2;--page:#161b21;--line:#3a4551;--link:#8cbcff;--bad:#ff9d92}}
body{font:14px/1.4 system-ui,sans-serif;margin:1.5em;color:var(--ink);background:var(--page)}a{color:var(--link)}
.table{overflow-x:auto}table{border-collapse:collapse;width:100%}td,th{padding:.3em .8em;border-bottom:1px solid var(--line);text-align:left}
img{border-radius:4px;display:block}.failed td{color:var(--bad)}input{font:inherit;padding:.4em;width:min(20em,100%);margin-bottom:1em}
:focus-visible{outline:3px solid var(--link);outline-offset:2px}"""  # noqa: E501
_FILTER = (
    "document.querySelector('input').oninput=e=>{for(const r of document.querySelectorAll('tbody "
    "tr'))"
    "r.hidden=!r.textContent.toLowerCase().includes(e.target.value.toLowerCase())}"
)


def _page(rows: list[dict[str, Any]]) -> str:
    done = sum(record["status"] == "done" for record in rows)
    heads = ("character", "job", "photo", "action", "seed", "frames", "views", "result")
    lines = "\n".join(map(_line, rows))
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>a2v: {done} videos</title><style>{_STYLE}</style>\n"
        f"<main><h1>{done} videos, {len(rows) - done} failed</h1>\n"
        '<input type="search" aria-label="filter" placeholder="filter"> <a '
        'href="results.csv">results.csv</a>\n'
        '<div class="table" tabindex="0" role="region" aria-label="jobs"><table><thead><tr>'
        f"{''.join(f'<th>{name}</th>' for name in heads)}</tr></thead><tbody>\n{lines}\n"
        f"</tbody></table></div></main>\n<script>{_FILTER}</script></html>\n"
    )


def _line(record: Mapping[str, Any]) -> str:
    folder = urllib.parse.quote(os.fsencode(record["folder"]))
    what = record.get("action") or Path(str(record.get("motion", ""))).name
    told = (
        record.get("name") or record["folder"],
        Path(str(record.get("photo", ""))).name,
        what,
        *(record.get(n, "") for n in ("seed", "frames", "views")),
    )
    cells = "".join(f"<td>{html.escape(str(value))}</td>" for value in told)
    if record["status"] == "failed":
        return f'<tr class="failed"><td></td>{cells}<td>{html.escape(str(record.get("problem", "")))}</td></tr>'  # noqa: E501
    name = html.escape(str(told[0]))
    picture = (
        f'<a href="{folder}/preview.html"><img src="{folder}/{THUMBNAIL}" loading="lazy" '
        f'height="96" alt="turn the character of {name}"></a>'
    )
    links = " ".join(
        f'<a href="{folder}/{name}">{name}</a>'
        for name in ("video.mp4", "character.glb", "motion.bvh")
    )
    return f"<tr><td>{picture}</td>{cells}<td>{links}</td></tr>"
