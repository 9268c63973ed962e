"""Threads, signals, panics, processes."""

import multiprocessing
import os
import signal
import sys
import threading
import time

import numpy as np
import pytest

import bansho
from bansho import _bansho

LONG = "bansho = 2\n[picture]\nsize = [960, 540]\nframes = 200\n[[flame_particles]]\nparticles = 4000\npreroll_s = 30\n"


def test_a_panic_becomes_an_exception_and_the_interpreter_lives(capfd):
    with pytest.raises(bansho.InternalError, match="Bansho failed: on purpose; this is a bug"):
        _bansho.panic_for_test("on purpose")
    assert bansho.open(bansho.Scene([bansho.FlameSheet()]), size=(16, 16)).render(0).linear.shape == (16, 16, 4)


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_an_interrupt_stops_the_work_within_100_ms():
    shot = bansho.open(bansho.Scene.parse(LONG))
    sent = []

    def interrupt():
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    # A shell starts its background jobs with the signal ignored, and Python leaves it so.
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        threading.Timer(0.3, interrupt).start()
        with pytest.raises(KeyboardInterrupt):
            shot.render(199)
        elapsed = time.perf_counter() - sent[0]
    finally:
        signal.signal(signal.SIGINT, handler)
    # 0.1 s on an idle machine; other programs may take the time of a thread.
    assert elapsed < 0.3, f"{elapsed * 1e3:.0f} ms"
    # Other work goes on.
    assert shot.time_of(0) == 0.0


def test_other_threads_run_while_a_frame_is_drawn():
    shot = bansho.open(bansho.Scene([bansho.Picture(size=(640, 360)), bansho.FlameSheet(), bansho.Rain()]))
    counted = [0]
    is_done = threading.Event()

    def count():
        while not is_done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    for number in range(10):
        shot.render(number)
    is_done.set()
    thread.join()
    assert counted[0] > 5


def test_a_shot_may_be_used_from_several_threads(torch_scene):
    shot = bansho.open(torch_scene)
    expected = [shot.render(number).linear for number in range(4)]
    results = {}

    def draw(number):
        results[number] = shot.render(number).linear

    threads = [threading.Thread(target=draw, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(results[number], expected[number]) for number in range(4))


def rain_in_child(queue):
    image = np.full((48, 64, 3), 90, np.uint8)
    queue.put(bansho.rain(image, rate_mm_per_h=80, strength=10.0, seed=3).tobytes())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_draws_the_same():
    image = np.full((48, 64, 3), 90, np.uint8)
    expected = bansho.rain(image, rate_mm_per_h=80, strength=10.0, seed=3).tobytes()
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    process = context.Process(target=rain_in_child, args=(queue,))
    process.start()
    try:
        assert queue.get(timeout=60) == expected
    finally:
        process.join(10)
        process.kill()
