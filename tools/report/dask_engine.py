"""What `ygslam bench --engine dask://HOST:PORT` runs in place of a run: hands it to a Dask worker.

    python dask_engine.py check HOST:PORT FOLDER PATH...          # can its workers do the work?
    python dask_engine.py run HOST:PORT FOLDER LIMIT_S COMMAND...

Both end with one line of JSON on stderr: {"slots": N}, how many runs fit at a time; and how the run
ended. Exit codes: 0; 9 with one line of error where the engine, not the run, is at fault.
Workers need the files at the same places, and nothing of this project's Python.
"""
import json
import logging
import os
import signal
import sys
import tempfile
import threading
import time
import uuid

CONNECT_S = 10
EXIT_ENGINE = 9


def run_here(command, folder, limit_s):
    """On a worker: the command to its end, in a folder that is empty whoever was there before."""
    import contextlib
    import shutil
    import subprocess
    import distributed
    patience_s, look_s = 5, 0.5  # for a run that is asked to end; between two looks
    if not os.path.isdir(folder):
        raise FileNotFoundError(f"{folder} is not there: all workers must see the same files")
    for entry in os.scandir(folder):  # of a worker that died
        shutil.rmtree(entry) if entry.is_dir(follow_symlinks=False) else os.unlink(entry)
    worker, client = distributed.get_worker(), distributed.get_client()
    key, start = worker.get_current_task(), time.monotonic()
    asked_s = None
    with tempfile.TemporaryFile() as errors:
        # The kernel ends the run with the worker: it is done again elsewhere, in the same folder.
        child = subprocess.Popen(["setpriv", "--pdeathsig", "KILL", *command], cwd="/", stderr=errors,
                                 stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        try:
            while child.poll() is None:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    child.wait(look_s)
                # Nobody waits for it any more, or the scheduler has given it to another worker.
                if key not in client.processing([worker.address]).get(worker.address, ()):
                    raise RuntimeError("the scheduler wants this run no more")
                now = time.monotonic()
                if asked_s is None and limit_s and now - start > limit_s:
                    child.terminate()
                    asked_s = now
                elif asked_s is not None and now - asked_s > patience_s:
                    child.kill()
        finally:
            if child.poll() is None:
                child.kill()  # without a word to the files, which may be another one's by now
                child.wait()
        errors.seek(max(0, errors.seek(0, os.SEEK_END) - 8192))
        said = errors.read().decode("utf-8", "replace")
    return {"exit_code": max(child.returncode, 0), "signal": max(-child.returncode, 0),
            "wall_s": time.monotonic() - start, "timed_out": asked_s is not None, "errors": said}


def end_here(command):
    """On a worker, while it works: asks the run of that command to end. @return how many there were."""
    import psutil
    runs = [child for child in psutil.Process().children() if child.cmdline() == command]
    for child in runs:
        child.terminate()
    return len(runs)


def fault_here(marker, paths):
    """On a worker: what it does not see, or an empty text."""
    import shutil
    if shutil.which("setpriv") is None:
        return "has no setpriv (Debian's util-linux)"
    for path in (marker, *paths):
        if not os.path.exists(path):
            return f"does not see {path}: all workers must see the same files"
    if not os.access(os.path.dirname(marker), os.W_OK):
        return f"must not write to {os.path.dirname(marker)}"
    return "" if os.access(paths[0], os.X_OK) else f"must not run {paths[0]}"


def check(client, folder, paths):
    """How many runs fit at a time. @raise RuntimeError naming a worker and what is wrong with it."""
    versions = client.get_versions()  # before any code is sent

    def told(of):
        return {"Python": of["host"]["python"].rsplit(".", 2)[0],
                "distributed": of["packages"]["distributed"]}
    ours = told(versions["client"])
    for address, of in versions["workers"].items():
        for what, version in told(of).items():
            if version != ours[what]:
                raise RuntimeError(f"worker {address} has {what} {version}, here it is {ours[what]}")
    # A name that no other folder at the same place can have.
    with tempfile.NamedTemporaryFile(dir=folder, prefix=".engine-") as marker:
        faults = client.run(fault_here, marker.name, paths)
    for address, fault in faults.items():
        if fault:
            raise RuntimeError(f"worker {address} {fault}")
    slots = sum(client.nthreads().values())
    if slots == 0:
        raise RuntimeError("the scheduler has no workers")
    return {"slots": slots}


def run(client, folder, limit_s, command):
    """How the run ended on whatever worker it ended."""
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    future = client.submit(run_here, command, folder, limit_s, pure=False, retries=0,
                           key=f"ygslam-{uuid.uuid4().hex}")
    while not future.done():
        if stop.wait(0.1):
            if not any(client.run(end_here, command).values()):
                raise RuntimeError("ended before a worker began")
            break
    return future.result()


def main(arguments):
    action, address, folder, *rest = arguments
    try:
        from distributed import Client
    except ImportError as error:
        return {"error": str(error)}
    logging.disable()  # one line says it all
    try:
        client = Client(f"tcp://{address}", timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        return {"error": f"no Dask scheduler at {address}: {error}"}
    try:
        if action == "check":
            return check(client, folder, rest)
        return run(client, folder, float(rest[0]), rest[1:])
    except Exception as error:  # whatever a worker, a network or a library may raise
        return {"error": " ".join(f"{type(error).__name__}: {error}".split())}


if __name__ == "__main__":
    outcome = main(sys.argv[1:])
    print("error: " + outcome["error"] if "error" in outcome else json.dumps(outcome),
          file=sys.stderr, flush=True)
    os._exit(EXIT_ENGINE if "error" in outcome else 0)  # its threads have nothing to say
