"""A table as CSV, JSON and LaTeX (booktabs). HTML is made by the page's template."""
import csv
import io
import json

from .cells import letter
from .published import source_text

LATEX_SPECIAL = {"\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#",
                 "_": r"\_", "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}",
                 "^": r"\textasciicircum{}", "–": "--", "°": r"\textdegree{}", "·": r"$\cdot$",
                 "⚠": "!", ">": r"$>$", "<": r"$<$"}
# More columns than this are too small when scaled to a page: the table is continued below.
LATEX_COLUMNS, LATEX_COLUMNS_WITH_SPREADS = 12, 6


def to_json(table, citations):
    """Everything that is shown, as numbers. @param citations those of published.json."""
    return json.dumps({
        "id": table.id, "number": table.number, "title": table.title, "caption": table.caption,
        "columns": [{"group": c.group, "label": c.label, "published": c.published}
                    for c in table.columns],
        "rows": [{"label": r.label, "sublabel": r.sublabel, "kind": r.kind, "marked": r.marked,
                  **({"notes": r.notes} if r.notes else {}),
                  "cells": [cell_json(c) for c in r.cells]} for r in table.rows],
        "notes": {letter(i): text for i, text in enumerate(table.notes)},
        "remarks": table.remarks,
        "sources": {key: citations[key] for key in table.sources()},
    }, indent=1, ensure_ascii=False) + "\n"


def cell_json(cell):
    data = {"kind": cell.kind, "shown": cell.shown, "value": cell.value}
    for name in ("low", "high", "n", "total", "coverage"):
        if getattr(cell, name) is not None:
            data[name] = getattr(cell, name)
    for name in ("fault", "foreign", "notes"):
        if getattr(cell, name):
            data[name] = getattr(cell, name)
    return data


def to_csv(table, citations):
    """One line a row; a measured column is followed by lowest, highest, runs, coverage, fault."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    header = [table.row_heading, "remark"]
    measured = [any(row.cells[i].kind == "measured" for row in table.rows)
                for i in range(len(table.columns))]
    for column, wide in zip(table.columns, measured):
        name = f"{column.group}: {column.label}" if column.group else column.label
        header.append(name)
        if wide:
            header += [f"{name} ({what})" for what in ("low", "high", "runs", "tracked", "fault")]
    writer.writerow(header)
    for row in table.rows:
        line = [row.label, row.sublabel]
        for cell, wide in zip(row.cells, measured):
            line.append(csv_value(cell))
            if wide:
                line += ["" if value is None else value for value in
                         (cell.low, cell.high, cell.count_text, cell.coverage,
                          cell.fault or cell.text)]
        writer.writerow(line)
    for i, note in enumerate(table.notes):
        writer.writerow([f"note {letter(i)}", note])
    for remark in table.remarks:
        writer.writerow(["note on all", remark])
    for key in table.sources():
        writer.writerow([f"note source {key}", source_text(citations[key])])
    return out.getvalue()


def csv_value(cell):
    if cell.text is not None and cell.kind != "measured":
        return cell.text
    return "" if cell.value is None else repr(round(cell.value, 9))


def to_latex(table, citations):
    """A table* with booktabs; wide ones are continued below with the row labels again."""
    lines = ["% needs \\usepackage{booktabs,graphicx,textcomp}", r"\begin{table*}[t]",
             r"\centering", rf"\caption{{{latex(table.title)}. {latex(table.caption)}}}",
             rf"\label{{tab:{table.id}}}"]
    for start, end in table.parts(LATEX_COLUMNS, LATEX_COLUMNS_WITH_SPREADS):
        lines += latex_tabular(table, start, end) + [r"\par\smallskip"]
    for i, note in enumerate(table.notes):
        lines.append(rf"{{\footnotesize \textsuperscript{{{letter(i)}}}~{latex(note)}\par}}")
    lines += [rf"{{\footnotesize {latex(remark)}\par}}" for remark in table.remarks]
    if table.sources():
        said = "; ".join(f"{key}: {source_text(citations[key])}" for key in table.sources())
        lines.append(rf"{{\footnotesize Sources. {latex(said)}.\par}}")
    return "\n".join(lines + [r"\end{table*}", ""])


def latex_tabular(table, start, end):
    columns = table.columns[start:end]
    sides = "".join("l" if column.left else "r" for column in columns)
    lines = [r"\resizebox{\textwidth}{!}{%", rf"\begin{{tabular}}{{l{sides}}}", r"\toprule"]
    if any(column.group for column in columns):
        cells, rules, at = [""], [], 2
        for group, width, _, _ in table.groups(start, end):
            cells.append(rf"\multicolumn{{{width}}}{{c}}{{{latex(group)}}}")
            if group:
                rules.append(rf"\cmidrule(lr){{{at}-{at + width - 1}}}")
            at += width
        lines += [" & ".join(cells) + r" \\", "".join(rules)]
    lines.append(" & ".join([latex(table.row_heading)] + [latex(c.label) for c in columns])
                 + r" \\")
    lines.append(r"\midrule")
    for row in table.rows:
        label = latex(row.label) + (" !" if row.marked else "")
        if row.sublabel:
            label += rf" {{\scriptsize ({latex(row.sublabel)})}}"
        if row.notes:
            label += rf"\textsuperscript{{{','.join(row.notes)}}}"
        lines.append(" & ".join([label] + [latex_cell(c) for c in row.cells[start:end]]) + r" \\")
    return lines + [r"\bottomrule", r"\end{tabular}}"]


def latex_cell(cell):
    text = latex(cell.shown)
    if cell.rank == 1:
        text = rf"\textbf{{{text}}}"
    elif cell.rank == 2:
        text = rf"\underline{{{text}}}"
    if cell.foreign and cell.shown != "–":
        text = rf"\textit{{({text})}}"
    small = [part for part in (cell.spread_text, cell.count_text,
                               cell.fault if cell.value is not None else "") if part]
    if small:
        text += rf" {{\scriptsize [{latex('; '.join(small))}]}}"
    if cell.notes:
        text += rf"\textsuperscript{{{','.join(cell.notes)}}}"
    return text


def latex(text):
    """@param text words between backticks are commands."""
    parts = ["".join(LATEX_SPECIAL.get(letter_, letter_) for letter_ in part)
             for part in str(text).split("`")]
    return "".join(rf"\texttt{{{part}}}" if i % 2 else part for i, part in enumerate(parts))
