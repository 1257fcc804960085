"""Makes messages that no wheel of ROS 2 has, for the tests of the node: run by the interpreter of the environment
that they go to.

    .venv/ros-kilted/bin/python tools/ros_messages.py tests/ros_messages/*

Each folder is a package with msg/*.msg. rosidl's own generators write C, which is compiled into one library
beside the environment's packages, with what Fast DDS asks for.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import sysconfig
import tempfile

PREFIX = pathlib.Path(sys.prefix)
os.environ["AMENT_PREFIX_PATH"] = str(PREFIX)
TYPE_SUPPORTS = ["rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"]


def generate(package, folder, out):
    """Writes the C and Python of a package below `out`. @return the hash of each type by its name."""
    from rosidl_adapter.cli import TranslateMsgToIDL
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_generator_type_description.cli import HashTypeDescription
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport
    share, idl = [str(PREFIX / "share")], out / "idl" / package
    idl.mkdir(parents=True)
    messages = [f"{folder.resolve()}:msg/{file.name}" for file in sorted(folder.glob("msg/*.msg"))]
    files = TranslateMsgToIDL("msg2idl").translate(package, messages, share, idl)
    hashes = HashTypeDescription("hash").generate_type_hashes(package, files, [*share, str(out / "idl")], idl)
    for generator, more in ((GenerateC("c"), [hashes]),
                            (GenerateCTypesupport("ts", typesupport_implementations=TYPE_SUPPORTS), []),
                            (GenerateFastRTPSCTypesupport("ts"), []),
                            (GenerateIntrospectionCTypesupport("ts"), []),
                            (GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]), [])):
        place = out / type(generator).__name__ / package
        place.mkdir(parents=True)
        generator.generate(package, files, share, place, *more)
    return {said["type_hashes"][0]["type_name"]: said["type_hashes"][0]["hash_string"]
            for said in (json.loads(pathlib.Path(file).read_text(encoding="utf-8")) for file in hashes)}


def flags():
    import numpy
    include = PREFIX / "include"
    folders = [f"-I{folder}" for folder in include.iterdir() if folder.is_dir()]
    return ["-O1", "-fPIC", "-w", "-DNDEBUG", *folders, f"-I{include}", f"-I{numpy.get_include()}",
            f"-I{sysconfig.get_paths()['include']}", f"-I{sysconfig.get_paths()['platinclude']}"]


def compile_all(package, out, target):
    """One shared object of all that was generated."""
    sources = [file for kind in ("c", "cpp") for file in sorted(out.glob(f"Generate*/{package}/**/*.{kind}"))]
    includes = [f"-I{folder}" for folder in out.glob("Generate*")]
    objects = []
    for source in sources:
        objects.append(out / f"{package}_{len(objects)}.o")
        subprocess.run(["g++" if source.suffix == ".cpp" else "gcc", "-c", *includes, *flags(), "-o", objects[-1],
                        source], check=True)
    libraries = [f"-l:{file.name}" for name in ("std_msgs", "geometry_msgs", "builtin_interfaces", "rosidl", "rmw")
                 for file in sorted((PREFIX / "lib").glob(f"lib{name}*.so")) if "test" not in file.name]
    vendored = [f"-Wl,-rpath,{folder}" for folder in target.parent.parent.glob("*.libs")]
    subprocess.run(["g++", "-shared", "-o", target, *objects, f"-L{PREFIX / 'lib'}", f"-Wl,-rpath,{PREFIX / 'lib'}",
                    *vendored, "-Wl,--allow-shlib-undefined", "-Wl,--as-needed", *libraries], check=True)


def install(folder):
    package = folder.name
    place = pathlib.Path(sysconfig.get_paths()["purelib"]) / package
    with tempfile.TemporaryDirectory(prefix="ros_messages_") as scratch:
        out = pathlib.Path(scratch)
        hashes = generate(package, folder, out)
        python = out / "GeneratePython" / package
        shutil.rmtree(place, ignore_errors=True)
        (place / "msg").mkdir(parents=True)
        (place / "__init__.py").touch()
        for file in python.glob("msg/*.py"):
            shutil.copy(file, place / "msg")
        library = place / f"{package}_s__rosidl_typesupport_c.so"
        compile_all(package, out, library)
        for name in TYPE_SUPPORTS:  # where the dispatching type support looks
            link = PREFIX / "lib" / f"lib{package}__{name}.so"
            link.unlink(missing_ok=True)
            link.symlink_to(library)
    return hashes


def main():
    for folder in map(pathlib.Path, sys.argv[1:]):
        for name, digest in install(folder).items():
            print(name, digest)


if __name__ == "__main__":
    main()
