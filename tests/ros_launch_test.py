"""The launch files and the layout of the ROS 2 nodes, without ROS: what they name is what the nodes have.

    python tests/ros_launch_test.py

`launch` and `launch_ros` are in no package index: here stand recorders of the calls that the files make of them, with the
names and keywords of their documentation (launch.actions.DeclareLaunchArgument, launch.substitutions.LaunchConfiguration,
launch_ros.actions.Node, launch_ros.parameter_descriptions.ParameterValue). A wrong name or keyword fails.
"""
import ast
import pathlib
import re
import runpy
import sys
import types
import unittest
from dataclasses import dataclass, field
from unittest import mock

from foxglove_layout import topics_of

ROOT = pathlib.Path(__file__).resolve().parent.parent
NODE = ROOT / "python" / "ygslam" / "ros"


@dataclass(frozen=True)
class LaunchConfiguration:
    variable_name: str


@dataclass
class ParameterValue:
    value: LaunchConfiguration
    value_type: type


@dataclass
class DeclareLaunchArgument:
    name: str
    default_value: str

    def __post_init__(self):
        assert isinstance(self.default_value, str), f"{self.name}: launch takes texts alone"


@dataclass
class Node:
    executable: str
    package: str
    name: str
    output: str = "log"
    parameters: list = field(default_factory=list)
    remappings: list = field(default_factory=list)
    arguments: list = field(default_factory=list)


@dataclass
class LaunchDescription:
    entities: list

    def all_of(self, kind):
        return [entity for entity in self.entities if isinstance(entity, kind)]


def described(file):
    recorders = {"launch": [LaunchDescription], "launch.actions": [DeclareLaunchArgument],
                 "launch.substitutions": [LaunchConfiguration], "launch_ros": [], "launch_ros.actions": [Node],
                 "launch_ros.parameter_descriptions": [ParameterValue]}
    modules = {}
    for name, kinds in recorders.items():
        modules[name] = types.ModuleType(name)
        for kind in kinds:
            setattr(modules[name], kind.__name__, kind)
    with mock.patch.dict(sys.modules, modules):
        return runpy.run_path(str(file))["generate_launch_description"]()


def resolved(value, arguments):
    """As `ros2 launch` does it, with the defaults."""
    if isinstance(value, ParameterValue):
        text = arguments[value.value.variable_name]
        return {"true": True, "false": False}[text] if value.value_type is bool else value.value_type(text)
    if isinstance(value, LaunchConfiguration):
        return arguments[value.variable_name]
    return "".join(resolved(part, arguments) for part in value) if isinstance(value, list) else value


def own_parameters():
    for statement in ast.parse((NODE / "parameters.py").read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign) and statement.targets[0].id == "OWN":
            return {ast.literal_eval(name): ast.literal_eval(given.elts[0])
                    for name, given in zip(statement.value.keys, statement.value.values)}
    raise AssertionError("no OWN")


def published():
    """~/ is the node's name."""
    text = (NODE / "outputs.py").read_text(encoding="utf-8")
    return {topic.replace("~", "/ygslam") for topic in re.findall(r'create_publisher\(\w+, "([^"]+)"', text)}


class TheLaunchFiles(unittest.TestCase):
    def read(self, file):
        description = described(file)
        arguments = {one.name: one.default_value for one in description.all_of(DeclareLaunchArgument)}
        self.assertEqual(len(arguments), len(description.all_of(DeclareLaunchArgument)), "no name twice")
        return arguments, description.all_of(Node)

    def test_the_python_node_gets_parameters_that_it_has(self):
        arguments, nodes = self.read(ROOT / "ros2" / "python" / "launch" / "ygslam.launch.py")
        node, = nodes
        self.assertEqual((node.package, node.executable, node.name), ("ygslam_ros_py", "ygslam", "ygslam"))
        setup = (ROOT / "ros2" / "python" / "setup.py").read_text(encoding="utf-8")
        self.assertIn('NAME = "ygslam_ros_py"', setup)
        self.assertIn('f"ygslam = {NAME}:main"', setup)
        own = own_parameters()
        given = {name: resolved(value, arguments) for one in node.parameters for name, value in one.items()}
        self.assertLessEqual(set(given) - {"use_sim_time"}, set(own))
        other = {name: value for name, value in given.items() if name in own and value != own[name]}
        self.assertEqual(other, {"base_frame": "camera_link"}, "all else as the node has it by itself")
        self.assertIs(given["use_sim_time"], False)

    def test_the_python_node_gets_the_topics_of_a_realsense(self):
        arguments, (node,) = self.read(ROOT / "ros2" / "python" / "launch" / "ygslam.launch.py")
        topics = {topic: resolved(target, arguments) for topic, target in node.remappings}
        text = (NODE / "node.py").read_text(encoding="utf-8")
        for topic in ("rgb/image", "rgb/camera_info", "depth/image", "depth/camera_info", "imu", "odom"):
            self.assertIn(f'"{topic}"', text, "the node listens to it")
            self.assertTrue(topics[topic].startswith("/odom" if topic == "odom" else "/camera/camera/"), topic)
        self.assertEqual(topics["rgb/image/compressed"], topics["rgb/image"] + "/compressed")
        self.assertEqual(topics["depth/image/compressedDepth"], topics["depth/image"] + "/compressedDepth")
        arguments["rgb_image"] = "/front/image"
        self.assertEqual(resolved(dict(node.remappings)["rgb/image/compressed"], arguments), "/front/image/compressed")

    def test_the_node_in_cpp_gets_parameters_and_topics_that_it_has(self):
        arguments, (node, base) = self.read(ROOT / "ros2" / "launch" / "ygslam.launch.py")
        source = (ROOT / "ros2" / "src" / "ygslam_node.cpp").read_text(encoding="utf-8")
        self.assertEqual((node.package, node.executable), ("ygslam_ros", "ygslam"))
        for name in [*node.parameters[0], *dict(node.remappings)]:
            self.assertIn(f'"{name}"', source)
        self.assertEqual(base.package, "tf2_ros")
        self.assertIn("camera_link", [resolved(word, arguments) for word in base.arguments])


class TheLayoutForFoxglove(unittest.TestCase):
    def test_it_shows_all_that_the_node_publishes_and_nothing_else(self):
        inputs = {"/rgb/image", "/rgb/camera_info"}
        transforms = {"/tf"}  # a 3D panel takes them by itself
        self.assertEqual(topics_of("ros") - inputs, published() - transforms)


if __name__ == "__main__":
    unittest.main()
