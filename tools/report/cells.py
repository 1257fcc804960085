"""Tables as data: what the writers for HTML, LaTeX, CSV and JSON share."""
import dataclasses


@dataclasses.dataclass
class Cell:
    """@p kind: measured, published, derived, text, none.
    @p value with @p low and @p high as numbers; @p text is what is read (made from value if None).
    @p foreign: a published figure beside a sequence that is not the one it was measured on.
    @p fault: what went wrong with runs behind the figure, or instead of it."""
    kind: str = "none"
    value: float | None = None
    low: float | None = None
    high: float | None = None
    n: int | None = None
    total: int | None = None
    coverage: float | None = None
    decimals: int = 4
    unit: str = ""
    text: str | None = None
    fault: str = ""
    foreign: bool = False
    rank: int = 0  # 1 best, 2 second best, 0 neither
    notes: list = dataclasses.field(default_factory=list)

    @property
    def shown(self):
        if self.text is not None:
            return self.text
        if self.value is None:
            return self.fault or "–"
        return f"{self.value:.{self.decimals}f}{self.unit}"

    @property
    def spread_text(self):
        """'0.0128–0.0141', empty where it says nothing."""
        if self.low is None or self.n == 1:
            return ""
        return f"{self.low:.{self.decimals}f}–{self.high:.{self.decimals}f}"

    @property
    def count_text(self):
        """'4/5', empty where nothing was counted."""
        return "" if self.total is None else f"{self.n}/{self.total}"

    @property
    def coverage_text(self):
        return "" if self.coverage is None else f"tracked {100 * self.coverage:.1f} %"


@dataclasses.dataclass
class Column:
    label: str
    group: str = ""
    citation: str | None = None  # key of published.json's citations
    published: bool = False
    left: bool = False  # a column of words


@dataclasses.dataclass
class Row:
    label: str
    sublabel: str = ""
    cells: list = dataclasses.field(default_factory=list)
    kind: str = ""  # tum, rendered, bonn, folder, published
    marked: bool = False
    citation: str | None = None
    notes: list = dataclasses.field(default_factory=list)  # letters of footnotes of the whole row
    not_run: bool = False  # published figures alone


@dataclasses.dataclass
class Table:
    id: str
    number: str  # "2a"
    title: str
    caption: str
    row_heading: str
    columns: list
    rows: list = dataclasses.field(default_factory=list)
    notes: list = dataclasses.field(default_factory=list)
    remarks: list = dataclasses.field(default_factory=list)  # of the whole table, without a letter

    @property
    def run_rows(self):
        """Those that stand in the table, where any was run; the others are folded below it."""
        return [row for row in self.rows if not row.not_run] or self.rows

    @property
    def folded_rows(self):
        return [row for row in self.rows if row not in self.run_rows]

    @property
    def has_groups(self):
        return any(column.group for column in self.columns)

    def note(self, text):
        """The letter of a footnote, new or the same one again."""
        if text not in self.notes:
            self.notes.append(text)
        return letter(self.notes.index(text))

    def sources(self):
        """Keys of the citations that figures of this table come from, each once."""
        keys = [c.citation for c in self.columns] + [r.citation for r in self.rows]
        return list(dict.fromkeys(key for key in keys if key))

    def parts(self, most, most_with_spreads):
        """Ranges of columns that fit beside each other, cut between groups."""
        wide = any(cell.spread_text for row in self.rows for cell in row.cells)
        most = most_with_spreads if wide else most
        parts, start, at = [], 0, 0
        for _, width, _, _ in self.groups():
            if at + width - start > most and at > start:
                parts.append((start, at))
                start = at
            at += width
        return parts + [(start, at)]

    def groups(self, start=0, end=None):
        """[(group, number of columns, citation, published)] side by side."""
        found = []
        for column in self.columns[start:end]:
            if found and found[-1][0] == column.group and column.group:
                found[-1][1] += 1
            else:
                found.append([column.group, 1, column.citation, column.published])
        return [tuple(group) for group in found]


def letter(index):
    """a, b, ..., z, aa, ab, ..."""
    name = ""
    index += 1
    while index:
        index, rest = divmod(index - 1, 26)
        name = chr(ord("a") + rest) + name
    return name


def rank(cells):
    """Marks the best (lowest) and second best of the sound figures; those that read the same share a place."""
    judged = [cell for cell in cells
              if cell.value is not None and not cell.fault and not cell.foreign]
    values = sorted({round(cell.value, cell.decimals) for cell in judged})
    for cell in judged:
        place = values.index(round(cell.value, cell.decimals))
        cell.rank = place + 1 if place < 2 and len(values) > 1 else 0
