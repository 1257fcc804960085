"""Table 5 of the paper: time per frame, per approach and per stage."""
import statistics

from . import summary
from .cells import Cell, Column, Row, Table

STAGES = (("track", "Tracking"), ("orb", "ORB"), ("motion", "Motion check"), ("pose", "Pose"),
          ("segment", "Segmentation"), ("map", "Mapping"))
INVALID = ("Several runs shared the machine (or the sweep says so): these times are longer than a "
           "single run's and are no measurement.")


def approaches(sweep, published):
    """Table 5 as the paper has it: our modes, then the published systems."""
    columns = [Column("Segmentation [ms]"), Column("Tracking [ms]"),
               Column("Tracking, CPU time [ms]"), Column("Hardware", left=True)]
    table = Table("table5a", "5a", "Time per frame",
                  "Ours: mean over the frames of a run, then median over all runs of all sequences "
                  "and below it lowest–highest and how many runs gave a time. Segmentation runs "
                  "beside tracking, which does not wait for it. Published times were measured on "
                  "other machines.", "Approach", columns)
    for mode in sweep.modes:
        runs = [run for sequence in sweep.sequences for run in sequence.runs[mode]]
        row = Row(f"ours, {mode}", cells=[
            timing_cell(runs, "timing_ms", "segment"), timing_cell(runs, "timing_ms", "track"),
            timing_cell(runs, "cpu_ms", "track"), Cell("text", text=hardware(sweep, runs))])
        row.marked = any(cell.fault for cell in row.cells)
        mark_invalid(sweep, table, row.cells)
        table.rows.append(row)
    for entry in published.data["table5"]:
        table.rows.append(Row(entry["system"], cells=[
            Cell("published", text=entry["segment_ms"] or "–"),
            Cell("published", text=entry["track_ms"]), Cell("none"),
            Cell("text", text=entry["hardware"])], kind="published", citation=entry["system"]))
    return table


def stages(sweep):
    """Every stage, sequence and mode."""
    columns = [Column(label, "wall time, mean [ms]") for _, label in STAGES]
    columns += [Column("median", "tracking [ms]"), Column("p95", "tracking [ms]"),
                Column("max", "tracking [ms]"), Column("Tracking", "CPU time, mean [ms]"),
                Column("Segmentation", "CPU time, mean [ms]"),
                Column("Mapping", "CPU time, mean [ms]"), Column("Start-up [s]"),
                Column("Memory, peak [MB]")]
    table = Table("table5b", "5b", "Time per stage",
                  "Median over runs, below it lowest–highest and the runs that gave a time. ORB, "
                  "motion check and pose are parts of tracking; mapping is per keyframe.",
                  "Sequence, mode", columns)
    for sequence in sweep.sequences:
        for mode in sweep.modes:
            runs = sequence.runs[mode]
            cells = [timing_cell(runs, "timing_ms", key) for key, _ in STAGES]
            cells += [timing_cell(runs, "timing_ms", "track", statistic)
                      for statistic in ("median", "p95", "max")]
            cells += [timing_cell(runs, "cpu_ms", key) for key in ("track", "segment", "map")]
            cells += [figure_cell(runs, 2, "startup_s"), figure_cell(runs, 0, "peak_rss_mb")]
            if sequence.error:
                cells = [Cell("measured", fault="unreadable") for _ in cells]
            mark_invalid(sweep, table, cells[:len(STAGES) + 3])
            table.rows.append(Row(f"{sequence.name}, {mode}", cells=cells, kind=sequence.kind,
                                  marked=any(cell.fault for cell in cells)))
    return table


def timing_cell(runs, kind, stage, statistic="mean"):
    return figure_cell(runs, 2, kind, stage, statistic)


def figure_cell(runs, decimals, *keys):
    """Median and spread; a stage that never ran is a dash, a run that failed is a fault."""
    found = summary.spread(runs, *keys)
    fault = found.fault_text if found.faults else ""
    return Cell("measured", found.median, found.low, found.high, found.n if found.n else None,
                found.total if found.n else None, decimals=decimals, fault=fault)


def hardware(sweep, runs):
    """The machine, once, with its threads and the numbers' precision."""
    precisions = sorted({str(run.metrics.get("precision")) for run in runs
                         if run.metrics.get("precision")})
    parts = [str(sweep.data.get("machine") or machine_of(runs) or "unknown machine")]
    if "recorded" in precisions:
        parts.append("masks from files")
    networks = [p for p in precisions if p != "recorded"]
    if networks:
        parts.append("network " + "/".join(networks))
    return ", ".join(parts)


def machine_of(runs):
    for run in runs:
        machine = run.metrics.get("machine")
        if isinstance(machine, dict):
            return f"{machine.get('processor')}, {machine.get('threads')} threads"
    return None


def mark_invalid(sweep, table, cells):
    if not sweep.timings_valid:
        mark = table.note(INVALID)
        for cell in cells:
            if cell.value is not None and mark not in cell.notes:
                cell.notes.append(mark)


def tracking_summary(sweep, mode):
    """(median ms, runs) of the mean tracking time of a mode over all runs, for the summary."""
    values = [run.figure("timing_ms", "track", "mean") for s in sweep.sequences
              for run in s.runs[mode]]
    values = [value for value in values if value is not None]
    return (statistics.median(values), len(values)) if values else (None, 0)
