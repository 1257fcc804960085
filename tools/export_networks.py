"""The networks that tools/export_model.py exports: whose, under which licence, from where."""

from dataclasses import dataclass

ULTRALYTICS = "ultralytics"
OPENMMLAB = "openmmlab"
ROBOFLOW = "roboflow"

LICENCES = {
    ULTRALYTICS: "AGPL-3.0, code and weights (or an Ultralytics enterprise licence)",
    OPENMMLAB: "Apache-2.0, code and weights",
    ROBOFLOW: "Apache-2.0, code and weights",
}
HOMES = {
    ULTRALYTICS: "https://ultralytics.com/license",
    OPENMMLAB: "https://github.com/open-mmlab/mmdetection",
    ROBOFLOW: "https://github.com/roboflow/rf-detr",
}
PYTHONS = {ULTRALYTICS: (10, 13), OPENMMLAB: (10, 11), ROBOFLOW: (11, 13)}  # 3.x to 3.y
# Each file is installed after those before it, with these options of pip.
REQUIREMENTS = {
    ULTRALYTICS: [
        ("requirements-torch.txt",),
        ("requirements-export.txt",),
        ("requirements-ultralytics.txt", "--no-deps"),
    ],
    OPENMMLAB: [("requirements-rtmdet.txt",), ("requirements-openmmlab.txt", "--no-deps")],
    ROBOFLOW: [("requirements-torch.txt",), ("requirements-rfdetr.txt",)],
}
# Hosts beside PyPI that an export with the published weights must reach.
HOSTS = {
    ULTRALYTICS: "github.com",
    OPENMMLAB: "download.openmmlab.com",
    ROBOFLOW: "storage.googleapis.com",
}


@dataclass(frozen=True)
class Network:
    """One network that can be exported."""

    name: str
    maker: str
    weights_url: str  # empty: the maker's own package downloads them

    @property
    def has_open_size(self):
        """Whether its export can leave the input size open."""
        return self.maker == ULTRALYTICS

    @property
    def default_size(self):
        """(height, width), None for the network's own."""
        return None if self.maker == ROBOFLOW else (480, 640)

    @property
    def notice(self):
        """Whose it is and what that means."""
        return (
            f"Notice: {self.name} and its weights are licensed under {LICENCES[self.maker]}.\n"
            "They are no part of this project, which is Apache-2.0 and does not ship them.\n"
            f"What you do with the exported model is under that licence: {HOMES[self.maker]}\n"
        )


def _ultralytics():
    for family, release in (("yolov8", "v8.3.0"), ("yolo11", "v8.3.0"), ("yolo26", "v8.4.0")):
        for size in "nsmlx":
            name = f"{family}{size}-seg"
            url = f"https://github.com/ultralytics/assets/releases/download/{release}/{name}.pt"
            yield Network(name, ULTRALYTICS, url)


def _rtmdet():
    stamps = {
        "tiny": "20221130_151727-ec670f7e",
        "s": "20221121_212604-fdc5d7ec",
        "m": "20221123_001039-6eba602e",
        "l": "20221124_103237-78d1d652",
    }
    folder = "https://download.openmmlab.com/mmdetection/v3.0/rtmdet"
    for size, stamp in stamps.items():
        stem = f"rtmdet-ins_{size}_8xb32-300e_coco"
        yield Network(f"rtmdet-ins-{size}", OPENMMLAB, f"{folder}/{stem}/{stem}_{stamp}.pth")


def _rfdetr():
    for size in ("nano", "small", "medium", "large"):
        yield Network(f"rfdetr-seg-{size}", ROBOFLOW, "")


NETWORKS = {
    network.name: network for make in (_ultralytics, _rtmdet, _rfdetr) for network in make()
}
DEFAULT = "yolov8n-seg"


def table():
    """The networks by maker, with licence and needs, for --help."""
    lines = ["networks (NAME), their licences and what an export needs beside PyPI:"]
    for maker, licence in LICENCES.items():
        names = [network.name for network in NETWORKS.values() if network.maker == maker]
        low, high = PYTHONS[maker]
        for first in range(0, len(names), 5):
            lines.append("  " + " ".join(names[first : first + 5]))
        lines.append(f"      {licence}")
        lines.append(f"      Python 3.{low} to 3.{high}; published weights from {HOSTS[maker]}")
    return "\n".join(lines)
