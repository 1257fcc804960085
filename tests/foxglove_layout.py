"""The layouts for Foxglove and Lichtblick in examples/foxglove."""
import json
import pathlib

FOLDER = pathlib.Path(__file__).resolve().parent.parent / "examples" / "foxglove"


def topics_of(name):
    """What a layout's panels show."""
    layout = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    panels = layout["configById"]
    assert set(panels) == set(_leaves(layout["layout"])), "each panel has a place, and each place a panel"
    topics = set()
    for panel in panels.values():
        image = panel.get("imageMode", {})
        topics |= {*panel.get("topics", {}), *image.get("annotations", {})}
        topics |= {image[key] for key in ("imageTopic", "calibrationTopic") if key in image}
        topics |= {path["value"].split(".")[0] for path in panel.get("paths", [])}
        topics |= {panel["topicPath"].split(".")[0]} if "topicPath" in panel else set()
        topics |= {panel["topicToRender"]} if "topicToRender" in panel else set()
    return topics


def _leaves(node):
    return [node] if isinstance(node, str) else _leaves(node["first"]) + _leaves(node["second"])
