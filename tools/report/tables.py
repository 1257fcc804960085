"""Tables 1 to 5 of the paper, with measured columns beside the published ones."""
from . import summary
from .cells import Cell, Column, Row, Table, rank
from .published import COLUMNS, reduction_percent

BASELINE, BEST_MODE = "off", "full"
PART_TOLERANCE = 0.1  # a recording whose duration is this far from Table 1 is a part of it

FOREIGN = ("Published figures in this row belong to the TUM recording of that name, not to this "
           "sequence, and are no comparison.")
RENDERED = "Rendered by `ygslam simulate` in the manner of the TUM sequence; not a TUM recording."
PART = "Only a part of the TUM recording (its duration differs from Table 1 of the paper)."
RUNS = ("Median over the runs that gave a number, below it lowest–highest, how many did of all, and "
        "the lowest share of frames that were tracked. A row with a run that failed or "
        "was lost is marked ⚠.")


class Builder:
    """Makes every table of a sweep."""

    def __init__(self, sweep, published):
        self.sweep, self.published = sweep, published
        self.entries = ordered_rows(sweep, published)

    def all(self):
        tables = [self.sequences()]
        specs = (("2", "Absolute trajectory error (ATE)", "table2", " m",
                  [("a", "", summary.ATE)]),
                 ("3", "Translational drift (RPE)", "table3", " m",
                  [("a", "over 30 frames", summary.RPE_30_M), ("b", "over 1 s", summary.RPE_1S_M)]),
                 ("4", "Rotational drift (RPE)", "table4", "°",
                  [("a", "over 30 frames", summary.RPE_30_DEG),
                   ("b", "over 1 s", summary.RPE_1S_DEG)]))
        for number, title, key, unit, protocols in specs:
            for part, protocol, keys in protocols:
                tables.append(self.measured(number + part, title, key, unit, protocol, keys))
            part = "abc"[len(protocols)]
            tables.append(self.compared(number + part, title, key, unit, protocols))
        from .timing_tables import approaches, stages
        return tables + [approaches(self.sweep, self.published), stages(self.sweep)]

    def sequences(self):
        """Table 1: what the sequences are."""
        keys = (("duration_s", "Duration [s]", 2), ("length_m", "Length [m]", 3),
                ("speed_mps", "Speed [m/s]", 3), ("angular_speed_degps", "Turning [°/s]", 3))
        columns = [Column("Frames", "measured")] + [Column(k[1], "measured") for k in keys]
        columns += [Column(k[1], "in the paper", "YG-SLAM", True) for k in keys]
        table = Table("table1", "1", "Sequences", "Duration, path length and mean speeds of the "
                      "true camera, from the truth as recorded.", "Sequence",
                      columns + [Column("Description", left=True)])
        for row_name, sequence in self.entries:
            row = self.row(table, row_name, sequence)
            truth = sequence.truth if sequence else None
            row.cells.append(Cell("measured", sequence.frames if sequence else None, decimals=0))
            for key, _, decimals in keys:
                value = (truth or {}).get(key)
                cell = Cell("measured", value, decimals=decimals)
                if sequence and sequence.error:
                    cell.fault = "unreadable"
                elif value is None:
                    cell.text = "no truth" if sequence else "not run"
                row.cells.append(cell)
            paper = self.published.data["paper_rows"].get(row_name, {})
            for key, _, decimals in keys:
                row.cells.append(Cell("published", paper.get("table1", {}).get(key),
                                      decimals=decimals, foreign=self.foreign(row_name, sequence)))
            row.cells.append(Cell("text", text=paper.get("description", "")))
        return table

    def measured(self, number, title, key, unit, protocol, keys):
        """Our modes with spread, and what switching the dynamic part on brings."""
        columns = [Column(c, f"{mode}") for mode in self.sweep.modes for c in COLUMNS]
        ablation = BASELINE in self.sweep.modes and BEST_MODE in self.sweep.modes
        if ablation:
            columns += [Column(c, "reduction, full against off") for c in COLUMNS]
        heading = f"{title} {protocol}".strip() + f" [{unit.strip()}], measured"
        table = Table(f"table{number}", number, heading, RUNS + (
            " Reductions by eq. (20) of the medians." if ablation else ""), "Sequence", columns)
        for row_name, sequence in self.entries:
            if sequence is None:
                continue
            row = self.row(table, row_name, sequence)
            cells = {}
            for mode in self.sweep.modes:
                for statistic in ("rmse", "std"):
                    cell = measured_cell(sequence, mode, *keys, statistic)
                    cell.coverage = None if statistic == "std" else cell.coverage
                    cells[mode, statistic] = cell
                    row.cells.append(cell)
            for statistic in ("rmse", "std"):
                rank([cells[mode, statistic] for mode in self.sweep.modes])
                if ablation:
                    row.cells.append(reduction_cell(cells[BASELINE, statistic],
                                                    cells[BEST_MODE, statistic]))
            row.marked = any(cell.fault for cell in row.cells)
        return table

    def compared(self, number, title, key, unit, protocols):
        """Our best mode beside the published systems, with error reductions by eq. (20)."""
        mode = BEST_MODE if BEST_MODE in self.sweep.modes else self.sweep.modes[-1]
        columns = [Column(c, f"ours, {mode}" + (f", {name}" if name else ""))
                   for _, name, _ in protocols for c in COLUMNS]
        columns += [Column(c, s, s, True) for s in self.published.systems for c in COLUMNS]
        columns += [Column(c, "YG-SLAM's reduction against ORB-SLAM2, as printed", "YG-SLAM", True)
                    for c in COLUMNS]
        columns += [Column(c, "the same, recomputed") for c in COLUMNS]
        columns += [Column(c, f"our {mode}{', ' + protocols[0][1] if protocols[0][1] else ''} "
                           "against published ORB-SLAM2") for c in COLUMNS]
        if key == "table2":
            columns += [Column("RMSE", peer, peer, True) for peer in self.published.peers]
            columns.append(Column("RMSE", "best published", None, True))
        caption = ("Our median beside the published figures. "
                   "Bold: best, underlined: second best among the figures that can be compared. "
                   "Error reduction by eq. (20) of the paper. ")
        caption += self.published.data["notes"]["bold"]
        heading = f"{title} [{unit.strip()}] beside published systems"
        table = Table(f"table{number}", number, heading, caption, "Sequence", columns)
        for row_name, sequence in self.entries:
            bonn = self.bonn_best(sequence) if key == "table2" else None
            if row_name in self.published.rows or bonn is not None:
                table.rows.append(self.compared_row(table, key, row_name, sequence, mode, protocols,
                                                    bonn))
        table.remarks.append(self.published.average_note(key))
        our = our_average(table, self.published, self.entries)
        if our:
            table.remarks.append(our)
        if key != "table2":
            table.remarks.append(self.published.data["notes"]["rpe"])
        return table

    def compared_row(self, table, key, row_name, sequence, mode, protocols, bonn):
        row = self.row(table, row_name, sequence, append=False)
        foreign = self.foreign(row_name, sequence)
        ours = []
        for _, _, keys in protocols:
            for statistic in ("rmse", "std"):
                cell = (measured_cell(sequence, mode, *keys, statistic) if sequence
                        else Cell("measured", text="not run"))
                cell.coverage = cell.low = None
                ours.append(cell)
        theirs = [self.published_cell(table, key, row_name, system, column, foreign)
                  for system in self.published.systems for column in (0, 1)]
        row.cells = ours + theirs + self.reduction_cells(table, key, row_name, foreign)
        for column in (0, 1):
            orb = theirs[2 * self.published.systems.index("ORB-SLAM2") + column]
            row.cells.append(Cell("none") if foreign else reduction_cell(orb, ours[column]))
        if key == "table2":
            peers = [Cell("published", peer.get(row_name), foreign=foreign)
                     for peer in self.published.peers.values()]
            best = (bonn if bonn is not None else self.published.best_ate_m(row_name)
                    if row_name in self.published.rows else None)
            row.cells += peers + [Cell("published", best, foreign=foreign and bonn is None,
                                       notes=[table.note(self.bonn_note())] if bonn is not None
                                       else [])]
        else:
            peers = []
        if not foreign:
            for column in (0, 1):
                rank([c for c in ours[column::2] + theirs[column::2]
                      + (peers if column == 0 else []) if "suspect" not in c.notes])
        for cell in row.cells:
            cell.notes = [note for note in cell.notes if note != "suspect"]
        row.marked = any(cell.fault for cell in ours)
        return row

    def published_cell(self, table, key, row_name, system, column, foreign):
        if row_name not in self.published.rows:
            return Cell("none")
        cell = Cell("published", self.published.figure(key, row_name, system, column),
                    foreign=foreign)
        erratum = self.published.erratum(key, row_name, system)
        if erratum:
            cell.notes.append(table.note(f"{system}, {self.published.short(row_name)}: "
                                         + erratum["what"]))
            if erratum.get("suspect"):
                cell.notes.append("suspect")
        return cell

    def reduction_cells(self, table, key, row_name, foreign):
        if row_name not in self.published.rows:
            return [Cell("none")] * 4
        printed = [Cell("published", self.published.printed_reduction(key, row_name, column),
                        decimals=2, unit=" %", foreign=foreign) for column in (0, 1)]
        again = [Cell("derived", self.published.recomputed_reduction(key, row_name, column),
                      decimals=2, unit=" %", foreign=foreign) for column in (0, 1)]
        for column in (0, 1):
            note = self.published.reduction_note(key, row_name, column)
            if note:
                printed[column].notes.append(table.note(note))
        return printed + again

    def bonn_best(self, sequence):
        if sequence is None or sequence.kind != "bonn":
            return None
        return self.published.bonn_best_ate_m(sequence.name)

    def bonn_note(self):
        return "Bonn: " + self.published.citations["Bonn"]["text"] + "."

    def foreign(self, row_name, sequence):
        """Whether published figures of a row are not about this sequence."""
        return sequence is not None and row_name in self.published.rows and (
            sequence.kind != "tum" or self.is_part(row_name, sequence))

    def is_part(self, row_name, sequence):
        paper = self.published.data["paper_rows"][row_name]["table1"]["duration_s"]
        duration = (sequence.truth or {}).get("duration_s")
        return (sequence.kind == "tum" and duration is not None
                and abs(duration - paper) > PART_TOLERANCE * paper)

    def row(self, table, row_name, sequence, append=True):
        """A row with its label; what must be known about the sequence is a footnote."""
        label = (self.published.short(row_name) if row_name in self.published.rows
                 else sequence.name)
        row = Row(label, "", [], sequence.kind if sequence else "published")
        if sequence is None:
            row.sublabel = "TUM recording, not run"
            row.not_run = True
        elif row_name in self.published.rows:
            row.sublabel = ("rendered, not TUM" if sequence.rendered else
                            "TUM, a part" if self.is_part(row_name, sequence) else
                            "TUM" if sequence.kind == "tum" else "not a TUM folder")
            if sequence.name != label:
                row.sublabel += f" · {sequence.name}"
            if self.foreign(row_name, sequence):
                if any(column.published for column in table.columns):
                    row.notes.append(table.note(FOREIGN))
                row.notes.append(table.note(RENDERED if sequence.rendered else PART))
        else:
            row.sublabel = {"bonn": "Bonn", "rendered": "rendered", "tum": "TUM"}.get(
                sequence.kind, "own folder")
        if append:
            table.rows.append(row)
        return row


def ordered_rows(sweep, published):
    """[(row name, sequence or None)]: the paper's rows that were run, TUM before rendered; then all
    other sequences, Bonn first; the paper's rows that were not run last."""
    entries, not_run = [], []
    for row_name in published.rows:
        own = [s for s in sweep.sequences if s.paper_row == row_name]
        real = [s for s in own if not s.rendered]
        entries += [(row_name, s) for s in real]
        not_run += [] if real else [(row_name, None)]
        entries += [(row_name, s) for s in own if s.rendered]
    rest = [s for s in sweep.sequences if s.paper_row not in published.rows]
    rest.sort(key=lambda s: {"bonn": 0, "tum": 1, "folder": 2}.get(s.kind, 3))
    return entries + [(None, s) for s in rest] + not_run


def measured_cell(sequence, mode, *keys):
    """Median and spread of one figure of one mode, or what happened instead."""
    if sequence.error:
        return Cell("measured", fault="unreadable", n=0, total=0)
    runs = sequence.runs[mode]
    if not runs:
        return Cell("measured", text="not run")  # this mode was asked for other sequences only
    found = summary.spread(runs, *keys)
    coverage = summary.spread(runs, "coverage").low
    cell = Cell("measured", found.median, found.low, found.high, found.n, found.total, coverage,
                fault=found.fault_text)
    if found.n == 0 and not found.faults:
        # Judged, but no two poses are far enough apart; or nothing to judge by. Neither is a fault.
        judged = summary.spread(runs, "ate", "rmse").n
        cell.text, cell.fault = "too short" if judged else "no truth", ""
    return cell


def reduction_cell(alpha, beta):
    """Eq. (20) of two cells; what is wrong with either is wrong with the reduction."""
    value = reduction_percent(alpha.value, beta.value)
    fault = beta.fault or alpha.fault
    return Cell("derived", value, decimals=2, unit=" %", fault=fault)


def our_average(table, published, entries):
    """The mean of our reductions over the four walking recordings, only if all are there."""
    found = {}
    offset = next(i for i, c in enumerate(table.columns) if "against published" in c.group)
    shown = [(r, s) for r, s in entries if r in published.rows]
    for (row_name, sequence), row in zip(shown, table.rows):
        cells = row.cells[offset:offset + 2]
        if sequence and row_name in published.walking_rows() and all(
                c.value is not None and not c.fault for c in cells):
            found.setdefault(row_name, [c.value for c in cells])
    if not found:
        return None
    missing = [published.short(r) for r in published.walking_rows() if r not in found]
    if missing:
        return ("Our average reduction over the walking recordings is not given: no sound figure "
                "for " + ", ".join(missing) + ".")
    means = [sum(pair[i] for pair in found.values()) / len(found) for i in (0, 1)]
    return (f"Our average reduction over the four walking recordings: RMSE {means[0]:.2f} %, "
            f"S.D. {means[1]:.2f} %.")
