"""How long map() and room() keep their caller while frames come: in a large map, and as a sequence is mapped.

    map_file_bench --keyframes 500 --features 1000 --file large.map --keep
    PYTHONPATH=build/release/python python bench/snapshot_wait.py SEQUENCE [--map large.map --camera FX FY CX CY]

The camera is that of the map; its size must be the sequence's.
"""
import argparse
import statistics
import time

import ygslam


def waited_ms(call):
    start = time.perf_counter()
    answer = call()
    return 1e3 * (time.perf_counter() - start), answer


def row(name, waits):
    waits = sorted(waits)
    print(f"{name:8} median {statistics.median(waits):8.3f} ms   p99 {waits[int(.99 * (len(waits) - 1))]:8.3f} ms   "
          f"max {waits[-1]:8.3f} ms   ({len(waits)} calls)")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sequence")
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--map", default="")
    parser.add_argument("--camera", type=float, nargs=4)
    arguments = parser.parse_args()
    frames = ygslam.open(arguments.sequence)
    camera = frames.camera
    if arguments.camera:
        camera = ygslam.CameraModel(*arguments.camera, width=camera.width, height=camera.height)
    slam = ygslam.Slam(camera, segmenter="none", load_map=arguments.map)
    maps, rooms = [], []
    for i in range(min(arguments.frames, len(frames))):
        frame = frames[i]
        slam.process(frame.rgb, frame.depth, frame.t_ns)
        wait_ms, snapshot = waited_ms(slam.map)
        maps.append(wait_ms)
        if hasattr(slam, "room"):
            wait_ms, room = waited_ms(slam.room)
            rooms.append(wait_ms)
    print(f"{snapshot}: {len(snapshot.keyframes)} keyframes, {len(snapshot.landmarks)} landmarks, "
          f"{len(snapshot.points)} points")
    row("map()", maps)
    if rooms:
        print(room)
        row("room()", rooms)


if __name__ == "__main__":
    main()
