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
from bansho import _bansho, weather

LONG = "bansho = 2\n[picture]\nsize = [960, 540]\nframes = 200\n[[flame_particles]]\nparticles = 4000\npreroll_s = 30\n"


def test_a_panic_becomes_an_exception_and_the_interpreter_lives(capfd):
    with pytest.raises(bansho.InternalError, match="Bansho failed: on purpose; this is a bug"):
        _bansho.panic_for_test("on purpose")
    assert bansho.open(bansho.Scene([bansho.FlameSheet()]), size=(16, 16)).render(0).linear.shape == (16, 16, 4)


class BrokenShot:
    """Stands in for a shot that is of no use after a panic."""

    exception: type[BaseException] = bansho.InternalError

    def __init__(self, threads):
        pass

    def draw(self, *arguments):
        raise self.exception("on purpose")


@pytest.mark.parametrize("exception", [bansho.InternalError, MemoryError, KeyboardInterrupt])
def test_rain_and_fog_are_drawn_again_after_a_panic(monkeypatch, exception):
    image, depth = np.full((20, 30, 3), 90, np.uint8), np.full((20, 30), 50.0, np.float32)
    draws = [lambda: bansho.rain(image, depth, strength=5), lambda: bansho.fog(image, depth, 50.0)]
    expected = [draw() for draw in draws]
    monkeypatch.setattr(weather, "_cache", weather._Cache())
    for draw, drawn in zip(draws, expected, strict=True):
        weather._cache._shots.clear()
        with monkeypatch.context() as broken:
            broken.setattr(_bansho, "PlateShot", BrokenShot)
            broken.setattr(BrokenShot, "exception", exception)
            with pytest.raises(exception, match="on purpose"):
                draw()
        assert np.array_equal(draw(), drawn)


def test_a_value_that_is_refused_leaves_the_shot_in_use(monkeypatch):
    monkeypatch.setattr(weather, "_cache", weather._Cache())
    image = np.full((20, 30, 3), 90, np.uint8)
    bansho.rain(image, strength=5)
    (shot,) = weather._cache._shots.values()
    with pytest.raises(ValueError, match="500 is out of range"):
        bansho.rain(image, strength=5, rate_mm_per_h=500)
    bansho.rain(image, strength=5)
    assert list(weather._cache._shots.values()) == [shot]


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def interrupted_after(seconds, work):
    """Does `work`, which takes longer than `seconds`, interrupts it then, and returns how long it goes on, s."""
    sent = []

    def interrupt():
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    # A shell starts its background jobs with the signal ignored, and Python leaves it so.
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        threading.Timer(seconds, interrupt).start()
        with pytest.raises(KeyboardInterrupt):
            work()
        return time.perf_counter() - sent[0]
    finally:
        signal.signal(signal.SIGINT, handler)


def test_an_interrupt_stops_the_work_within_100_ms(tmp_path):
    scene = bansho.Scene.parse(LONG)
    shot, effect = bansho.open(scene), bansho.Effect(scene)
    several = bansho.open(bansho.Scene([bansho.Picture(size=(960, 540), frames=10_000), bansho.FlameSheet(), bansho.Rain()]))
    large = bansho.open(bansho.Scene([bansho.Picture(size=(3840, 2160), frames=1000), bansho.FlameSheet()]))
    image = np.full((2160, 3840, 3), 90, np.uint8)
    calls = {
        "render": lambda: shot.render(199),
        "at": lambda: effect.at(6.0),
        "rain": lambda: [bansho.rain(image, rate_mm_per_h=80, strength=10.0, seed=seed) for seed in range(100)],
        # Most of the time goes into the compression of files.
        "write": lambda: large.write(tmp_path / "f.####.exr"),
        "frames": lambda: list(several.frames(frames_in_flight=3)),
        "streaks": lambda: bansho.streaks(20, size=4096),
        # The start of a loop is searched for.
        "open": lambda: [bansho.open(bansho.Scene([bansho.FlameSheet(), bansho.Rain(rate_mm_per_h=100)]), loop_s=8.0, seed=seed) for seed in range(400)],
    }
    for name, call in calls.items():
        elapsed = interrupted_after(0.3, call)
        # 0.1 s on an idle machine; other programs may take the time of a thread.
        assert elapsed < 0.3, f"{name}: {elapsed * 1e3:.0f} ms"
    # Other work goes on.
    assert shot.time_of(0) == 0.0
    assert effect.time_s < 6.0


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
    start = time.perf_counter()
    for number in range(10):
        shot.render(number)
    elapsed = time.perf_counter() - start
    is_done.set()
    thread.join()
    # With the interpreter held, it counts once or twice in each call.
    assert counted[0] > 0.1 * elapsed / 0.001, f"{counted[0]} in {elapsed:.2f} s"


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


def rain_over_gray():
    return bansho.rain(np.full((48, 64, 3), 90, np.uint8), rate_mm_per_h=80, strength=10.0, seed=3).tobytes()


def in_forked_process(work):
    """What `work` returns in a process that is forked from this one."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=lambda: sender.send(work()))
    process.start()
    try:
        assert receiver.poll(60), "the forked process waits forever"
        return receiver.recv()
    finally:
        process.join(10)
        process.kill()


def over_an_array():
    scene = bansho.Scene({"picture": {"size": [64, 48]}, "plate": {"image": "street"}, "rain": [{"rate_mm_per_h": 80.0, "opacity_gain": 10.0}]})
    arrays = {"street": np.full((48, 64, 3), 90, np.uint8)}
    return bansho.open(scene, arrays=arrays).render(0).display().tobytes() + bansho.Effect(scene, arrays=arrays).linear().tobytes()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_opens_pictures_that_are_arrays():
    expected = over_an_array()
    assert in_forked_process(over_an_array) == expected


def test_threads_that_share_a_shot_and_an_effect_wait_for_each_other():
    """Their frames have many parts, so that threads of the pool take on work of one call while they wait for parts of another."""
    scene = bansho.Scene([bansho.Picture(size=(640, 360)), bansho.FlameSheet(), bansho.Rain(rate_mm_per_h=50)])
    shot, effect = bansho.open(scene, threads=4), bansho.Effect(scene, threads=4)
    expected = [shot.render(number).linear.sum() for number in range(3)]
    failed = []

    def draw(thread):
        for turn in range(6):
            number = (thread + turn) % 3
            if shot.render(number).linear.sum() != expected[number] or effect.size != (640, 360):
                failed.append(number)
            effect.at(0.1 * number)

    threads = [threading.Thread(target=draw, args=(thread,), daemon=True) for thread in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive(), "the threads wait for each other forever"
    assert not failed


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_process_that_is_forked_while_a_thread_draws_is_told_so():
    scene = bansho.Scene([bansho.Picture(size=(64, 36)), bansho.FlameParticles(particles=3000)])
    shot, effect, stop = bansho.open(scene), bansho.Effect(scene), threading.Event()

    def draw(call):
        while not stop.is_set():
            call()

    def refused(call):
        try:
            call()
        except RuntimeError as told:
            return str(told)
        return "done"

    for number, call in enumerate((lambda: shot.render(20), effect.restart)):
        thread = threading.Thread(target=draw, args=(call,), daemon=True)
        thread.start()
        try:
            # Between two calls nobody uses it, so that a child may draw.
            answers = {in_forked_process(lambda call=call: refused(call)) for _ in range(5)}
        finally:
            stop.set()
            thread.join(30)
            stop.clear()
        allowed = "another thread was using this object when this process was forked; allowed: an object that is opened in this process"
        assert answers <= {allowed, "done"} and allowed in answers, (number, answers)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_process_that_is_forked_while_frames_are_drawn_ahead_is_told_so():
    shot = bansho.open(bansho.Scene([bansho.Picture(size=(640, 360), frames=100), bansho.FlameSheet(), bansho.Rain()]), threads=2)
    # So many that some are still being drawn when the process is forked, also where other programs take its time.
    frames = shot.frames(frames_in_flight=24)
    assert next(frames).number == 0

    def answer(call):
        try:
            call()
        except RuntimeError as told:
            return str(told)
        return "done"

    others = (lambda: shot.render(1), lambda: list(shot.frames(0, 4, frames_in_flight=2)))
    forked = "another thread was using this object when this process was forked; allowed: an object that is opened in this process"
    assert in_forked_process(lambda: [answer(call) for call in (*others, lambda: next(frames))]) == [forked] * 3
    assert in_forked_process(lambda: answer(frames.close)) == "done"
    assert next(frames).number == 1
    frames.close()
    # Once the tasks have ended nobody uses the shot.
    deadline = time.perf_counter() + 30
    while in_forked_process(lambda: [answer(call) for call in others]) != ["done"] * 2:
        assert time.perf_counter() < deadline


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_draws_the_same():
    expected = rain_over_gray()
    assert in_forked_process(rain_over_gray) == expected
