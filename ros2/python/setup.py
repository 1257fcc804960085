from setuptools import setup

NAME = "ygslam_ros_py"
setup(name=NAME, version="0.1.0", packages=[NAME], zip_safe=True, license="Apache-2.0",
      description="ROS 2 node of YG-SLAM", maintainer="YG-SLAM developers", maintainer_email="ygslam@example.org",
      data_files=[("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
                  (f"share/{NAME}", ["package.xml"]), (f"share/{NAME}/launch", ["launch/ygslam.launch.py"])],
      install_requires=["setuptools"], entry_points={"console_scripts": [f"ygslam = {NAME}:main"]})
