"""`Shot.frames` draws several frames at once where they do not follow from each other."""

import contextlib
import gc
import itertools
import threading
import time
import weakref

import numpy as np
import pytest

import bansho
from bansho import _bansho

SCENE = [bansho.Picture(size=(64, 36), frames=12), bansho.FlameSheet(width=0.5, height=0.9), bansho.Rain(rate_mm_per_h=80)]


@pytest.fixture(scope="module")
def scene():
    """A flame in the rain."""
    return bansho.Scene(SCENE)


def as_bytes(frame):
    planes = [frame.linear, frame.depth, *frame.aovs.values(), *frame.layers.values()]
    return frame.number, [np.ascontiguousarray(plane).tobytes() for plane in planes]


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_frames_are_those_of_render_in_order(scene, threads):
    shot = bansho.open(scene, threads=threads, aovs=True, layers=True)
    expected = {number: as_bytes(shot.render(number)) for number in range(-3, 12)}
    for in_flight in (None, 1, 2, 5, 90):
        for numbers in (range(12), range(-3, 12, 4), range(11, -3, -5), range(7, 8), range(4, 4)):
            frames = shot.frames(numbers.start, numbers.stop, step=numbers.step, frames_in_flight=in_flight)
            assert [as_bytes(frame) for frame in frames] == [expected[number] for number in numbers], (in_flight, numbers)


def test_the_number_of_frames_in_flight_is_that_of_the_program(scene):
    def count(frames, stated=None, threads=8, **options):
        return bansho.open(scene, threads=threads, **options)._shot.frames_in_flight(frames, stated)

    assert [count(1000, threads=threads) for threads in (1, 7, 8, 12)] == [1, 1, 8, 12]
    assert [count(frames) for frames in (0, 1, 16, 32, 64)] == [1, 1, 1, 2, 4], "a sixteenth of the frames"
    assert [count(3, stated) for stated in (1, 2, 3, 9)] == [1, 2, 3, 3]
    assert count(1000, size=(4096, 4096)) < 8, "frames of 1 GiB together"


def test_simulations_are_drawn_one_frame_after_the_other():
    simulated = bansho.open(bansho.Scene([bansho.Picture(size=(32, 18), frames=3), bansho.FlameParticles(particles=100, preroll_s=0.1)]))
    assert simulated._shot.frames_in_flight(1000, 7) == 1
    expected = [frame.linear.tobytes() for frame in simulated.frames()]
    assert [frame.linear.tobytes() for frame in simulated.frames(frames_in_flight=3)] == expected


@pytest.mark.parametrize("given", [0, -1, 1.5, "auto", 2**70, [2]])
def test_a_number_that_is_none_is_refused_before_anything_is_drawn(scene, given):
    with pytest.raises(ValueError, match="frames_in_flight: .*; allowed: None, or a number of frames of at least 1"):
        bansho.open(scene).frames(frames_in_flight=given)


def test_more_frames_than_there_is_memory_for_are_refused(scene):
    shot = bansho.open(scene, size=(16384, 16384))
    with pytest.raises(ValueError, match=r"frames_in_flight: 1000000 frames would take [\d.]+ GiB; allowed: None, or 1 to \d+$"):
        shot.frames(0, 2_000_000, frames_in_flight=1_000_000)


def test_a_stream_that_is_closed_has_no_further_frames(scene):
    stream = bansho.open(scene, threads=2)._shot.frame_stream(0, 1, 12, 3)
    assert [frame["number"] for frame in itertools.islice(stream, 4)] == [0, 1, 2, 3]
    stream.close()
    assert list(stream) == []


def test_no_more_frames_are_drawn_ahead_than_are_in_flight():
    ahead = []

    def take(index, last):
        ahead.append(last - index)
        time.sleep(0.002)

    _bansho.stream_for_test(200, 200, "never", take)
    assert max(ahead) in (1, 2), "two in flight, the next of which is started when one is taken"


def test_an_iteration_may_end_early(scene):
    shot = bansho.open(scene, size=(320, 180), threads=2)
    for end in (lambda frames: frames.close(), lambda frames: None):
        frames = shot.frames(frames_in_flight=4)
        assert next(frames).number == 0
        end(frames)
        gone = weakref.ref(frames)
        del frames
        gc.collect()
        assert gone() is None
    assert shot.render(3).number == 3
    with contextlib.suppress(ZeroDivisionError):
        for frame in shot.frames(frames_in_flight=4):
            frame.number // 0
    assert [frame.number for frame in shot.frames(frames_in_flight=4)] == list(range(12))


def test_a_frame_that_fails_is_told_after_those_before_it(photograph):
    scene = bansho.Scene({"picture": {"size": [64, 36], "frames": 9}, "plate": {"image": "p.####.png"}, "rain": [{}]})
    shot = bansho.open(scene, threads=2, arrays={"p.####.png": [photograph] * 4})
    with pytest.raises(ValueError) as expected:
        shot.render(4)
    for in_flight in (1, 2, 5):
        frames, numbers = shot.frames(frames_in_flight=in_flight), []
        with pytest.raises(type(expected.value)) as failed:
            for frame in frames:
                numbers.append(frame.number)
        assert numbers == [0, 1, 2, 3] and str(failed.value) == str(expected.value) and "frame 4; allowed" in str(failed.value)
        assert list(frames) == []


def test_a_panic_is_told_after_the_results_before_it(capfd):
    for index in (0, 1, 5):
        taken = []
        with pytest.raises(bansho.InternalError, match="Bansho failed: on purpose; this is a bug"):
            _bansho.stream_for_test(9, index, "on purpose", lambda index, last: taken.append(index))
        assert taken == list(range(index))


def test_other_frames_are_drawn_between_those_of_an_iteration(scene):
    shot = bansho.open(scene, threads=2)
    expected = [(frame.linear.tobytes(), frame.display().tobytes()) for frame in map(shot.render, range(12))]
    others = [shot.display(number).tobytes() for number in range(12)]
    for frame in shot.frames(frames_in_flight=3):
        number = 11 - frame.number
        assert shot.render(number).linear.tobytes() == expected[number][0]
        assert shot.display(number).tobytes() == others[number]
        assert (frame.linear.tobytes(), frame.display().tobytes()) == expected[frame.number]
    pairs = zip(shot.frames(frames_in_flight=2), shot.frames(step=2, frames_in_flight=5), strict=False)
    assert [(one.number, two.number) for one, two in pairs] == [(0, 0), (1, 2), (2, 4), (3, 6), (4, 8), (5, 10)]


def test_threads_draw_other_frames_during_an_iteration(scene):
    shot = bansho.open(scene, threads=3)
    expected = [frame.linear.tobytes() for frame in map(shot.render, range(12))]
    failed = []

    def draw(thread):
        for turn in range(12):
            number = (5 * turn + thread) % 12
            if shot.render(number).linear.tobytes() != expected[number]:
                failed.append(number)

    def iterate():
        for frame in shot.frames(frames_in_flight=4):
            if frame.linear.tobytes() != expected[frame.number]:
                failed.append(frame.number)

    threads = [threading.Thread(target=draw, args=(thread,), daemon=True) for thread in range(2)]
    threads += [threading.Thread(target=iterate, daemon=True) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive(), "the threads wait for each other forever"
    assert not failed


def test_other_threads_run_while_frames_are_waited_for(scene):
    shot, counted, is_done = bansho.open(scene, size=(1280, 720), threads=2), [0], threading.Event()

    def count():
        while not is_done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    start = time.perf_counter()
    assert len(list(shot.frames(frames_in_flight=2))) == 12
    elapsed = time.perf_counter() - start
    is_done.set()
    thread.join()
    # With the interpreter held, it counts once or twice in each call.
    assert counted[0] > 0.1 * elapsed / 0.001, f"{counted[0]} in {elapsed:.2f} s"


def test_progress_is_told_for_each_frame(scene):
    told = []
    frames = bansho.open(scene).frames(2, 8, step=2, progress=lambda done, total: told.append((done, total)), frames_in_flight=2)
    assert next(frames).number == 2 and told == [], "it is told once the next one is asked for"
    assert [frame.number for frame in frames] == [4, 6] and told == [(1, 3), (2, 3), (3, 3)]
