"""The published figures: reading them, error reductions by eq. (20), and what is wrong in print."""
import json
import pathlib

FILE = pathlib.Path(__file__).with_name("published.json")
TABLES = ("table2", "table3", "table4")
COLUMNS = ("RMSE", "S.D.")
# Percentage points between a printed and a recomputed reduction that rounding of the last digits
# printed explains everywhere; what differs by more is an erratum or was made from other figures.
TOLERANCE_POINTS = 0.05
HALF_DIGIT = 0.00005  # figures are printed with four decimals


def reduction_percent(alpha, beta):
    """Eq. (20) of the paper: (alpha - beta) / alpha x 100 %; None where alpha is not positive."""
    return None if alpha is None or beta is None or alpha <= 0 else 100 * (alpha - beta) / alpha


def could_be_rounding(alpha, beta, printed):
    """Whether unrounded figures that print as alpha and beta can give the printed reduction [%]."""
    low = reduction_percent(alpha - HALF_DIGIT, beta + HALF_DIGIT)
    high = reduction_percent(alpha + HALF_DIGIT, beta - HALF_DIGIT)
    return low - 0.005 <= printed <= high + 0.005


def source_text(citation):
    """A citation as a reader sees it, with what could not be confirmed of it."""
    doubt = citation.get("unconfirmed")
    return citation["text"] + (f" (not confirmed: {doubt})" if doubt else "")


class Published:
    """published.json with the questions the tables ask."""

    def __init__(self, data=None):
        self.data = data or json.loads(FILE.read_text(encoding="utf-8"))
        self.rows = list(self.data["paper_rows"])
        self.systems = self.data["systems"]
        self.peers = self.data["peers_ate_rmse_m"]
        self.citations = self.data["citations"]

    def short(self, row):
        return self.data["paper_rows"][row]["short"]

    def figure(self, table, row, system, column):
        """RMSE (column 0) or S.D. (column 1) as printed; None where the paper has none."""
        pair = self.data[table][row][system]
        return None if pair is None else pair[column]

    def printed_reduction(self, table, row, column):
        return self.data[table][row]["reduction"][column]

    def recomputed_reduction(self, table, row, column):
        return reduction_percent(self.figure(table, row, "ORB-SLAM2", column),
                                 self.figure(table, row, "YG-SLAM", column))

    def erratum(self, table, row, system):
        """The entry of errata for a printed figure, or None."""
        for entry in self.data["errata"]:
            if (entry["where"], entry["row"], entry["system"]) == (table, row, system):
                return entry
        return None

    def reductions_that_differ(self):
        """[(table, row, column)] where print and eq. (20) differ by more than TOLERANCE_POINTS."""
        return [(table, row, column) for table in TABLES for row in self.rows for column in (0, 1)
                if abs(self.recomputed_reduction(table, row, column)
                       - self.printed_reduction(table, row, column)) > TOLERANCE_POINTS]

    def known_errata_of_reductions(self):
        return [(e["where"], e["row"], e["column"]) for e in self.data["errata_of_reductions"]]

    def reduction_note(self, table, row, column):
        """A sentence about a reduction that is printed wrongly, or None."""
        if (table, row, column) not in self.reductions_that_differ():
            return None
        printed = self.printed_reduction(table, row, column)
        pair = [self.figure(table, row, system, column) for system in ("ORB-SLAM2", "YG-SLAM")]
        why = ("figures before rounding could give the printed one"
               if could_be_rounding(*pair, printed) else "no rounding explains the printed one")
        return (f"{self.short(row)}, {COLUMNS[column]}: the paper prints {printed:.2f} %, eq. (20) "
                f"gives {self.recomputed_reduction(table, row, column):.2f} % from the figures "
                f"printed ({why})")

    def average_reduction(self, table, column):
        """Mean of the recomputed reductions over the four walking rows [%]."""
        values = [self.recomputed_reduction(table, row, column) for row in self.walking_rows()]
        return sum(values) / len(values)

    def average_note(self, table):
        """What the paper's text says of the average over the walking rows, and what it is."""
        text = self.data["average_reduction_in_the_text"][table]
        parts = []
        for column, name in enumerate(COLUMNS):
            found = self.average_reduction(table, column)
            wrong = " (an erratum)" if abs(found - text[column]) > TOLERANCE_POINTS else ""
            parts.append(f"{name} {found:.2f} %, in the paper's text {text[column]:.2f} %{wrong}")
        return ("Average published reduction over the four walking rows by eq. (20): "
                + "; ".join(parts))

    def walking_rows(self):
        return [row for row in self.rows if "_walking_" in row]

    def best_ate_m(self, row):
        """Lowest published ATE RMSE of any system on a row of the paper."""
        found = [self.figure("table2", row, system, 0) for system in self.systems]
        found += [peer.get(row) for peer in self.peers.values()]
        return min(value for value in found if value is not None)

    def bonn_best_ate_m(self, name):
        """Lowest published ATE RMSE on a Bonn sequence, by folder name; None if not known."""
        key = name.replace("\\", "/").rstrip("/").rsplit("/", 1)[-1].rsplit("__", 1)[-1]
        for prefix in ("rgbd_bonn_", "bonn_"):
            key = key.removeprefix(prefix)
        return self.data["bonn_best_ate_rmse_m"].get(key)
