"""Ctrl-C stops long work, and a forked process says that it cannot do any."""

import os
import signal
import subprocess
import sys
import time

import pytest

HERE = os.path.dirname(__file__)
ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join([HERE, os.environ.get("PYTHONPATH", "")]),
}

WORK = """
import sys, time
import numpy as np
import hemicube as hc
from shapes import sphere

vertices, faces = sphere(1.0, 150, inwards=True)
ball = sphere(0.3, 30)
print("ready", flush=True)
try:
    hc.view_factors(vertices, faces, obstacles=ball, memory=1 << 50)
except KeyboardInterrupt:
    print("stopped", time.time(), flush=True)
    # The process goes on as if nothing had been.
    print(len(hc.view_factors(*sphere(1.0, 4, inwards=True))), flush=True)
"""

# What a busy machine may take; it is a few hundredths of a second otherwise.
PATIENCE = 10.0


@pytest.mark.skipif(os.name == "nt", reason="Windows sends Ctrl-C to all processes of a console")
def test_ctrl_c_stops_the_work():
    process = subprocess.Popen(
        [sys.executable, "-c", WORK],
        stdout=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(2.0)
    sent = time.time()
    process.send_signal(signal.SIGINT)
    word, at = process.stdout.readline().split()
    assert word == "stopped"
    took = float(at) - sent
    print(f"from SIGINT to KeyboardInterrupt: {took:.3f} s")
    assert took < PATIENCE
    assert process.stdout.readline() == "48\n"
    assert process.wait(60) == 0


FORKED = """
import os
import hemicube as hc
from shapes import room

hc.view_factors(*room())
if os.fork() == 0:
    try:
        hc.view_factors(*room())
    except hc.Error as error:
        print(error, flush=True)
    os._exit(0)
os.wait()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_forked_process_does_not_wait_for_ever():
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FORKED],
        capture_output=True,
        text=True,
        timeout=60,
        env=ENVIRONMENT,
    )
    assert "use the start method 'spawn'" in done.stdout, done
