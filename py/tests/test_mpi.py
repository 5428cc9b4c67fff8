"""Light by several processes, as mpiexec starts them."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import hemicube as hc

if not os.environ.get("HEMICUBE_REQUIRE_MPI"):
    pytest.importorskip("mpi4py")

MPIEXEC = Path(sys.executable).parent / "mpiexec"
SMALL = ["--patch-size", ".05", "--samples", "64"]


def command(ranks, *arguments):
    program = [MPIEXEC, "-n", ranks, sys.executable, "-m", "hemicube.mpi", "light"]
    return [str(part) for part in [*program, *arguments, "--threads", 1]]


def light(ranks, *arguments):
    return subprocess.run(
        command(ranks, *arguments), capture_output=True, text=True, timeout=600, check=False
    )


@pytest.fixture(scope="module")
def of_one(tmp_path_factory):
    """The room, solved by one rank."""
    path = tmp_path_factory.mktemp("ranks") / "one.hemi"
    done = light(1, "room", "-o", path, *SMALL)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(path)]
    return path


@pytest.mark.parametrize("ranks", [2, 4])
def test_the_file_is_the_same_for_any_number_of_ranks(ranks, of_one, tmp_path):
    path, report = tmp_path / "room.hemi", tmp_path / "report.json"
    done = light(ranks, "room", "-o", path, *SMALL, "--report", report)
    assert done.returncode == 0, done.stderr
    assert path.read_bytes() == of_one.read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["report.json", "room.hemi"]
    found = json.loads(report.read_text())
    about = found["ranks"]
    assert len(about["rows"]) == len(about["peak_memory_bytes"]) == ranks
    assert max(about["rows"]) - min(about["rows"]) < 0.2 * sum(about["rows"])
    assert about["taken_up"] == 0
    # Three numbers of single precision a patch.
    assert about["bytes_a_sweep"] == 12 * found["patches"]
    assert about["bytes_shared"] > 10 * about["bytes_a_sweep"]
    # Four bytes a hit, of 64 rays a row at most.
    assert 100 < about["bytes_collected"] / sum(about["rows"]) < 300
    assert "MiB a sweep" in done.stderr


def test_light_is_that_of_one_process(of_one, tmp_path):
    scene = hc.load("room")
    scene.light(patch_size=0.05, samples=64).save(tmp_path / "alone.hemi")
    with np.load(of_one) as shared, np.load(tmp_path / "alone.hemi") as alone:
        for name in ("light/irradiance", "light/direct", "light/arrived"):
            apart = np.linalg.norm(shared[name] - alone[name]) / np.linalg.norm(alone[name])
            assert apart < 1e-3, name
        for name in ("factors/patches", "factors/lengths", "factors/halves", "light/usable"):
            assert np.array_equal(shared[name], alone[name]), name
        ends = np.cumsum(alone["factors/lengths"])[:-1:97]
        rows = (np.split(of["factors/columns"], ends) for of in (shared, alone))
        for a, b in zip(*rows, strict=True):
            assert np.array_equal(np.sort(a), np.sort(b))


def pid_of(rank, output):
    """The process of a rank that is to write `output`."""
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().split(b"\0")
            environment = (folder / "environ").read_bytes().split(b"\0")
        except OSError:
            continue
        is_python = b"hemicube.mpi" in words and str(MPIEXEC).encode() not in words
        ours = str(output).encode() in words and f"PMI_RANK={rank}".encode() in environment
        if is_python and ours:
            return int(folder.name)
    raise AssertionError(f"no process of rank {rank}")


def test_a_rank_that_is_killed_ends_the_job_and_its_rows_serve_the_next(of_one, tmp_path):
    path = tmp_path / "room.hemi"
    rows = tmp_path / "room.hemi.rows"
    # Slower: what is killed must not be done.
    slow = ["--patch-size", ".05", "--samples", "1024"]
    with subprocess.Popen(
        command(3, "room", "-o", path, *slow), stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as job:
        deadline = time.monotonic() + 300
        while not rows.is_dir() or len(list(rows.glob("*.rows"))) < 20:
            assert job.poll() is None and time.monotonic() < deadline
            time.sleep(0.02)
        os.kill(pid_of(1, path), signal.SIGKILL)
        said, _ = job.communicate(timeout=60)
    assert job.returncode != 0
    assert b"KILLED BY SIGNAL: 9" in said or b"signal" in said.lower(), said
    assert not path.exists()
    left = len(list(rows.glob("*.rows")))
    done = light(2, "room", "-o", path, *slow, "--report", tmp_path / "report.json")
    assert done.returncode == 0, done.stderr
    about = json.loads((tmp_path / "report.json").read_text())["ranks"]
    assert about["taken_up"] >= left and f"{about['taken_up']} of an earlier run" in done.stderr
    assert not rows.exists()
    afresh = light(4, "room", "-o", tmp_path / "afresh.hemi", *slow)
    assert afresh.returncode == 0, afresh.stderr
    assert (tmp_path / "afresh.hemi").read_bytes() == path.read_bytes()
    # Rows of other options are of no use, and that is said.
    rows.mkdir()
    (rows / "0123456789abcdef-0.rows").write_bytes(b"nothing")
    other = light(2, "room", "-o", path, *SMALL)
    assert other.returncode == 0 and "other options" in other.stderr
    assert path.read_bytes() == of_one.read_bytes() and not rows.exists()


def test_what_is_wrong_is_said_and_ends_the_job(tmp_path):
    none = light(2, tmp_path / "none.obj", "-o", tmp_path / "none.hemi")
    assert none.returncode != 0 and "none.obj" in none.stderr
    folder = light(2, "room", "-o", tmp_path / "none" / "room.hemi", *SMALL)
    assert folder.returncode != 0 and "room.hemi" in folder.stderr
    name = light(2, "room", "-o", tmp_path / "room.png")
    assert name.returncode != 0 and ".hemi" in name.stderr
    share = light(2, "room", "-o", tmp_path / "room.hemi", "--error", "1")
    assert share.returncode != 0 and share.stderr.count("is no percentage") == 1
    rays = light(2, "room", "-o", tmp_path / "room.hemi", "--samples", "7")
    assert rays.returncode != 0 and rays.stderr.count("is no integer from 32 to 65536") == 1
    nowhere = tmp_path / "none" / "r.json"
    report = light(2, "room", "-o", tmp_path / "room.hemi", "--report", nowhere)
    assert report.returncode != 0 and "r.json: cannot be written" in report.stderr
    memory = light(2, "room", "-o", tmp_path / "room.hemi", "--memory", "1")
    assert memory.returncode != 0 and "--samples, or more --memory" in memory.stderr
    assert "Traceback" not in memory.stderr and "samples=" not in memory.stderr
    assert list(tmp_path.iterdir()) == []


def test_messages_are_cut():
    script = """
import hemicube.mpi
from mpi4py import MPI
hemicube.mpi.MESSAGE = 24
ranks = hemicube.mpi.Communicator(MPI.COMM_WORLD, MPI.BYTE)
said = [bytes(range(n)) for n in (50, 0, 17)]
assert ranks.all_gather(said[ranks.rank]) == said
assert ranks.gather(said[ranks.rank]) == (said if ranks.rank == 0 else [])
assert ranks.all_gather(b"") == [b""] * 3
assert (ranks.shared, ranks.collected) == ([67, 0], 67)
"""
    subprocess.run([MPIEXEC, "-n", "3", sys.executable, "-c", script], check=True, timeout=60)


@pytest.mark.parametrize("name", ["_hemicube.solve_shared", "_scene"])
def test_a_rank_that_panics_ends_the_job(name, tmp_path):
    script = f"""
import sys
import hemicube.mpi
from mpi4py import MPI
class Panic(BaseException):
    pass
def fails(*_):
    if MPI.COMM_WORLD.rank == 1:
        raise Panic("it broke")
    if {name!r} != "_scene":
        MPI.COMM_WORLD.Barrier()
hemicube.mpi.{name} = fails
sys.exit(hemicube.mpi.main(["light", "room", "-o", "room.hemi"]))
"""
    done = subprocess.run(
        [MPIEXEC, "-n", "2", sys.executable, "-c", script],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode != 0 and "it broke" in done.stderr


def test_without_mpi4py_the_message_names_it(tmp_path):
    (tmp_path / "mpi4py.py").write_text("raise ImportError('there is none')\n")
    done = subprocess.run(
        [sys.executable, "-m", "hemicube.mpi", "light", "room", "-o", "room.hemi"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )
    assert done.returncode == 2 and "pip install mpi4py mpich" in done.stderr
