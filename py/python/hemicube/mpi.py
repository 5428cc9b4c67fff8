"""Light by several processes, which MPI starts on one machine or on many.

    pip install mpi4py mpich
    mpiexec -n 4 python -m hemicube.mpi light room.glb -o room.hemi

Each process, a rank, makes and keeps its own rows of form factors; all of them hear of all light
after every sweep of the solver. The file is the same to the last byte for any number of ranks. Rows
are kept in a folder beside it until it is complete, and serve the next run if this one is stopped.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import re
import signal
import statistics
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from types import FrameType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _arrays, _hemicube
from ._errors import Error, FileError, InputError
from ._progress import hearer
from .scene import Scene, load

if TYPE_CHECKING:
    from mpi4py import MPI

MISSING = "hemicube.mpi needs mpi4py and an MPI: pip install mpi4py mpich"

MESSAGE = 1 << 30
"""Most bytes that one call of MPI brings: counts of more than 2 GiB are not safe everywhere."""


class Communicator:
    """What the library asks of MPI: bytes of every rank, for all of them or for the first."""

    def __init__(self, comm: MPI.Intracomm, byte: MPI.Datatype) -> None:
        self.comm, self.byte = comm, byte
        self.rank, self.size = comm.Get_rank(), comm.Get_size()
        self.shared: list[int] = []
        """Bytes that all ranks together told each other, call by call."""
        self.collected = 0
        """Bytes that rank 0 alone was told."""

    def all_gather(self, own: bytes) -> list[bytearray]:
        """What each rank gave, on every rank."""
        return self._gathered(own, None)

    def gather(self, own: bytes) -> list[bytearray]:
        """The same on rank 0 alone; nothing on the others."""
        return self._gathered(own, 0)

    def _gathered(self, own: bytes, root: int | None) -> list[bytearray]:
        counts = np.empty(self.size, np.int64)
        _wait(self.comm.Iallgather(np.array([len(own)], np.int64), counts))
        if root is None:
            self.shared.append(int(counts.sum()))
        else:
            self.collected += int(counts.sum())
        hears = root is None or self.rank == root
        found = [bytearray() for _ in counts] if hears else []
        given = np.frombuffer(own, np.uint8)
        step = MESSAGE // self.size
        for start in range(0, int(counts.max()), step):
            now = np.clip(counts - start, 0, step)
            ends = np.cumsum(now)
            buffer = np.empty(int(ends[-1]) if hears else 0, np.uint8)
            into = [buffer, now, ends - now, self.byte] if hears else None
            part = [given[start : start + step], self.byte]
            if root is None:
                _wait(self.comm.Iallgatherv(part, into))
            else:
                _wait(self.comm.Igatherv(part, into, root))
            for piece, count, end in zip(found, now, ends, strict=False):
                piece += buffer[end - count : end].data
        return found


def _wait(request: MPI.Request) -> None:
    """Waits for the other ranks without keeping a core busy: they may need it."""
    pause = 1e-5
    while not request.Test():
        time.sleep(pause)
        pause = min(2.0 * pause, 1e-3)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command on this rank, and returns its exit code."""
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        print(f"{MISSING} ({error})", file=sys.stderr)
        return 2
    comm = MPI.COMM_WORLD
    # One rank alone says what is wrong with the arguments, or how they are used.
    with contextlib.ExitStack() as stack:
        if comm.rank > 0:
            stack.enter_context(contextlib.redirect_stderr(io.StringIO()))
            stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
        args = _arguments().parse_args(arguments)
    if MPI.Query_thread() < MPI.THREAD_MULTIPLE:
        if comm.rank == 0:
            _say("hemicube.mpi needs an MPI whose calls may come from several threads at a time")
        return 2
    local = comm.Split_type(MPI.COMM_TYPE_SHARED).size
    threads = args.threads or max(1, _cores() // local)
    os.environ["RAYON_NUM_THREADS"] = str(threads)

    def stop(number: int, _: FrameType | None) -> None:
        _say(f"rank {comm.rank}: stopped by {signal.Signals(number).name}")
        comm.Abort(128 + number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    ranks = Communicator(comm, MPI.BYTE)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            scene, problem = _scene(args), None
        # A panic of the library is no Exception.
        except BaseException as error:
            scene, problem = None, str(error) or type(error).__name__
        problems = [text for text in comm.allgather(problem) if text is not None]
        if scene is None or problems:
            if ranks.rank == 0:
                _say(_by_flags(problems[0]))
            return 2
        try:
            return _light(scene, args, ranks, local, heard)
        except BaseException as error:
            # Others would wait for this rank for ever. What is wrong on all of them the first says.
            if ranks.rank > 0:
                time.sleep(1.0)
            _say(f"rank {ranks.rank}: {_by_flags(str(error)) or type(error).__name__}")
            if not isinstance(error, Error):
                traceback.print_exc()
            # What was said has to come through first.
            time.sleep(0.2)
            comm.Abort(2 if isinstance(error, (InputError, FileError)) else 1)
            return 1


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m hemicube.mpi",
        description="Light by several processes: mpiexec -n 4 python -m hemicube.mpi light ...",
        epilog="The same for any number of ranks; rows in OUT.hemi.rows serve the next run.",
    )
    light = parser.add_subparsers(dest="command", required=True).add_parser(
        "light", help="solve a model for each source of light, and write OUT.hemi"
    )
    light.add_argument("model", help=".gltf, .glb, .obj, .stl, .ply or .vs3, or a built-in scene")
    light.add_argument("-o", "--output", required=True, metavar="OUT.hemi")
    light.add_argument("--patch-size", type=_area, metavar="AREA", help="largest patch, m²")
    asked = light.add_mutually_exclusive_group()
    rays = _whole(32, 1 << 16)
    asked.add_argument("--samples", type=rays, metavar="N", help="rays a row, 32 to 65536")
    asked.add_argument("--error", type=_share, metavar="PERCENT", help="error aimed at, like 1%%")
    seed = _whole(0, (1 << 32) - 1)
    light.add_argument("--seed", type=seed, default=0, metavar="N", help="another one, other rays")
    light.add_argument("--unit", default="m", help="of the model: m, mm, cm, in, ft, or metres")
    light.add_argument("--up", type=float, nargs=3, metavar=("X", "Y", "Z"))
    light.add_argument("--sides", choices=("file", "one", "two"), default="file")
    light.add_argument("--max-reflectance", type=float, default=0.9, metavar="R")
    light.add_argument("--flip", action="store_true", help="turn every face round")
    light.add_argument(
        "--sky", type=float, nargs=3, metavar=("R", "G", "B"), help="radiance from everywhere"
    )
    light.add_argument("--threads", type=_whole(1, 1 << 16), metavar="N", help="of each rank")
    light.add_argument("--memory", type=_whole(1, 1 << 40), metavar="MIB", help="of each rank")
    light.add_argument("--report", metavar="FILE", help="what happened, as JSON")
    light.add_argument("-q", "--quiet", action="store_true")
    return parser


def _share(text: str) -> float:
    """A share of 1 from a percentage, like 1% or .5%."""
    share = _number(text.removesuffix("%")) / 100.0
    if not text.endswith("%") or not 0.0 < share < 1.0:
        raise argparse.ArgumentTypeError(f"{text!r} is no percentage like 1%")
    return share


def _area(text: str) -> float:
    area = _number(text)
    if not 0.0 < area < np.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is no area in m², like .01")
    return area


def _whole(least: int, most: int) -> Callable[[str], int]:
    """Reads an integer from `least` to `most`."""

    def read(text: str) -> int:
        number = _number(text)
        if not least <= number <= most or number != int(number):
            raise argparse.ArgumentTypeError(f"{text!r} is no integer from {least} to {most}")
        return int(number)

    return read


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no number") from None


def _scene(args: argparse.Namespace) -> Scene:
    """The model, with the sky that was asked for."""
    if not args.output.lower().endswith(".hemi"):
        raise InputError(f"{args.output}: solutions are written as .hemi")
    if args.report and not os.access(os.path.dirname(args.report) or ".", os.W_OK):
        raise FileError(f"{args.report}: cannot be written there")
    scene = load(
        args.model,
        unit=args.unit if args.unit.isalpha() else float(args.unit),
        up=args.up,
        sides=args.sides,
        max_reflectance=args.max_reflectance,
        flip=args.flip,
    )
    if args.sky is not None:
        scene.sky = args.sky
    return scene


def _light(
    scene: Scene,
    args: argparse.Namespace,
    ranks: Communicator,
    local: int,
    heard: list[warnings.WarningMessage],
) -> int:
    """Lights a model, and says on rank 0 what came of it."""
    asked = SimpleNamespace(
        error=args.error,
        samples=args.samples,
        patch_size=args.patch_size,
        seed=args.seed,
        memory=args.memory << 20 if args.memory else _arrays.available_memory() // local,
    )
    bar = hearer(ranks.rank == 0 and not args.quiet and sys.stderr.isatty())
    done = _hemicube.solve_shared(scene._scene, asked, args.output, ranks, bar)
    # What is doubtful about the model all ranks heard, what is about rows some.
    said = ranks.comm.gather([str(warning.message) for warning in heard])
    peaks = np.empty(ranks.size, np.int64)
    ranks.comm.Allgather(np.array([_peak_memory()], np.int64), peaks)
    if said is None:
        return 0
    report: dict[str, Any] = json.loads(done)
    about = report["ranks"]
    # Nothing is shared as often as the light of all patches after a sweep.
    about["bytes_a_sweep"] = statistics.mode(ranks.shared)
    about["bytes_shared"] = sum(ranks.shared)
    about["bytes_collected"] = ranks.collected
    about["peak_memory_bytes"] = peaks.tolist()
    for text in dict.fromkeys(text for texts in said for text in texts):
        _say(f"warning: {text}")
    if not args.quiet:
        _say_report(report, args.output)
    if args.report:
        _write_whole(args.report, json.dumps(report, indent=2) + "\n")
    print(args.output)
    return 0


def _say_report(report: dict[str, Any], output: str) -> None:
    about = report["ranks"]
    rows = about["rows"]
    taken = f", {about['taken_up']} of an earlier run" if about["taken_up"] else ""
    _say(f"{report['scene']}: {report['patches']} patches, {len(rows)} ranks")
    _say(f"rows: {sum(rows)}, {min(rows)} to {max(rows)} a rank{taken}")
    names = ("bytes_a_sweep", "bytes_shared", "bytes_collected")
    sweep, shared, collected = (about[name] / 2**20 for name in names)
    _say(f"sent: {sweep:.2f} MiB a sweep, {shared:.1f} MiB in all, {collected:.0f} MiB of rows")
    _say(f"memory: {max(about['peak_memory_bytes']) / 2**20:.0f} MiB at most in a rank")
    _say(f"{output}: {os.path.getsize(output) / 2**20:.1f} MiB")


def _cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _peak_memory() -> int:
    """The most memory that this process had, bytes; 0 where the system does not say."""
    try:
        with open("/proc/self/status", encoding="ascii") as status:
            peak = next(line for line in status if line.startswith("VmHWM:"))
        return int(peak.split()[1]) << 10
    except (OSError, StopIteration):
        return 0


def _write_whole(path: str, text: str) -> None:
    """Writes a file beside its place, and then into it."""
    folder = os.path.dirname(path) or "."
    file = tempfile.NamedTemporaryFile("w", dir=folder, delete=False, encoding="utf-8")
    try:
        with file:
            file.write(text)
        os.replace(file.name, path)
    except BaseException:
        os.unlink(file.name)
        raise


def _by_flags(text: str) -> str:
    """A message that names arguments of Python (`patch_size=`), with this command's flags."""
    flag = r"\b(error|flip|max_reflectance|memory|patch_size|samples|seed|sides|unit|up)=(\w?)"
    text = text.replace("scene.sky", "--sky")

    def named(found: re.Match[str]) -> str:
        return " ".join(filter(None, ("--" + found[1].replace("_", "-"), found[2])))

    return re.sub(flag, named, text)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
